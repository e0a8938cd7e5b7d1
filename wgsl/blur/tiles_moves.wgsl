// What the filter over tiles asks of every pixel, in one texture: its streak's direction and length, its depth.
//#include common/finite.wgsl
//#include common/frame.wgsl
//#include common/shutter.wgsl
//#include blur/tiles_streak.wgsl

@group(1) @binding(0) var motion: texture_2d<f32>;      // to_prev, to_next [px]
@group(1) @binding(1) var depth: texture_2d<f32>;
@group(1) @binding(2) var moves: texture_storage_2d<rgba32float, write>;    // direction, length [px], depth

override DEEP: bool = false;        // read `depth`

const FAR: f32 = 1e10;              // depth of nothing

@compute @workgroup_size(WG_X, WG_Y)
fn main(@builtin(global_invocation_id) id: vec3u) {
    if any(id.xy >= frame.size) { return; }
    let path = trajectory_from(any_motion(textureLoad(motion, id.xy, 0)));
    let times = shutter_times(vec2f(id.xy) + 0.5, 0.0);
    let farthest = streak(path, times.delay);
    var z = 1.0;
    if DEEP {
        z = textureLoad(depth, id.xy, 0).x;
        z = select(FAR, min(z, FAR), is_finite(z) && z > 0.0);
    }
    textureStore(moves, id.xy, vec4f(unit(farthest), length(farthest), z));
}
