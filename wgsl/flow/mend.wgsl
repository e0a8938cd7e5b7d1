// Pixels that are not found again take over the state of sound ones around them that are like them: what is hidden
// moves as what it belongs to.
//#include flow/band.wgsl
//#include flow/match.wgsl

struct Others {         // how the states of the two other frames lead back to this one
    near: f32,          // by their flow: 1; by its continuation to their far frame: -1
    far: f32,           // the same; 0 if the far frame is no neighbour, or there is none
    unused: vec2u,
}

@group(1) @binding(5) var<uniform> others: Others;
@group(1) @binding(6) var states: texture_2d_array<f32>;
@group(1) @binding(7) var near_states: texture_2d_array<f32>;
@group(1) @binding(8) var far_states: texture_2d_array<f32>;
@group(1) @binding(9) var lost: texture_2d<u32>;        // output of `find_lost`: 1 if a pixel is not found again
@group(1) @binding(10) var lost_out: texture_storage_2d<r32uint, write>;
@group(1) @binding(11) var output: StatesOut;

const MOST_MISSED: f32 = 1.5;       // way there and back of a pixel that is found again [px]
const RINGS: u32 = 9u;
const DIRECTIONS: u32 = 8u;
const FIRST_RING: f32 = 2.0;        // its radius [px]
const RING_GROWTH: f32 = 1.5;
const RING_TURN: f32 = 0.37;        // of the directions, per px of radius
const EIGHTH: f32 = 0.785398;       // of a turn [rad]
const UNLIKE_PRICE: f32 = 0.2;      // per difference of display colours,
const MOST_UNLIKE: f32 = 0.5;       // which counts up to this
const FAR_PRICE: f32 = 0.001;       // per px of distance
const MOST_COST: f32 = 0.15;        // of the match: hidden pixels match nowhere

/// Where the way to another frame and back ends, from where it began [px].
fn missed(px: vec2i, flow: vec2f, other: texture_2d_array<f32>, side: f32) -> f32 {
    let at = vec2f(px) + flow;
    let last = vec2f(frame.size) - 1.0;
    if any(at < vec2f(0.0)) || any(at > last) { return 2.0 * MOST_MISSED; }
    let corner = vec2i(at);
    let part = at - vec2f(corner);
    let right = vec2i(min(corner.x + 1, i32(last.x)), corner.y);
    let below = vec2i(corner.x, min(corner.y + 1, i32(last.y)));
    let top = mix(back(other, corner, side), back(other, right, side), part.x);
    let bottom = mix(back(other, below, side), back(other, vec2i(right.x, below.y), side), part.x);
    return length(flow + mix(top, bottom, part.y));
}

/// Another frame's displacement to this one.
fn back(other: texture_2d_array<f32>, px: vec2i, side: f32) -> vec2f {
    let state = textureLoad(other, px, 0, 0);
    return select(state.zw - state.xy, state.xy, side > 0.0);
}

@compute @workgroup_size(WG_X, WG_Y)
fn find_lost(@builtin(local_invocation_index) local: u32, @builtin(workgroup_id) group: vec3u) {
    let id = banded_pixel(local, group);
    if any(id >= frame.size) { return; }
    let px = vec2i(id);
    let state = load_state(states, px);
    var is_lost = missed(px, state.flow, near_states, others.near) > MOST_MISSED;
    if others.far != 0.0 {
        let flow = view.far_factor * state.flow + state.bend;
        is_lost = is_lost && missed(px, flow, far_states, others.far) > MOST_MISSED;
    }
    textureStore(lost_out, px, vec4u(u32(is_lost)));
}

@compute @workgroup_size(WG_X, WG_Y)
fn mend(@builtin(local_invocation_index) local: u32, @builtin(workgroup_id) group: vec3u) {
    let id = banded_pixel(local, group);
    let px = vec2i(min(id, frame.size - 1u));
    var state = load_state(states, px);
    let tries = select(0u, RINGS * DIRECTIONS, textureLoad(lost, px, 0).x != 0u);
    if tries > 0u { load_patch(px); }
    var best = OUTSIDE;
    for (var k = 0u; k < tries; k++) {
        let radius = FIRST_RING * pow(RING_GROWTH, f32(k / DIRECTIONS));
        let angle = EIGHTH * (f32(k % DIRECTIONS) + RING_TURN * radius);
        let source = px + vec2i(round(radius * vec2f(cos(angle), sin(angle))));
        let is_there = all(source >= vec2i(0)) && all(source < vec2i(frame.size));
        let is_sound = is_there && textureLoad(lost, source, 0).x == 0u;
        let candidate = moved(load_state(states, source), vec2f(px - source));
        let unlike = min(dot(abs(textureLoad(here, source, 0, 0).rgb - centre_color), vec3f(1.0)), MOST_UNLIKE);
        let least = UNLIKE_PRICE * unlike + FAR_PRICE * radius;
        let most = select(-1.0, min(best - least, MOST_COST), is_sound);
        let own = price(candidate);
        let total = least + min(own + match_cost(candidate, most - own), MOST_COST);
        if is_sound && total < best {
            best = total;
            state = candidate;
        }
    }
    if all(id < frame.size) {
        textureStore(output, id, 0, vec4f(state.flow, state.bend));
        textureStore(output, id, 1, state.slope);
    }
}
