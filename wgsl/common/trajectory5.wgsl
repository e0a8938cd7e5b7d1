// Paths through five positions, from the vectors of three frames: those of a neighbour, where the surface is by then,
// lead on to the frame after it.
//#include common/path.wgsl

const MOST_CHANGE: f32 = 3.0;           // of a half acceleration from one frame to the next, as a ratio
const SPARED_CHANGE: f32 = 2.0;         // and this much more [px]: a larger change is another surface, or noise
const KINK_ACCELERATION: f32 = 1.0;     // from this half acceleration on [px] a path may have a kink,
const KINK_RATIO: f32 = 0.15;           // if those before and after it are smaller by this
const LEAST_TURNED: f32 = 1.0;          // half acceleration [px] from which on turns are told
const LEAST_COSINE: f32 = -0.5;         // of the angle per frame: beyond 120 degrees it may be another one
const LEAST_SWING: f32 = -0.7;          // the same of a swing along one axis; it counts as one of 120 degrees
const SAME_LENGTH: f32 = 0.2;           // of accelerations on a circle: relative difference of their squares
const OFF_TURN: f32 = 0.2;              // share of the acceleration by which a turn may miss

struct Acceleration {       // of a surface in a neighbouring frame
    half: vec2f,            // [px per squared frame interval]
    is_known: bool,
    depth_ratio: f32,       // of the depth there to that here, 1 if it is not known
}

/// The trajectory with these vectors, through five positions as far as the frames before and after show the surface.
fn trajectory_between(motion: vec4f, before: Acceleration, after: Acceleration) -> Trajectory5 {
    var trajectory = trajectory5_from(trajectory_from(motion));
    let here = trajectory.half_acceleration;
    let both = before.is_known && after.is_known;
    var earlier = before.half;
    var later = after.half;
    if !before.is_known { earlier = continued(here, later); }
    if !after.is_known { later = continued(here, earlier); }
    let most = max(select(0.0, length(before.half), before.is_known), select(0.0, length(after.half), after.is_known));
    let limit = MOST_CHANGE * length(here) + SPARED_CHANGE;
    let stays = all(abs(motion) < vec4f(STATIC_EPSILON));
    // Straight before and after, but not here: it starts, stops or bounces in this very frame.
    trajectory.has_kink = both && length(here) > KINK_ACCELERATION && most < KINK_RATIO * length(here);
    if (before.is_known || after.is_known) && !stays && most <= limit && !trajectory.has_kink {
        let factor = min(turn_factors(here, 0.5 * (earlier + later)), vec2f(limit / max(most, 1e-6)));
        trajectory.third = factor * (later - earlier) / 6.0;
    }
    return trajectory;
}

/// Half the acceleration in the neighbouring frame that does not show the surface, from those here and in the other
/// one: turned back by the same angle if its length stays, as on a circle; else changed as much the other way.
fn continued(here: vec2f, there: vec2f) -> vec2f {
    let length2 = dot(here, here);
    let cosine = dot(there, here) / max(length2, 1e-12);
    let turns = length2 > LEAST_TURNED * LEAST_TURNED && cosine > LEAST_COSINE && cosine < 1.0
        && abs(dot(there, there) / length2 - 1.0) < SAME_LENGTH;
    return 2.0 * select(1.0, cosine, turns) * here - there;
}

/// Factors of the third term, across and down. The mean of the neighbouring accelerations is cos w times their own if a body turns
/// about a point or swings, by an angle w per frame; one across and another one down if it swings both ways, as a hand-held camera.
fn turn_factors(here: vec2f, mean: vec2f) -> vec2f {
    let length2 = dot(here, here);
    let cosine = dot(mean, here) / max(length2, 1e-12);
    let off = mean - cosine * here;
    let turns = length2 > LEAST_TURNED * LEAST_TURNED && cosine > LEAST_COSINE
        && dot(off, off) < OFF_TURN * OFF_TURN * length2;
    return select(vec2f(swing_factor(here.x, mean.x), swing_factor(here.y, mean.y)), vec2f(turn_factor(cosine)), turns);
}

/// The same along one axis.
fn swing_factor(here: f32, mean: f32) -> f32 {
    let cosine = here * mean / max(here * here, 1e-12);
    return select(1.0, turn_factor(cosine), abs(here) > LEAST_TURNED && cosine > LEAST_SWING);
}

/// That of an angle of this cosine. It makes the path exact in the middle between the frames.
fn turn_factor(cosine: f32) -> f32 {
    let half_angle = sqrt(0.5 + 0.5 * clamp(cosine, LEAST_COSINE, 1.0));    // its cosine
    return 2.0 / (half_angle * (1.0 + half_angle));
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
