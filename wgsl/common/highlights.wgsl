// Lights that were cut off at white: expanded to many times white before a blur, compressed by the inverse after it. So
// they streak as bright lights do, and a picture in which nothing moves stays as it is. White is what all three colours
// are cut off at: yellow paint is at white in red and green, and is no light.

override HIGHLIGHTS: f32 = 1.0;     // times white that white counts as; 1: off

const HIGHLIGHT_KNEE: f32 = 0.92;    // of the darkest colour of a pixel: up to here, all stays as it is

/// Factor of the square that the curve adds from its knee to white: x + bend (x - knee)^2. Above white it goes on straight.
fn highlight_bend() -> f32 {
    return (HIGHLIGHTS - 1.0) / ((1.0 - HIGHLIGHT_KNEE) * (1.0 - HIGHLIGHT_KNEE));
}

/// Light of a pixel, not multiplied by alpha, expanded. Its three colours keep their ratios.
fn expanded(light: vec3f) -> vec3f {
    if HIGHLIGHTS == 1.0 { return light; }
    let darkest = min(light.x, min(light.y, light.z));
    let over = max(darkest - HIGHLIGHT_KNEE, 0.0);
    let bent = min(over, 1.0 - HIGHLIGHT_KNEE);
    return light * (1.0 + highlight_bend() * bent * (2.0 * over - bent) / max(darkest, HIGHLIGHT_KNEE));
}

/// The inverse of `expanded`.
fn compressed(light: vec3f) -> vec3f {
    if HIGHLIGHTS == 1.0 { return light; }
    let darkest = min(light.x, min(light.y, light.z));
    let over = max(darkest - HIGHLIGHT_KNEE, 0.0);
    let bent = min(over, HIGHLIGHTS - HIGHLIGHT_KNEE);
    // The root of bent = x + bend x^2 that is not negative, without a difference.
    let root = 2.0 * bent / (1.0 + sqrt(1.0 + 4.0 * highlight_bend() * bent));
    let x = root + (over - bent) / (1.0 + 2.0 * highlight_bend() * (1.0 - HIGHLIGHT_KNEE));
    return light * select(1.0, (HIGHLIGHT_KNEE + x) / darkest, darkest > HIGHLIGHT_KNEE);
}
