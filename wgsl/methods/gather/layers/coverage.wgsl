// Coverage of an edge pixel by its front surface: if vectors tell it, which some renderers filter, or else by colour.
//#include common/frame.wgsl
//#include methods/gather/surface.wgsl
//#include methods/gather/layers/crowd.wgsl
//#include methods/gather/layers/edge_flags.wgsl
//#include methods/gather/layers/sides.wgsl

const BETWEEN: f32 = 0.4;       // a vector from 0.1 to 0.9 of the way between two is a mixture of them
const BEYOND_HALF: f32 = 0.4;   // how far a colour leads beyond one half, against vectors that are means over their pixels,
const FAST_APART: f32 = 16.0;   // where front and back move apart by this, both ways together [px],
const MOST_BENT: f32 = 0.1;       // and bend by no more than this share of it: vectors that bend vary too
const LEAST_CONTRAST: f32 = 0.05;   // of two colours that tell coverage
const MATTE_CONTRAST: f32 = 0.5;    // difference of the alphas of front and back from which on alpha tells coverage
const OFF_AXIS: f32 = 0.25;     // distance of a mixed colour or vector from the line between two, as a share of its length

struct Coverage {       // of the front
    share: f32,         // in steps of a matte
    is_guess: bool,     // the pixels around tell it, not this one
}

/// Where alphas differ they tell coverage better than vectors, which some renderers do not filter.
fn measured_coverage(edge: EdgePixel, sides: Sides, axis: vec4f, background: vec4f) -> Coverage {
    let front_alpha = select(sides.front.color.a / max(sides.front.weight, 1e-9), 1.0, sides.thin);
    let back_alpha = sides.back.color.a / sides.back.weight;
    let by_alpha = front_alpha - back_alpha > MATTE_CONTRAST && edge.counts > 0.0;
    let by_vector = dot(edge.motion - sides.back_motion, axis) / dot(axis, axis);
    var measured = Coverage(clamp(select(by_vector,
        (edge.color.a / edge.counts - back_alpha) / (front_alpha - back_alpha), by_alpha), 0.0, 1.0), false);
    let unfiltered = is_unfiltered(edge.px);
    if !by_alpha && edge.counts > 0.0 && (unfiltered || !are_filtered(edge.px, sides.back_motion, axis)) {
        measured = coverage_by_color(edge, sides, background,
                                     select(measured.share, f32(edge.z < edge.between), unfiltered),
                                     select(0.0, BEYOND_HALF, !unfiltered && is_fast_and_straight(axis)));
    }
    measured.share = round(measured.share * f32(WHOLE)) / f32(WHOLE);
    return measured;
}

/// The same where vectors and depths are of the middles of pixels: by the colour, over or under one half, as that middle says,
/// or up to `beyond` that half. If the colour does not tell, a middle in front covers its pixel; one behind is covered as far as the
/// pixels around are in front, or as little as the colour may be of the front.
fn coverage_by_color(edge: EdgePixel, sides: Sides, background: vec4f, at_middle: f32, beyond: f32) -> Coverage {
    let front = sides.front.color / max(sides.front.weight, 1e-9);
    let place = place_between(edge.color / edge.counts, front, background);
    let least = select(0.0, 0.5 - beyond, at_middle >= 0.5);
    if place.is_told { return Coverage(clamp(place.share, least, least + 0.5 + beyond), false); }
    if at_middle >= 0.5 { return Coverage(at_middle, false); }
    return Coverage(clamp(place.damped, 0.0, front_around(edge)), true);
}

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
        let near = inside(px + vec2i(i % 3, i / 3) - 1);
        let share = dot(textureLoad(motion, near, 0) - back, axis) / dot(axis, axis);
        result = result || abs(share - 0.5) < BETWEEN;
    }
    return result;
}

struct ColorPlace {     // of a colour between those of back and front: 0, 1
    share: f32,
    is_told: bool,      // it is near the line between them
    damped: f32,        // the share, the less the farther from the line
}

fn place_between(own: vec4f, front: vec4f, back: vec4f) -> ColorPlace {
    let axis = front.rgb - back.rgb;
    let length2 = dot(axis, axis);
    let way = dot(own.rgb - back.rgb, axis);
    let share = way / max(length2, 1e-12);
    let off = own.rgb - back.rgb - share * axis;
    let off2 = dot(off, off);
    let is_told = length2 > LEAST_CONTRAST * LEAST_CONTRAST && off2 < OFF_AXIS * OFF_AXIS * length2;
    return ColorPlace(share, is_told, way / max(length2 + off2, 1e-12));
}

/// True if two surfaces move apart fast, and by the same before and after the frame.
fn is_fast_and_straight(axis: vec4f) -> bool {
    let apart = length(axis);
    return apart >= FAST_APART && length(axis.xy + axis.zw) < MOST_BENT * apart;
}
