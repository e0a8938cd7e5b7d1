// Crowds of surfaces, as in grass, where there is no foreground and no background: silhouettes stay as they are there.
// A tile is in a crowd if more than CROWD_SHARE of the pixels around it show three surfaces or more.
//#include common/frame.wgsl
//#include methods/gather/surface.wgsl

@group(1) @binding(20) var<storage, read_write> crowds: array<atomic<u32>>; // per tile, its pixels that show three surfaces; then 1 if it is in a crowd

const CROWD_SHARE: f32 = 0.2;
const CROWD_TILES: u32 = 3u;    // to every side: how far around a tile is looked

/// Count a pixel that shows three surfaces.
fn count_in_crowd(px: vec2i) {
    atomicAdd(&crowds[tile_index(vec2u(px) / TILE)], 1u);
}

/// Find out whether a tile is in a crowd, once all pixels are counted.
fn find_crowd(tile: vec2u) {
    let tiles = tiles_of(frame.size);
    let low = tile - min(tile, vec2u(CROWD_TILES));
    let high = min(tile + CROWD_TILES + 1u, tiles);
    var showing = 0u;
    for (var y = low.y; y < high.y; y++) {
        for (var x = low.x; x < high.x; x++) { showing += atomicLoad(&crowds[tile_index(vec2u(x, y))]); }
    }
    let extent = min(high * TILE, frame.size) - low * TILE;
    let is_crowd = f32(showing) > CROWD_SHARE * f32(extent.x * extent.y);
    atomicStore(&crowds[tiles.x * tiles.y + tile_index(tile)], select(0u, 1u, is_crowd));
}

fn is_in_crowd(px: vec2i) -> bool {
    let tiles = tiles_of(frame.size);
    return atomicLoad(&crowds[tiles.x * tiles.y + tile_index(vec2u(px) / TILE)]) != 0u;
}

fn tile_index(tile: vec2u) -> u32 {
    return tile.y * tiles_of(frame.size).x + tile.x;
}
