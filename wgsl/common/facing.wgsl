// Facing of surfaces: leading ones face the way they move, as far as the image plane shows it.
//#include common/finite.wgsl

struct Facing {
    right: vec4f,           // the camera's x axis in the world
    up: vec4f,              // its y axis
    planar: vec4f,          // depth along the view axis of a depth d: (x + y d) / (z + w d)
}

const MIN_SLOPE: f32 = 2e-5;    // share of depth per pixel under which a slope is taken for rounding
const MIN_COSINE: f32 = 1e-3;   // under which a normal counts as being at a right angle to the motion

/// True if a surface that moves by `motion` [px] faces that way, by its normal in the world.
fn normal_faces_motion(facing: Facing, normal: vec3f, motion: vec2f) -> bool {
    let n = vec2f(dot(facing.right.xyz, normal), -dot(facing.up.xyz, normal));
    return dot(n, motion) > MIN_COSINE * length(normal) * length(motion);
}

/// The same by depth: whatever the field of view, a surface faces the way its depth grows.
fn slope_faces_motion(facing: Facing, depth: texture_2d<f32>, px: vec2u, motion: vec2f) -> bool {
    let z = planar_depth(facing, depth, vec2i(px));
    if z < 0.0 { return false; }
    let slope = vec2f(slope_along(facing, depth, vec2i(px), vec2i(1, 0), z),
                      slope_along(facing, depth, vec2i(px), vec2i(0, 1), z));
    return dot(slope, motion) > MIN_SLOPE * z * length(motion);
}

/// Change of depth per pixel. Of the differences to both sides the smaller one, which stays on the surface.
fn slope_along(facing: Facing, depth: texture_2d<f32>, px: vec2i, step: vec2i, z: f32) -> f32 {
    let before = planar_depth(facing, depth, px - step);
    let after = planar_depth(facing, depth, px + step);
    if before < 0.0 && after < 0.0 { return 0.0; }
    if before < 0.0 { return after - z; }
    if after < 0.0 { return z - before; }
    return select(after - z, z - before, abs(z - before) < abs(after - z));
}

/// Depth along the view axis; -1 where there is none, or outside the image.
fn planar_depth(facing: Facing, depth: texture_2d<f32>, px: vec2i) -> f32 {
    if any(px < vec2i(0)) || any(px >= vec2i(textureDimensions(depth))) { return -1.0; }
    let z = textureLoad(depth, px, 0).x;
    let to = facing.planar;
    let planar = (to.x + to.y * z) / (to.z + to.w * z);
    return select(-1.0, planar, is_finite(planar) && planar > 0.0);
}
