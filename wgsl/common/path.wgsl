// The trajectory of a pixel's content through the previous, this and the next frame.

struct Trajectory {             // position(t) = position(0) + velocity t + half_acceleration t^2
    velocity: vec2f,            // [px per frame interval]
    half_acceleration: vec2f,   // [px per squared frame interval]
}

const STATIC_EPSILON: f32 = 0.01;   // what is displaced by less than this [px] does not move

/// The parabola through the three positions; a line where `motion` = (to_prev, to_next) [px] are opposite.
fn trajectory_from(motion: vec4f) -> Trajectory {
    return Trajectory(0.5 * (motion.zw - motion.xy), 0.5 * (motion.zw + motion.xy));
}

/// Displacement [px] at time `t` [frame intervals] of what is here at time 0.
fn displacement(trajectory: Trajectory, t: f32) -> vec2f {
    return (trajectory.velocity + trajectory.half_acceleration * t) * t;
}

/// When between `opens` and `closes` it moves slowest: a trajectory that comes back turns there, so that its
/// farthest displacement is at one of these three times.
fn slowest_time(trajectory: Trajectory, opens: f32, closes: f32) -> f32 {
    let v = trajectory.velocity;
    let a = trajectory.half_acceleration;
    return clamp(-0.5 * dot(v, a) / max(dot(a, a), 1e-30), opens, closes);
}
