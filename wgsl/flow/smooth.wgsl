// States drawn to the plane through those around them that are of like pixels and like them: less noise.
//#include flow/band.wgsl
//#include flow/plane.wgsl

@group(1) @binding(0) var here: texture_2d_array<f32>;      // features of the frame
@group(1) @binding(1) var states: texture_2d_array<f32>;
@group(1) @binding(2) var output: StatesOut;

@compute @workgroup_size(WG_X, WG_Y)
fn main(@builtin(local_invocation_index) local: u32, @builtin(workgroup_id) group: vec3u) {
    let id = banded_pixel(local, group);
    let px = vec2i(min(id, frame.size - 1u));
    let plane = fitted_plane(here, states, px, load_state(states, px));
    if any(id >= frame.size) { return; }
    textureStore(output, id, 0, vec4f(plane.flow, plane.bend));
    textureStore(output, id, 1, plane.slope);
}
