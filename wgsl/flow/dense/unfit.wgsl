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
const LEAST_EVEN: f32 = 0.3;    // share of such places which, if they fit the mean of both neighbours, show that light
                                // changes evenly, as in a dissolve: no body is lost there,
const REGION: i32 = 32;         // in the square up to so many px around a place, about as far as blocks are searched
const STEP: i32 = 2;            // px from one place that is counted to the next
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
    var fits_neither = false;
    for (var k = 0; k < side * side; k++) {
        fits_neither = fits_neither || is_unfit(fit_of(cell * SPACING - BESIDE + vec2i(k % side, k / side)));
    }
    if fits_neither && variance(cell) > FLAT && !is_even(cell) {
        list.blocks[atomicAdd(&groups.count, 1u)] = id.y * cells.x + id.x;
    }
}

/// The output of measure.wgsl at a place, or at the nearest one inside.
fn fit_of(place: vec2i) -> vec4f {
    return textureLoad(fits, clamp(place, vec2i(0), vec2i(textureDimensions(fits)) - 1), 0);
}

fn is_unfit(fit: vec4f) -> bool {
    return fit.x > UNFIT && fit.y > CHANGED + summary.noise[0];
}

/// True if light changes evenly around a block.
fn is_even(cell: vec2i) -> bool {
    let side = 2 * REGION / STEP + 1;
    var all = 0.0;
    var even = 0.0;
    for (var k = 0; k < side * side; k++) {
        let fit = fit_of(cell * SPACING + SPACING / 2 - REGION + STEP * vec2i(k % side, k / side));
        let counts = select(0.0, 1.0, is_unfit(fit));
        all += counts;
        even += select(0.0, counts, fit.z <= UNFIT);
    }
    return even > LEAST_EVEN * all;
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
