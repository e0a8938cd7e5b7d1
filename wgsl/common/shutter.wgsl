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
override AUTO: bool = false;    // as many samples as a streak has pixels, up to frame.samples

const FEWEST: u32 = 2u;         // samples of what moves

/// From when to when, after its own instant, a frame `offset` intervals away is shown [frame intervals].
fn shown(offset: f32) -> vec2f {
    let late = 0.5 * (abs(shutter.rolling.x) + abs(shutter.rolling.y));
    return shutter.span + vec2f(-late, late) - offset;
}

struct Times {      // what a pixel's sample times have in common, fetched once before its loop
    count: u32,     // samples of this pixel
    first: f32,     // of a box [frame intervals]
    step: f32,
    shift: f32,     // within every share, -0.5..0.5
    delay: f32,     // of the rolling shutter [frame intervals]
}

/// For the pixel at `x` [px], its samples moved by `shift` within their shares.
fn shutter_times(x: vec2f, shift: f32) -> Times {
    let delay = dot(shutter.rolling, x / vec2f(frame.size) - 0.5);
    return Times(frame.samples, shutter.span.x + (0.5 + shift) * shutter.step + delay, shutter.step, shift, delay);
}

/// With AUTO, fewer where the streak is short [px]: one a pixel.
fn enough_times(times: Times, streak: f32) -> Times {
    if !AUTO { return times; }
    let count = clamp(u32(ceil(min(streak, 1e6))), min(FEWEST, frame.samples), frame.samples);
    let step = shutter.step * f32(frame.samples) / f32(count);
    return Times(count, shutter.span.x + (0.5 + times.shift) * step + times.delay, step, times.shift, times.delay);
}

/// Time of sample `i` of times.count [frame intervals].
fn shutter_time(times: Times, i: u32) -> f32 {
    if EVEN { return times.first + f32(i) * times.step; }
    if AUTO { return time_of((f32(i) + 0.5 + times.shift) / f32(times.count)) + times.delay; }
    return within(strata[i], times.shift) + times.delay;
}

/// When the share `u` of the exposure has passed [frame intervals].
fn time_of(u: f32) -> f32 {
    let x = u * f32(arrayLength(&strata));
    let i = min(u32(x), arrayLength(&strata) - 1u);
    return within(strata[i], x - f32(i) - 0.5);
}

/// Time at `shift`, -0.5..0.5, from the middle of a stratum.
fn within(stratum: Stratum, shift: f32) -> f32 {
    let side = select(stratum.end - stratum.middle, stratum.middle - stratum.begin, shift < 0.0);
    return stratum.middle + 2.0 * shift * side;
}
