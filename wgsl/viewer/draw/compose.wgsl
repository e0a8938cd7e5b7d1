// The image that the viewer shows: one or two images, as colour, depth or motion, side by side or compared.
//#include common/color.wgsl
//#include common/frame.wgsl
//#include common/wheel.wgsl

@group(1) @binding(0) var<uniform> view: View;
@group(1) @binding(1) var first: texture_2d<f32>;
@group(1) @binding(2) var second: texture_2d<f32>;
@group(1) @binding(3) var picture: texture_storage_2d<rgba16float, write>;  // display values

struct View {
    area: vec4f,        // x, y, width, height of the area beside the panel [px]
    place: vec4f,       // the same of the whole image, which may extend beyond the area
    key: vec4f,         // the same of the colour bar; without a width there is none
    wheel: vec4f,       // the same of the colour wheel of motion
    line: f32,          // x of the wipe's line [px]
    thick: f32,         // half the width of a line [px]
    exposure: f32,      // factor of colours
    gain: f32,          // factor of differences
    middle: f32,        // depth of middle grey [scene units]
    fastest: f32,       // speed of full brightness [image heights per frame]
}

override FIRST: u32 = 0u;       // content of the first image
override SECOND: u32 = 0u;
override COMPARE: u32 = 0u;
override TONE: u32 = 0u;
override TAPS: u32 = 1u;        // per side of a pixel that shows many texels; 0: texel for texel

const COLOR: u32 = 0u;
const DEPTH: u32 = 1u;
const MOTION: u32 = 2u;
const DISPLAY: u32 = 3u;          // display values already

const ONE: u32 = 0u;
const WIPE: u32 = 1u;
const SPLIT: u32 = 2u;
const DIFFERENCE: u32 = 3u;
const ERROR: u32 = 4u;
const RED_CYAN: u32 = 5u;

const CLIP: u32 = 0u;
const SOFT: u32 = 1u;
const FALSE: u32 = 2u;            // colours of brightness, LOWEST to HIGHEST

const LOWEST: f32 = -10.0;        // [stops from 1.0]
const HIGHEST: f32 = 6.0;
const LUMINANCE: vec3f = vec3f(0.2126, 0.7152, 0.0722);  // of Rec. 709

const BACKGROUND: vec3f = vec3f(0.075, 0.078, 0.086);

@compute @workgroup_size(WG_X, WG_Y)
fn main(@builtin(global_invocation_id) id: vec3u) {
    if any(id.xy >= frame.size) { return; }
    textureStore(picture, id.xy, vec4f(shown(vec2f(id.xy) + 0.5), 1.0));
}

/// The same by a rasterizer: where compute shaders run one after the other, it need not wait for them.
@fragment
fn texel(@builtin(position) at: vec4f) -> @location(0) vec4f {
    return vec4f(shown(at.xy), 1.0);
}

/// Display values of the pixel whose centre is `at`.
fn shown(at: vec2f) -> vec3f {
    if !is_in(at, view.area) { return BACKGROUND; }
    let has_key = FIRST == DEPTH || COMPARE == ERROR || (FIRST == COLOR && TONE == FALSE);
    if has_key && is_in(at, view.key) { return color_bar(at); }
    let color = comparison(at);
    if FIRST != MOTION { return color; }
    return select(color, wheel(at, color), is_in(at, view.wheel));
}

fn is_in(at: vec2f, box: vec4f) -> bool {
    return all(at >= box.xy) && all(at < box.xy + box.zw);
}

fn comparison(at: vec2f) -> vec3f {
    if COMPARE == SPLIT { return side_by_side(at); }
    if !is_in(at, view.place) { return BACKGROUND; }
    let uv = (at - view.place.xy) / view.place.zw;
    if COMPARE == WIPE {
        if abs(at.x - view.line) < view.thick { return vec3f(0.95); }
        if at.x > view.line { return seen(second, SECOND, uv); }
    }
    let here = seen(first, FIRST, uv);
    if COMPARE == DIFFERENCE {
        return clamp(abs(here - seen(second, SECOND, uv)) * view.gain, vec3f(0.0), vec3f(1.0));
    }
    if COMPARE == RED_CYAN { return vec3f(here.r, seen(second, SECOND, uv).gb); }
    if COMPARE == ERROR {
        return heat(dot(abs(here - seen(second, SECOND, uv)), vec3f(view.gain / 3.0)));
    }
    return here;
}

/// Both images in full, at half the size.
fn side_by_side(at: vec2f) -> vec3f {
    let half = vec2f(0.5 * view.area.z, view.area.w);
    let right = at.x >= view.area.x + half.x;
    if abs(at.x - view.area.x - half.x) < view.thick { return vec3f(0.35); }
    let middle = view.area.xy + half * vec2f(select(0.5, 1.5, right), 0.5);
    let size = view.place.zw * 0.5;
    let pan = (view.place.xy + size - view.area.xy - view.area.zw * 0.5) * 0.5;
    let uv = (at - middle - pan) / size + 0.5;
    if any(uv < vec2f(0.0)) || any(uv >= vec2f(1.0)) { return BACKGROUND; }
    if right { return seen(second, SECOND, uv); }
    return seen(first, FIRST, uv);
}

fn seen(image: texture_2d<f32>, kind: u32, uv: vec2f) -> vec3f {
    let size = vec2f(textureDimensions(image));
    let near = textureLoad(image, vec2u(min(uv * size, size - 1.0)), 0);
    if kind == DEPTH { return vec3f(grey_of(near.x)); }
    if kind == MOTION { return motion_color(near.zw / size.y); }
    let color = filtered(image, uv * size, size);
    if kind == DISPLAY { return color; }
    return displayed(color);
}

/// Bilinear between texels, or the mean of those under one pixel.
fn filtered(image: texture_2d<f32>, at: vec2f, size: vec2f) -> vec3f {
    if TAPS == 0u { return finite(textureLoad(image, vec2u(at), 0)); }
    if TAPS == 1u { return bilinear(image, at, size); }
    let step = size / (view.place.zw * select(1.0, 0.5, COMPARE == SPLIT));
    var sum = vec3f(0.0);
    for (var i = 0u; i < TAPS * TAPS; i++) {
        let shift = (vec2f(vec2u(i % max(TAPS, 1u), i / max(TAPS, 1u))) + 0.5) / f32(TAPS) - 0.5;
        sum += bilinear(image, at + shift * step, size);
    }
    return sum / f32(TAPS * TAPS);
}

fn bilinear(image: texture_2d<f32>, at: vec2f, size: vec2f) -> vec3f {
    let from_ = clamp(at - 0.5, vec2f(0.0), size - 1.0);
    let a = vec2u(from_);
    let b = min(a + 1u, vec2u(size) - 1u);
    let share = fract(from_);
    let top = mix(textureLoad(image, a, 0), textureLoad(image, vec2u(b.x, a.y), 0), share.x);
    let low = mix(textureLoad(image, vec2u(a.x, b.y), 0), textureLoad(image, b, 0), share.x);
    return finite(mix(top, low, share.y));
}

fn finite(color: vec4f) -> vec3f {
    return select(vec3f(0.0), color.rgb, is_finite4(color));
}

/// Display values of linear light: exposure, tone curve, sRGB.
fn displayed(light: vec3f) -> vec3f {
    var x = max(light * view.exposure, vec3f(0.0));
    if TONE == FALSE { return false_color(dot(x, LUMINANCE)); }
    if TONE == SOFT { x = x / (1.0 + x); }
    return srgb_from_linear(min(x, vec3f(1.0)));
}

/// The colour of a luminance by its stops.
fn false_color(bright: f32) -> vec3f {
    return heat((log2(max(bright, 1e-20)) - LOWEST) / (HIGHEST - LOWEST));
}

/// Grey of a depth: near is bright, no depth is black.
fn grey_of(depth: f32) -> f32 {
    if !is_finite(depth) || depth <= 0.0 { return 0.0; }
    return view.middle / (view.middle + depth);
}

/// Display colour of motion [image heights per frame].
fn motion_color(motion: vec2f) -> vec3f {
    if !is_finite(motion.x) || !is_finite(motion.y) { return vec3f(0.2); }
    return srgb_from_linear(wheel_color(motion, view.fastest));
}

/// Black, violet, red, yellow, white for 0 to 1.
fn heat(x: f32) -> vec3f {
    let u = clamp(x, 0.0, 1.0) * 4.0;
    var color = mix(vec3f(0.0, 0.0, 0.02), vec3f(0.28, 0.06, 0.46), min(u, 1.0));
    color = mix(color, vec3f(0.80, 0.20, 0.30), clamp(u - 1.0, 0.0, 1.0));
    color = mix(color, vec3f(0.99, 0.70, 0.15), clamp(u - 2.0, 0.0, 1.0));
    return mix(color, vec3f(1.0, 1.0, 0.90), clamp(u - 3.0, 0.0, 1.0));
}

/// The colour bar of the error, of depth, or of false colours; from low to high, left to right.
fn color_bar(at: vec2f) -> vec3f {
    let x = (at.x - view.key.x) / view.key.z;
    if FIRST == DEPTH && COMPARE != ERROR { return vec3f(1.0 - x); }
    return heat(x);
}

fn wheel(at: vec2f, around: vec3f) -> vec3f {
    let from_middle = (at - view.wheel.xy) / view.wheel.zw * 2.0 - 1.0;
    let radius = length(from_middle);
    if radius >= 1.0 { return around; }
    if radius >= 0.97 { return vec3f(0.9); }
    return motion_color(from_middle * view.fastest);
}
