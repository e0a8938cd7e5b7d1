// From a pixel and its depth to the homogeneous point that the camera matrices multiply, and back to pixels.
//#include common/finite.wgsl

// Kinds of depth.
const PLANAR: u32 = 0u;             // distance along the view axis of a perspective camera
const ORTHOGRAPHIC: u32 = 1u;       // the same of an orthographic one
const CLIP: u32 = 2u;               // z after projection, as in a depth buffer

const MIN_W: f32 = 1e-4;            // clip w, as a share of the point's distance, below which it is not before the camera

struct Viewport {
    display: vec2f,         // size of the whole image that the matrices speak of [px]
    origin: vec2f,          // of this image in it [px]
    far: f32,               // from this depth on there is nothing: it moves with the camera's rotation alone
    depth_kind: u32,        // PLANAR, ORTHOGRAPHIC or CLIP
    unused: vec2f,          // a struct within a uniform must fill multiples of 16 bytes
}

fn is_nothing(viewport: Viewport, z: f32) -> bool {
    return !is_finite(z) || z >= viewport.far || (z <= 0.0 && viewport.depth_kind == PLANAR);
}

/// Normalised device coordinates, -1..1 with y up, of the centre of `px`.
fn ndc_of(viewport: Viewport, px: vec2u) -> vec2f {
    return ((vec2f(px) + 0.5 + viewport.origin) / viewport.display * 2.0 - 1.0) * vec2f(1.0, -1.0);
}

/// A point of the view volume up to a positive factor.
/// Dividing a perspective point by its depth makes infinitely far an ordinary number, 0.
fn homogeneous(viewport: Viewport, ndc: vec2f, z: f32, nothing_there: bool) -> vec4f {
    if viewport.depth_kind == PLANAR { return vec4f(ndc, 1.0, select(1.0 / z, 0.0, nothing_there)); }
    return vec4f(ndc, z, 1.0);
}

/// Displacement from `ndc` to a clip position [px]; exactly 0 where nothing moved.
fn to_pixels(viewport: Viewport, clip: vec4f, ndc: vec2f) -> vec2f {
    return (clip.xy - ndc * clip.w) / clip.w * vec2f(0.5, -0.5) * viewport.display;
}
