// Linear light, premultiplied by alpha -> the samples that are stored, not rounded yet.
//#include common/frame.wgsl
//#include common/highlights.wgsl
//#include common/transfer.wgsl
//#include video/planes/code.wgsl

@group(1) @binding(0) var<uniform> code: Code;
@group(1) @binding(1) var light: texture_2d<f32>;
@group(1) @binding(2) var output: Output;

@compute @workgroup_size(WG_X, WG_Y)
fn main(@builtin(global_invocation_id) id: vec3u) {
    if any(id.xy >= frame.size) { return; }
    let premultiplied = textureLoad(light, id.xy, 0);
    var color = premultiplied.xyz;
    if ALPHA { color = select(vec3f(0.0), color / premultiplied.w, premultiplied.w > 0.0); }
    let signal = vec4f(signal_of(compressed(color)), 1.0);
    let samples = vec3f(dot(code.x, signal), dot(code.y, signal), dot(code.z, signal));
    textureStore(output, id.xy, vec4f(samples, code.alpha * premultiplied.w));
}
