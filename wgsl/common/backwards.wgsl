// Where the content that a pixel shows at a time comes from, in the frame itself; reads the binding `motion`.
//#include common/frame.wgsl
//#include common/trajectory5.wgsl

const ASIDE: f32 = 0.25;        // frame intervals along its own path, to either side, at which the velocity around a pixel is read

/// Displacement from a pixel to what it shows at time `t`, as a trajectory. What is at y moves to x = y + v(y) t + a(y) t^2, so that
/// y = x - v t + (J v - a) t^2 to second order, where J v is the change of the velocity along itself: none in a translation, twice
/// the half acceleration a in a turn. At an edge of the motion it is a step, and counts up to the velocity itself.
fn backwards(trajectory: Trajectory, x: vec2f) -> Trajectory {
    let v = trajectory.velocity;
    let change = (velocity_at(x + ASIDE * v) - velocity_at(x - ASIDE * v)) / (2.0 * ASIDE);
    let most = min(1.0, length(v) / max(length(change), 1e-6));
    return Trajectory(-v, most * change - trajectory.half_acceleration);
}

/// The same through five positions. A path with a kink has straight pieces.
fn backwards5(trajectory: Trajectory5, x: vec2f) -> Trajectory5 {
    let parabola = backwards(Trajectory(trajectory.velocity, trajectory.half_acceleration), x);
    let half = select(parabola.half_acceleration, -trajectory.half_acceleration, trajectory.has_kink);
    return Trajectory5(parabola.velocity, half, -trajectory.third, trajectory.has_kink);
}

fn velocity_at(x: vec2f) -> vec2f {
    let last = vec2f(frame.size) - 1.0;
    return trajectory_from(textureLoad(motion, vec2i(clamp(floor(x), vec2f(0.0), last)), 0)).velocity;
}
