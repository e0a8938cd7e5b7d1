// Motion to the frames around, where their distances in time differ, as ways within the frame's own interval.
//#include common/frame.wgsl

struct Pace {
    factors: vec4f,     // of to_prev, to_next
}

@group(1) @binding(0) var<uniform> pace: Pace;
@group(1) @binding(1) var motion: texture_2d<f32>;      // to_prev, to_next [px]
@group(1) @binding(2) var output: Output;

@compute @workgroup_size(WG_X, WG_Y)
fn main(@builtin(global_invocation_id) id: vec3u) {
    if any(id.xy >= frame.size) { return; }
    textureStore(output, id.xy, pace.factors * textureLoad(motion, id.xy, 0));
}
