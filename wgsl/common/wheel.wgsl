// Motion as a colour, as wgmb/color/srgb.py has it: hue is the direction, brightness the speed.
//#include common/finite.wgsl

/// Linear light, 0 to 1; full brightness at the speed `fastest` and above; grey where motion is not finite.
fn wheel_color(motion: vec2f, fastest: f32) -> vec3f {
    if !is_finite(motion.x) || !is_finite(motion.y) { return vec3f(0.2); }
    let value = clamp(length(motion) / fastest, 0.0, 1.0);
    let hue = select(atan2(motion.y, motion.x), 0.0, value == 0.0);
    let third = 2.0943951;      // of a turn [rad]
    return (0.5 + 0.5 * cos(vec3f(hue) - vec3f(0.0, third, 2.0 * third))) * value;
}
