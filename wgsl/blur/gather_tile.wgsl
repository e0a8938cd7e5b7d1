// What a tile of a frame may show over the exposure: the few motions that stand for all in it.
//#include common/path.wgsl

const TILE: u32 = 16u;          // side [px]
const PATHS: u32 = 4u;          // motions kept a tile
const LAYERS: u32 = 8u;         // of the texture that holds them: about, depths, from when, till when, then the paths

const NONE: f32 = 3e38;         // depth of nothing
const STILL: f32 = 0.01;        // what is displaced by less than this [px] needs no search
const HALF_MAX: f32 = 65504.0;  // largest finite f16

// `about`: how many paths there are, fewer where the rest is like these or like standing still; 1 if
// there are silhouettes; the longest displacement [px].

fn tiles_of(size: vec2u) -> vec2u {
    return (size + TILE - 1u) / TILE;
}

/// A place of a surface: all that the search needs in one texel, rgba32uint. Velocity, half_acceleration in
/// half floats, depth; a depth under 0 is that of a pixel at a silhouette; in a far layer, 0 says that
/// there is none. The last bit of the depth says whether the pixel is calm.
fn packed(path: Trajectory, depth: f32, calm: bool) -> vec4u {
    let half_acceleration = clamp(path.half_acceleration, vec2f(-HALF_MAX), vec2f(HALF_MAX));
    let bits = (bitcast<u32>(depth) & ~1u) | u32(calm);
    return vec4u(bitcast<vec2u>(path.velocity), pack2x16float(half_acceleration), bits);
}

fn path_in(texel: vec4u) -> Trajectory {
    return Trajectory(bitcast<vec2f>(texel.xy), unpack2x16float(texel.z));
}

fn depth_in(texel: vec4u) -> f32 {
    return bitcast<f32>(texel.w & ~1u);
}

fn is_calm(texel: vec4u) -> bool {
    return (texel.w & 1u) == 1u;
}
