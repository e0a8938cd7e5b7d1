// The blur extent of a pixel: how far its content gets from its position while the shutter is open.
//#include common/path.wgsl
//#include common/shutter.wgsl

/// The farthest displacement while the shutter is open [px], turned round if it is reached before time 0: the
/// filter takes every pixel's blur as extending so far to either side.
fn blur_extent(trajectory: Trajectory, delay: f32) -> vec2f {
    let opens = shutter.span.x + delay;
    let closes = shutter.span.y + delay;
    let turns = slowest_time(trajectory, opens, closes);
    let closing = sign(closes) * displacement(trajectory, closes);
    let opening = sign(opens) * displacement(trajectory, opens);
    let turn = sign(turns) * displacement(trajectory, turns);
    let farthest = select(closing, opening, dot(opening, opening) > dot(closing, closing));
    return select(farthest, turn, dot(turn, turn) > dot(farthest, farthest));
}

/// The direction of `v`; 0 where it has none.
fn unit(v: vec2f) -> vec2f {
    return v / max(length(v), 1e-6);
}

/// Motion clamped to lengths whose squares are finite.
fn finite_motion(motion: vec4f) -> vec4f {
    return clamp(motion, vec4f(-1e9), vec4f(1e9));
}
