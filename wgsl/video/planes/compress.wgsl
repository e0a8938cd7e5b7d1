// Linear light with its highlights expanded, premultiplied by alpha -> the same with highlights as they were.
//#include common/frame.wgsl
//#include common/highlights.wgsl

@group(1) @binding(0) var light: texture_2d<f32>;
@group(1) @binding(1) var output: Output;

@compute @workgroup_size(WG_X, WG_Y)
fn main(@builtin(global_invocation_id) id: vec3u) {
    if any(id.xy >= frame.size) { return; }
    let premultiplied = textureLoad(light, id.xy, 0);
    let alpha = premultiplied.w;
    let color = compressed(select(vec3f(0.0), premultiplied.xyz / alpha, alpha > 0.0)) * alpha;
    textureStore(output, id.xy, vec4f(color, alpha));
}
