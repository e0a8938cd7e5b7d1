// Half a sweep: every second pixel, as on a chessboard, tries other states and keeps the best. First those of other
// pixels (Barnes et al., "PatchMatch", 2009; on planes: Bleyer et al. 2011), then variations of its own.
//#include common/hash.wgsl
//#include common/loops.wgsl
//#include flow/band.wgsl
//#include flow/plane.wgsl
//#include flow/steps.wgsl

struct Sweep {
    color: u32,         // of the chessboard: 0 or 1
    seed: u32,          // of the random numbers
    reach: f32,         // of random pixels [px]
    flow_step: f32,     // greatest random change of the flow [px]
    bend_step: f32,     // of the bend [px]
    most_apart: f32,    // differences from neighbours beyond this [px] cost no more
    carried: u32,       // how many of the carried states there are
    is_known: u32,      // 1 if `costs` tells what the states of this colour cost
    most: mat4x4f,      // homography of most of the picture to the near frame: columns of 3, from pixels to pixels
    lead_factor: f32,   // pixels of this level along one of `lead`; 0 if there is none
    unused: u32,
    unused_too: vec2u,
}

@group(1) @binding(5) var<uniform> sweep: Sweep;
@group(1) @binding(6) var states: texture_2d_array<f32>;
@group(1) @binding(7) var carried_near: texture_2d_array<f32>;  // states of the near frame, carried into this one
@group(1) @binding(8) var carried_far: texture_2d_array<f32>;   // the same of the far frame
@group(1) @binding(9) var<storage, read_write> costs: array<f32>;   // of every pixel's state: its match
@group(1) @binding(10) var output: StatesOut;
@group(1) @binding(11) var lead: texture_2d_array<f32>;         // the guide, and where it leads: see repeats.wgsl

const SMOOTHNESS: f32 = 0.08;       // cost of 1 px of difference from the neighbours
const BEND_SHARE: f32 = 0.5;        // of a difference of bends, against one of flows
const NEIGHBOURS: u32 = 8u;
const NEAR: u32 = 3u;               // pixels tried along the axes are 1 and 3 px away,
const DIAGONAL: f32 = 9.0;          // those along the diagonals 9 px
const AXES: u32 = 8u;
const FIXED: u32 = 12u;             // along axes and diagonals
const RANDOM: u32 = 2u;             // pixels anywhere within reach
const PROPAGATED: u32 = 18u;        // the above, standing still, two carried states, and one made of both
const FLOW_TRIES: u32 = 3u;         // random changes of the flow, each half as large as the one before
const SLOPE_TRIES: u32 = 2u;        // random changes of the slope
const SLOPE_STEP: f32 = 0.05;       // greatest of the first of them
const SLOPE_FALL: f32 = 0.4;        // each is so much of the one before
const BEND_TRIES: u32 = 2u;         // random changes of the bend, with the flow or without
const REFINED: u32 = 11u;           // two planes, the changes, no slope, no bend
override ASIDE_PRICE: f32 = 0.4;    // of moving otherwise than most, per longer side of the picture, where a patch
const PLAIN: f32 = 0.0009;          // has gradients: more than this, squared; its neighbours tell how a plain one moves
const ASTRAY_PRICE: f32 = 0.2;      // of differing from the guide where it leads, per px of its level,
const LEEWAY: f32 = 1.0;            // beyond this [px of its level],
const MOST_ASTRAY: f32 = 2.0;       // for so much more at most [px of its level]
const SAME: f32 = 0.001;            // states closer than this are not tried again [px]
const UNKNOWN: f32 = 1000.0;        // energy of a state that is to be tried first: more than any

var<private> around: array<vec4f, NEIGHBOURS>;      // flow and bend of the neighbours, each moved here
var<private> around_weight: array<f32, NEIGHBOURS>; // all of them sum up to SMOOTHNESS
var<private> most: vec2f;           // the flow of most of the picture here [px],
var<private> aside_price: f32;      // and the price of differing from it by 1 px
var<private> led: vec4f;            // the guide's displacements here [px]: to the near frame and the far one,
var<private> astray_price: f32;     // and the price of differing from it by 1 px

/// Each neighbour's state along its own slope, and its weight by likeness; and the motion of most of the picture.
fn load_neighbours(px: vec2i) {
    let color = textureLoad(here, px, 0, 0).rgb;
    var total = 1e-6;
    for (var k = 0u; k < NEIGHBOURS; k++) {
        let place = select(k, NEIGHBOURS, k == NEIGHBOURS / 2u);    // of 3 x 3, but for the centre
        let by = vec2i(vec2u(place % 3u, place / 3u)) - 1;
        let at = px + by;
        let is_inside = all(at >= vec2i(0)) && all(at < vec2i(frame.size));
        let state = moved(load_state(states, at), -vec2f(by));
        let weight = select(0.0, likeness(textureLoad(here, at, 0, 0).rgb, color), is_inside);
        around[k] = vec4f(state.flow, state.bend);
        around_weight[k] = weight;
        total += weight;
    }
    for (var k = 0u; k < NEIGHBOURS; k++) { around_weight[k] *= SMOOTHNESS / total; }
    let x = vec2f(px) + 0.5;
    let at = sweep.most * vec4f(x, 1.0, 0.0);
    most = at.xy / at.z - x;
    var square = 0.0;
    for (var k = 0u; k < SAMPLES; k++) {
        let gradient = vec2f(patch0[k].w, patch1[k].x) - 0.5;
        square += patch1[k].w * dot(gradient, gradient);
    }
    aside_price = ASIDE_PRICE * square / (square + PLAIN) / f32(max(frame.size.x, frame.size.y));
    astray_price = 0.0;
    if sweep.lead_factor > 0.0 {
        let source = px / i32(sweep.lead_factor);
        led = sweep.lead_factor * textureLoad(lead, source, 0, 0);
        astray_price = ASTRAY_PRICE * textureLoad(lead, source, 1, 0).x / sweep.lead_factor;
    }
}

/// By how much a state differs from the guide [px]: the mean of both sides, of each what is beyond LEEWAY.
fn astray(state: State) -> f32 {
    let by = abs(led - vec4f(state.flow, way_to_far(state).flow));
    let away = max(by.xz, by.yw) - sweep.lead_factor * LEEWAY;
    let counted = clamp(away, vec2f(0.0), vec2f(sweep.lead_factor * MOST_ASTRAY));
    return select(counted.x, 0.5 * (counted.x + counted.y), VIEWS == AROUND);
}

/// Cost of differing from the neighbours, and from most of the picture: where a thing repeats, or has no end along its
/// way, this decides.
fn smoothness(state: State) -> f32 {
    let aside = abs(state.flow - most);
    var sum = aside_price * (aside.x + aside.y);
    if astray_price > 0.0 { sum += astray_price * astray(state); }
    for (var k = 0u; k < NEIGHBOURS; k++) {
        let d = abs(around[k] - vec4f(state.flow, state.bend));
        sum += around_weight[k] * min(d.x + d.y + BEND_SHARE * (d.z + d.w), sweep.most_apart);
    }
    return sum;
}

struct Best {
    state: State,
    energy: f32,
    cost: f32,          // of the match alone
}

fn begin(px: vec2i) -> Best {
    load_patch(px);
    load_neighbours(px);
    let state = load_state(states, px);
    let cost = costs[px.y * i32(frame.size.x) + px.x];
    return Best(state, select(UNKNOWN, smoothness(state) + price(state) + cost, sweep.is_known == 1u), cost);
}

/// The better one of two states.
fn attempt(best: Best, candidate: State) -> Best {
    var state = candidate;
    let is_own = best.energy == UNKNOWN;
    if !is_own { state.slope = clamp(state.slope, vec4f(-STEEPEST), vec4f(STEEPEST)); }
    let least = smoothness(state) + price(state);
    let apart = abs(vec4f(state.flow - best.state.flow, state.bend - best.state.bend));
    let is_same = !is_own && max(max(apart.x, apart.y), max(apart.z, apart.w)) < SAME
        && all(abs(state.slope - best.state.slope) < vec4f(SAME));
    let most = select(best.energy - least, -1.0, is_same);
    let cost = match_cost(state, most);
    if least + cost < best.energy && !is_same { return Best(state, least + cost, cost); }
    return best;
}

/// The pixel of an invocation, which has the chessboard's colour; the one beside it is other_pixel().
fn own_pixel(local: u32, group: vec3u) -> vec2i {
    let at = banded_pixel(local, group);
    return vec2i(vec2u(2u * at.x + (at.y + sweep.color) % 2u, at.y));
}

fn other_pixel(px: vec2i) -> vec2i {
    return vec2i(px.x ^ 1, px.y);
}

fn is_inside(px: vec2i) -> bool {
    return all(px < vec2i(frame.size));
}

fn store(px: vec2i, state: State) {
    if is_inside(px) {
        textureStore(output, px, 0, vec4f(state.flow, state.bend));
        textureStore(output, px, 1, state.slope);
    }
}

fn store_best(px: vec2i, best: Best) {
    if is_inside(px) { costs[px.y * i32(frame.size.x) + px.x] = best.cost; }
    store(px, best.state);
    store(other_pixel(px), load_state(states, other_pixel(px)));
}

/// Three random numbers, -0.5 to 0.5.
fn random3(px: vec2i, which: u32) -> vec3f {
    return unit_float3(pcg3d(vec3u(vec2u(px), sweep.seed + which))) - 0.5;
}

/// Where the state of a candidate comes from.
fn source_of(px: vec2i, k: u32) -> vec2i {
    let along = select(1, i32(NEAR), k >= AXES / 2u) * (1 - 2 * i32(k % 2u));
    let by = select(vec2i(along, 0), vec2i(0, along), k % 4u >= 2u);
    let across = i32(DIAGONAL) * (2 * vec2i(vec2u(k % 2u, k / 2u % 2u)) - 1);
    let random = vec2i(2.0 * sweep.reach * random3(px, k).xy);
    let fixed = select(by, across, k >= AXES);
    return px + select(fixed, random, k >= FIXED);
}

// Loops end at their end, for lavapipe. Where a pixel's own state has no known cost, it is the first candidate.

@compute @workgroup_size(WG_X, WG_Y)
fn propagate(@builtin(local_invocation_index) local: u32, @builtin(workgroup_id) group: vec3u) {
    let px = own_pixel(local, group);
    var best = begin(min(px, vec2i(frame.size) - 1));
    let own = 1u - sweep.is_known;
    let turns = turns_of(PROPAGATED + own, local);
    var turn = 0u;
    loop {
        let k = turn - own;
        var source = source_of(px, k);
        let is_there = all(source >= vec2i(0)) && all(source < vec2i(frame.size));
        if k >= PROPAGATED || !is_there { source = px; }
        var candidate = moved(load_state(states, source), vec2f(px - source));
        if k == FIXED + RANDOM { candidate = State(); }
        if k == FIXED + RANDOM + 1u && sweep.carried > 0u { candidate = load_state(carried_near, px); }
        if k == FIXED + RANDOM + 2u && sweep.carried > 1u { candidate = load_state(carried_far, px); }
        if k == FIXED + RANDOM + 3u && sweep.carried > 1u {     // each side as the frame there has it
            candidate = load_state(carried_near, px);
            candidate.bend = view.far_factor * (load_state(carried_far, px).flow - candidate.flow);
        }
        best = attempt(best, candidate);
        turn++;
        if turn >= turns { break; }
    }
    store_best(px, best);
}

/// Variation `k` of a state.
fn varied(state: State, plane: Plane, px: vec2i, k: u32) -> State {
    var result = state;
    let random = random3(px, 2u * k);
    let more = random3(px, 2u * k + 1u);
    if k < 2u { result.slope = plane.slope; }
    if k == 1u { result.flow = plane.flow; }
    let flow_try = k - 2u;
    if flow_try < FLOW_TRIES { result.flow += 2.0 * sweep.flow_step * exp2(-f32(flow_try)) * random.xy; }
    let slope_try = flow_try - FLOW_TRIES;
    if slope_try < SLOPE_TRIES {
        result.slope += 2.0 * SLOPE_STEP * pow(SLOPE_FALL, f32(slope_try)) * vec4f(random.xy, more.xy);
    }
    let bend_try = slope_try - SLOPE_TRIES - 1u;
    if bend_try == 0xffffffffu { result.slope = vec4f(0.0); }
    if bend_try < BEND_TRIES {
        let by = 2.0 * sweep.bend_step * random.xy;
        result.bend += by;
        if bend_try % 2u == 1u { result.flow += by; }
    }
    if bend_try == BEND_TRIES { result.bend = vec2f(0.0); }
    return result;
}

@compute @workgroup_size(WG_X, WG_Y)
fn refine(@builtin(local_invocation_index) local: u32, @builtin(workgroup_id) group: vec3u) {
    let px = own_pixel(local, group);
    let inside = min(px, vec2i(frame.size) - 1);
    var best = begin(inside);
    let plane = fitted_plane(here, states, inside, best.state);
    let own = 1u - sweep.is_known;
    let turns = turns_of(REFINED + own, local);
    var turn = 0u;
    loop {
        best = attempt(best, varied(best.state, plane, px, turn - own));
        turn++;
        if turn >= turns { break; }
    }
    let steps = inverse_steps(best.state);
    let state = best.state;
    var k = 0u;
    loop {
        best = attempt(best, stepped(state, steps, k));
        k++;
        if k >= STEPS { break; }
    }
    store_best(px, best);
}

/// After the sweeps: every pixel takes the steps that improve its match, whatever its neighbours do. So all may move
/// together by a part of a pixel, which a sweep does not let one of them do alone; smooth.wgsl removes the noise.
@compute @workgroup_size(WG_X, WG_Y)
fn polish(@builtin(local_invocation_index) local: u32, @builtin(workgroup_id) group: vec3u) {
    let px = vec2i(banded_pixel(local, group));
    let inside = min(px, vec2i(frame.size) - 1);
    load_patch(inside);
    let own = load_state(states, inside);
    let steps = inverse_steps(own);
    var state = own;
    var energy = price(own) + steps.cost;
    var k = 0u;
    loop {
        let candidate = stepped(own, steps, k);
        let least = price(candidate);
        let changed = least + match_cost(candidate, energy - least);
        if changed < energy {
            energy = changed;
            state = candidate;
        }
        k++;
        if k >= STEPS { break; }
    }
    store(px, state);
}
