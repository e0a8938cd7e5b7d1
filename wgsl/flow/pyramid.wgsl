// Linear pictures of half the size, and the features of a picture that flow compares: colour, gradient, and the
// direction of the gradient whatever its strength.
//#include common/color.wgsl
//#include common/frame.wgsl
//#include flow/features.wgsl

@group(1) @binding(0) var picture: texture_2d<f32>;     // of each pass: the output of the one before
@group(1) @binding(1) var display: texture_2d<f32>;     // output of `encode_display`
@group(1) @binding(2) var output: Output;
@group(1) @binding(3) var features: Features;           // see write_features()

alias Features = texture_storage_2d_array<rgba8unorm, write>;

const SOBEL: f32 = 0.25;                // so that an edge from 0 to 1 has a gradient of 1
const SPREAD_RADIUS: i32 = 8;           // of the Gaussian around a gradient [px]
const SPREAD_FALLOFF: f32 = 0.125;      // 1 / (2 sigma^2), sigma = 2 px
const FAINT: f32 = 0.03;                // gradients weaker than this have little direction
const DIRECTION_WEIGHT: f32 = 0.05;     // of the direction among the features

/// Level 0: the values of a picture for flow, 0 to 1.
@compute @workgroup_size(WG_X, WG_Y)
fn limit(@builtin(global_invocation_id) id: vec3u) {
    if any(id.xy >= frame.size) { return; }
    textureStore(output, id.xy, limited(textureLoad(picture, id.xy, 0)));
}

/// The mean of 2 x 2 pixels; the last row and column count twice where they have no other.
@compute @workgroup_size(WG_X, WG_Y)
fn halve(@builtin(global_invocation_id) id: vec3u) {
    if any(id.xy >= frame.size) { return; }
    let last = vec2i(textureDimensions(picture)) - 1;
    let a = 2 * vec2i(id.xy);
    let b = min(a + 1, last);
    let sum = (textureLoad(picture, a, 0) + textureLoad(picture, vec2i(b.x, a.y), 0))
        + (textureLoad(picture, vec2i(a.x, b.y), 0) + textureLoad(picture, b, 0));
    textureStore(output, id.xy, sum / 4.0);
}

/// Display values, and their luma.
@compute @workgroup_size(WG_X, WG_Y)
fn encode_display(@builtin(global_invocation_id) id: vec3u) {
    if any(id.xy >= frame.size) { return; }
    let shown = srgb_from_linear(textureLoad(picture, id.xy, 0).rgb);
    textureStore(output, id.xy, vec4f(shown, dot(shown, LUMA)));
}

/// The gradient of the luma (Sobel), and its square.
@compute @workgroup_size(WG_X, WG_Y)
fn find_gradients(@builtin(global_invocation_id) id: vec3u) {
    if any(id.xy >= frame.size) { return; }
    let at = vec2i(id.xy);
    let left = luma(at + vec2i(-1, -1)) + 2.0 * luma(at + vec2i(-1, 0)) + luma(at + vec2i(-1, 1));
    let right = luma(at + vec2i(1, -1)) + 2.0 * luma(at + vec2i(1, 0)) + luma(at + vec2i(1, 1));
    let above = luma(at + vec2i(-1, -1)) + 2.0 * luma(at + vec2i(0, -1)) + luma(at + vec2i(1, -1));
    let below = luma(at + vec2i(-1, 1)) + 2.0 * luma(at + vec2i(0, 1)) + luma(at + vec2i(1, 1));
    let gradient = SOBEL * vec2f(right - left, below - above);
    textureStore(output, id.xy, vec4f(gradient, dot(gradient, gradient), 0.0));
}

/// The squares, averaged along x.
@compute @workgroup_size(WG_X, WG_Y)
fn spread(@builtin(global_invocation_id) id: vec3u) {
    if any(id.xy >= frame.size) { return; }
    let own = textureLoad(picture, id.xy, 0);
    textureStore(output, id.xy, vec4f(own.xy, mean_square(vec2i(id.xy), vec2i(1, 0)), 0.0));
}

/// Layer 0: display red, green, blue, gradient along x; layer 1: gradient along y, direction x, y. What may be
/// negative is stored plus 0.5, and cut off where it does not fit; directions are stored 4 times as large.
@compute @workgroup_size(WG_X, WG_Y)
fn write_features(@builtin(global_invocation_id) id: vec3u) {
    if any(id.xy >= frame.size) { return; }
    let gradient = textureLoad(picture, id.xy, 0).xy;
    let strength = sqrt(mean_square(vec2i(id.xy), vec2i(0, 1))) + FAINT;
    let direction = DIRECTION_WEIGHT / DIRECTION_SCALE * gradient / strength;
    let shown = textureLoad(display, id.xy, 0).rgb;
    textureStore(features, id.xy, 0u, vec4f(shown, gradient.x + 0.5));
    textureStore(features, id.xy, 1u, vec4f(gradient.y + 0.5, direction + 0.5, 0.0));
}

fn luma(px: vec2i) -> f32 {
    return textureLoad(picture, inside(px), 0).w;
}

/// Gaussian mean of the gradients' squares along an axis.
fn mean_square(px: vec2i, axis: vec2i) -> f32 {
    let last = vec2i(frame.size) - 1;
    var sum = 0.0;
    var total = 0.0;
    for (var i = -SPREAD_RADIUS; i <= SPREAD_RADIUS; i++) {
        let weight = exp(-SPREAD_FALLOFF * f32(i * i));
        sum += weight * textureLoad(picture, clamp(px + i * axis, vec2i(0), last), 0).z;
        total += weight;
    }
    return sum / total;
}
