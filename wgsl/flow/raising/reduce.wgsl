// A picture at a size that is searched sooner, and as it is display, by which states are raised to its own size again.
//#include common/color.wgsl
//#include common/frame.wgsl
//#include flow/features.wgsl

@group(1) @binding(0) var picture: texture_2d<f32>;                                 // linear
@group(1) @binding(1) var small: texture_storage_2d<rgba32float, write>;            // linear
@group(1) @binding(2) var display: texture_storage_2d_array<rgba8unorm, write>;       // display values

/// The mean of the picture over the area of a small pixel: each of its pixels counts by the part that is in there.
@compute @workgroup_size(WG_X, WG_Y)
fn reduce(@builtin(global_invocation_id) id: vec3u) {
    if any(id.xy >= frame.size) { return; }
    let factor = vec2f(textureDimensions(picture)) / vec2f(frame.size);
    let begin = factor * vec2f(id.xy);
    let end = min(begin + factor, vec2f(textureDimensions(picture)));
    let first = vec2u(begin);
    let count = vec2u(ceil(end)) - first;
    var sum = vec4f(0.0);
    var total = 0.0;
    for (var k = 0u; k < count.x * count.y; k++) {
        let px = first + vec2u(k % count.x, k / count.x);
        let covered = min(vec2f(px) + 1.0, end) - max(vec2f(px), begin);
        let weight = max(covered.x, 0.0) * max(covered.y, 0.0);
        sum += weight * limited(textureLoad(picture, px, 0));
        total += weight;
    }
    textureStore(small, id.xy, sum / total);
}

@compute @workgroup_size(WG_X, WG_Y)
fn show(@builtin(global_invocation_id) id: vec3u) {
    if any(id.xy >= frame.size) { return; }
    textureStore(display, id.xy, 0, vec4f(srgb_from_linear(limited(textureLoad(picture, id.xy, 0)).rgb), 1.0));
}
