// The places of the small level that fit neither neighbour, as a list of blocks that are to be searched.
//#include common/frame.wgsl
//#include flow/dense/sampling.wgsl
//#include flow/dense/summary.wgsl

struct Groups {         // of workgroups, one for each block of the list, as indirect dispatch takes them; all 0 at first
    count: atomic<u32>,
    down: u32,
    deep: u32,
}

@group(1) @binding(2) var fits: texture_2d<f32>;        // output of measure.wgsl
@group(1) @binding(3) var<storage, read> summary: Summary;
@group(1) @binding(4) var<storage, read_write> groups: Groups;
@group(1) @binding(5) var<storage, read_write> list: List;
@group(1) @binding(6) var output: texture_storage_2d<rgba32float, write>;   // of every block: 0, it has no way

const BESIDE: i32 = 4;          // px around the place of a block in which one that does not fit is enough
const UNFIT: f32 = 7.0;         // levels of 255 of difference to the better neighbour
const CHANGED: f32 = 10.0;      // levels by which such a place must differ from both neighbours, beyond noise
const FLAT: f32 = 6.25;         // variance [squared levels] of a block that tells nothing

@compute @workgroup_size(WG_X, WG_Y)
fn main(@builtin(global_invocation_id) id: vec3u) {
    let cells = textureDimensions(output);
    if id.x == 0u && id.y == 0u {
        groups.down = 1u;
        groups.deep = 1u;
    }
    if any(id.xy >= cells) { return; }
    textureStore(output, id.xy, vec4f(0.0));
    let cell = vec2i(id.xy);
    let side = SPACING + 2 * BESIDE;
    let last = vec2i(textureDimensions(fits)) - 1;
    let least = CHANGED + summary.noise[0];
    var is_unfit = false;
    for (var k = 0; k < side * side; k++) {
        let px = clamp(cell * SPACING - BESIDE + vec2i(k % side, k / side), vec2i(0), last);
        let fit = textureLoad(fits, px, 0);
        is_unfit = is_unfit || (fit.x > UNFIT && fit.y > least);
    }
    if is_unfit && variance(cell) > FLAT {
        list.blocks[atomicAdd(&groups.count, 1u)] = id.y * cells.x + id.x;
    }
}

fn variance(cell: vec2i) -> f32 {
    var sum = vec2f(0.0);
    for (var k = 0; k < BLOCK * BLOCK; k++) {
        let value = grey(corner_of(cell) + vec2i(k % BLOCK, k / BLOCK), turn.here);
        sum += vec2f(value, value * value);
    }
    let mean = sum / f32(BLOCK * BLOCK);
    return mean.y - mean.x * mean.x;
}
