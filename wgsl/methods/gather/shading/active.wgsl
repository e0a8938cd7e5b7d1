// Tiles of pixels by changes of light in them: far from all changes, costly passes write nothing.
//#include common/frame.wgsl

const LIGHT_TILE: u32 = 16u;    // side [px of light]
override LIGHT_SCALE: u32 = 1u; // side of a pixel of light [px]; passes over light alone have 1

// Properties of a tile, bits of its word.
const MAY_CHANGE: u32 = 1u;     // light differs from frame to frame somewhere in it, if only by noise
const CHANGES: u32 = 2u;        // it changes in it, or beside it
const NEAR: u32 = 4u;           // it changes in a tile that is NEAR_TILES away at most
const DISTANCE_BITS: u32 = 8u;  // from this bit on: tiles to the nearest one in which it changes, FAR_TILES at most
const FAR_TILES: i32 = 8;
const NEAR_TILES: i32 = 1;     // flow and its means look less far than that

fn light_tile(px: vec2u) -> u32 {
    let side = LIGHT_TILE * LIGHT_SCALE;
    return px.y / side * ((frame.size.x + side - 1u) / side) + px.x / side;
}

struct FoundTiles {
    any: atomic<u32>,   // 1 if light changes anywhere
    tiles: array<atomic<u32>>,
}

// A list of tiles: workgroups of an indirect dispatch over their pixels, WG_X * WG_Y each; the number of tiles; workgroups of
// one over an image of half the size or less, one a tile; a word that is free; the tiles.
const TILE_GROUPS = LIGHT_TILE * LIGHT_TILE / (WG_X * WG_Y);   // of a tile
const LIGHT_GROUPS_PER_ROW: u32 = 32768u;     // of a dispatch; devices take 65,535
const LISTED: u32 = 3u;         // word of the number
const HALVED: u32 = 4u;         // first word of the workgroups for the smaller image
const FIRST_LISTED: u32 = 8u;

struct TileList {
    groups: vec3u,
    count: atomic<u32>,
    halved: vec3u,
    free: u32,
    tiles: array<u32>,
}
