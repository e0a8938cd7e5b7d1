// Dense inverse search on one level (Kroeger, Timofte, Dai and Van Gool, "Fast Optical Flow using Dense Inverse Search",
// 2016): each patch follows its own gradients to where it matches, in either neighbour.
//#include common/frame.wgsl
//#include flow/dense/sampling.wgsl
//#include flow/dense/grid.wgsl

@group(1) @binding(2) var coarser: texture_2d<f32>;     // motion of the coarser level [px of that], to_prev, to_next
@group(1) @binding(3) var output: texture_storage_2d<rgba32float, write>;   // see patch_place()

const ACROSS: i32 = 8;          // patches of a workgroup
const DOWN: i32 = 4;
const TILE_X: i32 = 36;         // pixels that they cover
const TILE_Y: i32 = 20;
const TILE_AREA: i32 = 720;
const STEPS: u32 = 10u;         // of inverse search
const LONGEST_STEP: f32 = 2.0;  // [px]
const FARTHEST: f32 = 8.0;      // from where the search begins [px]
const FLAT: f32 = 32.0;         // squared gradients [levels^2 / px^2] of a patch that tells little of its place
const STARTS: u32 = 5u;         // see start()

var<workgroup> tile: array<vec4f, TILE_AREA>;   // of the picture: grey, and the gradient

struct Fit {
    product: vec2f,     // of gradients and differences
    error: f32,         // squared differences; both without the patches' means
}

/// A row of a patch between pixels of a row.
struct Row {
    left: vec4f,
    right: vec4f,
}

/// Workgroups of the previous picture and of the next one alternate.
@compute @workgroup_size(WG_X)
fn search(@builtin(local_invocation_index) local: u32, @builtin(workgroup_id) group: vec3u) {
    let first = vec2i(group.xy / vec2u(1u, 2u)) * vec2i(ACROSS, DOWN);
    fill_tile(first * STRIDE - STRIDE, i32(local));
    workgroupBarrier();
    let side = group.y % 2u;
    let inner = vec2i(i32(local) % ACROSS, i32(local) / ACROSS);
    let patch_at = min(first + inner, patches_of(frame.size) - 1);
    let way = searched(patch_at * STRIDE - STRIDE, (patch_at - first) * STRIDE, side);
    if all(first + inner < patches_of(frame.size)) {
        textureStore(output, patch_place(patch_at, side, frame.size), vec4f(way, 0.0, 0.0));
    }
}

fn fill_tile(corner: vec2i, local: i32) {
    for (var k = local; k < TILE_AREA; k += i32(WG_X)) {
        let px = corner + vec2i(k % TILE_X, k / TILE_X);
        tile[k] = vec4f(grey(px, turn.here), gradient(px), 0.0);
    }
}

/// The way of the patch with a `corner` in the picture, `inner` in the tile.
fn searched(corner: vec2i, inner: vec2i, side: u32) -> vec2f {
    var slopes = vec2f(0.0);    // sums over the patch
    var square = vec3f(0.0);    // xx, xy, yy
    for (var k = 0; k < PATCH * PATCH; k++) {
        let g = tile[(inner.y + k / PATCH) * TILE_X + inner.x + k % PATCH].yz;
        slopes += g;
        square += vec3f(g.x * g.x, g.x * g.y, g.y * g.y);
    }
    let area = f32(PATCH * PATCH);
    square += vec3f(FLAT, 0.0, FLAT) - vec3f(slopes.x * slopes.x, slopes.x * slopes.y, slopes.y * slopes.y) / area;
    let layer = layer_of(side);
    var begin = start(corner, side, 0u);
    var least = fit(corner, inner, begin, slopes, layer).error;
    for (var k = 1u; k < STARTS; k++) {
        let other = start(corner, side, k);
        let error = fit(corner, inner, other, slopes, layer).error;
        begin = select(begin, other, error < least);
        least = min(least, error);
    }
    var best = begin;
    var way = begin;
    for (var k = 0u; k < STEPS; k++) {
        let here = fit(corner, inner, way, slopes, layer);
        best = select(best, way, here.error < least);
        least = min(least, here.error);
        let step = vec2f(square.y * here.product.y - square.z * here.product.x, square.y * here.product.x - square.x * here.product.y)
            / (square.x * square.z - square.y * square.y);
        way += clamp(step, vec2f(-LONGEST_STEP), vec2f(LONGEST_STEP));
        way = clamp(way, begin - FARTHEST, begin + FARTHEST);
    }
    return best;
}

/// Ways to begin at: those of the coarser level, in the patch's middle and at the four patches beside it.
fn start(corner: vec2i, side: u32, k: u32) -> vec2f {
    let sign = select(-1, 1, k % 2u == 0u);
    let by = select(vec2i(0), sign * select(vec2i(0, STRIDE), vec2i(STRIDE, 0), k <= 2u), k > 0u);
    let few = vec2f(textureDimensions(coarser));
    let scale = vec2f(frame.size) / few;
    let at = clamp((vec2f(corner + by) + 0.5 * f32(PATCH)) / scale - 0.5, vec2f(0.0), few - 1.0);
    let low = vec2i(at);
    let high = min(low + 1, vec2i(few) - 1);
    let share = at - vec2f(low);
    let upper = mix(textureLoad(coarser, low, 0), textureLoad(coarser, vec2i(high.x, low.y), 0), share.x);
    let lower = mix(textureLoad(coarser, vec2i(low.x, high.y), 0), textureLoad(coarser, high, 0), share.x);
    let motion = mix(upper, lower, share.y);
    return scale * select(motion.xy, motion.zw, side == 1u);
}

fn fit(corner: vec2i, inner: vec2i, way: vec2f, slopes: vec2f, layer: u32) -> Fit {
    let place = vec2f(corner) + way;
    let low = vec2i(floor(place));
    let share = place - floor(place);
    var sums = vec4f(0.0);      // of differences, their squares, their products with the gradient
    var above = row_between(low, share.x, layer);
    for (var y = 0; y < PATCH; y++) {
        let below = row_between(low + vec2i(0, y + 1), share.x, layer);
        let left = mix(above.left, below.left, share.y);
        let right = mix(above.right, below.right, share.y);
        let k = (inner.y + y) * TILE_X + inner.x;
        sums += products(tile[k], left.x) + products(tile[k + 1], left.y) + products(tile[k + 2], left.z) + products(tile[k + 3], left.w);
        sums += products(tile[k + 4], right.x) + products(tile[k + 5], right.y) + products(tile[k + 6], right.z) + products(tile[k + 7], right.w);
        above = below;
    }
    let mean = sums.x / f32(PATCH * PATCH);
    return Fit(sums.zw - mean * slopes, sums.y - mean * sums.x);
}

fn products(own: vec4f, other: f32) -> vec4f {
    let apart = other - own.x;
    return apart * vec4f(1.0, apart, own.yz);
}

fn row_between(first: vec2i, share: f32, layer: u32) -> Row {
    let left = vec4f(grey(first, layer), grey(first + vec2i(1, 0), layer), grey(first + vec2i(2, 0), layer), grey(first + vec2i(3, 0), layer));
    let right = vec4f(grey(first + vec2i(4, 0), layer), grey(first + vec2i(5, 0), layer), grey(first + vec2i(6, 0), layer), grey(first + vec2i(7, 0), layer));
    let after = grey(first + vec2i(8, 0), layer);
    return Row(mix(left, vec4f(left.yzw, right.x), share), mix(right, vec4f(right.yzw, after), share));
}
