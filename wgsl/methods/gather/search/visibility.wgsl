// The nearest samples that are at a pixel by a time, by searches of all frames and layers.
//#include common/depth.wgsl
//#include methods/gather/motion.wgsl
//#include methods/gather/search/search.wgsl

override CONFIDENCE: bool = false;  // show how sure the result is instead of it
override CROWDED: bool = false;     // tiles are crowded: searches of front layers start from scattered motions too

const INFERRED_DEPTH_BIAS: f32 = 1.2;   // factor of the depth of backgrounds that no frame showed: others are preferred
const ITERATIONS_SAVED: u32 = 3u;       // from a tile's motion, compared with a start from nothing
const SCATTERED: u32 = 16u;             // bit of scattered motions among the pending starts
const MAX_STEP_RATIO: f32 = 0.75;       // of a step to the distance from the first solution: longer ones end an iteration
const ELSEWHERE: f32 = 2.0;             // samples of one frame farther apart than this [px] are of different surfaces
const BODY_DEPTH_RATIO: f32 = 1.3;      // of depths close together on one body: at outlines, round ones fall away steeply
const OWN_TIME: f32 = 0.0625;           // up to here from its instant, the frame itself is surer of the surface of a silhouette [frame intervals]
const NEIGHBOUR_RESIDUAL: f32 = 0.5;    // MAX_RESIDUAL of other frames' samples: a surface that turns away from edge on is wide there
const GOES_ON: f32 = 5.0;               // how far a surface is taken to go on behind something nearer [px]
const GONE: f32 = 2.0;                  // a front that has moved as far from its pixel shows the background there [px]

struct Sample {
    depth: f32,         // biased, for comparisons
    true_depth: f32,
    residual2: f32,     // squared distance of its position from the pixel [px^2]; 0 unless CONFIDENCE
    at: vec2f,          // in its frame [px]
    layer: u32,         // of `surfaces`
}

struct Cover {          // a pixel's own layer, which may hide samples of other frames
    z: f32,             // its depth
    goes_on: bool,      // it is still there
}

struct Visible {        // the nearest samples of each kind
    opaque: Sample,
    front_edge: Sample,
    back_edge: Sample,  // behind the front edge
    miss2: f32,         // least squared distance from the pixel at which a front layer's first search ended [px^2]
    cover: Cover,       // of the pixel's own last layer
}

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
    var visible = Visible(nothing(), nothing(), nothing(), INFINITE, cover_at(x, starts.own_back, t));
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

/// The search after `last`. The back of the frame itself where its front is `hidden`; the neighbour there too, unless that back
/// belongs to a surface before it, or far from the frame's own instant; the other neighbour if the background is at best inferred; the frames beyond them if
/// there is none; the neighbours' backs at last, where it is at best inferred and no edge is before it.
fn next_search(last: u32, visible: Visible, t: f32, hidden: bool, has_edge: bool) -> u32 {
    let none = visible.opaque.depth >= INFINITE;
    let inferred = none || (visible.opaque.layer == OWN_BACK && visible.opaque.depth > visible.opaque.true_depth);
    let try_back = hidden && has_edge;
    let try_neighbours_back = try_back && inferred && (none || visible.front_edge.depth >= INFINITE);
    var next = last + 1u;
    if next == OWN_BACK && !try_back { next = NEIGHBOUR_FRONT; }
    if next == NEIGHBOUR_FRONT && !(sources.count > 1u && ((hidden && !is_complement(visible.opaque, t)) || abs(t) > TRUSTED_TIME)) { next = SEARCHES; }
    if next == OTHER_FRONT && !(sources.count > 2u && inferred) { next = FAR_FRONT; }
    if next == FAR_FRONT && !(FAR && none) { next = NEIGHBOUR_BACK; }
    if next == OTHER_FAR && !(sources.far_count > 1u && none) { next = NEIGHBOUR_BACK; }
    if next == NEIGHBOUR_BACK && !try_neighbours_back { next = SEARCHES; }
    if next == OTHER_BACK && !(try_neighbours_back && sources.count > 2u) { next = SEARCHES; }
    return next;
}

struct Query {          // layer and place of a search
    x: vec2f,           // the pixel [px]
    u: f32,             // time since the frame's instant [frame intervals]
    layer: u32,         // of `surfaces`
    handicap: f32,      // factor of the layer's depths
}

struct Starts {         // whose trajectories the first searches of a pixel start from, read once
    own: Trajectory5,
    own_back: vec4u,    // the surface at the pixel in the frame's own back layer, see pack_surface()
    front1: vec4u,      // and in the layers of neighbouring frames
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

/// Search one layer from `own`, the displacement of the pixel's own trajectory [px]; then, in a front layer, from what is
/// scattered and from the tile's candidates, if they may be nearer than the visible surface.
fn search_layer(visible: ptr<function, Visible>, query: Query, own: vec2f, candidates: Candidates) {
    let is_front = query.layer % 2u == 0u;
    var seeds = seeds_at(candidates, query.u, select(0u, may_be_there(candidates, query.u), is_front));
    let f = query.layer / 2u;
    let word = scattered_at(vec2u(query.x), query.u + offset_of(f), f, CROWDED && is_front && !is_far(query.layer));
    let there = displacement_in(word, query);
    var first = First(vec2f(INFINITE), INFINITE);
    var is_first = true;
    loop {
        let state = find_surface(&seeds, query, own, there, is_first, first, (*visible).opaque.depth);
        let most = select(MAX_RESIDUAL, NEIGHBOUR_RESIDUAL, query.layer > 1u);
        let is_there = state.residual2 <= most * most && is_inside(query.x - state.d);
        if is_first && is_there { first = First(state.d, max(depth_in(state.word), 0.0) * query.handicap); }
        if is_first && is_front && !is_far(query.layer) { (*visible).miss2 = min((*visible).miss2, state.residual2); }
        if is_there { record(visible, query, state); }
        let nearer = may_be_nearer(candidates, (*visible).opaque.depth / query.handicap);
        let clearly_nearer = may_be_nearer(candidates, first.depth / (query.handicap * SURFACE_DEPTH_RATIO));
        seeds.pending &= nearer & (clearly_nearer | ~are_solution(seeds, first.d));
        let z = scattered_depth(word) * query.handicap;
        let is_nearer = is_first && word != 0u && z < (*visible).opaque.depth;
        if CROWDED && is_nearer && !is_again(there, z, first) { seeds.pending |= SCATTERED; }
        is_first = false;
        if seeds.pending == 0u { break; }
    }
}

struct First {          // where the first search of a layer led; if nowhere, the place where it stopped tells nothing
    d: vec2f,           // displacement [px]
    depth: f32,         // biased; 0 at a silhouette, which nothing counts as nearer than
}

/// True if the surface at a displacement and a depth is the first solution. One with equal motion that is clearly nearer is not.
fn is_again(d: vec2f, depth: f32, first: First) -> bool {
    return same_solution(d, first.d) && depth * SURFACE_DEPTH_RATIO >= first.depth;
}

/// The displacement of the pixel in a word of scattered motions [px].
fn displacement_in(word: u32, query: Query) -> vec2f {
    var d = vec2f(0.0);
    for (var i = 0u; i < select(0u, 1u, CROWDED && word != 0u); i++) {
        let there = surface_of(scattered_pixel(word, vec2u(query.x) / BLOCK), query.layer);
        d = displacement5(unpack_trajectory(there), query.u);
    }
    return d;
}

/// The first pending start, which is pending no more: what is scattered, `there`, before the seeds, as it is the nearest.
fn next_start(seeds: ptr<function, Seeds>, there: vec2f) -> vec2f {
    if CROWDED && (*seeds).pending >= SCATTERED {
        (*seeds).pending -= SCATTERED;
        return there;
    }
    return next_seed(seeds);
}

/// Iterate from `own` at first; after that from pending starts, `there` and seeds, one after the other until one leads to a surface. A seed
/// is given up if it leads to the first solution, to something that is not nearer than `limit`, or astray: its
/// residual is INFINITE then.
fn find_surface(seeds: ptr<function, Seeds>, query: Query, own: vec2f, there: vec2f,
                is_first: bool, first: First, limit: f32) -> WarpState {
    var state = WarpState(0u, own, INFINITE);
    var n = 1u;
    var before = vec2f(0.0);    // the last step, if no leap came after it
    if !is_first {
        state.d = next_start(seeds, there);
        n = ITERATIONS_SAVED;
    }
    loop {              // a turn is a step
        let back = state.d - first.d;
        let start = state.d;
        state = warp_step(query.x, state.d, query.u, query.layer);
        n++;
        let z = depth_in(state.word) * query.handicap;
        let again = is_again(state.d, abs(z), first);
        let farther = !is_first && z >= limit;
        let astray = !is_first && state.residual2 > MAX_STEP_RATIO * MAX_STEP_RATIO * dot(back, back);
        let ended = has_ended(state) || n > MAX_ITERATIONS || again || farther || astray;
        if again || farther { state.residual2 = INFINITE; }
        let is_there = state.residual2 <= MAX_RESIDUAL * MAX_RESIDUAL;
        if ended && (is_first || is_there || (*seeds).pending == 0u) { break; }
        let step = state.d - start;
        let leaps = is_slow(step, before);
        state.d += select(vec2f(0.0), leap(step, before), leaps);
        before = select(step, vec2f(0.0), leaps);
        if ended {
            state.d = next_start(seeds, there);
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
    let found = Sample(depth, abs(z), select(0.0, state.residual2, CONFIDENCE), query.x - state.d, query.layer);
    // A silhouette of the frame's own is not found once more a frame interval away, where paths that bend are off.
    let t = query.u + offset_of(query.layer / 2u);
    let front_edge_z = (*visible).front_edge.true_depth;
    let is_own = z < 0.0 || (abs(t) < OWN_TIME && found.true_depth < front_edge_z * BODY_DEPTH_RATIO);
    let is_again = query.layer > 1u && (*visible).front_edge.layer < 2u && is_own;
    let is_still_covered = query.layer > 1u && is_covered((*visible).cover, found.true_depth);
    let counts = !is_still_covered && (!(is_far(query.layer) || is_again) || is_hidden(found));
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

/// True if the frame itself hides a sample of another frame, or does not hold its place: else it would show it. What is
/// far away, and what it shows already, is easily mistaken.
fn is_hidden(found: Sample) -> bool {
    let surface = surface_of(vec2i(nearest_pixel(found.at)), found.layer);
    let here = found.at + displacement5(unpack_trajectory(surface), -offset_of(found.layer / 2u));
    let own = abs(unpack_depth(surface_of(vec2i(nearest_pixel(here)), 0u)));
    return !is_inside(here) || own * SURFACE_DEPTH_RATIO < found.true_depth;
}

/// True if this is a back layer of the frame itself which makes up the colour of its pixel with a front of uncertain coverage: no other
/// background does, until that front has gone.
fn is_complement(found: Sample, t: f32) -> bool {
    if found.layer != OWN_BACK { return false; }
    let front = surface_of(vec2i(nearest_pixel(found.at)), OWN_FRONT);
    return (front.w & (SINGLE | BY_COLOR)) == BY_COLOR && length(displacement_of(front, t)) < GONE;
}

/// A pixel's own surface by the time `t`: where what is at the pixel then is behind something nearer in the frame, nobody sees if the
/// surface has ended, and it is taken to go on, near the frame's own instant and place.
fn cover_at(x: vec2f, surface: vec4u, t: f32) -> Cover {
    let z = abs(unpack_depth(surface));
    let at = x - displacement_of(surface, t);
    let nearer = abs(unpack_depth(surface_of(vec2i(nearest_pixel(at)), 0u)));
    let is_near = abs(t) < TRUSTED_TIME && distance(at, x) < GOES_ON && is_inside(at);
    return Cover(z, is_near && nearer * BODY_DEPTH_RATIO < z);
}

/// True if a sample of another frame at the depth `z` is behind a pixel's own surface that goes on.
fn is_covered(cover: Cover, z: f32) -> bool {
    return cover.goes_on && cover.z * BODY_DEPTH_RATIO < z;
}

fn nothing() -> Sample {
    return Sample(INFINITE, INFINITE, 0.0, vec2f(-9.0), 99u);
}

/// True if `b` is of another surface, behind that of `a`; neighbouring frames show the same one again.
fn is_behind(b: Sample, a: Sample) -> bool {
    return b.depth >= a.depth * SURFACE_DEPTH_RATIO * select(NEIGHBOUR_DEPTH_BIAS, 1.0, a.layer == b.layer);
}

/// True if the edge `a` is of another surface, before that of `b`: clearly nearer; or just nearer, if it is elsewhere in the
/// same frame.
fn is_before(a: Sample, b: Sample) -> bool {
    let is_elsewhere = a.layer / 2u == b.layer / 2u && distance(a.at, b.at) > ELSEWHERE;
    return a.depth < b.depth / select(SURFACE_DEPTH_RATIO, 1.0, is_elsewhere);
}
