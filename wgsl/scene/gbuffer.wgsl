// The G-buffer of one instant of a scene: colour, depth, normal and object index.
//#include common/frame.wgsl
//#include scene/trace.wgsl

@group(1) @binding(3) var<uniform> view: View;
@group(1) @binding(4) var color: Color;                                     // linear
@group(1) @binding(5) var depth: texture_storage_2d<r32float, write>;       // along the view axis
@group(1) @binding(6) var normal: texture_storage_2d<rgba32float, write>;   // in the world
@group(1) @binding(7) var object: texture_storage_2d<r32uint, write>;

alias Color = texture_storage_2d<rgba32float, write>;

struct View {
    time: f32,      // of the image, in the time of the rows of poses [frame intervals]
}

@compute @workgroup_size(WG_X, WG_Y)
fn main(@builtin(global_invocation_id) id: vec3u) {
    if any(id.xy >= frame.size) { return; }
    let now = instant(view.time);
    let middle = vec2f(id.xy) + 0.5;
    var ray = camera_ray(middle, now);
    var hit = Hit(BACKGROUND_DEPTH, 0u, Pose());
    var sum = vec3f(0.0);
    let rays = turns_of(scene.rays * scene.rays, id.x);
    for (var i = 0u; i < rays; i++) {
        let within = (vec2f(vec2u(i % scene.rays, i / scene.rays)) + 0.5) / f32(scene.rays);
        ray = camera_ray(vec2f(id.xy) + within, now);
        hit = nearest(ray, now);
        sum += radiance(hit, ray, now);
    }
    textureStore(color, id.xy, vec4f(sum / f32(scene.rays * scene.rays), 1.0));

    // Depth, normal and index are of one ray through the centre, as they cannot be averaged. If there was one ray
    // only, it was that one.
    let more = turns_of(select(1u, 0u, scene.rays == 1u), id.x);
    for (var i = 0u; i < more; i++) {
        ray = camera_ray(middle, now);
        hit = nearest(ray, now);
    }
    let there = hit.depth < BACKGROUND_DEPTH;
    textureStore(depth, id.xy, vec4f(hit.depth));
    textureStore(normal, id.xy, vec4f(select(vec3f(0.0), world_normal(hit, ray, now), there), 0.0));
    textureStore(object, id.xy, vec4u(select(0u, bodies[hit.body].object, there)));
}
