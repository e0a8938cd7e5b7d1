// The pyramid of a picture: its display values without colour, and ever smaller copies of them.
//#include common/color.wgsl
//#include common/frame.wgsl
//#include flow/features.wgsl
//#include flow/dense/turn.wgsl

@group(1) @binding(1) var picture: texture_2d<f32>;                                 // linear
@group(1) @binding(2) var finer: texture_2d_array<f32>;     // stored as r32float
@group(1) @binding(3) var output: texture_storage_2d_array<r32float, write>;

const WHITE: f32 = 255.0;
const AROUND: i32 = 3;      // pixels a side that a smaller one may cover, as it is at most twice as large

@compute @workgroup_size(WG_X, WG_Y)
fn write_grey(@builtin(global_invocation_id) id: vec3u) {
    if any(id.xy >= frame.size) { return; }
    let shown = srgb_from_linear(limited(textureLoad(picture, id.xy, 0)).rgb);
    textureStore(output, id.xy, turn.here, vec4f(WHITE * dot(shown, LUMA)));
}

/// Means over the areas of smaller pixels: each pixel counts by the part that is in there.
@compute @workgroup_size(WG_X, WG_Y)
fn reduce(@builtin(global_invocation_id) id: vec3u) {
    if any(id.xy >= frame.size) { return; }
    let many = vec2f(textureDimensions(finer));
    let factor = many / vec2f(frame.size);
    let begin = factor * vec2f(id.xy);
    let end = min(begin + factor, many);
    let last = vec2i(many) - 1;
    var sum = 0.0;
    var total = 0.0;
    for (var k = 0; k < AROUND * AROUND; k++) {
        let px = vec2i(begin) + vec2i(k % AROUND, k / AROUND);
        let covered = max(min(vec2f(px) + 1.0, end) - max(vec2f(px), begin), vec2f(0.0));
        let at = min(px, last);
        let weight = covered.x * covered.y;
        sum += weight * textureLoad(finer, at, turn.here, 0).x;
        total += weight;
    }
    textureStore(output, id.xy, turn.here, vec4f(sum / total));
}
