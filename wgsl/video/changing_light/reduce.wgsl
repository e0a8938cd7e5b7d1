// A picture at a smaller size, as square roots of its light: differences of these are about as visible everywhere.
//#include common/frame.wgsl

override STEP: u32 = 4u;    // px of the picture along a small pixel

@group(1) @binding(0) var picture: texture_2d<f32>;     // stored as given: linear
@group(1) @binding(1) var output: Output;

/// Roots of the mean over STEP x STEP pixels, those of them that are in the picture.
@compute @workgroup_size(WG_X, WG_Y)
fn main(@builtin(global_invocation_id) id: vec3u) {
    if any(id.xy >= frame.size) { return; }
    let first = STEP * id.xy;
    let end = min(first + STEP, textureDimensions(picture));
    var sum = vec3f(0.0);
    for (var y = first.y; y < end.y; y++) {
        for (var x = first.x; x < end.x; x++) {
            let px = vec2u(x, y);
            sum += textureLoad(picture, px, 0).rgb;
        }
    }
    let count = (end - first).x * (end - first).y;
    textureStore(output, id.xy, vec4f(sqrt(max(sum / f32(count), vec3f(0.0))), 1.0));
}
