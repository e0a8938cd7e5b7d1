// The passes of light of one instant of a scene: the light on its surfaces, and their colour.
//#include scene/rays.wgsl

@group(1) @binding(4) var light: Light;     // sun with its shadow and ambient light; 0 for the sky
@group(1) @binding(5) var albedo: Light;    // its factor

alias Light = texture_storage_2d<rgba32float, write>;

@compute @workgroup_size(WG_X, WG_Y)
fn main(@builtin(global_invocation_id) id: vec3u) {
    let px = vec2u(id.x, view.top + id.y);
    if any(px >= frame.size) { return; }
    let now = Instant(0u, 0.0);
    let camera = pose(0u, now);
    let rays = turns_of(scene.rays * scene.rays, px.x);
    var lit = 0.0;
    var color = vec3f(0.0);
    var i = 0u;
    loop {
        let ray = ray_of(px, i, camera);
        let hit = nearest(ray, now);
        if hit.depth < BACKGROUND_DEPTH {
            let one = lighting(hit, ray, normalize(ray.direction), now);
            lit += one.sun + one.ambient;
            color += one.color;
        }
        i++;
        if i >= rays { break; }
    }
    let share = 1.0 / f32(scene.rays * scene.rays);
    textureStore(light, px, vec4f(vec3f(lit * share), 1.0));
    textureStore(albedo, px, vec4f(color * share, 1.0));
}
