// The first states, on the coarsest level: the best of all whole displacements within reach, for one pixel of each
// block; the sweeps pass it on. What accelerates has no displacement that fits both sides: there each side's own best
// one makes a state with a bend.
//#include common/loops.wgsl
//#include flow/search_patch.wgsl

struct Reach {
    most: i32,          // greatest displacement along either axis [px]
    first: i32,         // the first column of displacements of this pass; it takes COLUMNS of them
    blocks: vec2u,      // across, down
    begins: u32,        // 1 in the first pass
    unused: u32,
}

@group(1) @binding(5) var<uniform> reach: Reach;
@group(1) @binding(6) var<storage, read_write> best: array<Best>;   // of each block
@group(1) @binding(7) var output: StatesOut;

struct Best {           // u, v, cost
    both: vec4f,        // of the displacement that is best for both sides together
    near: vec4f,        // that to the near frame which is best by itself
    far: vec4f,         // that to the far frame
}

const COLUMNS: i32 = 9;             // lavapipe ends loops after 65,535 turns
override BLOCK: i32 = 2;            // pixels along a block
const LENGTH_PRICE: f32 = 0.0025;   // per px of displacement: of those that match much alike, the shortest
const PAIR_PRICE: f32 = 0.015;      // for two displacements in place of one, besides the cost of the bend

fn cheaper(found: vec4f, by: vec2f, cost: f32) -> vec4f {
    return select(found, vec4f(by, cost, 0.0), cost < found.z);
}

@compute @workgroup_size(WG_X, WG_Y)
fn search(@builtin(global_invocation_id) id: vec3u) {
    let block = min(id.xy, reach.blocks - 1u);
    let px = min(BLOCK * vec2i(block), vec2i(frame.size) - 1);
    let index = block.y * reach.blocks.x + block.x;
    load_search_patch(px);
    let none = vec4f(0.0, 0.0, 2.0 * OUTSIDE, 0.0);
    var found = Best(none, none, none);
    if reach.begins == 0u { found = best[index]; }
    let turns = turns_of(u32(2 * reach.most + 1), id.x);
    for (var column = reach.first; column < reach.first + COLUMNS; column++) {
        for (var k = 0u; k < turns; k++) {
            let by = vec2i(column, i32(k) - reach.most);
            let length_price = LENGTH_PRICE * f32(abs(by.x) + abs(by.y));
            let most = found.both.z - length_price;
            let near_most = max(select(most, 2.0 * most, VIEWS == AROUND), found.near.z - length_price);
            let n = whole_cost(near, px + by, select(-1.0, near_most, abs(column) <= reach.most));
            var cost = n;
            var f = n;
            if VIEWS == AROUND {
                let useful = min(most, n + HIDDEN_PRICE);
                let limit = max(2.0 * useful - n, useful - HIDDEN_PRICE);
                let far_most = max(limit, found.far.z - length_price);
                f = whole_cost(far, px - by, select(-1.0, far_most, abs(column) <= reach.most));
                cost = min(0.5 * (n + f), min(n, f) + HIDDEN_PRICE);
            }
            if abs(column) <= reach.most {
                found.both = cheaper(found.both, vec2f(by), cost + length_price);
                found.near = cheaper(found.near, vec2f(by), n + length_price);
                found.far = cheaper(found.far, -vec2f(by), f + length_price);
            }
        }
    }
    if all(id.xy < reach.blocks) { best[index] = found; }
}

@compute @workgroup_size(WG_X, WG_Y)
fn write_states(@builtin(global_invocation_id) id: vec3u) {
    if any(id.xy >= frame.size) { return; }
    let block = id.xy / u32(BLOCK);
    let found = best[block.y * reach.blocks.x + block.x];
    var state = State(found.both.xy, vec2f(0.0), vec4f(0.0));
    let pair = State(found.near.xy, found.far.xy - view.far_factor * found.near.xy, vec4f(0.0));
    let pair_cost = 0.5 * (found.near.z + found.far.z) + price(pair) + PAIR_PRICE;
    if VIEWS == AROUND && pair_cost < found.both.z { state = pair; }
    textureStore(output, id.xy, 0, vec4f(state.flow, state.bend));
    textureStore(output, id.xy, 1, state.slope);
}

/// Each side's own best displacement of a few blocks, evenly spaced: one for each pixel of a small picture.
@compute @workgroup_size(WG_X, WG_Y)
fn write_ways(@builtin(global_invocation_id) id: vec3u) {
    let few = textureDimensions(output);
    if any(id.xy >= few) { return; }
    let block = (2u * id.xy + 1u) * reach.blocks / (2u * few);
    let found = best[block.y * reach.blocks.x + block.x];
    textureStore(output, id.xy, 0, vec4f(found.near.xy, found.far.xy));
}
