// Differences from frame to frame: with the motion that was found, and without any.
//#include common/frame.wgsl
//#include methods/gather/shading/light.wgsl

@group(1) @binding(0) var flow: texture_2d<f32>;        // to the other frame [px]
@group(1) @binding(1) var flow_back: texture_2d<f32>;
@group(1) @binding(2) var values: texture_2d<f32>;
@group(1) @binding(3) var values_there: texture_2d<f32>;
@group(1) @binding(4) var linear: sampler;
@group(1) @binding(5) var differences: Differences;     // with, without

alias Differences = texture_storage_2d<rgba32float, write>;

@compute @workgroup_size(WG_X, WG_Y)
fn main(@builtin(global_invocation_id) id: vec3u) {
    if any(id.xy >= frame.size) { return; }
    let x = vec2f(id.xy) + 0.5;
    let scale = 1.0 / vec2f(frame.size);
    let own = textureLoad(values, id.xy, 0).a;
    let other = textureLoad(values_there, id.xy, 0).a;
    let ahead = textureSampleLevel(values_there, linear, (x + textureLoad(flow, id.xy, 0).xy) * scale, 0.0).a;
    let back = textureSampleLevel(values, linear, (x + textureLoad(flow_back, id.xy, 0).xy) * scale, 0.0).a;
    textureStore(differences, id.xy, vec4f(abs(ahead - own) + abs(back - other), 2.0 * abs(other - own), 0.0, 0.0));
}
