// Costs of two motions on the middle level: of dense inverse search, and of blocks.
//#include common/frame.wgsl
//#include flow/dense/differences.wgsl
//#include flow/dense/choice/thin.wgsl

@group(1) @binding(2) var motion: texture_2d<f32>;      // of the whole picture, by dense inverse search [px]
@group(1) @binding(3) var state: texture_2d<f32>;       // of this level, with the results of blocks [px]
@group(1) @binding(4) var areas: texture_2d<f32>;       // of the small level, see turn.wgsl
@group(1) @binding(5) var output: texture_storage_2d<rgba32float, write>;   // cost of each; 1 near other motion

const RADIUS: i32 = 2;          // of the squares that are compared [px]
const ROUGH: f32 = 0.6;         // levels of 255 that the motion's change from a pixel to the next costs, per px,
const MOST_ROUGH: f32 = 4.0;    // px, beyond which a change costs no more
const MOST_OTHER: f32 = 8.0;    // levels of 255 that the difference to the neighbour that fits worse may cost
const BESIDE: i32 = 4;          // px of the small level around other motion within which it may be taken

@compute @workgroup_size(WG_X, WG_Y)
fn main(@builtin(global_invocation_id) id: vec3u) {
    if any(id.xy >= frame.size) { return; }
    let px = vec2i(id.xy);
    let ours = thin(motion, px);
    let its = textureLoad(state, px, 0);
    let last = vec2i(frame.size) - 1;
    let right = min(px + vec2i(1, 0), last);
    let below = min(px + vec2i(0, 1), last);
    let our_rough = rough(ours, thin(motion, right), thin(motion, below));
    let its_rough = rough(its, textureLoad(state, right, 0), textureLoad(state, below, 0));
    let our_fit = differences(px, ours, RADIUS);
    let its_fit = differences(px, its, RADIUS);
    let our_cost = our_fit.better + our_rough + min(our_fit.worse, MOST_OTHER);
    let its_cost = its_fit.better + its_rough + min(its_fit.worse, MOST_OTHER);
    textureStore(output, px, vec4f(our_cost, its_cost, is_near(px), 0.0));
}

fn rough(own: vec4f, right: vec4f, below: vec4f) -> f32 {
    return ROUGH * min(dot(abs(right - own) + abs(below - own), vec4f(1.0)), MOST_ROUGH);
}

/// 1 where other motion was found near by, else 0.
fn is_near(px: vec2i) -> f32 {
    let few = vec2i(textureDimensions(areas));
    let small = px * few / vec2i(frame.size);
    let side = 2 * BESIDE + 1;
    var most = 0.0;
    for (var k = 0; k < side * side; k++) {
        let near = clamp(small + vec2i(k % side, k / side) - BESIDE, vec2i(0), few - 1);
        most = max(most, textureLoad(areas, near, 0).x);
    }
    return select(0.0, 1.0, most >= OTHERWISE);
}
