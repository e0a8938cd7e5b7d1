// How far motion goes there and back from pixel to pixel: nothing at an edge, which it crosses once.
//#include common/frame.wgsl
//#include video/ragged/around.wgsl

@group(1) @binding(0) var motion: texture_2d<f32>;  // to_prev, to_next [px]
@group(1) @binding(1) var output: Output;           // along the row and along the column, sums of all parts [px]

@compute @workgroup_size(WG_X, WG_Y)
fn main(@builtin(global_invocation_id) id: vec3u) {
    if any(id.xy >= frame.size) { return; }
    let px = vec2i(id.xy);
    textureStore(output, id.xy, vec4f(there_and_back(px, vec2i(1, 0)), there_and_back(px, vec2i(0, 1)), 0.0, 0.0));
}

/// The sum of the changes from pixel to pixel, beyond the change from the first to the last.
fn there_and_back(px: vec2i, step: vec2i) -> f32 {
    let first = textureLoad(motion, inside(px - RADIUS * step), 0);
    var last = first;
    var way = vec4f(0.0);
    for (var k = 1 - RADIUS; k <= RADIUS; k++) {
        let next = textureLoad(motion, inside(px + k * step), 0);
        way += abs(next - last);
        last = next;
    }
    return dot(way - abs(last - first), vec4f(1.0));
}
