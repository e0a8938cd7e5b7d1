// The motion of most of the picture, where it explains a pixel better than the state that was found. Of all motions it
// needs a reason the least: neither its slope nor its bend has a price.
//#include flow/band.wgsl
//#include flow/steps.wgsl

struct Dominant {
    to_near: mat4x4f,   // homography of most of the picture: columns of 3, from pixels to pixels
    to_far: mat4x4f,
}

@group(1) @binding(5) var<uniform> dominant: Dominant;
@group(1) @binding(6) var states: texture_2d_array<f32>;
@group(1) @binding(7) var output: StatesOut;

const SAME_WAY: f32 = 1.0;      // a pixel that moves so much like most of the picture on one side [px] does so on the other
                                // too, rather than being hidden there

const UNSEEN_PRICE: f32 = 0.06; // for leaving the picture on both sides as most of it does
const MUCH_ALIKE: f32 = 4.0;    // motion off that of most by less than this [px] reaches at most 2 px to either side of
                                // its pixel in a whole frame: no farther than the patch that was compared
const AS_WELL: f32 = 0.01;      // matches that differ by less are equally good

fn displaced(homography: mat4x4f, x: vec2f) -> vec2f {
    let at = homography * vec4f(x, 1.0, 0.0);
    return at.xy / at.z - x;
}

/// Motion of most of the picture at a pixel.
fn dominant_state(px: vec2i) -> State {
    let x = vec2f(px) + 0.5;
    let flow = displaced(dominant.to_near, x);
    let across = vec2f(0.5, 0.0);
    let along_x = displaced(dominant.to_near, x + across) - displaced(dominant.to_near, x - across);
    let along_y = displaced(dominant.to_near, x + across.yx) - displaced(dominant.to_near, x - across.yx);
    let bend = displaced(dominant.to_far, x) - view.far_factor * flow;
    let slope = vec4f(along_x.x, along_y.x, along_x.y, along_y.y);
    return State(flow, bend, clamp(slope, vec4f(-STEEPEST), vec4f(STEEPEST)));
}

/// Displacements to the near and the far frame of a few pixels, evenly spaced: one for each pixel of a small picture.
/// They are those of most of the picture, with the steps that match better.
@compute @workgroup_size(WG_X, WG_Y)
fn correct(@builtin(local_invocation_index) local: u32, @builtin(workgroup_id) group: vec3u) {
    let id = banded_pixel(local, group);
    let few = textureDimensions(output);
    let px = vec2i((2u * min(id, few - 1u) + 1u) * frame.size / (2u * few));
    load_patch(px);
    let most = dominant_state(px);
    let steps = inverse_steps(most);
    let ways = vec4f(most.flow + steps.near, way_to_far(most).flow + steps.far);
    if all(id < few) { textureStore(output, id, 0, ways); }
}

@compute @workgroup_size(WG_X, WG_Y)
fn follow(@builtin(local_invocation_index) local: u32, @builtin(workgroup_id) group: vec3u) {
    let id = banded_pixel(local, group);
    let px = vec2i(min(id, frame.size - 1u));
    load_patch(px);
    var state = load_state(states, px);
    let most = dominant_state(px);
    let near_apart = length(state.flow - most.flow);
    let far_apart = length(way_to_far(state).flow - way_to_far(most).flow);
    var least = price(state) + match_cost(state, OUTSIDE);
    if min(near_apart, far_apart) < SAME_WAY { least += HIDDEN_PRICE; }
    if match_cost(most, least) < least { state = most; }
    if all(id < frame.size) {
        textureStore(output, id, 0, vec4f(state.flow, state.bend));
        textureStore(output, id, 1, state.slope);
    }
}

/// Displacements to the near and the far frame of a few pixels, as their states have them.
@compute @workgroup_size(WG_X, WG_Y)
fn write_ways(@builtin(local_invocation_index) local: u32, @builtin(workgroup_id) group: vec3u) {
    let id = banded_pixel(local, group);
    let few = textureDimensions(output);
    if any(id >= few) { return; }
    let state = load_state(states, vec2i((2u * id + 1u) * frame.size / (2u * few)));
    textureStore(output, id, 0, vec4f(state.flow, way_to_far(state).flow));
}

/// In the end, motion that the picture hardly tells becomes that of most of it: what leaves the picture, and what moves
/// much like most where it matches as well, as large areas of one colour do.
@compute @workgroup_size(WG_X, WG_Y)
fn settle(@builtin(local_invocation_index) local: u32, @builtin(workgroup_id) group: vec3u) {
    let id = banded_pixel(local, group);
    let px = vec2i(min(id, frame.size - 1u));
    load_patch(px);
    let most = dominant_state(px);
    var state = extended(load_state(states, px), most);
    let near_apart = length(state.flow - most.flow);
    let far_apart = select(length(way_to_far(state).flow - way_to_far(most).flow), 0.0, VIEWS == ONE);
    let cost = match_cost(state, OUTSIDE);
    let least = cost + AS_WELL;
    let is_alike = max(near_apart, far_apart) < MUCH_ALIKE && match_cost(most, least) < least;
    if is_alike || (cost > UNSEEN_PRICE && has_left(most)) { state = most; }
    if all(id < frame.size) {
        textureStore(output, id, 0, vec4f(state.flow, state.bend));
        textureStore(output, id, 1, state.slope);
    }
}

/// A state that leaves the picture on one side and on the other moves like most of it, which does not leave: it goes on
/// like most, too.
fn extended(own: State, most: State) -> State {
    var state = own;
    let way = way_to_far(state);
    let near_leaves = leaves(state.flow);
    let far_leaves = leaves(way.flow);
    let may_go_on = VIEWS == AROUND && !has_left(most);
    if may_go_on && near_leaves && !far_leaves && length(way.flow - way_to_far(most).flow) < SAME_WAY {
        state.flow = (way.flow - most.bend) / view.far_factor;
        state.bend = most.bend;
    }
    if may_go_on && far_leaves && !near_leaves && length(own.flow - most.flow) < SAME_WAY {
        state.bend = most.bend;
    }
    return state;
}

/// True where most of the picture leaves it on all sides that there are.
fn has_left(most: State) -> bool {
    return leaves(most.flow) && (VIEWS == ONE || leaves(way_to_far(most).flow));
}

fn leaves(flow: vec2f) -> bool {
    let at = centre + flow;
    return any(at < vec2f(0.0)) || any(at > vec2f(frame.size) - 1.0);
}
