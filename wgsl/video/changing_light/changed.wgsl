// The changes of light of small pixels, as change.wgsl leaves them, at a pixel of the picture.

@group(1) @binding(8) var changes: texture_2d<f32>;     // linear, of small pixels; the neighbours' shares of the exposure
@group(1) @binding(9) var linear: sampler;
@group(1) @binding(10) var standing: texture_2d<f32>;   // of small pixels: shares of the neighbours' light where it stands
@group(1) @binding(11) var previous: texture_2d<f32>;   // stored as given: linear, the neighbours, not read where nothing stands
@group(1) @binding(12) var next: texture_2d<f32>;       // stored as given

override STEP: u32 = 4u;    // px of the picture along a small pixel; 0: nothing changes

const ALIKE: f32 = 0.4;     // difference of roots of light beyond which a pixel shows something else

/// Light of a pixel, premultiplied by alpha, with its change.
fn changed(own: vec4f, px: vec2u) -> vec4f {
    if STEP == 0u { return own; }
    let at = (vec2f(px) + 0.5) / (f32(STEP) * vec2f(textureDimensions(changes)));
    let change = textureSampleLevel(changes, linear, at, 0.0);
    // A pixel loses at most the share of the exposure in which its light fades to that of the neighbours. A small pixel beside a
    // lamp holds light of the lamp, and would darken its surroundings further.
    var color = own.rgb + max(own.a * change.rgb, -change.w * max(own.rgb, vec3f(0.0)));
    let shares = own.a * textureSampleLevel(standing, linear, at, 0.0).xy;
    if any(shares > vec2f(0.0)) {
        // As roots of light, in which a share of any difference is about as visible.
        let root = sqrt(max(color, vec3f(0.0)));
        var stands = vec3f(0.0);
        if shares.x > 0.0 { stands += shares.x * alike(textureLoad(previous, px, 0).rgb, root); }
        if shares.y > 0.0 { stands += shares.y * alike(textureLoad(next, px, 0).rgb, root); }
        color += stands * (2.0 * root + stands);
    }
    return vec4f(max(color, min(own.rgb, vec3f(0.0))), own.a);
}

/// Difference of a neighbour's root of light, none of something else.
fn alike(light: vec3f, root: vec3f) -> vec3f {
    let apart = sqrt(max(light, vec3f(0.0))) - root;
    return exp(-dot(apart, apart) / (3.0 * ALIKE * ALIKE)) * apart;
}
