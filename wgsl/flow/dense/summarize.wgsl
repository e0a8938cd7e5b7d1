// The picture as a whole: noise, the median of the motion, and the affine motion of most of it, by least squares
// whose weights fall with the distance (Geman and McClure, "Statistical Methods for Tomographic Image Reconstruction",
// 1987), of which the scale shrinks. One workgroup for each neighbour.
//#include common/frame.wgsl
//#include flow/dense/summary.wgsl

@group(1) @binding(0) var begin: texture_2d<f32>;       // motion on the small level [px]
@group(1) @binding(1) var<storage, read> tables: array<u32>;
@group(1) @binding(2) var<storage, read_write> output: Summary;

const TOGETHER: u32 = 64u;          // invocations
const EACH: u32 = 8u;               // bins of each: BINS / TOGETHER
const NOISE: f32 = 0.1;             // share of the pixels whose changes are taken for noise
const STEP: u32 = 4u;            // px from one place that is looked at to the next
const TURNS: u32 = 12u;             // of least squares
const WIDEST: f32 = 16.0;           // scale of the distance in the first turn [px],
const NARROWEST: f32 = 0.5;         // in the last ones,
const SHRINKS: f32 = 0.7;           // and from one to the next
const LEVEL: f32 = 0.000001;        // weight that every motion has of being the same everywhere

var<workgroup> counts: array<u32, TOGETHER>;
var<workgroup> squares: array<mat3x3f, TOGETHER>;   // sums of each invocation: of (x, y, 1) with itself,
var<workgroup> products: array<mat3x3f, TOGETHER>;  // and with the motion
var<workgroup> fitted: mat3x3f;

@compute @workgroup_size(64)
fn main(@builtin(local_invocation_index) local: u32, @builtin(workgroup_id) group: vec3u) {
    let side = group.x;
    let noise = quantile(CHANGES, NOISE, local) / BINS_PER_LEVEL;
    let across = quantile(PREV_X + 2u * side, 0.5, local);
    let down = quantile(PREV_X + 2u * side + 1u, 0.5, local);
    let median = (vec2f(across, down) + 0.5 - f32(BINS / 2u)) / BINS_PER_PIXEL;
    var most = mat3x3f(vec3f(0.0), vec3f(0.0), vec3f(median, 0.0));
    var scale = WIDEST;
    for (var turn = 0u; turn < TURNS; turn++) {
        add_up(most, scale, side, local);
        workgroupBarrier();
        if local == 0u { fitted = solved(); }
        most = workgroupUniformLoad(&fitted);
        scale = max(scale * SHRINKS, NARROWEST);
    }
    if local == 0u {
        output.most[side] = Most(most[0], most[1], most[2], vec4f(median, 0.0, 0.0));
        output.noise[side] = noise;
    }
}

/// The bin of a table below which so large a share of it lies.
fn quantile(table: u32, share: f32, local: u32) -> f32 {
    var own = 0u;
    for (var k = 0u; k < EACH; k++) { own += tables[table * BINS + local * EACH + k]; }
    workgroupBarrier();
    counts[local] = own;
    workgroupBarrier();
    let size = textureDimensions(begin);
    let wanted = u32(share * f32(size.x * size.y));
    var sum = 0u;
    var first = 0u;
    for (var k = 0u; k < TOGETHER; k++) {
        let fits = sum + counts[k] <= wanted && first == k;
        sum += select(0u, counts[k], fits);
        first += u32(fits);
    }
    first = min(first, TOGETHER - 1u);
    var place = 0u;
    for (var k = 0u; k < EACH; k++) {
        let count = tables[table * BINS + first * EACH + k];
        let fits = sum + count <= wanted && place == k;
        sum += select(0u, count, fits);
        place += u32(fits);
    }
    return f32(first * EACH + min(place, EACH - 1u));
}

/// Sums of every TOGETHER-th place, weighted by how well `most` agrees with the motion there.
fn add_up(most: mat3x3f, scale: f32, side: u32, local: u32) {
    let size = textureDimensions(begin);
    let few = (size + STEP - 1u) / STEP;
    var square = mat3x3f();
    var product = mat3x3f();
    for (var k = local; k < few.x * few.y; k += TOGETHER) {
        let px = min(vec2u(k % few.x, k / few.x) * STEP + STEP / 2u, size - 1u);
        let motion = textureLoad(begin, px, 0);
        let way = vec3f(select(motion.xy, motion.zw, side == 1u), 0.0);
        let place = centred(vec2f(px), vec2f(size));
        let apart = (most * place - way) / scale;
        let near = 1.0 / (1.0 + dot(apart, apart));
        let weighted = near * near * place;
        square += mat3x3f(weighted * place.x, weighted * place.y, weighted * place.z);
        product += mat3x3f(way * weighted.x, way * weighted.y, way * weighted.z);
    }
    squares[local] = square;
    products[local] = product;
}

/// The affine motion of which the squared distances, as they are weighted, are the least.
fn solved() -> mat3x3f {
    var square = mat3x3f(vec3f(LEVEL, 0.0, 0.0), vec3f(0.0, LEVEL, 0.0), vec3f(0.0, 0.0, LEVEL));
    var product = mat3x3f();
    for (var k = 0u; k < TOGETHER; k++) {
        square += squares[k];
        product += products[k];
    }
    let a = cross(square[1], square[2]);
    let b = cross(square[2], square[0]);
    let c = cross(square[0], square[1]);
    return product * mat3x3f(a, b, c) * (1.0 / dot(square[0], a));
}
