// A surface as the search reads it, packed into one texel; and the tiles for which candidate motions are kept.
//#include common/path.wgsl

const TILE: u32 = 16u;          // side [px]
const MOTIONS: u32 = 4u;        // motions kept per tile
const INFINITE: f32 = 3e38;     // over all depths, distances and times: those of nothing at all
const HALF_MAX: f32 = 65504.0;  // largest finite f16

// The candidate motions of a tile: those which may bring something into it while the shutter is open. Per frame they
// are layers of one texture of bits: header, min_depth; in half floats, as searches only start from them, the times at
// which they enter and leave the tile, velocities, half accelerations. The header is their number, which is smaller where
// further ones would resemble these or standing still; 1 if an edge may come; the greatest displacement [px]; 0.
const CANDIDATE_LAYERS: u32 = 5u;
const TIME_SLACK: f32 = 0.002;  // for rounding: they enter so much earlier and leave so much later [frame intervals]

/// Tiles across and down an image.
fn tiles_of(size: vec2u) -> vec2u {
    return (size + TILE - 1u) / TILE;
}

/// All that the search needs to know of a pixel's front or back layer, as rgba32uint: velocity, half acceleration in
/// half floats, depth. The last THIRD_BITS bits of both velocities are the trajectory's third term; they are known to
/// 1/16,000 of themselves. The sign of the depth and its last three bits are flags.
/// Front layer: depth is negative if an edge is within a pixel; LAST_BIT says that it is smooth, one surface of
/// one weight in its 3 x 3. Back layer: depth is 0 if there is none; LAST_BIT says that it was seen, not inferred.
/// KINK is of the trajectory.
fn pack_surface(trajectory: Trajectory5, depth: f32, last_bit: bool) -> vec4u {
    let third = vec2i(round(clamp(trajectory.third / THIRD_STEP, vec2f(-THIRD_MAX), vec2f(THIRD_MAX))));
    let flags = select(0u, LAST_BIT, last_bit) | select(0u, KINK, trajectory.has_kink);
    let mask = (1u << THIRD_BITS) - 1u;
    let velocity = (bitcast<vec2u>(trajectory.velocity) + (1u << (THIRD_BITS - 1u))) & vec2u(~mask);
    return vec4u(velocity | (bitcast<vec2u>(third) & vec2u(mask)), pack_halves(trajectory.half_acceleration),
                 (bitcast<u32>(depth) & ~FLAGS) | flags);
}

/// Two half floats, as near as finite ones get.
fn pack_halves(v: vec2f) -> u32 {
    return pack2x16float(clamp(v, vec2f(-HALF_MAX), vec2f(HALF_MAX)));
}

const LAST_BIT: u32 = 1u;
const KINK: u32 = 2u;
const AROUND: u32 = 4u;         // of a back layer, set by the separation: its colour is that of neighbouring frames
const FLAGS: u32 = 7u;
const THIRD_BITS: u32 = 10u;
const THIRD_STEP: f32 = 0.03125;        // [px]: up to 0.39 of it are seen within a frame interval
const THIRD_MAX: f32 = 511.0;

fn unpack_trajectory(surface: vec4u) -> Trajectory5 {
    let unused = 32u - THIRD_BITS;
    let third = vec2f(bitcast<vec2i>(surface.xy << vec2u(unused)) >> vec2u(unused)) * THIRD_STEP;
    let velocity = bitcast<vec2f>(surface.xy & vec2u(~((1u << THIRD_BITS) - 1u)));
    return Trajectory5(velocity, unpack2x16float(surface.z), third, (surface.w & KINK) != 0u);
}

fn unpack_depth(surface: vec4u) -> f32 {
    return bitcast<f32>(surface.w & ~FLAGS);
}

/// Of a front layer.
fn is_smooth(surface: vec4u) -> bool {
    return (surface.w & LAST_BIT) != 0u;
}

/// Of a back layer.
fn was_seen(surface: vec4u) -> bool {
    return (surface.w & LAST_BIT) != 0u;
}
