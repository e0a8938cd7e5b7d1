// States on the next finer level: those of the coarser one, each moved along its slope, twice as long.
//#include common/frame.wgsl
//#include flow/state.wgsl

@group(1) @binding(0) var states: texture_2d_array<f32>;
@group(1) @binding(1) var output: StatesOut;

@compute @workgroup_size(WG_X, WG_Y)
fn main(@builtin(global_invocation_id) id: vec3u) {
    if any(id.xy >= frame.size) { return; }
    let coarse = vec2i(id.xy / 2u);
    let by = 0.5 * vec2f(id.xy) - 0.25 - vec2f(coarse);
    let state = moved(load_state(states, coarse), by);
    textureStore(output, id.xy, 0, 2.0 * vec4f(state.flow, state.bend));
    textureStore(output, id.xy, 1, state.slope);
}
