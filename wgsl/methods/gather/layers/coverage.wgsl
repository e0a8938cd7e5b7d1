// Coverage of an edge pixel by its front surface: if vectors tell it, which some renderers filter, or else by colour.
//#include common/frame.wgsl
//#include methods/gather/layers/edge_flags.wgsl

const BETWEEN: f32 = 0.4;       // a vector from 0.1 to 0.9 of the way between two is a mixture of them
const LEAST_CONTRAST: f32 = 0.05;   // of two colours that tell coverage
const OFF_AXIS: f32 = 0.25;     // distance of a mixed colour or vector from the line between two, as a share of its length

/// True if a vector, from that of the background on, lies near the way to that of the foreground: else it is of a third surface.
fn is_mixture(own: vec4f, axis: vec4f) -> bool {
    let length2 = dot(axis, axis);
    let off = own - clamp(dot(own, axis) / length2, 0.0, 1.0) * axis;
    return dot(off, off) <= OFF_AXIS * OFF_AXIS * length2 + EDGE_MOTION * EDGE_MOTION;
}

/// True if some vector of the 3 x 3 is between those of the two surfaces: the renderer has filtered them.
fn are_filtered(px: vec2i, back: vec4f, axis: vec4f) -> bool {
    var result = false;
    for (var i = 0; i < 9; i++) {
        let share = dot(textureLoad(motion, clamped(px + vec2i(i % 3, i / 3) - 1), 0) - back, axis) / dot(axis, axis);
        result = result || abs(share - 0.5) < BETWEEN;
    }
    return result;
}

/// Coverage where vectors are of the pixel's middle, by the colour's place between those of front and back, if it is between them.
/// It is over or under one half, as that middle says.
fn coverage_by_color(own: vec4f, front: vec4f, back: vec4f, at_middle: f32) -> f32 {
    let axis = front.rgb - back.rgb;
    let length2 = dot(axis, axis);
    let share = dot(own.rgb - back.rgb, axis) / max(length2, 1e-12);
    let off = own.rgb - back.rgb - share * axis;
    let is_between = length2 > LEAST_CONTRAST * LEAST_CONTRAST && dot(off, off) < OFF_AXIS * OFF_AXIS * length2;
    let least = select(0.0, 0.5, at_middle >= 0.5);
    return select(at_middle, clamp(share, least, least + 0.5), is_between);
}
