// What volumes are shown on: a ground with three grids of lines, a sky. Colours are display values.

struct Stage {
    tint: vec4f,        // w: height of the ground
    light: vec4f,       // direction towards it; w unused
    cells: vec4f,       // side of each grid's cells [scene units]; w unused
    weights: vec4f,     // brightness of each grid; w unused
}

const LINES: f32 = 60.0;    // one over the width of a grid's line
const NIGHT: vec3f = vec3f(0.0, 0.0, 0.1);

/// The ground at (x, z), averaged over `width`.
fn ground_color(stage: Stage, at: vec2f, width: vec2f) -> vec3f {
    var grids = 0.0;
    for (var i = 0u; i < 3u; i++) {
        let covered = (grid_integral(at + 0.5 * width, stage.cells[i])
                       - grid_integral(at - 0.5 * width, stage.cells[i])) / width;
        grids += stage.weights[i] * (1.0 - 0.6 * covered.x) * (1.0 - 0.6 * covered.y);
    }
    let q = dot(at, at);
    return (stage.tint.rgb + grids) * (2.0 / (0.75 * q + 1.0) - 1.2 / (2.25 * q + 1.0));
}

fn grid_integral(x: vec2f, side: f32) -> vec2f {
    let cell = x / side;
    let whole = floor(cell);
    return (whole + min(LINES * side * (cell - whole), vec2f(1.0))) / LINES;
}

/// The sky, and the haze above the horizon, over what is seen in a direction that rises by `up` per unit length.
fn haze(stage: Stage, color: vec3f, up: f32) -> vec3f {
    let near = mix(color, 0.7 * stage.tint.rgb, 1.0 - smoothstep(0.0, 0.02, abs(up) + 0.003));
    return mix(near, NIGHT, smoothstep(0.0, 0.5, up));
}

/// How a volume or its solid looks where its normal is `n`.
fn material(color: vec3f, n: vec3f, light: vec3f, direction: vec3f) -> vec3f {
    let facing = dot(n, light);
    let gloss = dot(direction, light - 2.0 * facing * n);
    return color * (0.9 * max(facing, 0.05) + 0.05 * max(gloss, 0.0));
}

/// sRGB display values -> linear light (IEC 61966-2-1).
fn linear_light(display: vec3f) -> vec3f {
    let x = clamp(display, vec3f(0.0), vec3f(1.0));
    return select(pow((x + 0.055) / 1.055, vec3f(2.4)), x / 12.92, x <= vec3f(0.04045));
}
