// Lists of tiles: those in which light may change; those in which it does, those near them, of these the others, and all.
//#include common/frame.wgsl
//#include methods/gather/shading/active.wgsl

@group(1) @binding(0) var<storage, read_write> found: FoundTiles;
@group(1) @binding(1) var<storage, read_write> changing: TileList;  // all lists are 0 at first
@group(1) @binding(2) var<storage, read_write> near: TileList;
@group(1) @binding(3) var<storage, read_write> whole: TileList;
@group(1) @binding(4) var<storage, read_write> doubtful: TileList;
@group(1) @binding(5) var<storage, read_write> beside: TileList;

/// After `screen`: an invocation is a tile. Tiles beside one in which light may change are read with it.
@compute @workgroup_size(WG_X, WG_Y)
fn list_doubtful(@builtin(global_invocation_id) id: vec3u) {
    let tiles = light_tiles();
    if any(id.xy >= tiles) { return; }
    let tile = id.y * tiles.x + id.x;
    whole.tiles[tile] = tile;
    if tiles_to(vec2i(id.xy), MAY_CHANGE, 1) <= 1 { doubtful.tiles[atomicAdd(&doubtful.count, 1u)] = tile; }
}

@compute @workgroup_size(1)
fn size_doubtful() {
    let tiles = light_tiles();
    let count = atomicLoad(&doubtful.count);
    doubtful.groups = groups_for(TILE_GROUPS * count);
    let all_tiles = select(0u, tiles.x * tiles.y, count > 0u);
    atomicStore(&whole.count, all_tiles);
    whole.groups = groups_for(TILE_GROUPS * all_tiles);
}

/// After `limit_ratio`: an invocation is a tile.
@compute @workgroup_size(WG_X, WG_Y)
fn main(@builtin(global_invocation_id) id: vec3u) {
    let tiles = light_tiles();
    if any(id.xy >= tiles) { return; }
    let distance = tiles_to(vec2i(id.xy), CHANGES, FAR_TILES - 1);
    let tile = id.y * tiles.x + id.x;
    atomicOr(&found.tiles[tile], u32(distance) << DISTANCE_BITS);
    if distance == 0 { changing.tiles[atomicAdd(&changing.count, 1u)] = tile; }
    if distance > 0 && distance <= NEAR_TILES { beside.tiles[atomicAdd(&beside.count, 1u)] = tile; }
    if distance <= NEAR_TILES {
        atomicOr(&found.tiles[tile], NEAR);
        near.tiles[atomicAdd(&near.count, 1u)] = tile;
    }
}

/// After all tiles: workgroups for the lists.
@compute @workgroup_size(1)
fn size_lists() {
    let tiles = light_tiles();
    atomicStore(&whole.count, select(0u, tiles.x * tiles.y, atomicLoad(&changing.count) > 0u));
    changing.groups = groups_for(TILE_GROUPS * atomicLoad(&changing.count));
    near.halved = groups_for(atomicLoad(&near.count));
    near.groups = groups_for(TILE_GROUPS * atomicLoad(&near.count));
    beside.groups = groups_for(TILE_GROUPS * atomicLoad(&beside.count));
    whole.groups = groups_for(TILE_GROUPS * atomicLoad(&whole.count));
}

fn groups_for(wanted: u32) -> vec3u {
    return vec3u(min(wanted, LIGHT_GROUPS_PER_ROW), (wanted + LIGHT_GROUPS_PER_ROW - 1u) / LIGHT_GROUPS_PER_ROW, 1u);
}

/// Tiles across and down.
fn light_tiles() -> vec2u {
    return (frame.size + LIGHT_TILE - 1u) / LIGHT_TILE;
}

/// From a tile to the nearest one of which this is known; more than `reach`: there is none so close.
fn tiles_to(tile: vec2i, known: u32, reach: i32) -> i32 {
    let count = vec2i(light_tiles());
    var distance = reach + 1;
    for (var y = -reach; y <= reach; y++) {
        for (var x = -reach; x <= reach; x++) {
            let at = tile + vec2i(x, y);
            let is_there = all(at >= vec2i(0)) && all(at < count);
            let word = atomicLoad(&found.tiles[select(0, at.y * count.x + at.x, is_there)]);
            distance = select(distance, min(distance, max(abs(x), abs(y))), is_there && (word & known) != 0u);
        }
    }
    return distance;
}
