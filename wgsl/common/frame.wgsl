// Facts about the frame that every pass reads, and the order in which invocations take its pixels.
// Group 0 is bound for every pass; group 1 is a pass's own.

struct Frame {
    size: vec2u,        // image size [px]
    index: u32,         // frame number, varies the jitter
    samples: u32,       // taps, or time samples, per pixel
    jitter: f32,        // 0: the middle of every stratum, 1: anywhere in it
    max_blur: f32,      // greatest blur length [px per exposure]
    origin: vec2i,      // of this image in the display window: the whole image, of which it may hold a part [px]
    display: vec2u,     // size of the display window [px]
}

@group(0) @binding(0) var<uniform> frame: Frame;

alias Output = texture_storage_2d<rgba32float, write>;   // the one place that names the format

// Workgroup [px]. Rows of 32 are a warp on a GPU, and a fifth faster than 8 x 8 on lavapipe.
const WG_X: u32 = 32u;
const WG_Y: u32 = 2u;
const INTERLEAVE: u32 = 16u;    // rows of workgroups from one to the next of a swizzled dispatch

/// A pixel, or outside of the image the nearest one inside.
fn inside(px: vec2i) -> vec2i {
    return clamp(px, vec2i(0), vec2i(frame.size) - 1);
}

/// The pixel of an invocation, swizzled, for passes whose pixels differ in cost. A software driver gives every
/// core one stretch of the workgroups: interleaved rows spread each stretch over the image. It works on
/// eight invocations at once, as long as the slowest takes: these are blocks of 4 x 2 pixels, which cross fewer
/// edges than rows of eight.
fn swizzled_pixel(local: u32, group: vec3u, groups: vec3u) -> vec2u {
    return vec2u(group.x * WG_X + local / 8u * 4u + local % 4u,
                 interleaved_row(group.y, groups.y) * WG_Y + local / 4u % 2u);
}

/// The row at `place` of the order 0, INTERLEAVE, 2 INTERLEAVE, ..., 1, INTERLEAVE + 1, ... of all rows.
fn interleaved_row(place: u32, rows: u32) -> u32 {
    let length = rows / INTERLEAVE;             // of most runs; the first few have one row more
    let rest = place - min(rows % INTERLEAVE * (length + 1u), place);
    if place < rows % INTERLEAVE * (length + 1u) {
        return place % (length + 1u) * INTERLEAVE + place / (length + 1u);
    }
    return rest % length * INTERLEAVE + rows % INTERLEAVE + rest / length;
}
