// A surface as the search reads it, packed into one texel; and the tiles for which candidate motions are kept.
//#include common/path.wgsl

const TILE: u32 = 16u;          // side [px]
const MOTIONS: u32 = 4u;        // motions kept per tile
const INFINITE: f32 = 3e38;     // over all depths, distances and times: those of nothing at all
const HALF_MAX: f32 = 65504.0;  // largest finite f16

// The candidate motions of a tile: those which may bring something into it while the shutter is open. Per frame they
// are layers of one texture: header, min_depth, t_enter, t_exit, then the trajectories. The header is
// their number, which is smaller where further ones would resemble these or standing still; 1 if an edge may come;
// the greatest displacement [px]; 0.
const CANDIDATE_LAYERS: u32 = 8u;

/// Tiles across and down an image.
fn tiles_of(size: vec2u) -> vec2u {
    return (size + TILE - 1u) / TILE;
}

/// All that the search needs to know of a pixel's front or back layer, as rgba32uint: velocity, half acceleration in
/// half floats, depth. The sign of the depth and its last bit are flags.
/// Front layer: depth is negative if an edge is within a pixel; the last bit says that it is smooth, one surface of
/// one weight in its 3 x 3. Back layer: depth is 0 if there is none; the last bit says that it was seen, not inferred.
fn pack_surface(trajectory: Trajectory, depth: f32, last_bit: bool) -> vec4u {
    let half_acceleration = clamp(trajectory.half_acceleration, vec2f(-HALF_MAX), vec2f(HALF_MAX));
    let bits = (bitcast<u32>(depth) & ~1u) | u32(last_bit);
    return vec4u(bitcast<vec2u>(trajectory.velocity), pack2x16float(half_acceleration), bits);
}

fn unpack_trajectory(surface: vec4u) -> Trajectory {
    return Trajectory(bitcast<vec2f>(surface.xy), unpack2x16float(surface.z));
}

fn unpack_depth(surface: vec4u) -> f32 {
    return bitcast<f32>(surface.w & ~1u);
}

/// Of a front layer.
fn is_smooth(surface: vec4u) -> bool {
    return (surface.w & 1u) == 1u;
}

/// Of a back layer.
fn was_seen(surface: vec4u) -> bool {
    return (surface.w & 1u) == 1u;
}
