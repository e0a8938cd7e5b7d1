// Pictures of one level, at whole places and between them.
//#include flow/dense/turn.wgsl

@group(1) @binding(1) var levels: texture_2d_array<f32>;    // stored as r32float

/// A pixel of a layer, or outside of the picture the nearest one inside.
fn grey(place: vec2i, layer: u32) -> f32 {
    let px = clamp(place, vec2i(0), vec2i(textureDimensions(levels)) - 1);
    return textureLoad(levels, px, layer, 0).x;
}

/// Between four pixels, whose centres are whole numbers.
fn grey_between(place: vec2f, layer: u32) -> f32 {
    let low = vec2i(floor(place));
    let share = place - floor(place);
    let upper = mix(grey(low, layer), grey(low + vec2i(1, 0), layer), share.x);
    let lower = mix(grey(low + vec2i(0, 1), layer), grey(low + 1, layer), share.x);
    return mix(upper, lower, share.y);
}

/// The change from pixel to pixel, across and down [levels / px].
fn gradient(px: vec2i) -> vec2f {
    let across = grey(px + vec2i(1, 0), turn.here) - grey(px - vec2i(1, 0), turn.here);
    let down = grey(px + vec2i(0, 1), turn.here) - grey(px - vec2i(0, 1), turn.here);
    return 0.5 * vec2f(across, down);
}
