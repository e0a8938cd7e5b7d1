// Motion of a small level, raised to a larger one.
//#include common/frame.wgsl
//#include flow/dense/raising.wgsl

@group(1) @binding(3) var state: texture_2d<f32>;           // of the small level: to_prev, to_next [px]
@group(1) @binding(4) var output: texture_storage_2d<rgba32float, write>;

@compute @workgroup_size(WG_X, WG_Y)
fn main(@builtin(global_invocation_id) id: vec3u) {
    if any(id.xy >= frame.size) { return; }
    let px = vec2i(id.xy);
    let factor = vec2f(frame.size) / vec2f(textureDimensions(state));
    textureStore(output, px, factor.xyxy * textureLoad(state, likest(px, vec2f(frame.size)), 0));
}
