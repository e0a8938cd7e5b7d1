// State of a pixel in flow: one displacement with its slope, which holds for both other frames but for a bend.

struct State {
    flow: vec2f,        // displacement to the near frame [px]
    bend: vec2f,        // the displacement to the far frame, less View.far_factor times `flow` [px]
    slope: vec4f,       // change of the flow: du/dx, du/dy, dv/dx, dv/dy
}

alias StatesOut = texture_storage_2d_array<rgba32float, write>;    // layer 0: flow, bend; layer 1: slope

const STEEPEST: f32 = 0.6;      // greatest slope

fn load_state(states: texture_2d_array<f32>, px: vec2i) -> State {
    let first = textureLoad(states, px, 0, 0);
    return State(first.xy, first.zw, textureLoad(states, px, 1, 0));
}

/// The same plane of flow, as it is at another pixel.
fn moved(state: State, by: vec2f) -> State {
    return State(state.flow + sloped(state.slope, by), state.bend, state.slope);
}

fn sloped(slope: vec4f, by: vec2f) -> vec2f {
    return vec2f(dot(slope.xy, by), dot(slope.zw, by));
}
