// Bends of a frame's paths beyond the three positions of its own vectors, from the frames before and after it.
//#include common/accelerations.wgsl
//#include common/frame.wgsl

@group(1) @binding(0) var motion: texture_2d<f32>;          // stored as given: to_prev, to_next [px]
@group(1) @binding(1) var depth: texture_2d<f32>;           // stored as given
@group(1) @binding(2) var bends: texture_storage_2d<r32uint, write>;    // see pack_bend()

@compute @workgroup_size(WG_X, WG_Y)
fn main(@builtin(global_invocation_id) id: vec3u) {
    if any(id.xy >= frame.size) { return; }
    let px = vec2i(id.xy);
    let vectors = textureLoad(motion, px, 0);
    let z = valid_depth(textureLoad(depth, px, 0).x);
    let before = acceleration_in(px, vectors.xy, z, false);
    let after = acceleration_in(px, vectors.zw, z, true);
    textureStore(bends, px, vec4u(pack_bend(trajectory_between(vectors, before, after))));
}
