// Passes over a list of tiles. Elsewhere their textures are 0.
//#include methods/gather/shading/active.wgsl

@group(1) @binding(20) var<storage, read> listed: array<u32>;   // see active.wgsl

/// The pixel of an invocation; outside of the image where there is none.
fn listed_pixel(group: vec3u, local: u32) -> vec2u {
    return listed_part(group, local, 1u);
}

/// The same in an image of half the size; outside of the whole one where there is none.
fn listed_half(group: vec3u, local: u32) -> vec2u {
    return listed_part(group, local, 2u);
}

fn listed_part(group: vec3u, local: u32, divisor: u32) -> vec2u {
    let groups = select(1u, TILE_GROUPS, divisor == 1u);
    let k = (group.y * LIGHT_GROUPS_PER_ROW + group.x) / groups;
    let tile = listed[FIRST_LISTED + min(k, listed[LISTED] - 1u)];
    let across = (frame.size.x + LIGHT_TILE - 1u) / LIGHT_TILE;
    let n = group.x % groups * (WG_X * WG_Y) + local;
    let side = LIGHT_TILE / divisor;
    let px = side * vec2u(tile % across, tile / across) + vec2u(n % side, n / side);
    return select(frame.size, px, k < listed[LISTED] && n < side * side);
}
