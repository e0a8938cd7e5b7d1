// Motions, and how far they lead while a frame is shown. A path as a vector: velocity, half_acceleration.
//#include common/path.wgsl
//#include common/shutter.wgsl

const WILD: f32 = 1e5;          // motions beyond this [px] are errors
const FARTHEST: i32 = 16;       // tiles that a motion is followed over

fn as_vec4(path: Trajectory) -> vec4f {
    return vec4f(path.velocity, path.half_acceleration);
}

fn displaced(path: vec4f, u: f32) -> vec2f {
    return displacement(Trajectory(path.xy, path.zw), u);
}

/// How long after, or before, the instant of the frame `offset` intervals away it is shown at most.
fn longest_time(offset: f32) -> f32 {
    let span = abs(exposure_window(offset));
    return max(span.x, span.y);
}

/// How far apart two motions come by the time `u`, before or after, squared.
fn apart(a: vec4f, b: vec4f, u: f32) -> f32 {
    let d = (a - b) * vec4f(u, u, u * u, u * u);
    return dot(d, d) + 2.0 * abs(dot(d.xy, d.zw));
}
