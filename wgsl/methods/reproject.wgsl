// Sample reprojection in depth-tested time slices: every sample is splatted to its position at every time, the
// nearest one is visible (Taylor, extended by the depth test and the object motion that he left to others).
//#include common/depth.wgsl
//#include common/trajectory5.wgsl
//#include common/frame.wgsl
//#include common/loops.wgsl
//#include common/shutter.wgsl

struct Chunk {                  // time slices of one source frame that are done together
    first: u32,
    count: u32,                 // SLICES at most
    shift: f32,                 // of their times, -0.5..0.5 of a slice's share of the exposure
    offset: f32,                // of the source frame [frame intervals]
    source: u32,                // index of the source frame; 0 is the frame itself
}

@group(1) @binding(0) var<uniform> chunk: Chunk;
@group(1) @binding(1) var color: texture_2d<f32>;       // of the source, premultiplied by alpha and weight
@group(1) @binding(2) var motion: texture_2d<f32>;      // of the source: to_prev, to_next [px]
@group(1) @binding(3) var depth: texture_2d<f32>;       // of the source
@group(1) @binding(4) var weight: texture_2d<f32>;      // of the source, 0: does not count
@group(1) @binding(5) var own: texture_2d<f32>;         // the frame itself, for pixels that no sample reached
@group(1) @binding(6) var linear: sampler;
@group(1) @binding(7) var<storage, read_write> nearest: array<atomic<u32>>;     // by slice and pixel: key of the visible sample
@group(1) @binding(8) var<storage, read_write> winner: array<atomic<u32>>;      // by slice and pixel: complement of that sample's number
@group(1) @binding(9) var<storage, read_write> hits: array<u32>;                // by source and pixel: bits of where the sample may be visible
@group(1) @binding(10) var<storage, read_write> open: array<atomic<u32>>;       // by block: bits of the slices in which the frame itself leaves holes
@group(1) @binding(11) var<storage, read_write> means: array<vec4f>;            // mean colour over the slices so far
@group(1) @binding(12) var<storage, read_write> counts: array<f32>;             // weight of that mean
@group(1) @binding(13) var output: Output;
@group(1) @binding(14) var bends: texture_2d<u32>;       // of the source, see common/trajectory5.wgsl

override FIVE_POSITIONS: bool = false;     // read `bends`; else paths are parabolas
override WEIGHTED: bool = false;
override COUNTS: bool = false;      // show the share of slices that reached a pixel instead of its colour

const SLICES: u32 = 8u;             // of a chunk: each with four pixels, they fill the bits of a word
const BLOCK_BITS: u32 = 3u;         // a block is 8 x 8 pixels
const OFF_CENTRE: f32 = 0.004;      // share of its depth by which a sample counts as farther, per pixel off its position
const NEIGHBOUR_BIT: u32 = 0x80000000u;     // of a depth: the sample is of a neighbouring frame
// A sample's number: its column, its row from bit ROW_BIT on, its source from bit SOURCE_BIT on.
const ROW_BIT: u32 = 15u;
const SOURCE_BIT: u32 = 30u;

/// First pass, once per source frame: the depth of the nearest sample at every pixel, in every slice. Of a
/// neighbouring frame only where the frame itself leaves holes.
@compute @workgroup_size(WG_X, WG_Y)
fn splat_depths(@builtin(global_invocation_id) id: vec3u) {
    if any(id.xy >= frame.size) { return; }
    let sample = sample_at(id.xy);
    var slices = sample.slices;
    if chunk.source > 0u {
        let count = turns_of(chunk.count, id.x);
        for (var k = 0u; k < count; k++) {
            let to = clamp(floor(position(sample, k)) - vec2f(frame.origin) + 1.0, vec2f(0.0), vec2f(frame.size));
            slices &= atomicLoad(&open[block_of(vec2u(to))]) | ~(1u << k);
        }
    }
    var bits = 0u;
    loop {      // loop form: see wgsl.md
        let k = firstTrailingBit(slices);
        let x = position(sample, k);
        for (var i = 0u; i < 4u; i++) {
            let on = landing(sample, k, x, i);
            if slices != 0u && on.key > 0u {
                bits |= select(0u, 1u, on.key >= atomicMax(&nearest[on.at], on.key)) << (4u * k + i);
            }
        }
        slices &= slices - 1u;
        if slices == 0u { break; }
    }
    hits[hits_of(id.xy)] = bits;
}

/// Second pass: of the samples that are equally near, the one of least number, so that it is always the same one.
@compute @workgroup_size(WG_X, WG_Y)
fn splat_winners(@builtin(global_invocation_id) id: vec3u) {
    if any(id.xy >= frame.size) { return; }
    let sample = sample_at(id.xy);
    let number = ~((chunk.source << SOURCE_BIT) | (id.y << ROW_BIT) | id.x);
    var bits = hits[hits_of(id.xy)];
    loop {
        let k = firstTrailingBit(bits) >> 2u;
        let on = landing(sample, k, position(sample, k), firstTrailingBit(bits) & 3u);
        if bits != 0u && on.key == atomicLoad(&nearest[on.at]) { atomicMax(&winner[on.at], number); }
        bits &= bits - 1u;
        if bits == 0u { break; }
    }
}

/// Third pass: the visible sample's colour, filtered where the point that lands on the pixel's centre came from.
@compute @workgroup_size(WG_X, WG_Y)
fn resolve(@builtin(global_invocation_id) id: vec3u) {
    if any(id.xy >= frame.size) { return; }
    let at = index_of(id.xy);
    let pixels = frame.size.x * frame.size.y;
    var slices = (1u << chunk.count) - 1u;
    if chunk.source > 0u { slices = atomicLoad(&open[block_of(id.xy)]); }
    var holes = slices;
    let static_color = textureLoad(color, id.xy, 0);
    var mean = means[at];
    var count = counts[at];
    loop {
        let k = firstTrailingBit(slices);
        let visible = ~atomicLoad(&winner[k * pixels + at]);
        if slices != 0u && visible >> SOURCE_BIT == chunk.source {
            holes &= ~(1u << k);
            let px = vec2u(visible & ((1u << ROW_BIT) - 1u), (visible & ((1u << SOURCE_BIT) - 1u)) >> ROW_BIT);
            let moved = displacement_in(trajectory_at(px), times_at(px), k);
            let uv = (vec2f(id.xy) + 0.5 - moved) / vec2f(frame.size);
            let is_static = all(moved == vec2f(0.0));       // then the pixel itself, to the bit
            let sample_color = select(textureSampleLevel(color, linear, uv, 0.0), static_color, is_static);
            var sample_weight = 1.0;
            if WEIGHTED { sample_weight = textureSampleLevel(weight, linear, uv, 0.0).x; }
            count += sample_weight;
            // A running mean: equal colours stay equal to the bit, and no sum of finite ones overflows.
            if count > 0.0 { mean += (sample_color - sample_weight * mean) / count; }
        }
        slices &= slices - 1u;
        if slices == 0u { break; }
    }
    means[at] = mean;
    counts[at] = count;
    for (var i = 0u; i < 4u; i++) {     // the blocks of all positions whose four pixels include this one
        if chunk.source == 0u && holes != 0u { atomicOr(&open[block_of(id.xy + vec2u(i & 1u, i >> 1u))], holes); }
    }
}

/// After the last slice: the result.
@compute @workgroup_size(WG_X, WG_Y)
fn finish(@builtin(global_invocation_id) id: vec3u) {
    if any(id.xy >= frame.size) { return; }
    let at = index_of(id.xy);
    var result = textureLoad(own, id.xy, 0);
    if counts[at] > 0.0 { result = means[at]; }
    if COUNTS { result = vec4f(vec3f(counts[at] / f32(frame.samples)), 1.0); }
    textureStore(output, id.xy, result);
}

fn index_of(px: vec2u) -> u32 {
    return px.y * frame.size.x + px.x;
}

/// Index of the hits of the source's sample at `px`.
fn hits_of(px: vec2u) -> u32 {
    return chunk.source * frame.size.x * frame.size.y + index_of(px);
}

/// Index of the block of a pixel, or of the pixel after the last one of a row or column.
fn block_of(px: vec2u) -> u32 {
    let at = px >> vec2u(BLOCK_BITS);
    return at.y * ((frame.size.x >> BLOCK_BITS) + 1u) + at.x;
}

struct Sample {
    x: vec2f,           // in the display window [px], centres of pixels are integers
    trajectory: Trajectory5,
    depth: f32,
    times: SampleTimes,
    slices: u32,        // bits of those in which it may be visible
}

fn sample_at(px: vec2u) -> Sample {
    let z = valid_depth(textureLoad(depth, px, 0).x);
    var slices = (1u << chunk.count) - 1u;
    if WEIGHTED { slices = select(0u, slices, textureLoad(weight, px, 0).x > 0.0); }
    return Sample(vec2f(vec2i(px) + frame.origin), trajectory_at(px), z, times_at(px), slices);
}

/// The trajectory of the source's sample at `px`.
fn trajectory_at(px: vec2u) -> Trajectory5 {
    let vectors = textureLoad(motion, px, 0);
    if !FIVE_POSITIONS { return trajectory5_from(trajectory_from(vectors)); }
    return trajectory_with(vectors, textureLoad(bends, px, 0).x);
}

/// Sample times of the source's pixel at `px`, in the source frame's own time.
fn times_at(px: vec2u) -> SampleTimes {
    var times = shutter_times(vec2f(px) + 0.5, chunk.shift);
    times.first -= chunk.offset;
    times.delay -= chunk.offset;
    return times;
}

/// Displacement by the time of slice `k` of the chunk [px].
fn displacement_in(trajectory: Trajectory5, times: SampleTimes, k: u32) -> vec2f {
    return displacement5(trajectory, shutter_time(times, chunk.first + k));
}

/// Position of a sample in slice `k` of the chunk, in the display window [px].
fn position(sample: Sample, k: u32) -> vec2f {
    return sample.x + displacement_in(sample.trajectory, sample.times, k);
}

struct Landing {
    at: u32,            // index of slice and pixel
    key: u32,           // the nearer, the greater; 0: outside
}

/// Of a sample at `x` of the display window in slice `k`, on pixel `i` of the four around it.
fn landing(sample: Sample, k: u32, x: vec2f, i: u32) -> Landing {
    let absolute = floor(x) + vec2f(vec2u(i & 1u, i >> 1u));
    let off = abs(absolute - x);
    let to = absolute - vec2f(frame.origin);
    let size = vec2f(frame.size);
    if !(all(to >= vec2f(0.0)) && all(to < size) && all(off < vec2f(1.0))) { return Landing(0u, 0u); }
    // The bits of positive floats are in the order of the floats. Samples of a neighbouring frame come after all
    // of the frame's own: they fill holes and replace nothing.
    let neighbour = select(0u, NEIGHBOUR_BIT, chunk.source > 0u);
    let z = sample.depth * (1.0 + OFF_CENTRE * (off.x + off.y));
    return Landing((k * frame.size.y + u32(to.y)) * frame.size.x + u32(to.x), ~(bitcast<u32>(z) | neighbour));
}
