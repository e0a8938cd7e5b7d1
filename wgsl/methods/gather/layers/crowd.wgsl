// The silhouettes around a tile, by the counts of its edges. In a crowd of surfaces, as in grass, there is
// no foreground and no background: silhouettes stay as they are there. Where vectors are not filtered, colours alone tell
// coverage, and wrongly where surfaces are small: silhouettes whose surfaces hardly move apart stay as they are there too.
//#include common/frame.wgsl
//#include methods/gather/surface.wgsl
//#include methods/gather/layers/edge_flags.wgsl

@group(1) @binding(20) var<storage, read_write> crowds: array<atomic<u32>>; // KINDS words per tile, a kind after the other

const THIRD_SURFACE: u32 = 0u;  // pixels that show three surfaces or more
const FAST_EDGE: u32 = 1u;      // edge pixels whose motions differ by more than FAST,
const MIXED_EDGE: u32 = 2u;     // and of them, those beside which motions are mixed
const AROUND_TILE: u32 = 3u;    // the result: CROWD, UNFILTERED
const KINDS: u32 = 4u;

const CROWD: u32 = 1u;          // more than CROWD_SHARE of the pixels around show three surfaces
const UNFILTERED: u32 = 2u;     // less than FILTERED_SHARE of the fast edges around are mixed
const CROWD_SHARE: f32 = 0.2;
const FILTERED_SHARE: f32 = 0.3;
const CROWD_TILES: u32 = 3u;    // to every side: how far around a tile is looked

/// Count a pixel.
fn count_edge(px: vec2i, kind: u32) {
    atomicAdd(&crowds[word_of(vec2u(px) / TILE, kind)], 1u);
}

/// Classify the surroundings of a tile, once all pixels are counted.
fn look_around(tile: vec2u) {
    let low = tile - min(tile, vec2u(CROWD_TILES));
    let high = min(tile + CROWD_TILES + 1u, tiles_of(frame.size));
    var counts = vec3u(0u);
    for (var y = low.y; y < high.y; y++) {
        for (var x = low.x; x < high.x; x++) {
            for (var kind = 0u; kind < AROUND_TILE; kind++) { counts[kind] += atomicLoad(&crowds[word_of(vec2u(x, y), kind)]); }
        }
    }
    let extent = min(high * TILE, frame.size) - low * TILE;
    let is_crowd = f32(counts[THIRD_SURFACE]) > CROWD_SHARE * f32(extent.x * extent.y);
    let is_unfiltered = f32(counts[MIXED_EDGE]) < FILTERED_SHARE * f32(counts[FAST_EDGE]);
    atomicStore(&crowds[word_of(tile, AROUND_TILE)], select(0u, CROWD, is_crowd) | select(0u, UNFILTERED, is_unfiltered));
}

/// The class of the tile of a pixel.
fn around_tile(px: vec2i) -> u32 {
    return atomicLoad(&crowds[word_of(vec2u(px) / TILE, AROUND_TILE)]);
}

/// True if vectors around the tile of a pixel are not filtered.
fn is_unfiltered(px: vec2i) -> bool {
    return (around_tile(px) & UNFILTERED) != 0u;
}

/// True if a pixel of these flags, in whose tile this is known, is at an edge that is seen while the shutter is open.
fn is_visible_edge(flags: u32, around: u32) -> bool {
    return is_edge(flags) && ((flags & SLOW) == 0u || (around & UNFILTERED) == 0u);
}

/// True if it is separated into layers.
fn is_separated(flags: u32, around: u32) -> bool {
    return is_visible_edge(flags, around) && (around & CROWD) == 0u;
}

fn word_of(tile: vec2u, kind: u32) -> u32 {
    let tiles = tiles_of(frame.size);
    return (kind * tiles.y + tile.y) * tiles.x + tile.x;
}
