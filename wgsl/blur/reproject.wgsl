// Sample reprojection in depth-tested time slices: every sample moves to its place at every time,
// the nearest one is seen (Taylor, extended by the depth test and object motion he left to others).
//#include common/finite.wgsl
//#include common/frame.wgsl
//#include common/path.wgsl
//#include common/shutter.wgsl

struct Chunk {                  // slices of one source that are done together
    first: u32,
    count: u32,                 // SLICES at most
    shift: f32,                 // of their times, -0.5..0.5 of a slice's share of the exposure
    offset: f32,                // of the source frame [frame intervals]
    source: u32,                // its number among the sources; 0 is the frame itself
}

@group(1) @binding(0) var<uniform> chunk: Chunk;
@group(1) @binding(1) var color: texture_2d<f32>;       // of the source, premultiplied by alpha and weight
@group(1) @binding(2) var motion: texture_2d<f32>;      // of the source: to_prev, to_next [px]
@group(1) @binding(3) var depth: texture_2d<f32>;       // of the source
@group(1) @binding(4) var weight: texture_2d<f32>;      // of the source, 0: counts for nothing
@group(1) @binding(5) var own: texture_2d<f32>;         // the frame itself, for pixels that nothing reached
@group(1) @binding(6) var linear: sampler;
@group(1) @binding(7) var<storage, read_write> nearest: array<atomic<u32>>;     // key of what is seen; slice, pixel
@group(1) @binding(8) var<storage, read_write> winner: array<atomic<u32>>;      // complement of that sample's number
@group(1) @binding(9) var<storage, read_write> hits: array<u32>;                // bits: where a sample may be seen; source, pixel
@group(1) @binding(10) var<storage, read_write> open: array<atomic<u32>>;       // bits: slices whose holes the frame leaves; block
@group(1) @binding(11) var<storage, read_write> means: array<vec4f>;            // of what was seen, over the slices
@group(1) @binding(12) var<storage, read_write> counts: array<f32>;             // its weight
@group(1) @binding(13) var output: Output;

override WEIGHTED: bool = false;
override COUNTS: bool = false;      // show how many slices reached a pixel instead of its colour

const SLICES: u32 = 8u;             // of a chunk: four pixels in each are the bits of a word
const BLOCK_BITS: u32 = 3u;         // a block is 8 x 8 pixels
const FAR: f32 = 1e10;              // depth of what has none
const OFF_CENTRE: f32 = 0.004;      // share of depth by which a sample stands back per pixel off its place
const NEIGHBOUR: u32 = 0x80000000u;
const ROW_BIT: u32 = 15u;           // in a sample's number its column comes first, then its row,
const SOURCE_BITS: u32 = 30u;       // then the source

/// The nearest of all samples at every pixel; a neighbouring frame's only where there are holes.
@compute @workgroup_size(WG_X, WG_Y)
fn depths(@builtin(global_invocation_id) id: vec3u) {
    if any(id.xy >= frame.size) { return; }
    let sample = sample_at(id.xy);
    var slices = sample.slices;
    if chunk.source > 0u {
        for (var k = 0u; k < chunk.count; k++) {
            let to = clamp(floor(place(sample, k)) + 1.0, vec2f(0.0), vec2f(frame.size));
            slices &= atomicLoad(&open[block_of(vec2u(to))]) | ~(1u << k);
        }
    }
    var bits = 0u;
    loop {      // short loops that end below save the turn in which nothing happens
        let k = firstTrailingBit(slices);
        let x = place(sample, k);
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

/// Of the samples that are as near, the one with the least number: the same one every time.
@compute @workgroup_size(WG_X, WG_Y)
fn winners(@builtin(global_invocation_id) id: vec3u) {
    if any(id.xy >= frame.size) { return; }
    let sample = sample_at(id.xy);
    let number = ~((chunk.source << SOURCE_BITS) | (id.y << ROW_BIT) | id.x);
    var bits = hits[hits_of(id.xy)];
    loop {
        let k = firstTrailingBit(bits) >> 2u;
        let on = landing(sample, k, place(sample, k), firstTrailingBit(bits) & 3u);
        if bits != 0u && on.key == atomicLoad(&nearest[on.at]) { atomicMax(&winner[on.at], number); }
        bits &= bits - 1u;
        if bits == 0u { break; }
    }
}

/// The colour that lands on the pixel's centre, from where the sample came.
@compute @workgroup_size(WG_X, WG_Y)
fn gather(@builtin(global_invocation_id) id: vec3u) {
    if any(id.xy >= frame.size) { return; }
    let at = index_of(id.xy);
    let pixels = frame.size.x * frame.size.y;
    var slices = (1u << chunk.count) - 1u;
    if chunk.source > 0u { slices = atomicLoad(&open[block_of(id.xy)]); }
    var unseen = slices;
    let still_color = textureLoad(color, id.xy, 0);
    var mean = means[at];
    var count = counts[at];
    loop {
        let k = firstTrailingBit(slices);
        let seen = ~atomicLoad(&winner[k * pixels + at]);
        if slices != 0u && seen >> SOURCE_BITS == chunk.source {
            unseen &= ~(1u << k);
            let px = vec2u(seen & ((1u << ROW_BIT) - 1u), (seen & ((1u << SOURCE_BITS) - 1u)) >> ROW_BIT);
            let moved = way(trajectory_from(textureLoad(motion, px, 0)), times_at(px), k);
            let uv = (vec2f(id.xy) + 0.5 - moved) / vec2f(frame.size);
            let still = all(moved == vec2f(0.0));       // to the bit
            let seen_color = select(textureSampleLevel(color, linear, uv, 0.0), still_color, still);
            var counted = 1.0;
            if WEIGHTED { counted = textureSampleLevel(weight, linear, uv, 0.0).x; }
            count += counted;
            // A running mean: equal colours stay equal to the bit, and no sum of finite ones overflows.
            if count > 0.0 { mean += (seen_color - counted * mean) / count; }
        }
        slices &= slices - 1u;
        if slices == 0u { break; }
    }
    means[at] = mean;
    counts[at] = count;
    for (var i = 0u; i < 4u; i++) {     // a place's four pixels are those before it
        if chunk.source == 0u && unseen != 0u { atomicOr(&open[block_of(id.xy + vec2u(i & 1u, i >> 1u))], unseen); }
    }
}

/// After the last slice.
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

/// Where the source's sample at `px` keeps its hits.
fn hits_of(px: vec2u) -> u32 {
    return chunk.source * frame.size.x * frame.size.y + index_of(px);
}

/// Index of the block of a pixel, or of one beyond the last.
fn block_of(px: vec2u) -> u32 {
    let at = px >> vec2u(BLOCK_BITS);
    return at.y * ((frame.size.x >> BLOCK_BITS) + 1u) + at.x;
}

struct Sample {
    x: vec2f,           // [px], centres of pixels are integers
    path: Trajectory,
    depth: f32,
    times: SampleTimes,
    slices: u32,        // bits of those in which it may be seen
}

fn sample_at(px: vec2u) -> Sample {
    var z = textureLoad(depth, px, 0).x;
    if !is_finite(z) || z <= 0.0 { z = FAR; }
    var slices = (1u << chunk.count) - 1u;
    if WEIGHTED { slices = select(0u, slices, textureLoad(weight, px, 0).x > 0.0); }
    return Sample(vec2f(px), trajectory_from(textureLoad(motion, px, 0)), z, times_at(px), slices);
}

/// Of the source's pixel at `px`, on the source's own clock.
fn times_at(px: vec2u) -> SampleTimes {
    var times = shutter_times(vec2f(px) + 0.5, chunk.shift);
    times.first -= chunk.offset;
    times.delay -= chunk.offset;
    return times;
}

/// How far it has moved by the time of slice `k` of the chunk [px].
fn way(path: Trajectory, times: SampleTimes, k: u32) -> vec2f {
    return displacement(path, shutter_time(times, chunk.first + k));
}

fn place(sample: Sample, k: u32) -> vec2f {
    return sample.x + way(sample.path, sample.times, k);
}

struct Landing {
    at: u32,            // index of slice and pixel
    key: u32,           // the nearer, the more; 0: is not seen there
}

/// Of a sample at `x` in slice `k`, on one of the four pixels around.
fn landing(sample: Sample, k: u32, x: vec2f, i: u32) -> Landing {
    let to = floor(x) + vec2f(vec2u(i & 1u, i >> 1u));
    let off = abs(to - x);
    let size = vec2f(frame.size);
    if !(all(to >= vec2f(0.0)) && all(to < size) && all(off < vec2f(1.0))) { return Landing(0u, 0u); }
    // Bits of positive floats are in their order; a neighbouring frame's come after all of the
    // frame's own: its samples fill what the frame itself does not show, and spoil nothing.
    let behind = select(0u, NEIGHBOUR, chunk.source > 0u);
    let z = sample.depth * (1.0 + OFF_CENTRE * (off.x + off.y));
    return Landing((k * frame.size.y + u32(to.y)) * frame.size.x + u32(to.x), ~(bitcast<u32>(z) | behind));
}
