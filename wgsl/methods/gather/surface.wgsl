// A surface as the search reads it, packed into one texel; and the tiles for which candidate motions are kept.
//#include common/path.wgsl

const TILE: u32 = 16u;          // side [px]
const MOTIONS: u32 = 4u;        // motions kept per tile
const INFINITE: f32 = 3e38;     // over all depths, distances and times: those of nothing at all
const HALF_MAX: f32 = 65504.0;  // largest finite f16

// The candidate motions of a tile: those which may bring something into it while the shutter is open. Per frame they
// are layers of one texture of bits: header, min_depth; in half floats, as searches only start from them, the times at
// which they enter and leave the tile, velocities, half accelerations. The header is their number, which is smaller where
// further ones would resemble these or standing still; 1 if an edge may come; the greatest displacement [px]; in the
// frame itself, 1 if the tile is crowded, as motions come that are unlike all of these (see scatter.wgsl).
const CANDIDATE_LAYERS: u32 = 5u;
const TIME_SLACK: f32 = 0.002;  // for rounding: they enter so much earlier and leave so much later [frame intervals]

/// Tiles across and down an image.
fn tiles_of(size: vec2u) -> vec2u {
    return (size + TILE - 1u) / TILE;
}

/// All that the search needs to know of a pixel's front or back layer, as rgba32uint: velocity, half acceleration in
/// half floats, depth. The last THIRD_BITS bits of both velocities are the trajectory's third term; they are known to
/// 1/16,000 of themselves. The sign of the depth and its last four bits are flags.
/// Front layer: depth is negative if an edge is within a pixel. A pixel of one layer is the same in both.
fn pack_surface(trajectory: Trajectory5, depth: f32, own_flags: u32) -> vec4u {
    let third = vec2i(round(clamp(trajectory.third / THIRD_STEP, vec2f(-THIRD_MAX), vec2f(THIRD_MAX))));
    let flags = own_flags | select(0u, KINK, trajectory.has_kink);
    let mask = (1u << THIRD_BITS) - 1u;
    let velocity = (bitcast<vec2u>(trajectory.velocity) + (1u << (THIRD_BITS - 1u))) & vec2u(~mask);
    return vec4u(velocity | (bitcast<vec2u>(third) & vec2u(mask)), pack_halves(trajectory.half_acceleration),
                 (bitcast<u32>(depth) & ~FLAGS) | flags);
}

/// Two half floats, as near as finite ones get.
fn pack_halves(v: vec2f) -> u32 {
    return pack2x16float(clamp(v, vec2f(-HALF_MAX), vec2f(HALF_MAX)));
}

const SMOOTH: u32 = 1u;         // of a front layer: one surface of one weight in its 3 x 3
const EDGELESS: u32 = 4u;       // of a front layer: SMOOTH, without an edge that is not seen while the shutter is open
const BY_COLOR: u32 = 4u;       // of a front layer that is separated: colours alone may have told its coverage
const SEEN: u32 = 1u;           // of a back layer: it was seen, not inferred
const KINK: u32 = 2u;           // of the trajectory
const AROUND: u32 = 4u;         // of a back layer: its colour is that of neighbouring frames
const SINGLE: u32 = 8u;         // nothing is behind: a back layer is empty here
const FLAGS: u32 = 15u;
const THIRD_BITS: u32 = 10u;
const THIRD_STEP: f32 = 0.03125;        // [px]: up to 0.39 of it are seen within a frame interval
const THIRD_UNIT: f32 = 7.450580596923828e-9;   // THIRD_STEP / 2^(32 - THIRD_BITS)
const THIRD_MAX: f32 = 511.0;

fn unpack_trajectory(surface: vec4u) -> Trajectory5 {
    let unused = 32u - THIRD_BITS;
    let third = vec2f(bitcast<vec2i>(surface.xy << vec2u(unused)) >> vec2u(unused)) * THIRD_STEP;
    let velocity = bitcast<vec2f>(surface.xy & vec2u(~((1u << THIRD_BITS) - 1u)));
    return Trajectory5(velocity, unpack2x16float(surface.z), third, (surface.w & KINK) != 0u);
}

/// displacement5() of the trajectory of a surface, in fewer operations one after the other: the search waits for it.
fn displacement_of(surface: vec4u, t: f32) -> vec2f {
    let unused = 32u - THIRD_BITS;
    let velocity = bitcast<vec2f>(surface.xy & vec2u(~((1u << THIRD_BITS) - 1u)));
    let bend = select(t * t, abs(t), (surface.w & KINK) != 0u);
    let third = vec2f(bitcast<vec2i>(surface.xy << vec2u(unused)));
    return velocity * t + third * (THIRD_UNIT * (t * t - 1.0) * t) + unpack2x16float(surface.z) * bend;
}

fn unpack_depth(surface: vec4u) -> f32 {
    return depth_in(surface.w);
}

/// The depth in a surface's last word.
fn depth_in(word: u32) -> f32 {
    return bitcast<f32>(word & ~FLAGS);
}

/// Of a front layer.
fn is_smooth(surface: vec4u) -> bool {
    return (surface.w & SMOOTH) != 0u;
}

/// The depth in the last word of a back layer's surface, 0 where it is empty.
fn back_depth_in(word: u32) -> f32 {
    return select(depth_in(word), 0.0, (word & SINGLE) != 0u);
}

struct Matte {          // how much of a pixel its front layer covers
    depth: f32,         // of the front layer, known to 1/16,000 of itself
    has_back: bool,     // a back layer is there
    coverage: f32,      // of the front layer, in steps of 1 / WHOLE
    weight: f32,        // times the coverage
}

const WHOLE: u32 = 511u;        // a coverage of 1
const HAS_BACK: u32 = 512u;
const MATTE_BITS: u32 = 10u;    // the last bits, which are not of the depth

fn pack_matte(matte: Matte) -> vec4u {
    let depth = (bitcast<u32>(matte.depth) << 1u) & ~((1u << MATTE_BITS) - 1u);    // without its sign
    let coverage = u32(round(matte.coverage * f32(WHOLE)));
    return vec4u(depth | coverage | select(0u, HAS_BACK, matte.has_back), bitcast<u32>(matte.weight), 0u, 0u);
}

/// `bits`: the result of pack_matte(); without the weight, that of pixels that all count alike.
fn unpack_matte(bits: vec4u, is_weighted: bool) -> Matte {
    let coverage = f32(bits.x & WHOLE) / f32(WHOLE);
    let depth = bitcast<f32>((bits.x >> MATTE_BITS) << (MATTE_BITS - 1u));
    return Matte(depth, (bits.x & HAS_BACK) != 0u, coverage, select(coverage, bitcast<f32>(bits.y), is_weighted));
}
