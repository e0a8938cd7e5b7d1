// Where a picture has one neighbour: the place that each of its pixels leads to, and which of those that lead to one place fits best.
//#include common/frame.wgsl
//#include flow/dense/differences.wgsl
//#include flow/dense/choice/leading.wgsl
//#include flow/dense/choice/thin.wgsl

@group(1) @binding(2) var motion: texture_2d<f32>;      // of the whole picture, by dense inverse search [px]
@group(1) @binding(3) var state: texture_2d<f32>;       // of this level, with the results of blocks [px]
@group(1) @binding(4) var chosen: texture_2d<f32>;      // 1 where that of blocks is taken
@group(1) @binding(5) var output: texture_storage_2d<rgba32float, write>;   // way to the neighbour [px]; its cost
@group(1) @binding(6) var<storage, read_write> arrivals: array<atomic<u32>>;    // of each pixel of the neighbour, see leading.wgsl; all 0 at first

@compute @workgroup_size(WG_X, WG_Y)
fn main(@builtin(global_invocation_id) id: vec3u) {
    if any(id.xy >= frame.size) { return; }
    let px = vec2i(id.xy);
    let both = select(thin(motion, px), textureLoad(state, px, 0), textureLoad(chosen, px, 0).x > 0.0);
    let way = select(both.xy, both.zw, turn.there.y > 0.0);
    let cost = cost_of(px, way);
    textureStore(output, px, vec4f(way, cost, 0.0));
    atomicMax(&arrivals[place_of(px, way)], arrival(px, cost));
}
