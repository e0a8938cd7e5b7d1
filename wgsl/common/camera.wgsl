// From a pixel and its depth to what a matrix of cameras.py multiplies, and back to pixels.

const PLANAR: u32 = 0u;             // distance along the view axis of a perspective camera
const ORTHOGRAPHIC: u32 = 1u;       // the same of an orthographic one
const CLIP: u32 = 2u;               // z after projection, as in a depth buffer

const NEAREST: f32 = 1e-4;          // share of its distance below which a point is at the camera, or behind

struct View {
    display: vec2f,         // size of the whole picture that the matrices speak of [px]
    origin: vec2f,          // where this image begins in it [px]
    far: f32,               // depth from here on: nothing there, moves with the camera's turn only
    depth_kind: u32,        // PLANAR, ORTHOGRAPHIC or CLIP
    unused: vec2f,          // a struct within a uniform must fill multiples of 16 bytes
}

fn is_nothing(view: View, z: f32) -> bool {
    return !is_finite(z) || z >= view.far || (z <= 0.0 && view.depth_kind == PLANAR);
}

/// Position -1..1, y up, of the centre of `px`.
fn ndc_of(view: View, px: vec2u) -> vec2f {
    return ((vec2f(px) + 0.5 + view.origin) / view.display * 2.0 - 1.0) * vec2f(1.0, -1.0);
}

/// A point of the view volume up to a positive factor.
/// Dividing a perspective point by its depth makes infinitely far an ordinary number, 0.
fn homogeneous(view: View, ndc: vec2f, z: f32, nothing_there: bool) -> vec4f {
    if view.depth_kind == PLANAR { return vec4f(ndc, 1.0, select(1.0 / z, 0.0, nothing_there)); }
    return vec4f(ndc, z, 1.0);
}

/// Displacement from `ndc` to a clip position [px]; exactly 0 where nothing moved.
fn to_pixels(view: View, clip: vec4f, ndc: vec2f) -> vec2f {
    return (clip.xy - ndc * clip.w) / clip.w * vec2f(0.5, -0.5) * view.display;
}
