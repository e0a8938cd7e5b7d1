// The path of a pixel's content through the previous, this and the next frame.

struct Path {
    velocity: vec2f,    // [px per frame interval]
    curvature: vec2f,   // [px per squared frame interval]
}

/// The parabola through the three places; a line where `motion` = (to_prev, to_next) [px] are opposite.
fn path_of(motion: vec4f) -> Path {
    return Path(0.5 * (motion.zw - motion.xy), 0.5 * (motion.zw + motion.xy));
}

/// When between `opens` and `closes` it is slowest: where a path that comes back turns.
fn turning(path: Path, opens: f32, closes: f32) -> f32 {
    let t = -0.5 * dot(path.velocity, path.curvature) / max(dot(path.curvature, path.curvature), 1e-30);
    return clamp(t, opens, closes);
}

/// Displacement [px] at time `t` of what is here at time 0.
fn displacement(path: Path, t: f32) -> vec2f {
    return (path.velocity + path.curvature * t) * t;
}
