// Small lights that the search missed: a pixel whose state leads to nothing alike in any frame takes the motion of the light
// to which it belongs, if that leads to its like.
//#include flow/band.wgsl
//#include flow/match.wgsl

struct Light {
    at: vec2f,          // its centre, in pixels whose centres are whole numbers
    reach: vec2f,       // half its width and height [px]
    flow: vec2f,        // as in State
    bend: vec2f,
}

@group(1) @binding(5) var<storage, read> lights: array<Light>;
@group(1) @binding(6) var states: texture_2d_array<f32>;
@group(1) @binding(7) var output: StatesOut;

const RIM: f32 = 1.5;           // around a light [px]
const BETTER: f32 = 0.1;        // the match has to be by so much better than the own one on either side

@compute @workgroup_size(WG_X, WG_Y)
fn main(@builtin(local_invocation_index) local: u32, @builtin(workgroup_id) group: vec3u) {
    let id = banded_pixel(local, group);
    let px = vec2i(min(id, frame.size - 1u));
    var state = load_state(states, px);
    let count = arrayLength(&lights);
    var which = count;
    for (var k = 0u; k < count; k++) {
        if all(abs(vec2f(px) - lights[k].at) < lights[k].reach + RIM) { which = k; }
    }
    if which < count {
        load_patch(px);
        let way = way_to_far(state);
        let n = near_cost(target_of(state.flow, state.slope, OUTSIDE));
        var least = n;
        if VIEWS != ONE { least = min(n, far_cost(target_of(way.flow, way.slope, OUTSIDE))); }
        let light = State(lights[which].flow, lights[which].bend, vec4f(0.0));
        if match_cost(light, least - BETTER) < least - BETTER { state = light; }
    }
    if all(id < frame.size) {
        textureStore(output, id, 0, vec4f(state.flow, state.bend));
        textureStore(output, id, 1, state.slope);
    }
}
