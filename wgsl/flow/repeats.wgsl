// Where the picture repeats, a wrong repeat may match better than the right one, because the light changes; and what
// turns back is taken for hidden on one side, because the slope differs there. In both, the smooth motion of guide.wgsl
// leads.
//#include flow/band.wgsl
//#include flow/search_patch.wgsl

@group(1) @binding(5) var states: texture_2d_array<f32>;
@group(1) @binding(6) var guide: texture_2d_array<f32>;         // displacements of this frame,
@group(1) @binding(7) var near_back: texture_2d_array<f32>;     // of the near frame to this one,
@group(1) @binding(8) var far_back: texture_2d_array<f32>;      // and of the far one
@group(1) @binding(9) var found: texture_2d<u32>;               // output of `find`
@group(1) @binding(10) var found_out: texture_storage_2d<r32uint, write>;
@group(1) @binding(11) var output: StatesOut;
@group(1) @binding(12) var lead: StatesOut;     // where the guide leads to: near frame, far one; x of layer 1: 1 if it leads
@group(1) @binding(13) var coarser_lead: texture_2d_array<f32>;     // the same of the coarser level

override IS_COARSEST: bool = true;      // repeats are sought, and there is no coarser lead

const APART: f32 = 2.0;         // along either axis [px]: a state that differs more from the guide is another motion
const TURNS: f32 = 1.5;         // the same of one side, where the other agrees
const ALIKE: f32 = 0.4;         // share of the difference half way up to which a patch is found again
const MOST_TURN: f32 = 0.05;    // of the longer side: how far from constant velocity a side is led
const MOST_MISSED: f32 = 3.0;   // along either axis: way there and back [px]
const HIDDEN: f32 = 0.3;        // cost of a side above which a pixel seems hidden there,
const LESS: f32 = 0.15;         // if the guide costs at least so much less
const AROUND_SIDE: i32 = 17;    // every third pixel along a side is counted,
const STRIDE: i32 = 3;
const ENOUGH_REPEATS: f32 = 0.08;   // share of them that must lead to repeats for the guide to lead,
const ENOUGH_HIDDEN: f32 = 0.1;     // or seem hidden
const IS_REPEAT: u32 = 1u;      // bits of findings: leads to a repeat,
const IS_HIDDEN: u32 = 0x1000u;     // seems hidden where the guide matches better,
const MAY_TURN: u32 = 0x1000000u;   // is led by the guide if enough around are so

/// True if the own picture repeats after `by`: the patch is found again after it, but not half way. One loop, because
/// every place of the text that compares a patch takes seconds to compile on the CPU.
fn repeats(px: vec2i, by: vec2f) -> bool {
    var least = vec2f(OUTSIDE);     // differences around the way, and around its half
    for (var k = 0; k < 18; k++) {
        let half_way = k / 9;
        let at = px + vec2i(round(select(by, 0.5 * by, half_way == 1))) + vec2i(k % 3, k / 3 % 3) - 1;
        let cost = whole_cost(here, at, least[half_way]);
        least[half_way] = min(least[half_way], cost);
    }
    return least.x < ALIKE * least.y;
}

/// The cost of a side by a pixel's own displacement, and by the guide's.
fn near_costs(px: vec2i, own: vec2f, guided: vec2f) -> vec2f {
    var costs = vec2f(0.0);
    for (var k = 0; k < 2; k++) {
        costs[k] = whole_cost(near, px + vec2i(round(select(own, guided, k == 1))), OUTSIDE);
    }
    return costs;
}

fn far_costs(px: vec2i, own: vec2f, guided: vec2f) -> vec2f {
    var costs = vec2f(0.0);
    for (var k = 0; k < 2; k++) {
        costs[k] = whole_cost(far, px + vec2i(round(select(own, guided, k == 1))), OUTSIDE);
    }
    return costs;
}

/// Where a state leads: displacements to the near frame and the far one.
fn ways_of(state: State) -> vec4f {
    return vec4f(state.flow, way_to_far(state).flow);
}

/// The state that leads so.
fn state_of(ways: vec4f) -> State {
    let bend = select(vec2f(0.0), ways.zw - view.far_factor * ways.xy, VIEWS == AROUND);
    return State(ways.xy, bend, vec4f(0.0));
}

/// Greatest difference of two ways along either axis: to the near frame and to the far one [px].
fn apart(own: vec4f, guided: vec4f) -> vec2f {
    let by = abs(own - guided);
    return vec2f(max(by.x, by.y), select(0.0, max(by.z, by.w), VIEWS == AROUND));
}

/// True if the guide's way to another frame is also that of the guide from there.
fn comes_back(px: vec2i, way: vec2f, back: texture_2d_array<f32>) -> bool {
    let at = px + vec2i(round(way));
    if any(at < vec2i(0)) || any(at >= vec2i(frame.size)) { return false; }
    let missed = abs(way + textureLoad(back, at, 0, 0).xy);
    return max(missed.x, missed.y) <= MOST_MISSED;
}

/// True if a side that costs so much seems hidden where the guide matches.
fn is_hidden(costs: vec2f) -> bool {
    return costs.x > HIDDEN && costs.x < OUTSIDE && costs.y < costs.x - LESS;
}

@compute @workgroup_size(WG_X, WG_Y)
fn find(@builtin(local_invocation_index) local: u32, @builtin(workgroup_id) group: vec3u) {
    let id = banded_pixel(local, group);
    if any(id >= frame.size) { return; }
    let px = vec2i(id);
    let own = ways_of(load_state(states, px));
    let guided = textureLoad(guide, px, 0, 0);
    let by = apart(own, guided);
    var result = 0u;
    if max(by.x, by.y) > TURNS {
        load_search_patch(px);
        let to_near = near_costs(px, own.xy, guided.xy);
        var to_far = vec2f(0.0);
        if VIEWS == AROUND { to_far = far_costs(px, own.zw, guided.zw); }
        if IS_COARSEST && max(by.x, by.y) > APART {     // a displacement that matches better may be off by a repeat
            for (var side = 0; side < 2; side++) {
                let is_better = select(to_near.x < to_near.y, to_far.x < to_far.y, side == 1);
                let way = own - guided;
                if is_better && repeats(px, select(way.xy, way.zw, side == 1)) { result = IS_REPEAT; }
            }
        }
        if VIEWS == AROUND {
            let is_one_sided = min(by.x, by.y) <= APART
                && max(by.x, by.y) <= MOST_TURN * f32(max(frame.size.x, frame.size.y));
            if is_one_sided && comes_back(px, guided.xy, near_back)
                && comes_back(px, guided.zw, far_back) {
                let seems_hidden = select(by.x > TURNS && is_hidden(to_near), is_hidden(to_far), by.y > TURNS);
                result += MAY_TURN + select(0u, IS_HIDDEN, seems_hidden);
            }
        }
    }
    textureStore(found_out, id, vec4u(result));
}

/// True where the guide leads, because enough pixels around are found.
fn is_led(px: vec2i) -> vec2<bool> {
    var sum = 0u;
    var all_around = 0u;
    for (var k = 0; k < AROUND_SIDE * AROUND_SIDE; k++) {
        let at = px + STRIDE * (vec2i(k % AROUND_SIDE, k / AROUND_SIDE) - AROUND_SIDE / 2);
        if all(at >= vec2i(0)) && all(at < vec2i(frame.size)) {
            sum += textureLoad(found, at, 0).r % MAY_TURN;
            all_around++;
        }
    }
    let most = f32(all_around);
    let may_turn = textureLoad(found, px, 0).r >= MAY_TURN;
    let is_turning = may_turn && f32(sum / IS_HIDDEN) > ENOUGH_HIDDEN * most;
    return vec2<bool>(f32(sum % IS_HIDDEN) > ENOUGH_REPEATS * most, is_turning);
}

/// Where the guide leads, it takes the place of states that differ from it.
@compute @workgroup_size(WG_X, WG_Y)
fn follow(@builtin(local_invocation_index) local: u32, @builtin(workgroup_id) group: vec3u) {
    let id = banded_pixel(local, group);
    if any(id >= frame.size) { return; }
    let px = vec2i(id);
    var state = load_state(states, px);
    var leads_to = textureLoad(guide, px, 0, 0);
    let by = apart(ways_of(state), leads_to);
    let is_led_here = is_led(px);
    if (is_led_here.x && max(by.x, by.y) > APART) || is_led_here.y { state = state_of(leads_to); }
    textureStore(output, id, 0, vec4f(state.flow, state.bend));
    textureStore(output, id, 1, state.slope);
    var leads = f32(any(is_led_here));
    if !IS_COARSEST && leads == 0.0 {
        leads_to = 2.0 * textureLoad(coarser_lead, px / 2, 0, 0);
        leads = textureLoad(coarser_lead, px / 2, 1, 0).x;
    }
    textureStore(lead, id, 0, leads_to);
    textureStore(lead, id, 1, vec4f(leads, 0.0, 0.0, 0.0));
}
