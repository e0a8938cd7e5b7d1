// One word per pixel with its depth, flagged where it is at an edge, from edges.wgsl for layers.wgsl.
//#include common/depth.wgsl
//#include common/frame.wgsl

@group(1) @binding(1) var motion: texture_2d<f32>;      // stored as given: of one frame: to_prev, to_next [px]
@group(1) @binding(2) var depth: texture_2d<f32>;   // stored as given

const EDGE: u32 = 1u;           // the last two bits of a depth: the pixel may show two surfaces,
const SLOW: u32 = 2u;           // and they hardly move apart while the shutter is open
const EDGE_MOTION: f32 = 0.5;   // difference of the motions of different surfaces [px]

fn depth_at(px: vec2i) -> f32 {
    let at = inside(px);
    return valid_depth(textureLoad(depth, at, 0).x);
}

/// A depth packed with the flags of an edge.
fn flag_depth(z: f32, is_at_edge: bool, is_slow: bool) -> u32 {
    return (bitcast<u32>(z) & ~(EDGE | SLOW)) | select(0u, EDGE, is_at_edge) | select(0u, SLOW, is_at_edge && is_slow);
}

fn is_edge(flags: u32) -> bool {
    return (flags & EDGE) != 0u;
}

/// The depth that is packed with flags.
fn flagged_depth(flags: u32) -> f32 {
    return bitcast<f32>(flags & ~(EDGE | SLOW));
}
