// Motion of the picture: of blocks, raised, where that was chosen, else of dense inverse search.
//#include common/frame.wgsl
//#include flow/dense/raising.wgsl

@group(1) @binding(3) var state: texture_2d<f32>;           // of that: to_prev, to_next [px]
@group(1) @binding(4) var chosen: texture_2d<f32>;          // of that: 1 where its motion is taken
@group(1) @binding(5) var motion: texture_2d<f32>;          // by dense inverse search
@group(1) @binding(6) var output: texture_storage_2d<rgba32float, write>;

@compute @workgroup_size(WG_X, WG_Y)
fn main(@builtin(global_invocation_id) id: vec3u) {
    if any(id.xy >= frame.size) { return; }
    let px = vec2i(id.xy);
    let factor = vec2f(frame.size) / vec2f(textureDimensions(state));
    let found = factor.xyxy * textureLoad(state, likest(px, vec2f(frame.size)), 0);
    let is_chosen = textureLoad(chosen, vec2i((vec2f(px) + 0.5) / factor), 0).x > 0.0;
    textureStore(output, px, select(textureLoad(motion, px, 0), found, is_chosen));
}
