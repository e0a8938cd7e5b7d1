// The passes of light of one instant of a scene: what falls on its surfaces, and their colour.
//#include common/frame.wgsl
//#include scene/trace.wgsl

@group(1) @binding(3) var<uniform> view: View;
@group(1) @binding(4) var light: Light;     // sun with its shadow and ambient light; 0 for the sky
@group(1) @binding(5) var albedo: Light;    // what it is multiplied by

alias Light = texture_storage_2d<rgba32float, write>;

struct View {
    time: f32,      // of the image, in the time of the rows of poses [frame intervals]
}

@compute @workgroup_size(WG_X, WG_Y)
fn main(@builtin(global_invocation_id) id: vec3u) {
    if any(id.xy >= frame.size) { return; }
    let now = instant(view.time);
    var lit = 0.0;
    var color = vec3f(0.0);
    let rays = turns_of(scene.rays * scene.rays, id.x);
    for (var i = 0u; i < rays; i++) {
        let within = (vec2f(vec2u(i % scene.rays, i / scene.rays)) + 0.5) / f32(scene.rays);
        let ray = camera_ray(vec2f(id.xy) + within, now);
        let hit = nearest(ray, now);
        if hit.depth < BACKGROUND_DEPTH {
            let one = lighting(hit, ray, normalize(ray.direction), now);
            lit += one.sun + one.ambient;
            color += one.color;
        }
    }
    let share = 1.0 / f32(scene.rays * scene.rays);
    textureStore(light, id.xy, vec4f(vec3f(lit * share), 1.0));
    textureStore(albedo, id.xy, vec4f(color * share, 1.0));
}
