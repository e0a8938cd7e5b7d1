// The trajectory of a pixel's content through the previous, this and the next frame.

struct Trajectory {             // position(t) = position(0) + velocity t + half_acceleration t^2
    velocity: vec2f,            // [px per frame interval]
    half_acceleration: vec2f,   // [px per squared frame interval]
}

const STATIC_EPSILON: f32 = 0.01;   // displacements below this [px] count as none

/// The parabola through the three positions; a line where `motion` = (to_prev, to_next) [px] are opposite.
fn trajectory_from(motion: vec4f) -> Trajectory {
    return Trajectory(0.5 * (motion.zw - motion.xy), 0.5 * (motion.zw + motion.xy));
}

/// Displacement [px] at time `t` [frame intervals] of what is here at time 0.
fn displacement(trajectory: Trajectory, t: f32) -> vec2f {
    return (trajectory.velocity + trajectory.half_acceleration * t) * t;
}

/// The time between `opens` and `closes` at which it moves slowest: a trajectory that comes back turns there, so that its
/// farthest displacement is at one of these three times.
fn slowest_time(trajectory: Trajectory, opens: f32, closes: f32) -> f32 {
    let v = trajectory.velocity;
    let a = trajectory.half_acceleration;
    return clamp(-0.5 * dot(v, a) / max(dot(a, a), 1e-30), opens, closes);
}

// The same through the five positions from the second frame before to the second one after: position(t) =
// position(0) + velocity t + half_acceleration t^2 + third (t^3 - t), which is the parabola where the third term is 0.
struct Trajectory5 {
    velocity: vec2f,            // mean of that before and after the frame [px per frame interval]
    half_acceleration: vec2f,   // [px per squared frame interval]
    third: vec2f,               // a sixth of the change of acceleration [px per cubed frame interval]
    has_kink: bool,             // two straight pieces: |t| instead of t^2
}

/// Largest deviation of any trajectory from its parabola within a frame interval of its instant, as a share of its half
/// acceleration: a kink by 1/4, a cubic by 0.064 of a change that MOST_CHANGE limits.
const MOST_BEND: f32 = 0.4;

fn trajectory5_from(parabola: Trajectory) -> Trajectory5 {
    return Trajectory5(parabola.velocity, parabola.half_acceleration, vec2f(0.0), false);
}

/// Displacement [px] at time `t` [frame intervals] of what is here at time 0.
fn displacement5(trajectory: Trajectory5, t: f32) -> vec2f {
    let bend = select(t, sign(t), trajectory.has_kink);
    return (trajectory.velocity + trajectory.half_acceleration * bend + trajectory.third * (t * t - 1.0)) * t;
}
