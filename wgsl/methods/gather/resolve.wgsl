// The image: for every pixel and every time of the exposure, the samples of up to three frames that are there by then
// are searched, the nearest ones composited front to back, and the results averaged.
//#include common/depth.wgsl
//#include common/frame.wgsl
//#include common/noise.wgsl
//#include common/path.wgsl
//#include common/shutter.wgsl
//#include methods/gather/worklist.wgsl
//#include methods/gather/motion.wgsl
//#include methods/gather/moving_light.wgsl
//#include methods/gather/search.wgsl

@group(1) @binding(3) var single_layer_mask: texture_2d_array<u32>; // bits of times, see the classification
@group(1) @binding(4) var layer_colors: texture_2d_array<f32>;  // front, back per frame; premultiplied by alpha, coverage, weight
@group(1) @binding(5) var mattes: texture_2d_array<u32>;    // stored as r32uint, rg32uint if WEIGHTED: per frame, see pack_matte()
@group(1) @binding(6) var second_differences: texture_2d<u32>;  // stored as rgba32uint: of the frame's own front colours
@group(1) @binding(7) var own_color: texture_2d<f32>;       // the frame as it came
@group(1) @binding(8) var own_weight: texture_2d<f32>;
@group(1) @binding(10) var output: Output;
@group(1) @binding(11) var<storage, read> worklist: WorkList;

override WEIGHTED: bool = false;    // read `own_weight`
override CONFIDENCE: bool = false;  // show how sure the result is instead of it
override PLAIN: bool = false;       // the blocks have one layer at all times, or nothing moves there: one search is enough

const INFERRED_DEPTH_BIAS: f32 = 1.2;   // factor of the depth of backgrounds that no frame showed: what one showed is preferred
const ITERATIONS_SAVED: u32 = 3u;       // from a tile's motion, compared with a start from nothing
const MAX_STEP_RATIO: f32 = 0.5;        // of a step to the distance from the first solution: longer ones end an iteration

const MAX_MISS: f32 = 8.0;              // if no search along the pixel's own path comes nearer than this [px], what is there is hidden
const FILL_DIRECTIONS: u32 = 8u;        // see cosine_of()
const SQRT_HALF: f32 = 0.70710678;
const FILL_STEPS: u32 = 13u;            // to every side, each FILL_GROWTH times as far as the one before: 64 px
const FILL_GROWTH: f32 = 1.414213562;
const FILL_DEPTH_RATIO: f32 = 1.1;      // of what is behind a surface
const ELSEWHERE: f32 = 2.0;             // samples of one frame farther apart than this [px] are of different surfaces

struct Sample {
    depth: f32,         // biased, for comparisons
    true_depth: f32,
    residual2: f32,     // squared distance of its position from the pixel [px^2]
    at: vec2f,          // in its frame [px]
    layer: u32,         // of `surfaces`
}

struct Visible {        // the nearest samples of each kind
    opaque: Sample,
    front_edge: Sample,
    back_edge: Sample,  // behind the front edge
    miss2: f32,         // least squared distance from the pixel at which a front layer's first search ended [px^2]
}

// Loops are left from their end, and what is rare has a loop of its own over bits of times: see lavapipe.md.

/// For blocks of active cells.
@compute @workgroup_size(CELL_TILES * TILE, STRIP_HEIGHT)
fn main(@builtin(local_invocation_index) local: u32, @builtin(workgroup_id) group: vec3u) {
    let in_block = local % (BLOCK * BLOCK);
    let k = worklist_index(group) * BLOCKS_PER_GROUP + local / (BLOCK * BLOCK);
    let id = unpack_cell(worklist.cells[k]) * BLOCK + vec2u(in_block % BLOCK, in_block / BLOCK);
    if k >= worklist.count || any(id >= frame.size) { return; }
    let x = vec2f(id) + 0.5;
    let tile = id / TILE;
    let candidates0 = load_candidates(tile, 0u);
    let candidates1 = load_candidates(tile, 1u);
    let candidates2 = load_candidates(tile, 2u);
    let front = 0u;
    let trajectory = unpack_trajectory(surface_of(vec2i(id), front));
    let starts = Starts(trajectory, surface_at(id, 2u), surface_at(id, 3u), surface_at(id, 4u), surface_at(id, 5u));
    let block_trajectory = unpack_trajectory(surface_of(vec2i(id / BLOCK * BLOCK), front));  // as classified
    let shift = frame.jitter * (pixel_noise(id) - 0.5);
    let times = sample_times(x, shift, candidates0, candidates1, candidates2);
    let share = 1.0 / f32(times.count);     // applied before adding, so that no sum of finite colours overflows

    // Static: nothing moves, nor does anything come here.
    let longest = max_abs_time(0.0);
    let v = abs(trajectory.velocity) + abs(trajectory.half_acceleration) * longest;
    let stays = all(v * longest < vec2f(STATIC_EPSILON));
    let last_word = (frame.samples - 1u) / TIMES_PER_WORD + 1u;
    let all_single = textureLoad(single_layer_mask, id / BLOCK, last_word, 0).x == 1u;
    let is_static = is_static_tile(candidates0, candidates1, candidates2) || (stays && all_single);
    let samples = select(times.count, 0u, is_static);

    var sum = Composite();
    var accepted = select(0.0, f32(times.count), is_static);
    var left_image = 0.0;
    var hidden = 0.0;       // times at which another surface must be there that no frame shows
    var first = 0u;         // time of this turn's words of bits
    loop {
        let valid = select(select(0u, (1u << (samples - first)) - 1u, samples > first), ~0u,
                           samples >= first + TIMES_PER_WORD);
        var single = textureLoad(single_layer_mask, id / BLOCK, first / TIMES_PER_WORD, 0).x & valid;
        var todo = single;
        loop {              // times at which one search is enough
            let t = time_in(times, first, todo);
            let found = iterate_fixed_point(x, displacement5(block_trajectory, t), t, front);
            let px = nearest_pixel(x - found.d);
            var is_even = true;     // of one weight
            var counts = 1.0;
            if WEIGHTED {
                is_even = is_smooth(surface_of(vec2i(px), front));
                counts = matte_at(px, front / 2u).weight;
            }
            if todo != 0u && is_even {
                var color = resampled(x - found.d, front, true);
                if MOVING_LIGHT { color += moving_light(x - found.d, 0u, t, duration_in(times, first, todo)); }
                let residual = min(sqrt(found.residual2), HALF_MAX);    // a wild motion may end it anywhere
                var one = Composite(color, counts, 1.0, residual, 0.0, 0.0);
                if CONFIDENCE && MOVING_LIGHT {
                    one.unlit = light_unknown(x - found.d, 0u, t, duration_in(times, first, todo));
                }
                add(&sum, one, share);
                accepted += 1.0;
            }
            if !is_even { single &= ~(1u << firstTrailingBit(todo)); }
            todo &= todo - 1u;
            if todo == 0u { break; }
        }
        if !PLAIN {
            todo = ~single & valid;
            var unresolved = 0u;
            var far = 0u;       // of them, those at which no search came near
            loop {              // all others
                if todo != 0u {     // where it is 0, the loops within end at once
                    let t = time_in(times, first, todo);
                    let visible = resolve_visibility(x, starts, t, candidates0, candidates1, candidates2);
                    let result = composite_front_to_back(visible, t, duration_in(times, first, todo));
                    let is_covered = result.coverage > 0.5;
                    if is_covered {
                        add(&sum, result, share / result.coverage);
                        accepted += 1.0;
                    } else {
                        let bit = todo & (~todo + 1u);
                        unresolved |= bit;
                        far |= select(0u, bit, visible.miss2 > MAX_MISS * MAX_MISS);
                    }
                }
                todo &= todo - 1u;
                if todo == 0u { break; }
            }
            loop {              // of them, those at which no frame shows anything: a tap along the pixel's own trajectory
                if unresolved != 0u {
                    let t = time_in(times, first, unresolved);
                    let p = x - displacement5(trajectory, t);
                    if (far & unresolved & (~unresolved + 1u)) != 0u {
                        hidden += 1.0;
                    } else {
                        var one = tap(p);
                        if MOVING_LIGHT { one.color += moving_light(p, 0u, t, duration_in(times, first, unresolved)); }
                        add(&sum, one, share);
                    }
                    if !is_inside(p) { left_image += 1.0; }
                }
                unresolved &= unresolved - 1u;
                if unresolved == 0u { break; }
            }
        }
        first += TIMES_PER_WORD;
        if first >= samples { break; }
    }
    if !PLAIN { add_hidden(&sum, id, hidden * share); }
    var result = max(sum.color, vec4f(0.0)) / sum.weight;
    if is_static || sum.weight <= 0.0 { result = static_color(id); }
    if CONFIDENCE {
        let share_accepted = max(accepted * share, 1e-9);
        if is_static { sum.unlit = static_unlit(id); }
        result = vec4f(max(accepted * share - sum.unlit, 0.0), sum.neighbours, sum.residual / share_accepted, left_image * share);
    }
    textureStore(output, id, result);
}

/// For static cells.
@compute @workgroup_size(CELL_TILES * TILE, STRIP_HEIGHT)
fn copy_static(@builtin(local_invocation_index) local: u32, @builtin(workgroup_id) group: vec3u) {
    let k = worklist_index(group);
    let id = pixel_in_strip(worklist.cells[k], group, local);
    if k >= worklist.count || any(id >= frame.size) { return; }
    var result = static_color(id);
    if CONFIDENCE { result = vec4f(1.0 - static_unlit(id), 0.0, 0.0, 0.0); }
    textureStore(output, id, result);
}

/// The frame's own pixel; without moving light, to the bit.
fn static_color(px: vec2u) -> vec4f {
    let color = lit_color(px);
    if !WEIGHTED { return color; }
    let counts = textureLoad(own_weight, px, 0).x;
    return select(vec4f(0.0), color / counts, counts > 0.0);
}

/// Of the frame's own pixel, the mean over the exposure.
fn lit_color(px: vec2u) -> vec4f {
    let color = textureLoad(own_color, px, 0);
    if !MOVING_LIGHT { return color; }
    let x = vec2f(px) + 0.5;
    let times = shutter_times(x, 0.0);
    let share = 1.0 / f32(times.count);
    var sum = vec4f(0.0);
    for (var i = 0u; i < times.count; i++) {
        sum += share * moving_light(x, 0u, shutter_time(times, i), sample_duration(times, i));
    }
    return max(color + sum, vec4f(0.0));
}

/// Of the frame's own pixel, the share of the exposure in which its light is not known.
fn static_unlit(px: vec2u) -> f32 {
    if !MOVING_LIGHT { return 0.0; }
    let x = vec2f(px) + 0.5;
    let times = shutter_times(x, 0.0);
    var sum = 0.0;
    for (var i = 0u; i < times.count; i++) {
        sum += light_unknown(x, 0u, shutter_time(times, i), sample_duration(times, i)) / f32(times.count);
    }
    return sum;
}

/// Time of the lowest set bit of a word whose bit 0 is sample `first`.
fn time_in(times: SampleTimes, first: u32, bits: u32) -> f32 {
    return shutter_time(times, min(first + firstTrailingBit(bits), times.count - 1u));
}

/// For how long that sample stands [frame intervals].
fn duration_in(times: SampleTimes, first: u32, bits: u32) -> f32 {
    if !MOVING_LIGHT { return 0.0; }
    return sample_duration(times, min(first + firstTrailingBit(bits), times.count - 1u));
}

/// The matte of a pixel of frame `f`.
fn matte_at(px: vec2u, f: u32) -> Matte {
    return unpack_matte(textureLoad(mattes, px, f, 0), WEIGHTED);
}

/// The pixel of the image nearest to a position [px].
fn nearest_pixel(p: vec2f) -> vec2u {
    return vec2u(clamp(p, vec2f(0.0), vec2f(frame.size) - 1.0));
}

// ---- visibility -----------------------------------------------------------------------------

// The layers are searched in this order, each only if it may add anything: see next_search().
const OWN_FRONT: u32 = 0u;          // of the frame itself
const OWN_BACK: u32 = 1u;
const NEIGHBOUR_FRONT: u32 = 2u;    // of the neighbouring frame on the side of the time
const OTHER_FRONT: u32 = 3u;        // of the other neighbouring frame
const FAR_FRONT: u32 = 4u;          // of the frame beyond the neighbour on the side of the time
const OTHER_FAR: u32 = 5u;          // of the frame beyond the other neighbour
const NEIGHBOUR_BACK: u32 = 6u;
const OTHER_BACK: u32 = 7u;
const SEARCHES: u32 = 8u;

/// The nearest samples that are at `x` [px] by the time `t` [frame intervals], by the candidates of all frames.
fn resolve_visibility(x: vec2f, starts: Starts, t: f32,
                      a: Candidates, b: Candidates, c: Candidates) -> Visible {
    let has_edge = max(a.header.y, max(b.header.y, c.header.y)) > 0.0;
    var visible = Visible(nothing(), nothing(), nothing(), INFINITE);
    var hidden = false;             // the front layer of the frame itself shows nothing opaque
    var search = OWN_FRONT;
    loop {
        var f = select(neighbour_of(t, search % 2u == 1u), 0u, search < NEIGHBOUR_FRONT);
        if FAR && (search == FAR_FRONT || search == OTHER_FAR) { f = far_of(t, search == OTHER_FAR); }
        let is_back = search == OWN_BACK || search > OTHER_FAR;
        let u = t - offset_of(f);
        let tile = vec2u(x) / TILE;
        let query = Query(x, u, 2u * f + u32(is_back), select(NEIGHBOUR_DEPTH_BIAS, 1.0, f == 0u));
        search_layer(&visible, query, start_of(starts, query), candidates_of(tile, f, a, b, c));
        if search == OWN_FRONT { hidden = visible.opaque.depth >= INFINITE; }
        search = next_search(search, visible, t, hidden, has_edge);
        if search >= SEARCHES { break; }
    }
    return visible;
}

/// The search after `last`. The back of the frame itself where its front is `hidden`; the neighbour there too, or far
/// from the frame's own instant; the other neighbour if the background is at best inferred; the frames beyond them if
/// there is none; the neighbours' backs at last, where it is at best inferred and no edge is before it.
fn next_search(last: u32, visible: Visible, t: f32, hidden: bool, has_edge: bool) -> u32 {
    let none = visible.opaque.depth >= INFINITE;
    let inferred = none || (visible.opaque.layer == OWN_BACK && visible.opaque.depth > visible.opaque.true_depth);
    let try_back = hidden && has_edge;
    let try_neighbours_back = try_back && inferred && (none || visible.front_edge.depth >= INFINITE);
    var next = last + 1u;
    if next == OWN_BACK && !try_back { next = NEIGHBOUR_FRONT; }
    if next == NEIGHBOUR_FRONT && !(sources.count > 1u && (hidden || abs(t) > TRUSTED_TIME)) { next = SEARCHES; }
    if next == OTHER_FRONT && !(sources.count > 2u && inferred) { next = FAR_FRONT; }
    if next == FAR_FRONT && !(FAR && none) { next = NEIGHBOUR_BACK; }
    if next == OTHER_FAR && !(sources.far_count > 1u && none) { next = NEIGHBOUR_BACK; }
    if next == NEIGHBOUR_BACK && !try_neighbours_back { next = SEARCHES; }
    if next == OTHER_BACK && !(try_neighbours_back && sources.count > 2u) { next = SEARCHES; }
    return next;
}

struct Query {          // what is searched, and where
    x: vec2f,           // the pixel [px]
    u: f32,             // time since the frame's instant [frame intervals]
    layer: u32,         // of `surfaces`
    handicap: f32,      // factor of the layer's depths
}

struct Starts {         // whose trajectories the first searches of a pixel start from, read once
    own: Trajectory5,
    front1: vec4u,      // what is at the pixel's place in the layers of neighbouring frames, see pack_surface()
    back1: vec4u,
    front2: vec4u,
    back2: vec4u,
}

fn surface_at(px: vec2u, layer: u32) -> vec4u {
    return surface_of(vec2i(px), min(layer, 2u * sources.count - 1u));
}

/// Displacement from which the first search of a layer starts: along the pixel's own trajectory, in that frame [px].
fn start_of(starts: Starts, query: Query) -> vec2f {
    let is_back = query.layer % 2u == 1u;
    let first = select(starts.front1, starts.back1, is_back);
    let second = select(starts.front2, starts.back2, is_back);
    var surface = select(first, second, query.layer > 3u);
    if is_far(query.layer) { surface = surface_of(vec2i(query.x), query.layer); }
    let there = displacement5(unpack_trajectory(surface), query.u);
    return select(there, displacement5(starts.own, query.u), query.layer < 2u);
}

struct First {          // where the first search of a layer led
    d: vec2f,           // [px]
    is_there: bool,     // a surface is at the pixel by the time
}

/// Search one layer from `own`, the displacement of the pixel's own trajectory [px]; then, in a front layer, from the
/// tile's candidates that may be nearer than what is visible already.
fn search_layer(visible: ptr<function, Visible>, query: Query, own: vec2f, candidates: Candidates) {
    let is_front = query.layer % 2u == 0u;
    var seeds = seeds_at(candidates, query.u, select(0u, ~0u, is_front));
    var first = First(vec2f(INFINITE), false);
    var is_first = true;
    loop {
        let state = find_surface(&seeds, query, own, is_first, first, (*visible).opaque.depth);
        let is_there = state.residual2 <= MAX_RESIDUAL * MAX_RESIDUAL;
        if is_first { first = First(state.d, is_there); }
        if is_first && is_front && !is_far(query.layer) { (*visible).miss2 = min((*visible).miss2, state.residual2); }
        if is_there { record(visible, query, state); }
        let wanted = may_be_visible(candidates, query.u, (*visible).opaque.depth / query.handicap);
        seeds.pending &= wanted & ~are_solution(seeds, first.d);
        is_first = false;
        if seeds.pending == 0u { break; }
    }
}

/// Iterate from `own` at first; after that from pending seeds, one after the other until one leads to a surface. A seed
/// is given up if it leads to the first solution, to something that is not nearer than `limit`, or astray: its
/// residual is INFINITE then.
fn find_surface(seeds: ptr<function, Seeds>, query: Query, own: vec2f, is_first: bool, first: First, limit: f32) -> WarpState {
    var state = WarpState(0u, own, INFINITE);
    var n = 1u;
    var before = vec2f(0.0);    // the last step, if no leap came after it
    if !is_first {
        state.d = next_seed(seeds);
        n = ITERATIONS_SAVED;
    }
    loop {              // a turn is a step
        let back = state.d - first.d;
        let start = state.d;
        state = warp_step(query.x, state.d, query.u, query.layer);
        n++;
        let again = same_solution(state.d, first.d);
        let farther = !is_first && depth_in(state.word) * query.handicap >= limit;
        let astray = !is_first && state.residual2 > MAX_STEP_RATIO * MAX_STEP_RATIO * dot(back, back);
        let ended = has_ended(state) || n > MAX_ITERATIONS || again || farther || astray;
        if (again && first.is_there) || farther { state.residual2 = INFINITE; }
        let is_there = state.residual2 <= MAX_RESIDUAL * MAX_RESIDUAL;
        if ended && (is_first || is_there || (*seeds).pending == 0u) { break; }
        let step = state.d - start;
        let further = leap(step, before);
        state.d += further;
        before = select(vec2f(0.0), step, all(further == vec2f(0.0)));
        if ended {
            state.d = next_seed(seeds);
            n = ITERATIONS_SAVED;
            before = vec2f(0.0);
        }
    }
    return state;
}

/// Keep a surface if it is the nearest of its kind.
fn record(visible: ptr<function, Visible>, query: Query, state: WarpState) {
    let is_back = query.layer % 2u == 1u;
    let z = select(depth_in(state.word), back_depth_in(state.word), is_back);
    let is_inferred = is_back && (state.word & SEEN) == 0u;
    let depth = abs(z) * query.handicap * select(1.0, INFERRED_DEPTH_BIAS, is_inferred);
    let found = Sample(depth, abs(z), state.residual2, query.x - state.d, query.layer);
    let counts = !is_far(query.layer) || is_hidden(found);
    if counts && z > 0.0 && found.depth < (*visible).opaque.depth { (*visible).opaque = found; }
    if counts && z < 0.0 {
        let front_edge = (*visible).front_edge;
        let in_front = found.depth < front_edge.depth;
        if in_front && is_behind(front_edge, found) { (*visible).back_edge = front_edge; }
        if !in_front && found.depth < (*visible).back_edge.depth && is_behind(found, front_edge) {
            (*visible).back_edge = found;
        }
        if in_front { (*visible).front_edge = found; }
    }
}

/// Whether the frame itself hides a sample of a frame beyond its neighbours, or does not hold its place: else it would
/// show it. What is far away is easily mistaken.
fn is_hidden(found: Sample) -> bool {
    let surface = surface_of(vec2i(nearest_pixel(found.at)), found.layer);
    let here = found.at + displacement5(unpack_trajectory(surface), -offset_of(found.layer / 2u));
    let own = abs(unpack_depth(surface_of(vec2i(nearest_pixel(here)), 0u)));
    return !is_inside(here) || own * SURFACE_DEPTH_RATIO < found.true_depth;
}

fn nothing() -> Sample {
    return Sample(INFINITE, INFINITE, INFINITE, vec2f(-9.0), 99u);
}

/// Whether `b` is of another surface, behind that of `a`; neighbouring frames show the same one again.
fn is_behind(b: Sample, a: Sample) -> bool {
    return b.depth >= a.depth * SURFACE_DEPTH_RATIO * select(NEIGHBOUR_DEPTH_BIAS, 1.0, a.layer == b.layer);
}

/// Whether the edge `a` is of another surface, before that of `b`: clearly nearer; or just nearer, if it is elsewhere in the
/// same frame.
fn is_before(a: Sample, b: Sample) -> bool {
    let is_elsewhere = a.layer / 2u == b.layer / 2u && distance(a.at, b.at) > ELSEWHERE;
    return a.depth < b.depth / select(SURFACE_DEPTH_RATIO, 1.0, is_elsewhere);
}

// ---- what no frame shows ----------------------------------------------------------------------

/// A tap of the frame itself.
fn tap(p: vec2f) -> Composite {
    var counts = 1.0;
    if WEIGHTED { counts = textureSampleLevel(own_weight, linear, p / vec2f(frame.size), 0.0).x; }
    return Composite(textureSampleLevel(own_color, linear, p / vec2f(frame.size), 0.0), counts, 1.0, 0.0, 0.0, 0.0);
}

/// Add what is hidden behind the pixel in all frames: the nearest surfaces behind its own, in FILL_DIRECTIONS
/// directions, weighted by the inverse square of their distances.
fn add_hidden(sum: ptr<function, Composite>, id: vec2u, share: f32) {
    let z = abs(unpack_depth(surface_of(vec2i(id), 0u)));
    let count = select(0u, FILL_DIRECTIONS, share > 0.0);
    var filled = Composite();
    var direction = 0u;
    loop {
        let along = vec2f(cosine_of(direction), cosine_of(direction + 6u));
        var distance = 1.0;
        var step = select(FILL_STEPS, 0u, direction < count);
        loop {
            let px = vec2i(floor(vec2f(id) + 0.5 + distance * along));
            let is_there = step < FILL_STEPS && all(px >= vec2i(0)) && all(px < vec2i(frame.size));
            let is_behind = unpack_depth(surface_of(px, 0u)) > z * FILL_DEPTH_RATIO;
            if is_there && is_behind {
                let part = 1.0 / (distance * distance);
                let counts = matte_at(vec2u(px), 0u).weight;
                add(&filled, Composite(textureLoad(layer_colors, px, 0, 0), counts, 1.0, 0.0, 0.0, 0.0), part);
                step = FILL_STEPS;
            }
            distance *= FILL_GROWTH;
            step++;
            if step >= FILL_STEPS { break; }
        }
        direction++;
        if direction >= count { break; }
    }
    if share > 0.0 {
        if filled.coverage > 0.0 {
            add(sum, filled, share / filled.coverage);
        } else {
            var counts = 1.0;
            if WEIGHTED { counts = textureLoad(own_weight, id, 0).x; }
            add(sum, Composite(textureLoad(own_color, id, 0), counts, 1.0, 0.0, 0.0, 0.0), share);
        }
    }
}

/// Of a number of eighths of a turn.
fn cosine_of(eighths: u32) -> f32 {
    let n = eighths % 8u;
    let size = select(select(1.0, 0.0, n % 4u == 2u), SQRT_HALF, n % 2u == 1u);
    return select(size, -size, n > 2u && n < 6u);
}

// ---- compositing ----------------------------------------------------------------------------

struct Composite {
    color: vec4f,       // premultiplied by coverage
    weight: f32,
    coverage: f32,
    residual: f32,      // distance from the pixel of what is composited, times its coverage [px]
    neighbours: f32,    // the part of the coverage that neighbouring frames gave
    unlit: f32,         // the part whose light moves and is not known
}

fn add(sum: ptr<function, Composite>, one: Composite, share: f32) {
    (*sum).color += share * one.color;
    (*sum).weight += share * one.weight;
    (*sum).coverage += share * one.coverage;
    (*sum).residual += share * one.residual;
    (*sum).neighbours += share * one.neighbours;
    (*sum).unlit += share * one.unlit;
}

/// Composite over one another (Porter and Duff's "over"): edges, by the texels of their own surface, then what is opaque.
fn composite_front_to_back(visible: Visible, t: f32, duration: f32) -> Composite {
    let front_edge = is_before(visible.front_edge, visible.opaque);
    let back_edge = front_edge && is_before(visible.back_edge, visible.opaque)
        && is_behind(visible.back_edge, visible.front_edge);
    let opaque = visible.opaque.depth < INFINITE;
    let at = visible.opaque.at;
    let layer = visible.opaque.layer;
    var filtered = opaque && visible.opaque.layer % 2u == 0u;   // as a whole, not texel by texel
    if WEIGHTED { filtered = filtered && is_smooth(surface_of(vec2i(nearest_pixel(at)), layer)); }
    let parts = u32(front_edge) + u32(back_edge) + u32(opaque && !filtered);
    var sum = Composite();
    var n = 0u;
    loop {
        var part = visible.opaque;
        if back_edge && n == 1u { part = visible.back_edge; }
        if front_edge && n == 0u { part = visible.front_edge; }
        var one = Composite();
        var i = 0u;
        loop {
            if n < parts { add_texel(&one, part, i); }
            i++;
            if n >= parts || i >= 4u { break; }
        }
        if part.layer % 2u == 1u && one.coverage > 1e-4 {       // backgrounds are opaque
            one.color /= one.coverage;
            one.weight /= one.coverage;
            one.coverage = 1.0;
        }
        if MOVING_LIGHT && n < parts { one.color += one.coverage * moving_light(part.at, part.layer, t, duration); }
        one.residual = one.coverage * sqrt(part.residual2);
        var from_around = part.layer > 1u;
        if CONFIDENCE && part.layer == 1u {
            from_around = (surface_of(vec2i(nearest_pixel(part.at)), 1u).w & AROUND) != 0u;
        }
        one.neighbours = select(0.0, one.coverage, from_around);
        if CONFIDENCE && MOVING_LIGHT && n < parts {
            one.unlit = one.coverage * light_unknown(part.at, part.layer, t, duration);
        }
        add(&sum, one, 1.0 - sum.coverage);
        n++;
        if n >= parts { break; }
    }
    if filtered {
        var counts = 1.0;
        if WEIGHTED { counts = matte_at(nearest_pixel(at), layer / 2u).weight; }
        let neighbours = select(0.0, 1.0, visible.opaque.layer > 1u);
        var color = resampled(at, layer, visible.opaque.layer == 0u);
        if MOVING_LIGHT { color += moving_light(at, visible.opaque.layer, t, duration); }
        var one = Composite(color, counts, 1.0, sqrt(visible.opaque.residual2), neighbours, 0.0);
        if CONFIDENCE && MOVING_LIGHT { one.unlit = light_unknown(at, layer, t, duration); }
        add(&sum, one, 1.0 - sum.coverage);
    }
    return sum;
}

/// Add texel `i` of the four around a sample, with its bilinear weight, if it is of the same surface.
fn add_texel(sum: ptr<function, Composite>, sample: Sample, i: u32) {
    let front = sample.layer / 2u * 2u;
    let is_back = sample.layer % 2u == 1u;
    let corner = floor(sample.at - 0.5);
    let share = sample.at - 0.5 - corner;
    let step = vec2f(vec2u(i & 1u, i >> 1u));
    let px = nearest_pixel(corner + step);
    let shares = mix(1.0 - share, share, step);
    let matte = matte_at(px, front / 2u);
    let from_back = is_back && matte.has_back;
    let z = matte.depth;
    // Of a front layer: what is not behind it. Of a back layer: the other back layers, and what lies as deep.
    let is_beyond = z > sample.true_depth * SURFACE_DEPTH_RATIO;
    let is_before = is_back && z < sample.true_depth / SURFACE_DEPTH_RATIO;
    let belongs = from_back || !(is_beyond || is_before);
    let amount = select(0.0, shares.x * shares.y, belongs);
    (*sum).color += amount * textureLoad(layer_colors, px, front + u32(from_back), 0);
    (*sum).weight += amount * select(matte.weight, 1.0, from_back);
    (*sum).coverage += amount * select(matte.coverage, 1.0, is_back);
}

/// Catmull-Rom interpolation where the frame's own texel is smooth, bilinear elsewhere. Between two texels the cubic
/// differs from the line by their second differences; those of the nearest texel stand for both. It is never less than half
/// of the line: beside a lamp it would swing far below 0.
fn resampled(at: vec2f, layer: u32, is_own: bool) -> vec4f {
    let f = fract(at - 0.5);
    let px = nearest_pixel(at);
    let differences = textureLoad(second_differences, px, 0);
    let across = vec4f(unpack2x16float(differences.x), unpack2x16float(differences.y));
    let down = vec4f(unpack2x16float(differences.z), unpack2x16float(differences.w));
    let share = select(vec2f(0.0), 0.5 * f * (1.0 - f), is_own);
    let line = textureSampleLevel(layer_colors, linear, at / vec2f(frame.size), layer, 0.0);
    return line - share.x * across - share.y * down;
}
