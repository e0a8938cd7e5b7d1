// A frame in which a pixel stands for a square of the image: the mean colour of its pixels, depth and motion of the nearest one.
//#include common/depth.wgsl
//#include common/frame.wgsl
//#include methods/gather/shading/light.wgsl
//#include methods/gather/shading/listed.wgsl

@group(1) @binding(0) var light: texture_2d<f32>;       // stored as given; these are of the whole image
@group(1) @binding(1) var depth: texture_2d<f32>;       // stored as given
@group(1) @binding(2) var motion: texture_2d<f32>;      // stored as given: to_prev, to_next [px]
@group(1) @binding(3) var less_light: texture_storage_2d<rgba16float, write>;
@group(1) @binding(4) var less_depth: texture_storage_2d<r32float, write>;
@group(1) @binding(5) var less_motion: texture_storage_2d<rgba32float, write>;   // [px of light]

override SCALE: u32 = 2u;       // side of a square [px]

@compute @workgroup_size(WG_X, WG_Y)
fn main(@builtin(local_invocation_index) local: u32, @builtin(workgroup_id) group: vec3u) {
    let id = listed_pixel(group, local);
    if any(id >= frame.size) { return; }
    let last = textureDimensions(light) - 1u;
    var sum = vec3f(0.0);
    var nearest = 2.0 * NO_DEPTH;
    var of_nearest = vec2u(0u);
    for (var k = 0u; k < SCALE * SCALE; k++) {
        let px = min(SCALE * id + vec2u(k % SCALE, k / SCALE), last);
        let z = valid_depth(textureLoad(depth, px, 0).x);
        sum += valid_light(textureLoad(light, px, 0));
        of_nearest = select(of_nearest, px, z < nearest);
        nearest = min(nearest, z);
    }
    textureStore(less_light, id, vec4f(sum / f32(SCALE * SCALE), 1.0));
    textureStore(less_depth, id, vec4f(nearest));
    textureStore(less_motion, id, textureLoad(motion, of_nearest, 0) / f32(SCALE));
}
