// Pixels that show one surface alone: only there light can be separated from the surface.
//#include common/depth.wgsl
//#include common/frame.wgsl
//#include methods/gather/shading/light.wgsl
//#include methods/gather/shading/listed.wgsl

@group(1) @binding(0) var depth: texture_2d<f32>;       // stored as given
@group(1) @binding(1) var motion: texture_2d<f32>;      // stored as given: to_prev, to_next [px]
@group(1) @binding(2) var plain: Plain;                 // 1, or 0 at an edge

alias Plain = texture_storage_2d<r32uint, write>;

const APART: f32 = 1.0;         // difference of motions from which on depths that hardly differ are an edge [px]
const TOUCHING: f32 = 1.01;     // ratio of such depths

@compute @workgroup_size(WG_X, WG_Y)
fn main(@builtin(local_invocation_index) local: u32, @builtin(workgroup_id) group: vec3u) {
    let id = listed_pixel(group, local);
    if any(id >= frame.size) { return; }
    textureStore(plain, id, vec4u(u32(is_plain(id))));
}

fn is_plain(id: vec2u) -> bool {
    let own = textureLoad(motion, id, 0);
    var nearest = NO_DEPTH;
    var farthest = 0.0;
    var apart2 = 0.0;
    for (var k = 0; k < 9; k++) {
        let px = inside(vec2i(id) + vec2i(k % 3, k / 3) - 1);
        let z = valid_depth(textureLoad(depth, px, 0).x);
        let difference = textureLoad(motion, px, 0) - own;
        nearest = min(nearest, z);
        farthest = max(farthest, z);
        apart2 = max(apart2, dot(difference, difference));
    }
    let parted = farthest > nearest * (SURFACE_DEPTH_RATIO * SURFACE_DEPTH_RATIO);
    let touching = farthest > nearest * TOUCHING && apart2 > APART * APART;
    return !(parted || touching);
}
