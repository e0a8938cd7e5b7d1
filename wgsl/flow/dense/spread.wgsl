// The ways of blocks, tried at every pixel of the small level near by.
//#include common/frame.wgsl
//#include flow/dense/differences.wgsl

@group(1) @binding(2) var begin: texture_2d<f32>;       // motion before [px]
@group(1) @binding(3) var ways: texture_2d<f32>;        // output of blocks.wgsl
@group(1) @binding(4) var output: texture_storage_2d<rgba32float, write>;   // to_prev, to_next [px]
@group(1) @binding(5) var areas: texture_storage_2d<r32float, write>;       // TRIED, or OTHERWISE

const SPACING: i32 = 4;         // from one block to the next [px]
const AROUND: i32 = 2;          // blocks to either side whose ways are tried
const RADIUS: i32 = 2;          // of the squares that are compared [px]
const OTHER: f32 = 0.35;        // share of the difference to the neighbour that fits worse,
const MOST_OTHER: f32 = 10.0;   // of which so many levels count at most, as it may hide the place
const BETTER: f32 = 1.15;       // factor,
const LEVEL: f32 = 1.0;         // and levels of 255, by which another way must fit better
const APART: f32 = 1.5;         // px from the motion before that count as another motion

@compute @workgroup_size(WG_X, WG_Y)
fn main(@builtin(global_invocation_id) id: vec3u) {
    if any(id.xy >= frame.size) { return; }
    let px = vec2i(id.xy);
    let before = textureLoad(begin, px, 0);
    let last = vec2i(textureDimensions(ways)) - 1;
    let cell = min(px / SPACING, last);
    let side = 2 * AROUND + 1;
    var best = before;
    var least = BETTER * cost(px, before) + LEVEL;
    var area = 0.0;
    for (var k = 0; k < side * side; k++) {
        let near = cell + vec2i(k % side, k / side) - AROUND;
        let way = textureLoad(ways, clamp(near, vec2i(0), last), 0);
        if way.z > 0.0 && all(near >= vec2i(0)) && all(near <= last) {
            let other = vec4f(-way.xy, way.xy);
            let price = cost(px, other);
            best = select(best, other, price < least);
            least = min(least, price);
            area = TRIED;
        }
    }
    let apart = abs(best - before);
    let farthest = max(max(apart.x, apart.y), max(apart.z, apart.w));
    textureStore(output, px, best);
    textureStore(areas, px, vec4f(select(area, OTHERWISE, farthest > APART)));
}

fn cost(px: vec2i, motion: vec4f) -> f32 {
    let both = differences(px, motion, RADIUS);
    return both.better + OTHER * min(both.worse, MOST_OTHER);
}
