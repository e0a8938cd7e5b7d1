// Blocks of the small level in places that fit neither neighbour, each looked for in both at once.
//#include common/frame.wgsl
//#include common/loops.wgsl
//#include flow/dense/differences.wgsl
//#include flow/dense/summary.wgsl

@group(1) @binding(2) var<storage, read> summary: Summary;
@group(1) @binding(3) var<storage, read> list: List;
@group(1) @binding(4) var output: texture_storage_2d<rgba32float, write>;   // to_next [px] of blocks, and 1: there is one

const TOGETHER: u32 = 64u;      // invocations that look for one block
const REACH: f32 = 0.2;         // of the longer side: how far it is looked for
const MOST_EACH: u32 = 67u;     // displacements of an invocation, up to 32 px to all sides
const OTHER: f32 = 0.35;        // share of the mean square to the neighbour that fits worse,
const MOST_SQUARE: f32 = 150.0; // of which so much counts at most, as it may hide the block
const ALIKE: f32 = 1.2;         // factor,
const LEVEL: f32 = 6.0;         // and squared levels, by which matches are alike

var<workgroup> block: array<f32, TOGETHER>;
var<workgroup> costs: array<f32, TOGETHER>;
var<workgroup> ways: array<vec4f, TOGETHER>;    // x, y, how far from most; of the best of each

/// A workgroup for each block of the list: all whole displacements within reach, opposite ones to both neighbours. Of
/// those that match alike, the one nearest to the motion of most.
@compute @workgroup_size(64)
fn search(@builtin(local_invocation_index) local: u32, @builtin(workgroup_id) group: vec3u) {
    let cells = textureDimensions(output);
    let number = list.blocks[group.x];
    let cell = vec2i(vec2u(number % cells.x, number / cells.x));
    let corner = corner_of(cell);
    block[local] = grey(corner + vec2i(i32(local) % BLOCK, i32(local) / BLOCK), turn.here);
    workgroupBarrier();
    let size = vec2f(textureDimensions(levels));
    let reach = i32(round(REACH * max(size.x, size.y)));
    let side = 2 * reach + 1;
    let count = turns_of(u32(side * side), number);
    var own: array<f32, MOST_EACH>;
    var least = NOWHERE;
    for (var k = 0u; k * TOGETHER + local < count; k++) {
        own[k] = cost(corner, way_of(k * TOGETHER + local, side, reach));
        least = min(least, own[k]);
    }
    costs[local] = least;
    workgroupBarrier();
    for (var k = 0u; k < TOGETHER; k++) { least = min(least, costs[k]); }
    let most = summary.most[1].median.xy;
    var best = vec4f(0.0, 0.0, NOWHERE, 0.0);
    for (var k = 0u; k * TOGETHER + local < count; k++) {
        let way = vec2f(way_of(k * TOGETHER + local, side, reach));
        let far = distance(way, most);
        if own[k] <= ALIKE * least + LEVEL && far < best.z { best = vec4f(way, far, 0.0); }
    }
    ways[local] = best;
    workgroupBarrier();
    if local == 0u {
        for (var k = 1u; k < TOGETHER; k++) { best = select(best, ways[k], ways[k].z < best.z); }
        textureStore(output, cell, vec4f(best.xy, 1.0, 0.0));
    }
}

fn way_of(number: u32, side: i32, reach: i32) -> vec2i {
    return vec2i(i32(number) % side, i32(number) / side) - reach;
}

fn cost(corner: vec2i, way: vec2i) -> f32 {
    var sum = vec2f(0.0);
    for (var k = 0; k < BLOCK * BLOCK; k++) {
        let px = corner + vec2i(k % BLOCK, k / BLOCK);
        let apart = vec2f(grey(px - way, turn.prev), grey(px + way, turn.next)) - block[k];
        sum += apart * apart;
    }
    let both = of_both(sum / f32(BLOCK * BLOCK));
    return both.better + OTHER * min(both.worse, MOST_SQUARE);
}
