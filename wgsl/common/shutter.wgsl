// The shutter reaches the GPU as numbers, so any curve drawn in wgmb/shutter.py works here.
// Time is in frame intervals; 0 is the frame's own instant.
//#include common/frame.wgsl

struct Shutter {
    span: vec2f,            // opens, closes [frame intervals]
    rolling: vec2f,         // delay across the width, the height [frame intervals]
    step: f32,              // span over frame.samples [frame intervals]
}

@group(0) @binding(1) var<uniform> shutter: Shutter;
@group(0) @binding(2) var<storage, read> strata: array<vec2f>;  // middle, length of each equal share of the exposure

override EVEN: bool = false;    // a box: all shares are equally long, and no table is needed

/// Time of sample `i` of frame.samples; `shift` in -0.5..0.5 moves it within its share.
fn shutter_time(i: u32, shift: f32, delay: f32) -> f32 {
    // Everything but `i` is in the bracket, which a compiler takes out of the loop.
    if EVEN { return (shutter.span.x + (0.5 + shift) * shutter.step + delay) + f32(i) * shutter.step; }
    let stratum = strata[i];
    return stratum.x + stratum.y * shift + delay;
}

/// By how much later than the middle of the image the pixel at `x` [px] is exposed.
fn shutter_delay(x: vec2f) -> f32 {
    return dot(shutter.rolling, x / vec2f(frame.size) - 0.5);
}
