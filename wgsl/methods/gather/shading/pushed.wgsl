// Values pushed to a pixel, in two words: darkness and weight, in steps of 1 / ONE. Over 128 whole pixels would have
// to meet in one for a sum to overflow; the clamp of compose.wgsl holds then too.

const ONE: f32 = 512.0;

/// Darkness times weight; weight.
fn unpack_pushed(a: u32, b: u32) -> vec4f {
    return vec4f(vec4u(a & 0xffffu, a >> 16u, b & 0xffffu, b >> 16u)) / ONE;
}
