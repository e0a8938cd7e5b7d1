// Tiles of a level in which the motion changes from pixel to pixel: beside an edge of something that moves.
//#include common/frame.wgsl
//#include flow/state.wgsl
//#include flow/edges/tile.wgsl

@group(1) @binding(0) var states: texture_2d_array<f32>;    // of the coarser level, which has half the size
@group(1) @binding(1) var output: texture_storage_2d<r32uint, write>;   // 1 for every tile that has an edge

const MARGIN: u32 = 2u;         // of a tile: edges so far beside it count [px of the coarser level]
const LEAST_APART: f32 = 0.25;  // change of motion from a pixel to the next one, beyond the slope [px of that level]

@compute @workgroup_size(WG_X, WG_Y)
fn main(@builtin(global_invocation_id) id: vec3u) {
    let size = vec2i(textureDimensions(states));
    let side = vec2u(TILE, TILE / 2u) + 2u * MARGIN;
    let corner = vec2i(id.xy * vec2u(TILE, TILE / 2u)) - i32(MARGIN);
    var apart = 0.0;
    for (var k = 0u; k < side.x * side.y; k++) {
        let px = clamp(corner + vec2i(vec2u(k % side.x, k / side.x)), vec2i(0), size - 1);
        let right = min(px + vec2i(1, 0), size - 1);
        let below = min(px + vec2i(0, 1), size - 1);
        let own = load_state(states, px);
        apart = max(apart, max(differs(own, right, px), differs(own, below, px)));
    }
    if all(id.xy < textureDimensions(output)) { textureStore(output, id.xy, vec4u(u32(apart > LEAST_APART))); }
}

/// By how much the state at another pixel leads elsewhere than a pixel's own [px].
fn differs(own: State, at: vec2i, px: vec2i) -> f32 {
    let other = moved(load_state(states, at), vec2f(px - at));
    return max(length(other.flow - own.flow), length(other.bend - own.bend));
}
