// Pixels that lead to a place of the only neighbour: a word for the one that fits best, 0 for none.
//#include common/frame.wgsl
//#include flow/dense/differences.wgsl

const INDEX_BITS: u32 = 17u;    // of a word, for the number of a pixel: a level of 320 x 320 px has so many; the others for the cost

/// The difference along a way to the neighbour, in levels of 255.
fn cost_of(px: vec2i, way: vec2f) -> f32 {
    return differences(px, vec4f(way, way), 2).better;
}

/// The number of the pixel that a way leads to.
fn place_of(px: vec2i, way: vec2f) -> u32 {
    let at = vec2u(clamp(vec2f(px) + round(way), vec2f(0.0), vec2f(frame.size) - 1.0));
    return at.y * frame.size.x + at.x;
}

/// A word that is the greater, the less a pixel costs.
fn arrival(px: vec2i, cost: f32) -> u32 {
    let steps = f32(1u << (32u - INDEX_BITS)) - 1.0;
    let fit = 1u + u32((steps - 1.0) * (1.0 - clamp(cost / MOST_APART, 0.0, 1.0)));
    return (fit << INDEX_BITS) | (u32(px.y) * frame.size.x + u32(px.x));
}

/// The pixel of a word.
fn leading(word: u32) -> vec2i {
    let index = word & ((1u << INDEX_BITS) - 1u);
    return vec2i(vec2u(index % frame.size.x, index / frame.size.x));
}
