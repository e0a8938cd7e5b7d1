// The backdrop that volumes are shown on: a ground with three grids of lines, and a sky. Colours are display values.

struct Backdrop {
    tint: vec4f,        // w: height of the ground
    light: vec4f,       // direction towards it; w unused
    cells: vec4f,       // side of each grid's cells [scene units]; w unused
    weights: vec4f,     // brightness of each grid; w unused
}

const LINES: f32 = 60.0;    // one over the width of a grid line [1 / scene unit]
const NIGHT: vec3f = vec3f(0.0, 0.0, 0.1);

/// The ground at `at` = (x, z), box-filtered over `width` [scene units].
fn ground_color(backdrop: Backdrop, at: vec2f, width: vec2f) -> vec3f {
    var grids = 0.0;
    for (var i = 0u; i < 3u; i++) {
        let covered = (grid_integral(at + 0.5 * width, backdrop.cells[i])
                       - grid_integral(at - 0.5 * width, backdrop.cells[i])) / width;
        grids += backdrop.weights[i] * (1.0 - 0.6 * covered.x) * (1.0 - 0.6 * covered.y);
    }
    let q = dot(at, at);
    return (backdrop.tint.rgb + grids) * (2.0 / (0.75 * q + 1.0) - 1.2 / (2.25 * q + 1.0));
}

/// Integral of the lines of one grid from 0 to `x`, along both axes.
fn grid_integral(x: vec2f, side: f32) -> vec2f {
    let cell = x / side;
    let whole = floor(cell);
    return (whole + min(LINES * side * (cell - whole), vec2f(1.0))) / LINES;
}

/// The sky, and haze around the horizon, over `color`, in a direction that rises by `up` per unit of length.
fn haze(backdrop: Backdrop, color: vec3f, up: f32) -> vec3f {
    let near = mix(color, 0.7 * backdrop.tint.rgb, 1.0 - smoothstep(0.0, 0.02, abs(up) + 0.003));
    return mix(near, NIGHT, smoothstep(0.0, 0.5, up));
}

/// Diffuse and specular shading of a volume, or of its solid, where the normal is `n`.
fn material(color: vec3f, n: vec3f, light: vec3f, direction: vec3f) -> vec3f {
    let diffuse = dot(n, light);
    let specular = dot(direction, light - 2.0 * diffuse * n);
    return color * (0.9 * max(diffuse, 0.05) + 0.05 * max(specular, 0.0));
}
