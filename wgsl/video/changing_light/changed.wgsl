// The changes of light of small pixels, as change.wgsl leaves them, at a pixel of the picture.

@group(1) @binding(8) var changes: texture_2d<f32>;     // linear, of small pixels
@group(1) @binding(9) var linear: sampler;

override STEP: u32 = 4u;    // px of the picture along a small pixel; 0: nothing changes

/// Light of a pixel, premultiplied by alpha, with what it changes.
fn changed(own: vec4f, px: vec2u) -> vec4f {
    if STEP == 0u { return own; }
    let at = (vec2f(px) + 0.5) / (f32(STEP) * vec2f(textureDimensions(changes)));
    let color = own.rgb + own.a * textureSampleLevel(changes, linear, at, 0.0).rgb;
    return vec4f(max(color, min(own.rgb, vec3f(0.0))), own.a);
}
