// Which way the surface at a pixel faces, as far as the picture's plane shows it.
//#include common/finite.wgsl

struct Facing {
    right: vec4f,           // the camera's x axis in the world
    up: vec4f,              // its y axis
    planar: vec4f,          // depth along the view axis of a depth d: (x + y d) / (z + w d)
}

const SLOPE: f32 = 2e-5;    // share of depth a pixel under which a surface has no slope, only rounding
const SIDEWAYS: f32 = 1e-3; // cosine under which a normal is at a right angle

/// Whether what moves along `way` [px] goes the way its surface faces, by the normal in the world.
fn leads(facing: Facing, normal: vec3f, way: vec2f) -> bool {
    let n = vec2f(dot(facing.right.xyz, normal), -dot(facing.up.xyz, normal));
    return dot(n, way) > SIDEWAYS * length(normal) * length(way);
}

/// The same by depth: a surface faces where its depth grows, whatever the field of view.
fn leads_by_depth(facing: Facing, depth: texture_2d<f32>, px: vec2u, way: vec2f) -> bool {
    let z = planar_depth(facing, depth, vec2i(px));
    if z < 0.0 { return false; }
    let slope = vec2f(slope_along(facing, depth, vec2i(px), vec2i(1, 0), z),
                      slope_along(facing, depth, vec2i(px), vec2i(0, 1), z));
    return dot(slope, way) > SLOPE * z * length(way);
}

/// Of the differences to both sides the smaller one, so that it is the surface's own [per px].
fn slope_along(facing: Facing, depth: texture_2d<f32>, px: vec2i, step: vec2i, z: f32) -> f32 {
    let before = planar_depth(facing, depth, px - step);
    let after = planar_depth(facing, depth, px + step);
    if before < 0.0 && after < 0.0 { return 0.0; }
    if before < 0.0 { return after - z; }
    if after < 0.0 { return z - before; }
    return select(after - z, z - before, abs(z - before) < abs(after - z));
}

/// Along the view axis; -1 where nothing is there or the picture ends.
fn planar_depth(facing: Facing, depth: texture_2d<f32>, px: vec2i) -> f32 {
    if any(px < vec2i(0)) || any(px >= vec2i(textureDimensions(depth))) { return -1.0; }
    let z = textureLoad(depth, px, 0).x;
    let to = facing.planar;
    let there = (to.x + to.y * z) / (to.z + to.w * z);
    return select(-1.0, there, is_finite(there) && there > 0.0);
}
