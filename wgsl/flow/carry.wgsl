// The states of one frame carried along their own flow into the frame beside it, where they are tried. Of those that
// land on a pixel the cheapest wins, and of equals the first: the result does not depend on any order.
//#include flow/band.wgsl
//#include flow/match.wgsl

struct Carry {
    along: f32,         // 1: into this frame's near one, -1: into its far one
    turn: f32,          // from the displacement back to the other frame's own flow
    unused: vec2u,
}

@group(1) @binding(5) var<uniform> carry: Carry;
@group(1) @binding(6) var states: texture_2d_array<f32>;
@group(1) @binding(7) var<storage, read_write> landings: array<Landing>;
@group(1) @binding(8) var output: StatesOut;

struct Landing {
    cost: atomic<u32>,      // the least, as the bits of a number above 0
    source: atomic<u32>,    // the first pixel that costs so little
    own: u32,               // cost of the pixel's own state
}

const NONE: u32 = 0xffffffffu;
const CORNERS: u32 = 4u;    // pixels around the place where a state lands

/// Displacement to the other frame, and its slope.
fn way_of(state: State) -> State {
    if carry.along > 0.0 { return state; }
    return way_to_far(state);
}

/// One of the pixels around the place where the state of a pixel lands; -1 if it is outside.
fn landing(px: vec2i, flow: vec2f, corner: u32) -> i32 {
    let at = vec2i(floor(vec2f(px) + flow)) + vec2i(vec2u(corner % 2u, corner / 2u));
    if any(at < vec2i(0)) || any(at >= vec2i(frame.size)) { return -1; }
    return at.y * i32(frame.size.x) + at.x;
}

@compute @workgroup_size(WG_X, WG_Y)
fn clear(@builtin(local_invocation_index) local: u32, @builtin(workgroup_id) group: vec3u) {
    let id = banded_pixel(local, group);
    if any(id >= frame.size) { return; }
    let index = id.y * frame.size.x + id.x;
    atomicStore(&landings[index].cost, NONE);
    atomicStore(&landings[index].source, NONE);
}

@compute @workgroup_size(WG_X, WG_Y)
fn claim(@builtin(local_invocation_index) local: u32, @builtin(workgroup_id) group: vec3u) {
    let id = banded_pixel(local, group);
    let px = vec2i(min(id, frame.size - 1u));
    let way = way_of(load_state(states, px));
    load_patch(px);
    let is_near = carry.along > 0.0;
    let n = near_cost(target_of(way.flow, way.slope, select(-1.0, OUTSIDE, is_near)));
    let f = far_cost(target_of(way.flow, way.slope, select(OUTSIDE, -1.0, is_near)));
    let cost = bitcast<u32>(min(n, f) + 1.0);
    if any(id >= frame.size) { return; }
    landings[id.y * frame.size.x + id.x].own = cost;
    for (var corner = 0u; corner < CORNERS; corner++) {
        let at = landing(px, way.flow, corner);
        if at >= 0 { atomicMin(&landings[at].cost, cost); }
    }
}

@compute @workgroup_size(WG_X, WG_Y)
fn settle(@builtin(local_invocation_index) local: u32, @builtin(workgroup_id) group: vec3u) {
    let id = banded_pixel(local, group);
    if any(id >= frame.size) { return; }
    let index = id.y * frame.size.x + id.x;
    let way = way_of(load_state(states, vec2i(id)));
    for (var corner = 0u; corner < CORNERS; corner++) {
        let at = landing(vec2i(id), way.flow, corner);
        if at >= 0 && atomicLoad(&landings[max(at, 0)].cost) == landings[index].own {
            atomicMin(&landings[at].source, index);
        }
    }
}

/// The state that came, from this frame's side: back along its way, or, by constant velocity, on along it.
@compute @workgroup_size(WG_X, WG_Y)
fn fetch(@builtin(local_invocation_index) local: u32, @builtin(workgroup_id) group: vec3u) {
    let id = banded_pixel(local, group);
    if any(id >= frame.size) { return; }
    let source = atomicLoad(&landings[id.y * frame.size.x + id.x].source);
    let start = vec2u(source % frame.size.x, source / frame.size.x);
    var way = State();
    if source != NONE { way = way_of(load_state(states, vec2i(start))); }
    textureStore(output, id, 0, vec4f(carry.turn * way.flow, 0.0, 0.0));
    textureStore(output, id, 1, carry.turn * way.slope);
}
