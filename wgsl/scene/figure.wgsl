// The figures of Cusa 2022: an orbiting disk on a screen and as it is perceived, and the section of a rotating torus.
// Colours are display values. Positions: 1 is the image height, y up, 0 in the middle.
//#include common/color.wgsl
//#include common/frame.wgsl
//#include common/loops.wgsl
//#include scene/density.wgsl
//#include scene/backdrop.wgsl

@group(1) @binding(1) var<uniform> figure: Figure;
@group(1) @binding(2) var output: Output;

const DISK: u32 = 0u;       // figure 5: a frame of a video
const NATURAL: u32 = 1u;    // figure 2: continuous time, beside the response of a cone cell
const SCREEN: u32 = 2u;     // figure 3: a video, beside the response of a cone cell
const SPIRIC: u32 = 3u;     // figure 6

override KIND: u32 = DISK;
override SHARP: bool = false;   // no blur: the disk, antialiased

struct Figure {
    turning: Rotation,
    small: f32,         // radius of the disk; of the torus the minor one
    large: f32,         // of its circle; major radius
    slice: f32,         // where the torus is cut
    speed: f32,         // [rad/s]
    rotation: f32,      // of the disk or torus now, clockwise [rad]
    circle: f32,        // rotation of the dashed circle [rad]
    dash: f32,          // where its dashes begin [rad]
    passes: u32,        // of the disk, that still contribute to the response
    sharpness: vec2f,   // of a cone cell's response: rate [1/s], delay times rate
    ways: u32,          // frames that still contribute to the response
    frames: array<vec4f, MOST_FRAMES>,    // rotation [rad], weight; 2 unused
}

const MOST_FRAMES: u32 = 64u;
const SOLID: vec3f = vec3f(0.8, 0.9, 1.0);
const GRID: vec3f = vec3f(0.2, 0.2, 0.501);    // 0.5, and on the safe side of 127.5 in 8 bits
const DASHES: vec3f = vec3f(1.0, 0.2, 0.2);
const SLOW: f32 = 0.1;      // speed at which the disk is perceived as it is [rad/s]

@compute @workgroup_size(WG_X, WG_Y)
fn main(@builtin(global_invocation_id) id: vec3u) {
    if any(id.xy >= frame.size) { return; }
    let size = vec2f(frame.size);
    let aspect = size.x / size.y;
    let p = ((vec2f(id.xy) + 0.5) / size - 0.5) * vec2f(aspect, -1.0);
    var color = vec3f(0.0);
    if KIND == DISK { color = mix(grid(p, size), SOLID, image(p, figure.rotation, size.y)); }
    if KIND == SPIRIC { color = vec3f(section(p)); }
    if KIND == NATURAL || KIND == SCREEN { color = panels(p, size, aspect); }
    textureStore(output, id.xy, vec4f(linear_from_srgb(color), 1.0));
}

fn grid(p: vec2f, size: vec2f) -> vec3f {
    let apart = abs(fract(p / 0.16) * 0.16 - 0.08);
    let amount = 1.0 - smoothstep(0.6 / size, 1.6 / size, apart);
    return GRID * max(amount.x, amount.y);
}

/// Coverage of the disk in a frame in which its rotation is `phi`.
fn image(p: vec2f, phi: f32, height: f32) -> f32 {
    if SHARP {
        let middle = figure.large * vec2f(cos(PI - phi), sin(PI - phi));
        return 1.0 - smoothstep(figure.small, figure.small + 1.0 / height, distance(p, middle));
    }
    return occupancy(-angle_from_disk(p, phi), disk_half_angle(length(p), figure.small, figure.large), figure.turning);
}

/// Angle of a place relative to the disk, counterclockwise, -pi..pi; the disk turns clockwise.
fn angle_from_disk(p: vec2f, phi: f32) -> f32 {
    return wrapped(angle(p.x, p.y) - PI + phi, PI);
}

/// An angle, made to lie in -below..TAU - below.
fn wrapped(x: f32, below: f32) -> f32 {
    return x + below - TAU * floor((x + below) / TAU) - below;
}

fn section(p: vec2f) -> f32 {
    let h = spiric_half_angle(length(p), figure.slice, figure.small, figure.large);
    return occupancy(wrapped(2.0 * (angle(p.x, p.y) - figure.rotation), PI), 2.0 * h, figure.turning);
}

fn panels(p: vec2f, size: vec2f, aspect: f32) -> vec3f {
    let right = p.x > 0.0;
    let q = vec2f(p.x + select(0.25, -0.25, right) * aspect, p.y);
    var seen = 0.0;
    if KIND == NATURAL {
        let h = disk_half_angle(length(q), figure.small, figure.large);
        let passed = wrapped(angle_from_disk(q, figure.rotation), 1.0);
        var since = 0.0;
        let passes = turns_of(figure.passes, bitcast<u32>(p.x));
        for (var k = 0u; k < passes; k++) {
            let beta = passed + TAU * f32(k);
            since += step_response((beta + h) / figure.speed) - step_response((beta - h) / figure.speed);
        }
        seen = select(step_response((passed + h) / SLOW) - step_response((passed - h) / SLOW), since, right);
    } else {
        var sum = 0.0;
        let ways = turns_of(figure.ways, bitcast<u32>(p.x));
        for (var i = 0u; i < ways; i++) {
            sum += figure.frames[i].y * image(q, figure.frames[i].x, size.y);
        }
        seen = select(image(q, figure.rotation, size.y), sum, right);
    }
    var color = SOLID * seen;
    let to = q - figure.large * vec2f(cos(PI - figure.circle), sin(PI - figure.circle));
    let dash = fract((atan2(to.y, to.x) - figure.dash) / (0.2 * PI)) * 0.2;
    let amount = (1.0 - smoothstep(1.0, 2.0, abs(length(to) - figure.small) * size.y))
        * smoothstep(0.05, 0.07, abs(dash - 0.1));
    color = mix(color, DASHES, select(0.0, amount, right));
    return mix(color, vec3f(0.9), 1.0 - smoothstep(3.0, 4.0, abs(p.x) * size.x));
}

/// Step response of a cone cell: the share of its response to a flash that has come after `x` seconds
/// (Howlett et al. 2017).
fn step_response(x: f32) -> f32 {
    return exp(-exp(min(figure.sharpness.y - figure.sharpness.x * x, 80.0)));
}
