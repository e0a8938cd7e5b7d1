// The exposure, and the sample times of a pixel. It reaches the GPU as numbers, so that any curve
// drawn in wgmb/shutter.py works here. Time is in frame intervals; 0 is the frame's own instant.
//#include common/frame.wgsl

struct Shutter {
    span: vec2f,            // opens, closes [frame intervals]
    rolling: vec2f,         // delay across the width, the height [frame intervals]
    step: f32,              // span over frame.samples [frame intervals]
}

struct Stratum {            // an equal share of the exposure [frame intervals]
    begin: f32,
    middle: f32,            // when half of it has passed
    end: f32,
}

@group(0) @binding(1) var<uniform> shutter: Shutter;
@group(0) @binding(2) var<storage, read> strata: array<Stratum>;

override BOX_SHUTTER: bool = false; // all strata are equally long, and the table of them is not read
override ADAPTIVE: bool = false;    // one sample per pixel of blur length, up to frame.samples

const MIN_SAMPLES: u32 = 2u;        // of a pixel that moves, if ADAPTIVE

/// First and last time at which a frame `offset` intervals away is exposed anywhere in the image, after
/// that frame's own instant [frame intervals].
fn exposure_window(offset: f32) -> vec2f {
    let first = vec2f(frame.origin) / vec2f(frame.display) - 0.5;
    let last = vec2f(frame.origin + vec2i(frame.size)) / vec2f(frame.display) - 0.5;
    let late = dot(abs(shutter.rolling), max(vec2f(0.5), max(-first, last)));
    return shutter.span + vec2f(-late, late) - offset;
}

struct SampleTimes {        // common to all sample times of a pixel, fetched once before its loop
    count: u32,
    first: f32,             // of a box shutter [frame intervals]
    step: f32,              // of a box shutter [frame intervals]
    shift: f32,             // within every stratum, -0.5..0.5
    delay: f32,             // of the rolling shutter [frame intervals]
}

/// For the pixel at `x` [px]; its samples are moved by `shift` within their strata.
fn shutter_times(x: vec2f, shift: f32) -> SampleTimes {
    let delay = dot(shutter.rolling, (x + vec2f(frame.origin)) / vec2f(frame.display) - 0.5);
    let first = shutter.span.x + (0.5 + shift) * shutter.step + delay;
    return SampleTimes(frame.samples, first, shutter.step, shift, delay);
}

/// If ADAPTIVE, as many samples as the blur is long [px]; else as many as before.
fn with_adaptive_count(times: SampleTimes, blur_length: f32) -> SampleTimes {
    if !ADAPTIVE { return times; }
    let count = clamp(u32(ceil(min(blur_length, 1e6))), min(MIN_SAMPLES, frame.samples), frame.samples);
    let step = shutter.step * f32(frame.samples) / f32(count);
    let first = shutter.span.x + (0.5 + times.shift) * step + times.delay;
    return SampleTimes(count, first, step, times.shift, times.delay);
}

/// Time of sample `i` of times.count [frame intervals].
fn shutter_time(times: SampleTimes, i: u32) -> f32 {
    if BOX_SHUTTER { return times.first + f32(i) * times.step; }
    if ADAPTIVE { return time_at_share((f32(i) + 0.5 + times.shift) / f32(times.count)) + times.delay; }
    return time_in_stratum(strata[i], times.shift) + times.delay;
}

/// When sample `i` begins and ends to stand for the exposure, without the delay [frame intervals].
fn sample_span(times: SampleTimes, i: u32) -> vec2f {
    let shares = vec2f(f32(i), f32(i) + 1.0) / f32(times.count);
    if BOX_SHUTTER { return mix(vec2f(shutter.span.x), vec2f(shutter.span.y), shares); }
    if ADAPTIVE { return vec2f(time_at_share(shares.x), time_at_share(shares.y)); }
    return vec2f(strata[i].begin, strata[i].end);
}

/// The time at which the share `u`, 0..1, of the exposure has passed [frame intervals].
fn time_at_share(u: f32) -> f32 {
    let x = u * f32(arrayLength(&strata));
    let i = min(u32(x), arrayLength(&strata) - 1u);
    return time_in_stratum(strata[i], x - f32(i) - 0.5);
}

/// Time at `shift`, -0.5..0.5, from the middle of a stratum [frame intervals].
fn time_in_stratum(stratum: Stratum, shift: f32) -> f32 {
    let side = select(stratum.end - stratum.middle, stratum.middle - stratum.begin, shift < 0.0);
    return stratum.middle + 2.0 * shift * side;
}
