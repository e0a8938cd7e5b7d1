// Where the content that a pixel shows at a time comes from, in the frame itself, by its motion (to_prev, to_next) [px].
//#include common/frame.wgsl
//#include common/trajectory5.wgsl

const ASIDE: f32 = 0.25;        // frame intervals along its own path, to either side, at which the velocity around a pixel is read

/// Displacement from a pixel to the point it shows at time `t`, as a trajectory. A point at y moves to x = y + v(y) t + a(y) t^2, so that
/// y = x - v t + (J v - a) t^2 to second order, where J v is the change of the velocity along itself: none in a translation, twice
/// the half acceleration a in a turn. At an edge of the motion it is a step, and counts up to the velocity itself.
fn backwards(motion: texture_2d<f32>, trajectory: Trajectory, x: vec2f) -> Trajectory {
    let v = trajectory.velocity;
    let change = (velocity_at(motion, x + ASIDE * v) - velocity_at(motion, x - ASIDE * v)) / (2.0 * ASIDE);
    let most = min(1.0, length(v) / max(length(change), 1e-6));
    return Trajectory(-v, most * change - trajectory.half_acceleration);
}

/// The same through five positions. A path with a kink has straight pieces.
fn backwards5(motion: texture_2d<f32>, trajectory: Trajectory5, x: vec2f) -> Trajectory5 {
    let parabola = backwards(motion, Trajectory(trajectory.velocity, trajectory.half_acceleration), x);
    let half = select(parabola.half_acceleration, -trajectory.half_acceleration, trajectory.has_kink);
    return Trajectory5(parabola.velocity, half, -trajectory.third, trajectory.has_kink);
}

/// The velocity between pixels, of the four around.
fn velocity_at(motion: texture_2d<f32>, x: vec2f) -> vec2f {
    let last = vec2f(frame.size) - 1.0;
    let at = clamp(x - 0.5, vec2f(0.0), last);
    let low = vec2i(at);
    let high = min(low + 1, vec2i(last));
    let part = at - vec2f(low);
    let upper = mix(velocity_of(motion, low), velocity_of(motion, vec2i(high.x, low.y)), part.x);
    let lower = mix(velocity_of(motion, vec2i(low.x, high.y)), velocity_of(motion, high), part.x);
    return mix(upper, lower, part.y);
}

fn velocity_of(motion: texture_2d<f32>, px: vec2i) -> vec2f {
    return trajectory_from(textureLoad(motion, px, 0)).velocity;
}
