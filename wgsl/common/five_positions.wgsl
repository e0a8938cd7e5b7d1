// Paths through five positions, from the vectors of three frames: those of a neighbour, where the surface is by then,
// lead on to the frame after it. Where there is no such neighbour its textures are empty: their depth is 0.
//#include common/depth.wgsl
//#include common/frame.wgsl
//#include common/path.wgsl

const RETURNS: f32 = 1.5;               // a surface is found again where its vector leads back within this [px]
const SAME_DEPTH_RATIO: f32 = 1.15;     // and its depth has not changed by more: it may come nearer
const MOST_CHANGE: f32 = 3.0;           // of a half acceleration from one frame to the next, as a ratio
const SPARED_CHANGE: f32 = 2.0;         // and this much more [px]: what changes more is another surface, or noise
const KINK_ACCELERATION: f32 = 1.0;     // from this half acceleration on [px] a path may have a kink,
const KINK_RATIO: f32 = 0.15;           // if those before and after it are smaller by this

struct Acceleration {       // of a surface in a neighbouring frame
    half: vec2f,            // [px per squared frame interval]
    is_known: bool,
}

/// The trajectory with these vectors, through five positions as far as the frames before and after show the surface.
fn trajectory_between(motion: vec4f, before: Acceleration, after: Acceleration) -> Trajectory5 {
    var trajectory = trajectory5_from(trajectory_from(motion));
    let here = trajectory.half_acceleration;
    // The change over two frame intervals; twice that over one, if one is all that is known.
    var change = vec2f(0.0);
    if before.is_known && after.is_known { change = after.half - before.half; }
    if before.is_known && !after.is_known { change = 2.0 * (here - before.half); }
    if after.is_known && !before.is_known { change = 2.0 * (after.half - here); }
    let most = max(select(0.0, length(before.half), before.is_known), select(0.0, length(after.half), after.is_known));
    let stays = all(abs(motion) < vec4f(STATIC_EPSILON));
    let believed = !stays && most <= MOST_CHANGE * length(here) + SPARED_CHANGE;
    trajectory.third = select(vec2f(0.0), change / 6.0, believed);
    // Straight before and after, but not here: it starts, stops or bounces in this very frame.
    trajectory.has_kink = before.is_known && after.is_known && length(here) > KINK_ACCELERATION
        && most < KINK_RATIO * length(here);
    if trajectory.has_kink { trajectory.third = vec2f(0.0); }
    return trajectory;
}

/// Half the acceleration in a neighbouring frame of what is displaced by `step` [px] up to it.
fn acceleration_in(motion_there: texture_2d<f32>, depth_there: texture_2d<f32>, px: vec2i, step: vec2f, z: f32,
                   is_next: bool) -> Acceleration {
    let at = vec2f(px) + 0.5 + step;
    let is_inside = all(at >= vec2f(0.0)) && all(at < vec2f(frame.size));
    let there = vec2i(clamp(at, vec2f(0.0), vec2f(frame.size) - 1.0));
    let vectors = textureLoad(motion_there, there, 0);
    let given = textureLoad(depth_there, there, 0).x;
    let ratio = valid_depth(given) / z;
    let off = select(vectors.zw, vectors.xy, is_next) + step;
    let is_same = given > 0.0 && ratio < SAME_DEPTH_RATIO && ratio > 1.0 / SAME_DEPTH_RATIO
        && dot(off, off) < RETURNS * RETURNS;
    return Acceleration(0.5 * (vectors.xy + vectors.zw), is_inside && is_same);
}

/// The part of a trajectory that three positions do not tell, in a word: its third term, or KINKED.
fn pack_bend(trajectory: Trajectory5) -> u32 {
    let third = clamp(trajectory.third, vec2f(-MOST_THIRD), vec2f(MOST_THIRD));
    return select(pack2x16float(third), KINKED, trajectory.has_kink);
}

const MOST_THIRD: f32 = 65504.0;        // [px], the largest finite f16
const KINKED: u32 = 0xffffffffu;        // no two finite numbers

/// The trajectory with these vectors and this bend.
fn trajectory_with(motion: vec4f, bend: u32) -> Trajectory5 {
    var trajectory = trajectory5_from(trajectory_from(motion));
    trajectory.has_kink = bend == KINKED;
    trajectory.third = unpack2x16float(select(bend, 0u, trajectory.has_kink));
    return trajectory;
}
