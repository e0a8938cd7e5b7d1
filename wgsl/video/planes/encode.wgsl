// Linear light -> samples that are stored as floats.
//#include common/frame.wgsl
//#include video/planes/samples.wgsl

@group(1) @binding(2) var output: Output;

@compute @workgroup_size(WG_X, WG_Y)
fn main(@builtin(global_invocation_id) id: vec3u) {
    if any(id.xy >= frame.size) { return; }
    textureStore(output, id.xy, samples_at(id.xy));
}
