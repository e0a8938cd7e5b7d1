// The shutter reaches the GPU as numbers, so any curve drawn in wgmb/shutter.py works here.
// Time is in frame intervals; 0 is the frame's own instant.
//#include common/frame.wgsl

struct Shutter {
    span: vec2f,            // opens, closes [frame intervals]
    rolling: vec2f,         // delay across the width, the height [frame intervals]
    step: f32,              // span over frame.samples [frame intervals]
}

@group(0) @binding(1) var<uniform> shutter: Shutter;
struct Stratum {            // an equal share of the exposure [frame intervals]
    begin: f32,
    middle: f32,            // when half of it has passed
    end: f32,
}

@group(0) @binding(2) var<storage, read> strata: array<Stratum>;

override EVEN: bool = false;    // a box: all shares are equally long, and no table is needed

struct Times {      // what a pixel's sample times have in common, fetched once before its loop
    first: f32,     // of a box [frame intervals]
    step: f32,
    shift: f32,     // within every share, -0.5..0.5
    delay: f32,     // of the rolling shutter [frame intervals]
}

/// For the pixel at `x` [px], its samples moved by `shift` within their shares.
fn shutter_times(x: vec2f, shift: f32) -> Times {
    let delay = dot(shutter.rolling, x / vec2f(frame.size) - 0.5);
    return Times(shutter.span.x + (0.5 + shift) * shutter.step + delay, shutter.step, shift, delay);
}

/// Time of sample `i` of frame.samples [frame intervals].
fn shutter_time(times: Times, i: u32) -> f32 {
    if EVEN { return times.first + f32(i) * times.step; }
    return within(strata[i], times.shift) + times.delay;
}

/// Time at `shift`, -0.5..0.5, from the middle of a stratum.
fn within(stratum: Stratum, shift: f32) -> f32 {
    let side = select(stratum.end - stratum.middle, stratum.middle - stratum.begin, shift < 0.0);
    return stratum.middle + 2.0 * shift * side;
}
