// The changes of light, added to a picture.
//#include common/frame.wgsl
//#include video/changing_light/changed.wgsl

@group(1) @binding(0) var picture: texture_2d<f32>;     // stored as given: linear, premultiplied alpha
@group(1) @binding(1) var output: Output;

@compute @workgroup_size(WG_X, WG_Y)
fn main(@builtin(global_invocation_id) id: vec3u) {
    if any(id.xy >= frame.size) { return; }
    let px = id.xy;
    textureStore(output, px, changed(textureLoad(picture, px, 0), px));
}
