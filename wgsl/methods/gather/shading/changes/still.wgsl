// Tiles in which the light on surfaces that rest may differ from a neighbouring frame. Their texture is where it was, so that
// nothing but light changes their colours. A pixel of light is a square of the image, of which one pixel is compared.
//#include common/depth.wgsl
//#include common/frame.wgsl
//#include methods/gather/shading/active.wgsl
//#include methods/gather/shading/changes/differs.wgsl
//#include methods/gather/shading/light.wgsl

@group(1) @binding(0) var light_here: texture_2d<f32>;      // stored as given; these are of the whole image
@group(1) @binding(1) var light_there: texture_2d<f32>;     // stored as given
@group(1) @binding(2) var depth_here: texture_2d<f32>;      // stored as given
@group(1) @binding(3) var depth_there: texture_2d<f32>;     // stored as given
@group(1) @binding(4) var motion_here: texture_2d<f32>;     // stored as given: to_prev, to_next [px]
@group(1) @binding(5) var motion_there: texture_2d<f32>;    // stored as given
@group(1) @binding(6) var<storage, read_write> found: FoundTiles;

override SCALE: u32 = 2u;       // side of a square [px]

@compute @workgroup_size(WG_X, WG_Y)
fn main(@builtin(global_invocation_id) id: vec3u) {
    if any(id.xy >= frame.size) { return; }
    let px = SCALE * id.xy;
    if !rests(textureLoad(motion_here, px, 0)) { return; }
    let z = valid_depth(textureLoad(depth_here, px, 0).x);
    let z_there = valid_depth(textureLoad(depth_there, px, 0).x);
    let here = valid_light(textureLoad(light_here, px, 0));
    let there = valid_light(textureLoad(light_there, px, 0));
    if !differs(here, there) || !is_as_deep_there(z, z_there) { return; }
    if rests(textureLoad(motion_there, px, 0)) { atomicOr(&found.tiles[light_tile(id.xy)], MAY_CHANGE); }
}
