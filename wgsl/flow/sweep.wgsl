// Half a sweep: every second pixel, as on a chessboard, tries other states and keeps the best. First those of other
// pixels (Barnes et al., "PatchMatch", 2009; on planes: Bleyer et al. 2011), then variations of its own.
//#include common/hash.wgsl
//#include flow/match.wgsl

struct Sweep {
    color: u32,         // of the chessboard: 0 or 1
    seed: u32,          // of the random numbers
    reach: f32,         // of random pixels [px]
    flow_step: f32,     // greatest random change of the flow [px]
    bend_step: f32,     // of the bend [px]
    most_apart: f32,    // differences from neighbours beyond this [px] cost no more
    carried: u32,       // how many of the carried states there are
    unused: u32,
}

@group(1) @binding(5) var<uniform> sweep: Sweep;
@group(1) @binding(6) var states: texture_2d_array<f32>;
@group(1) @binding(7) var carried_near: texture_2d_array<f32>;  // states of the near frame, carried into this one
@group(1) @binding(8) var carried_far: texture_2d_array<f32>;   // the same of the far frame
@group(1) @binding(9) var output: StatesOut;

const SMOOTHNESS: f32 = 0.08;       // cost of 1 px of difference from the neighbours
const BEND_SHARE: f32 = 0.5;        // of a difference of bends, against one of flows
const NEIGHBOURS: u32 = 8u;
const NEAR: u32 = 3u;               // pixels tried along the axes are 1 and 3 px away,
const DIAGONAL: f32 = 9.0;          // those along the diagonals 9 px
const AXES: u32 = 8u;
const FIXED: u32 = 12u;             // along axes and diagonals
const RANDOM: u32 = 2u;             // pixels anywhere within reach
const PROPAGATED: u32 = 17u;        // the above, standing still, and two carried states
const PLANE_RADIUS: i32 = 8;        // of the pixels to which a plane is fitted [px]
const PLANE_SIDE: u32 = 9u;         // such pixels along a side
const PLANE_INERTIA: f32 = 1.0;     // how much a fitted plane tends to be level [px^2]
const FLOW_TRIES: u32 = 4u;         // random changes of the flow, each half as large as the one before
const SLOPE_TRIES: u32 = 3u;        // random changes of the slope
const SLOPE_STEP: f32 = 0.05;       // greatest of the first of them
const SLOPE_FALL: f32 = 0.4;        // each is so much of the one before
const BEND_TRIES: u32 = 4u;         // random changes of the bend, with the flow or without
const BEND_FALL: f32 = 0.25;
const REFINED: u32 = 15u;           // two planes, the changes, no slope, no bend
const SAME: f32 = 0.001;            // states closer than this are not tried again [px]

var<private> around: array<vec4f, NEIGHBOURS>;      // flow and bend of the neighbours, each moved here
var<private> around_weight: array<f32, NEIGHBOURS>; // all of them sum up to SMOOTHNESS

/// Each neighbour's state along its own slope, and its weight by likeness.
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
}

/// Cost of differing from the neighbours.
fn smoothness(state: State) -> f32 {
    var sum = 0.0;
    for (var k = 0u; k < NEIGHBOURS; k++) {
        let d = abs(around[k] - vec4f(state.flow, state.bend));
        sum += around_weight[k] * min(d.x + d.y + BEND_SHARE * (d.z + d.w), sweep.most_apart);
    }
    return sum;
}

struct Best {
    state: State,
    energy: f32,
}

fn begin(px: vec2i) -> Best {
    load_patch(px);
    load_neighbours(px);
    let state = load_state(states, px);
    return Best(state, smoothness(state) + price(state) + match_cost(state, OUTSIDE));
}

/// The better one of two states.
fn attempt(best: Best, candidate: State) -> Best {
    var state = candidate;
    state.slope = clamp(state.slope, vec4f(-STEEPEST), vec4f(STEEPEST));
    let least = smoothness(state) + price(state);
    let apart = abs(vec4f(state.flow - best.state.flow, state.bend - best.state.bend));
    let is_same = max(max(apart.x, apart.y), max(apart.z, apart.w)) < SAME
        && all(abs(state.slope - best.state.slope) < vec4f(SAME));
    let most = select(best.energy - least, -1.0, is_same);
    let energy = least + match_cost(state, most);
    if energy < best.energy && !is_same { return Best(state, energy); }
    return best;
}

/// The pixel of an invocation, which has the chessboard's colour; the one beside it is other_pixel().
fn own_pixel(at: vec2u) -> vec2i {
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

@compute @workgroup_size(WG_X, WG_Y)
fn propagate(@builtin(local_invocation_index) local: u32,
        @builtin(workgroup_id) group: vec3u, @builtin(num_workgroups) groups: vec3u) {
    let px = own_pixel(swizzled_pixel(local, group, groups));
    var best = begin(min(px, vec2i(frame.size) - 1));
    for (var k = 0u; k < PROPAGATED; k++) {
        var source = source_of(px, k);
        if any(source < vec2i(0)) || any(source >= vec2i(frame.size)) { source = px; }
        var candidate = moved(load_state(states, source), vec2f(px - source));
        if k == FIXED + RANDOM { candidate = State(); }
        if k == FIXED + RANDOM + 1u && sweep.carried > 0u { candidate = load_state(carried_near, px); }
        if k == FIXED + RANDOM + 2u && sweep.carried > 1u { candidate = load_state(carried_far, px); }
        best = attempt(best, candidate);
    }
    store(px, best.state);
    store(other_pixel(px), load_state(states, other_pixel(px)));
}

struct Plane {
    flow: vec2f,
    slope: vec4f,
}

/// The plane through the flows near by that are of like pixels and like the state.
fn fitted_plane(px: vec2i, state: State) -> Plane {
    let color = textureLoad(here, px, 0, 0).rgb;
    var total = 0.0;
    var sum_at = vec2f(0.0);
    var sum_flow = vec2f(0.0);
    var square = vec3f(0.0);    // xx, xy, yy
    var product = vec4f(0.0);   // xu, yu, xv, yv
    for (var k = 0u; k < PLANE_SIDE * PLANE_SIDE; k++) {
        let by = 2 * vec2i(vec2u(k % PLANE_SIDE, k / PLANE_SIDE)) - PLANE_RADIUS;
        let at = px + by;
        let is_there = all(at >= vec2i(0)) && all(at < vec2i(frame.size));
        let flow = textureLoad(states, at, 0, 0).xy;
        let x = vec2f(by);
        let apart = dot(abs(flow - moved(state, x).flow), vec2f(1.0));
        let like = likeness(textureLoad(here, at, 0, 0).rgb, color) / (1.0 + apart * apart);
        let weight = select(0.0, like, is_there);
        total += weight;
        sum_at += weight * x;
        sum_flow += weight * flow;
        square += weight * vec3f(x.x * x.x, x.x * x.y, x.y * x.y);
        product += weight * vec4f(x * flow.x, x * flow.y);
    }
    let mean_at = sum_at / total;
    let xx = square.x - mean_at.x * sum_at.x + PLANE_INERTIA * total;
    let xy = square.y - mean_at.x * sum_at.y;
    let yy = square.z - mean_at.y * sum_at.y + PLANE_INERTIA * total;
    let u = product.xy - mean_at * sum_flow.x;
    let v = product.zw - mean_at * sum_flow.y;
    let slope = vec4f(u.x * yy - u.y * xy, u.y * xx - u.x * xy, v.x * yy - v.y * xy, v.y * xx - v.x * xy)
        / (xx * yy - xy * xy);
    return Plane(sum_flow / total - sloped(slope, mean_at), slope);
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
        let by = 2.0 * sweep.bend_step * pow(BEND_FALL, f32(bend_try / 2u)) * random.xy;
        result.bend += by;
        if bend_try % 2u == 1u { result.flow += by; }
    }
    if bend_try == BEND_TRIES { result.bend = vec2f(0.0); }
    return result;
}

@compute @workgroup_size(WG_X, WG_Y)
fn refine(@builtin(local_invocation_index) local: u32,
        @builtin(workgroup_id) group: vec3u, @builtin(num_workgroups) groups: vec3u) {
    let px = own_pixel(swizzled_pixel(local, group, groups));
    let inside = min(px, vec2i(frame.size) - 1);
    var best = begin(inside);
    let plane = fitted_plane(inside, best.state);
    for (var k = 0u; k < REFINED; k++) { best = attempt(best, varied(best.state, plane, px, k)); }
    store(px, best.state);
    store(other_pixel(px), load_state(states, other_pixel(px)));
}
