// Common parts of the passes of moving light: its brightness, and its differences from frame to frame.
//#include common/depth.wgsl
//#include common/finite.wgsl
//#include common/frame.wgsl

struct Side {
    next: u32,          // 1: the neighbour is the next frame; 0: the previous one
}

const LUMINANCE: vec3f = vec3f(0.2126, 0.7152, 0.0722);
const AS_DEEP_THERE: f32 = 1.15;    // ratio of the depths of the same surface in two frames
const BRIGHTEST_LIGHT: f32 = 1e4;   // more than this is taken for this

override PULLED: bool = false;      // reflections, which are pulled along their flow; else shadows, which are pushed

/// Light below this is dark [linear].
fn dark() -> f32 {
    return select(0.02, 0.05, PULLED);
}

/// True if a surface of the depth `z` may be that of the depth `z_there` in a neighbouring frame.
fn is_as_deep_there(z: f32, z_there: f32) -> bool {
    return max(z, z_there) < AS_DEEP_THERE * min(z, z_there) && z < NO_DEPTH;
}

/// Light as it came, which may be anything.
fn valid_light(given: vec4f) -> vec3f {
    return select(vec3f(0.0), clamp(given.rgb, vec3f(0.0), vec3f(BRIGHTEST_LIGHT)), is_finite4(vec4f(given.rgb, 0.0)));
}

fn inside(px: vec2i) -> vec2i {
    return clamp(px, vec2i(0), vec2i(frame.size) - 1);
}
