// Image warping by fixed-point iteration: where in a frame is that which is at a pixel at some other time?
// With p = x - d(p), d the displacement of the content at p, the iteration d <- displacement at (x - d) leads there from a
// good start (Bowles et al., "Iterative Image Warping", 2012; Yang et al., "Image-Based Bidirectional Scene
// Reprojection", 2011). It converges where d changes by less than a pixel per pixel, and to different surfaces
// from different starts: the pixel's own trajectory, and the candidate motions of its tile.
//#include common/frame.wgsl
//#include common/path.wgsl
//#include common/shutter.wgsl
//#include methods/gather/tiles/scattered.wgsl
//#include methods/gather/surface.wgsl
//#include methods/gather/worklist.wgsl

struct SourceFrames {
    offsets: vec4f,         // [frame intervals]; the first is 0, the frame itself
    far_offsets: vec2f,     // of those beyond the neighbours, which follow them
    count: u32,             // of the frame and its neighbours
    far_count: u32,
}

@group(1) @binding(0) var<uniform> sources: SourceFrames;
@group(1) @binding(1) var surfaces: texture_2d_array<u32>;          // stored as rgba32uint: see pack_surface(); front, back of the frame itself, front, back of the next one, ...
@group(1) @binding(2) var tile_candidates: texture_2d_array<u32>;   // CANDIDATE_LAYERS per frame
@group(1) @binding(20) var<storage, read> scattered: array<u32>;    // see scattered.wgsl

override FAR: bool = false;     // there are frames beyond the neighbours

const MAX_ITERATIONS: u32 = 6u; // from the pixel's own trajectory
const CONVERGED: f32 = 0.5;     // a step shorter than this [px] ends the iteration
const MAX_RESIDUAL: f32 = 1.0;  // a sample that is farther than this [px] from the pixel is not there
const SOLUTION_TOLERANCE: f32 = 0.75;   // displacements closer than this [px] in x and y are the same solution
const NEIGHBOUR_DEPTH_BIAS: f32 = 1.1;  // factor of depths in neighbouring frames: the frame's own sample is preferred
const TRUSTED_TIME: f32 = 0.25; // up to here from its instant the frame itself is enough, if it shows anything [frame intervals]

// Results of the classification: a bit per time, in words, of every block of pixels.
const BLOCKS_PER_GROUP = CELL_TILES * TILE * STRIP_HEIGHT / (BLOCK * BLOCK);   // of a workgroup of the resolve
const TIMES_PER_WORD: u32 = 32u;

struct Candidates {     // motions that may bring something of one frame into a tile, the nearest first
    header: vec4f,      // see CANDIDATE_LAYERS
    min_depth: vec4f,
    enters: vec4f,      // times since that frame's instant [frame intervals]
    leaves: vec4f,
    velocity_x: vec4f,
    velocity_y: vec4f,
    half_x: vec4f,      // half accelerations
    half_y: vec4f,
}

fn load_candidates(tile: vec2u, f: u32) -> Candidates {
    let zero = vec4f(0.0);
    if f >= sources.count + sources.far_count { return Candidates(zero, vec4f(INFINITE), zero, zero, zero, zero, zero, zero); }
    let first = f * CANDIDATE_LAYERS;
    let times = textureLoad(tile_candidates, tile, first + 2u, 0);
    let velocities = textureLoad(tile_candidates, tile, first + 3u, 0);
    let halves = textureLoad(tile_candidates, tile, first + 4u, 0);
    return Candidates(
        bitcast<vec4f>(textureLoad(tile_candidates, tile, first, 0)),
        bitcast<vec4f>(textureLoad(tile_candidates, tile, first + 1u, 0)),
        firsts(times), seconds(times), firsts(velocities), seconds(velocities), firsts(halves), seconds(halves),
    );
}

/// The first half floats of four words.
fn firsts(words: vec4u) -> vec4f {
    return vec4f(unpack2x16float(words.x).x, unpack2x16float(words.y).x, unpack2x16float(words.z).x, unpack2x16float(words.w).x);
}

fn seconds(words: vec4u) -> vec4f {
    return vec4f(unpack2x16float(words.x).y, unpack2x16float(words.y).y, unpack2x16float(words.z).y, unpack2x16float(words.w).y);
}

/// Those of frame `f`, `a` to `c` of the frame and its neighbours; those of others are rarely wanted.
fn candidates_of(tile: vec2u, f: u32, a: Candidates, b: Candidates, c: Candidates) -> Candidates {
    var result = a;
    if f == 1u { result = b; }
    if f == 2u { result = c; }
    if FAR && f >= sources.count { result = load_candidates(tile, f); }
    return result;
}

/// The candidates, a bit each, that may be in the tile at the time `u`.
fn may_be_there(candidates: Candidates, u: f32) -> u32 {
    return bits_of((candidates.enters <= vec4f(u)) & (candidates.leaves >= vec4f(u)));
}

/// Those that may be nearer than `depth`.
fn may_be_nearer(candidates: Candidates, depth: f32) -> u32 {
    return bits_of(candidates.min_depth < vec4f(depth));
}

fn bits_of(flags: vec4<bool>) -> u32 {
    let bits = select(vec4u(0u), vec4u(1u, 2u, 4u, 8u), flags);
    return bits.x | bits.y | bits.z | bits.w;
}

struct Seeds {          // displacements to start from [px]
    pending: u32,       // a bit each
    x: vec4f,
    y: vec4f,
}

/// The displacements by the time `u` along the candidate motions.
fn seeds_at(candidates: Candidates, u: f32, pending: u32) -> Seeds {
    let x = (candidates.velocity_x + candidates.half_x * u) * u;
    let y = (candidates.velocity_y + candidates.half_y * u) * u;
    return Seeds(pending, x, y);
}

/// The first pending seed, which is pending no more.
fn next_seed(seeds: ptr<function, Seeds>) -> vec2f {
    let s = *seeds;
    (*seeds).pending = s.pending & (s.pending - 1u);
    let later = select(vec2f(s.x.w, s.y.w), vec2f(s.x.z, s.y.z), (s.pending & 4u) != 0u);
    return select(select(later, vec2f(s.x.y, s.y.y), (s.pending & 2u) != 0u), vec2f(s.x.x, s.y.x), (s.pending & 1u) != 0u);
}

/// The word of what of frame `f` is scattered into the block of the pixel `px` by the time `t`, if `wanted`; else 0.
fn scattered_at(px: vec2u, t: f32, f: u32, wanted: bool) -> u32 {
    var word = 0u;
    for (var i = 0u; i < u32(wanted); i++) {
        let slices = slice_count(arrayLength(&scattered), sources.count);
        word = scattered[scattered_index(f, slice_at(t, slices), slices, px / BLOCK)];
    }
    return word;
}

/// The neighbouring frame on the side of `t`, or the only one; the `second`: the other one.
fn neighbour_of(t: f32, second: bool) -> u32 {
    return select(1u, 2u, (sources.count == 3u && t > 0.0) != second);
}

fn offset_of(f: u32) -> f32 {
    let near = select(select(sources.offsets.z, sources.offsets.y, f == 1u), 0.0, f == 0u);
    if !FAR || f < sources.count { return near; }
    return select(sources.far_offsets.x, sources.far_offsets.y, f > sources.count);
}

/// True if a layer is of a frame beyond the neighbours.
fn is_far(layer: u32) -> bool {
    return FAR && layer >= 2u * sources.count;
}

/// The frame beyond the neighbour on the side of `t`, or the only one; the `second`: the other one.
fn far_of(t: f32, second: bool) -> u32 {
    return sources.count + select(0u, 1u, sources.far_count == 2u && (t > 0.0) != second);
}

/// True if nothing moves that may come into a tile.
fn is_static_tile(a: Candidates, b: Candidates, c: Candidates) -> bool {
    return max(a.header.z, max(b.header.z, c.header.z)) < STATIC_EPSILON;
}

/// Sample times of the pixel at `x` [px], moved by `shift` within their strata. If ADAPTIVE, they are up to two pixels of its way
/// apart: each is read at two places, see passing.wgsl, which have one weight. Where the shutter's curve is not even, one pixel.
fn sample_times(x: vec2f, shift: f32, a: Candidates, b: Candidates, c: Candidates) -> SampleTimes {
    return with_adaptive_count(shutter_times(x, shift), select(1.0, 0.5, BOX_SHUTTER) * longest_blur(a, b, c));
}

/// Length of the longest candidate motion while the shutter is open [px].
fn longest_blur(a: Candidates, b: Candidates, c: Candidates) -> f32 {
    return max(blur_length_of(a, 0u), max(blur_length_of(b, 1u), blur_length_of(c, 2u)));
}

/// The same of frame `f`.
fn blur_length_of(candidates: Candidates, f: u32) -> f32 {
    let window = abs(exposure_window(sources.offsets[f]));
    return candidates.header.z * (shutter.span.y - shutter.span.x) / max(max(window.x, window.y), 1e-9);
}

fn is_inside(p: vec2f) -> bool {
    return all(p >= vec2f(0.0)) && all(p < vec2f(frame.size));
}

/// The pixel of the image nearest to a position [px].
fn nearest_pixel(p: vec2f) -> vec2u {
    return vec2u(clamp(p, vec2f(0.0), vec2f(frame.size) - 1.0));
}

fn same_solution(a: vec2f, b: vec2f) -> bool {
    return all(abs(a - b) < vec2f(SOLUTION_TOLERANCE));
}

/// The seeds, a bit each, that are the solution `d`.
fn are_solution(seeds: Seeds, d: vec2f) -> u32 {
    return bits_of((abs(seeds.x - d.x) < vec4f(SOLUTION_TOLERANCE)) & (abs(seeds.y - d.y) < vec4f(SOLUTION_TOLERANCE)));
}

struct WarpState {
    word: u32,          // the last one of the surface whose displacement it is, see pack_surface()
    d: vec2f,           // [px]; x - d is the next point of the iteration, and the solution when it has ended
    residual2: f32,     // squared distance from x of where that surface is at the time `u` [px^2]
}

/// The surface of a pixel in a layer.
fn surface_of(px: vec2i, layer: u32) -> vec4u {
    return textureLoad(surfaces, px, layer, 0);
}

/// One step d <- displacement at (x - d) in a layer, `u` after its frame's instant. INFINITE residual outside the image.
fn warp_step(x: vec2f, d: vec2f, u: f32, layer: u32) -> WarpState {
    let p = x - d;
    let surface = surface_of(vec2i(p), layer);      // towards 0: pixels outside do not matter
    let next = displacement_of(surface, u);
    let step = next - d;
    return WarpState(surface.w, next, select(INFINITE, dot(step, step), is_inside(p)));
}

/// True if the iteration has converged, or left the image.
fn has_ended(state: WarpState) -> bool {
    return state.residual2 < CONVERGED * CONVERGED || state.residual2 >= INFINITE;
}

// An iteration is slow if a step is longer than this share of the one before it, and leads nowhere from MOST_GROWTH times it on.
// Between two surfaces that both move away from the pixel, a leap goes half of the way, and the step after the next is twice as
// long: no rounding may decide whether it grows too much.
const SLOW_STEP: f32 = 0.5;
const MOST_GROWTH: f32 = 2.2;
const LEAST_TURN: f32 = 0.25;   // difference of the two steps, as a share of the first, that tells where they lead

/// True if the iteration converges slowly, or not at all, by a `step` and the one `before` it.
fn is_slow(step: vec2f, before: vec2f) -> bool {
    let change = before - step;
    let step2 = dot(step, step);
    let before2 = dot(before, before);
    return step2 > SLOW_STEP * SLOW_STEP * before2 && step2 < MOST_GROWTH * MOST_GROWTH * before2
        && dot(change, change) > LEAST_TURN * LEAST_TURN * before2;
}

/// The way on after a `step` and the one `before` it, to get where they lead: steps of what turns and zooms are, as complex
/// numbers, a geometric series (Aitken's delta-squared process).
fn leap(step: vec2f, before: vec2f) -> vec2f {
    let change = before - step;
    let square = vec2f(step.x * step.x - step.y * step.y, 2.0 * step.x * step.y);
    let rest = vec2f(dot(square, change), square.y * change.x - square.x * change.y);
    return rest * (1.0 / max(dot(change, change), 1e-12));
}

/// The fixed point to which the iteration leads from the displacement `start`.
fn iterate_fixed_point(x: vec2f, start: vec2f, u: f32, layer: u32) -> WarpState {
    var state = WarpState(0u, start, INFINITE);
    var n = 0u;
    loop {
        state = warp_step(x, state.d, u, layer);
        n++;
        if has_ended(state) || n >= MAX_ITERATIONS { break; }
    }
    return state;
}
