// Inputs of the filter over tiles, in one texture: direction and length of its blur, and its depth.
//#include common/depth.wgsl
//#include common/frame.wgsl
//#include common/shutter.wgsl
//#include methods/tiles_extent.wgsl

@group(1) @binding(0) var motion: texture_2d<f32>;      // to_prev, to_next [px]
@group(1) @binding(1) var depth: texture_2d<f32>;
@group(1) @binding(2) var velocity_depth: texture_storage_2d<rgba32float, write>;   // direction, extent [px], depth

override HAS_DEPTH: bool = false;   // read `depth`; else everything is equally near

@compute @workgroup_size(WG_X, WG_Y)
fn main(@builtin(global_invocation_id) id: vec3u) {
    if any(id.xy >= frame.size) { return; }
    let trajectory = trajectory_from(finite_motion(textureLoad(motion, id.xy, 0)));
    let times = shutter_times(vec2f(id.xy) + 0.5, 0.0);
    let extent = blur_extent(trajectory, times.delay);
    var z = 1.0;
    if HAS_DEPTH { z = valid_depth(textureLoad(depth, id.xy, 0).x); }
    textureStore(velocity_depth, id.xy, vec4f(unit(extent), length(extent), z));
}
