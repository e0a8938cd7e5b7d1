// States drawn to the plane through those around them that are of like pixels and like them: less noise.
//#include flow/plane.wgsl

@group(1) @binding(0) var here: texture_2d_array<f32>;      // features of the frame
@group(1) @binding(1) var states: texture_2d_array<f32>;
@group(1) @binding(2) var output: StatesOut;

@compute @workgroup_size(WG_X, WG_Y)
fn main(@builtin(global_invocation_id) id: vec3u) {
    if any(id.xy >= frame.size) { return; }
    let plane = fitted_plane(here, states, vec2i(id.xy), load_state(states, vec2i(id.xy)));
    textureStore(output, id.xy, 0, vec4f(plane.flow, plane.bend));
    textureStore(output, id.xy, 1, plane.slope);
}
