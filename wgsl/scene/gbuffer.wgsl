// The G-buffer of one instant of a scene: colour, depth, normal and object index.
//#include scene/rays.wgsl

@group(1) @binding(4) var color: Color;                                     // linear
@group(1) @binding(5) var depth: texture_storage_2d<r32float, write>;       // along the view axis
@group(1) @binding(6) var normal: texture_storage_2d<rgba32float, write>;   // in the world
@group(1) @binding(7) var object: texture_storage_2d<r32uint, write>;

alias Color = texture_storage_2d<rgba32float, write>;

override CENTRED: bool = true;  // one of the rays is through the pixel's centre: their number a side is odd

@compute @workgroup_size(WG_X, WG_Y)
fn main(@builtin(global_invocation_id) id: vec3u) {
    let px = vec2u(id.x, view.top + id.y);
    if any(px >= frame.size) { return; }
    let now = Instant(0u, 0.0);
    let camera = pose(0u, now);
    let rays = turns_of(scene.rays * scene.rays, px.x);
    // Depth, normal and index are of one ray through the centre, as they cannot be averaged.
    let centre = camera_ray(vec2f(px) + 0.5, camera);
    var seen = Hit(BACKGROUND_DEPTH, 0u, Pose());
    if !CENTRED { seen = nearest(centre, now); }
    var sum = vec3f(0.0);
    var i = 0u;
    loop {
        let ray = ray_of(px, i, camera);
        let hit = nearest(ray, now);
        sum += radiance(hit, ray, now);
        if CENTRED && i == rays / 2u { seen = hit; }
        i++;
        if i >= rays { break; }
    }
    textureStore(color, px, vec4f(sum / f32(scene.rays * scene.rays), 1.0));
    let there = seen.depth < BACKGROUND_DEPTH;
    textureStore(depth, px, vec4f(seen.depth));
    textureStore(normal, px, vec4f(select(vec3f(0.0), world_normal(seen, centre, now), there), 0.0));
    textureStore(object, px, vec4u(select(0u, bodies[seen.body].object, there)));
}
