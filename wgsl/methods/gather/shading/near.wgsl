// Tiles near those in which light changes, and lists of both.
//#include common/frame.wgsl
//#include methods/gather/shading/active.wgsl

@group(1) @binding(0) var<storage, read_write> found: Found;
@group(1) @binding(1) var<storage, read_write> changing: TileList;  // in which it changes; all 0 at first
@group(1) @binding(2) var<storage, read_write> close: TileList;     // near them

struct Found {
    any: u32,           // see gain.wgsl
    tiles: array<atomic<u32>>,
}

struct TileList {       // see active.wgsl
    groups: vec3u,
    count: atomic<u32>,
    tiles: array<u32>,
}

/// An invocation is a tile.
@compute @workgroup_size(WG_X, WG_Y)
fn main(@builtin(global_invocation_id) id: vec3u) {
    let tiles = (frame.size + LIGHT_TILE - 1u) / LIGHT_TILE;
    if any(id.xy >= tiles) { return; }
    let low = id.xy - min(id.xy, vec2u(NEAR_TILES));
    let high = min(id.xy + NEAR_TILES + 1u, tiles);
    var around = 0u;
    for (var y = low.y; y < high.y; y++) {
        for (var x = low.x; x < high.x; x++) { around |= atomicLoad(&found.tiles[y * tiles.x + x]); }
    }
    let tile = id.y * tiles.x + id.x;
    if (atomicLoad(&found.tiles[tile]) & CHANGES) != 0u { changing.tiles[atomicAdd(&changing.count, 1u)] = tile; }
    if (around & CHANGES) != 0u {
        atomicOr(&found.tiles[tile], NEAR);
        close.tiles[atomicAdd(&close.count, 1u)] = tile;
    }
}

/// After all tiles: workgroups for both lists.
@compute @workgroup_size(1)
fn size_lists() {
    changing.groups = groups_for(atomicLoad(&changing.count));
    close.groups = groups_for(atomicLoad(&close.count));
}

fn groups_for(tiles: u32) -> vec3u {
    let wanted = tiles * TILE_GROUPS;
    return vec3u(min(wanted, GROUPS_PER_ROW), (wanted + GROUPS_PER_ROW - 1u) / GROUPS_PER_ROW, 1u);
}
