// Common parts of the passes of moving light: its brightness, and its differences from frame to frame.
//#include common/depth.wgsl
//#include common/finite.wgsl
//#include common/frame.wgsl
//#include methods/gather/shading/rests.wgsl

const LUMINANCE: vec3f = vec3f(0.2126, 0.7152, 0.0722);
const AS_DEEP_THERE: f32 = 1.15;    // ratio of the depths of the same surface in two frames
const BRIGHTEST_LIGHT: f32 = 1e4;   // more than this is taken for this

override PULLED: bool = false;      // reflections, which are pulled along their flow; else shadows, which are pushed

/// Light below this is dark [linear].
fn dark() -> f32 {
    return select(DARK, 0.05, PULLED);
}

/// True if a surface of the depth `z` may be that of the depth `z_there` in a neighbouring frame.
fn is_as_deep_there(z: f32, z_there: f32) -> bool {
    return max(z, z_there) < AS_DEEP_THERE * min(z, z_there) && z < NO_DEPTH;
}

/// Light as it came, which may be anything.
fn valid_light(given: vec4f) -> vec3f {
    return select(vec3f(0.0), clamp(given.rgb, vec3f(0.0), vec3f(BRIGHTEST_LIGHT)), is_finite4(vec4f(given.rgb, 0.0)));
}

struct Square {         // four pixels, and where between their middles a place is
    pair: vec4i,        // the first one, the last one
    share: vec2f,
}

/// Those around a place [px]; edges repeat. (Samplers of most GPUs are less exact than that, and lavapipe's slower.)
fn square_around(at: vec2f) -> Square {
    return square_within(frame.size, at);
}

/// The same in an image of another size.
fn square_within(size: vec2u, at: vec2f) -> Square {
    let corner = floor(at - 0.5);
    let first = vec4i(vec2i(corner), vec2i(corner) + 1);
    return Square(clamp(first, vec4i(0), vec4i(size.xyxy) - 1), at - 0.5 - corner);
}

/// The values of its pixels, between them.
fn mixed(square: Square, own: vec4f, right: vec4f, below: vec4f, both: vec4f) -> vec4f {
    return mix(mix(own, right, square.share.x), mix(below, both, square.share.x), square.share.y);
}

/// Of images of which a pixel stands for 2 x 2 of the frame.
fn half_size() -> vec2u {
    return (frame.size + 1u) / 2u;
}

/// The number of a level of a pyramid, by its size: half that of the finer one, rounded up; 0 is the frame itself.
fn level_of(size: vec2u) -> u32 {
    let longer = vec2u(max(frame.size.x, frame.size.y), max(size.x, size.y));
    let bits = firstLeadingBit(longer - 1u);
    return bits.x - bits.y;
}

/// The pixel of the frame at which one of a level begins.
fn in_frame(px: vec2u, size: vec2u) -> vec2u {
    return min(px << vec2u(level_of(size)), frame.size - 1u);
}
