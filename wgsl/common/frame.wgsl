// What every pass is told about the frame it works on.
// Group 0 is given to every pass; group 1 is a pass's own.

struct Frame {
    size: vec2u,        // image size [px]
    index: u32,         // frame number, varies the jitter
    samples: u32,       // taps, or time samples, per pixel
    jitter: f32,        // 0: the middle of every stratum, 1: anywhere in it
    max_blur: f32,      // longest streak [px per exposure]
}

@group(0) @binding(0) var<uniform> frame: Frame;

alias Output = texture_storage_2d<rgba32float, write>;   // the one place that names the format

// Workgroup [px]; rows of 32 are a fifth faster than 8 x 8 on lavapipe and a warp on a GPU.
const WG_X: u32 = 32u;
const WG_Y: u32 = 2u;
const STRANDS: u32 = 16u;

/// The pixel of an invocation, where pixels differ in cost. Software drivers give every core one stretch of
/// the workgroups; this order spreads each such stretch over the whole picture. They work on eight pixels at
/// once, as long as the dearest takes; these are blocks of 4 x 2, which meet fewer edges than rows.
fn spread(local: u32, group: vec3u, groups: vec3u) -> vec2u {
    return vec2u(group.x * WG_X + local / 8u * 4u + local % 4u, strand(group.y, groups.y) * WG_Y + local / 4u % 2u);
}

/// The row that comes at a place in such an order of rows.
fn strand(place: u32, rows: u32) -> u32 {
    let length = rows / STRANDS;                // of most strands; the first few have one more
    let rest = place - min(rows % STRANDS * (length + 1u), place);
    if place < rows % STRANDS * (length + 1u) {
        return place % (length + 1u) * STRANDS + place / (length + 1u);
    }
    return rest % length * STRANDS + rows % STRANDS + rest / length;
}
