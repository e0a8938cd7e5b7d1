// The transfer function of sRGB (IEC 61966-2-1), both ways.

/// Display values 0..1 of linear light 0..1.
fn srgb_from_linear(light: vec3f) -> vec3f {
    let high = 1.055 * pow(max(light, vec3f(0.0031308)), vec3f(1.0 / 2.4)) - 0.055;
    return select(high, 12.92 * light, light <= vec3f(0.0031308));
}

/// Linear light 0..1 of display values, which are clamped to 0..1.
fn linear_from_srgb(display: vec3f) -> vec3f {
    let x = clamp(display, vec3f(0.0), vec3f(1.0));
    return select(pow((x + 0.055) / 1.055, vec3f(2.4)), x / 12.92, x <= vec3f(0.04045));
}
