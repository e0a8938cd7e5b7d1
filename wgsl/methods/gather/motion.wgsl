// Distances between motions, and how far they lead while a frame is exposed. A trajectory is kept in a texel as
// a vec4f: velocity, half acceleration; for where a search starts, the parabola is enough.
//#include common/path.wgsl
//#include common/shutter.wgsl

const MAX_MOTION: f32 = 1e5;    // motion beyond this [px] is taken for an error
const MAX_TILE_RADIUS: i32 = 16;    // tiles over which a motion is followed, to every side
const KINK_AS_PARABOLA: f32 = 1.25; // t^2 times this misses |t| by a quarter at most, for |t| up to 1
const LEAST_TIME: f32 = 0.01;       // [frame intervals]

/// The parabola that is near a trajectory until the time `u`, before and after; of a kink, which the frame itself alone may
/// have, while that is exposed. In place of t^3, the line that misses it least (Chebyshev) stands in a frame exposed about
/// its instant, and t elsewhere, which is right at the instants of the frames before and after.
fn as_vec4(trajectory: Trajectory5, u: f32) -> vec4f {
    let as_line = min(0.75 * u * u, 1.0);
    let closer = select(1.0, KINK_AS_PARABOLA / max(max_abs_time(0.0), LEAST_TIME), trajectory.has_kink);
    return vec4f(trajectory.velocity + (as_line - 1.0) * trajectory.third, closer * trajectory.half_acceleration);
}

/// Displacement by the time `u` [px].
fn displacement4(trajectory: vec4f, u: f32) -> vec2f {
    return (trajectory.xy + trajectory.zw * u) * u;
}

/// The longest time from the instant of the frame `offset` intervals away, before or after, at which it is exposed.
fn max_abs_time(offset: f32) -> f32 {
    let window = abs(exposure_window(offset));
    return max(window.x, window.y);
}

/// Greatest squared distance [px^2] between two trajectories at the times `u` and -u.
fn trajectory_distance2(a: vec4f, b: vec4f, u: f32) -> f32 {
    let d = (a - b) * vec4f(u, u, u * u, u * u);
    return dot(d, d) + 2.0 * abs(dot(d.xy, d.zw));
}
