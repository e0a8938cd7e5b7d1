// The part of a picture that is worked on by one submission. Without a GPU a whole one could take so long that the
// driver gives up.
//#include common/frame.wgsl

struct Band {
    first: u32,         // row of workgroups, in the order of swizzled_pixel()
    rows: u32,          // of workgroups that the whole picture has
    unused: vec2u,
}

@group(1) @binding(15) var<uniform> band: Band;

/// The pixel of an invocation, swizzled over the whole picture.
fn banded_pixel(local: u32, group: vec3u) -> vec2u {
    return swizzled_pixel(local, vec3u(group.x, band.first + group.y, 0u), vec3u(0u, band.rows, 0u));
}
