// The rays of a scene's image, which is drawn a few rows at a time.
//#include common/frame.wgsl
//#include scene/trace.wgsl

@group(1) @binding(3) var<uniform> view: View;

struct View {
    top: u32,       // first row of the image that is drawn, the dispatch has as many as are drawn [px]
}

/// Ray `i` of the scene.rays x scene.rays through a pixel.
fn ray_of(px: vec2u, i: u32, camera: Pose) -> Ray {
    let within = (vec2f(vec2u(i % scene.rays, i / scene.rays)) + 0.5) / f32(scene.rays);
    return camera_ray(vec2f(px) + within, camera);
}
