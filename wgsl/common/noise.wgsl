// Noise of a pixel in a frame: same input, same bits.
//#include common/frame.wgsl

const NOISES: u32 = 64u;         // frames after which it repeats

/// Interleaved gradient noise in [0, 1) (Jimenez 2014), shifted by the frame number.
fn pixel_noise(px: vec2u) -> f32 {
    let at = vec2f(vec2i(px) + frame.origin) + 5.588238 * f32(frame.index % NOISES);
    return fract(52.9829189 * fract(dot(at, vec2f(0.06711056, 0.00583715))));
}
