// How far something gets while the shutter is open.
//#include common/path.wgsl
//#include common/shutter.wgsl

/// The farthest it is from its place while the shutter is open [px]; turned round where that is before time 0.
fn streak(path: Trajectory, delay: f32) -> vec2f {
    let opens = shutter.span.x + delay;
    let closes = shutter.span.y + delay;
    let turns = slowest_time(path, opens, closes);
    let closing = sign(closes) * displacement(path, closes);
    let opening = sign(opens) * displacement(path, opens);
    let turn = sign(turns) * displacement(path, turns);
    let farthest = select(closing, opening, dot(opening, opening) > dot(closing, closing));
    return select(farthest, turn, dot(turn, turn) > dot(farthest, farthest));
}

fn unit(v: vec2f) -> vec2f {
    return v / max(length(v), 1e-6);
}

/// Motion of any finite length, to where its square is finite too.
fn any_motion(motion: vec4f) -> vec4f {
    return clamp(motion, vec4f(-1e9), vec4f(1e9));
}
