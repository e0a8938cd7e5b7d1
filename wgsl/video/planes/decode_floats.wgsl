// Signals of a picture, R, G, B and straight alpha -> linear light, premultiplied by alpha.
// Without ALPHA they are premultiplied already, and their alpha is kept.
//#include common/frame.wgsl
//#include common/highlights.wgsl
//#include common/transfer.wgsl
//#include video/planes/code.wgsl

@group(1) @binding(0) var signals: texture_2d<f32>;
@group(1) @binding(1) var output: Output;

@compute @workgroup_size(WG_X, WG_Y)
fn main(@builtin(global_invocation_id) id: vec3u) {
    if any(id.xy >= frame.size) { return; }
    let signal = textureLoad(signals, id.xy, 0);
    let alpha = select(1.0, signal.w, ALPHA);
    textureStore(output, id.xy, vec4f(expanded(light_of(signal.xyz)) * alpha, signal.w));
}
