// What a tile of a frame may show over the exposure: the few motions that stand for all in it.

const TILE: u32 = 32u;          // side [px]
const PATHS: u32 = 4u;          // motions kept a tile
const LAYERS: u32 = 5u;         // of the texture that holds them: what is below, then the paths

struct Tile {
    paths: array<vec4f, 4>,     // velocity, curvature: the longest, then always the most different
    box: vec4f,                 // least, greatest displacement of any while the frame is shown [px]
    about: vec4f,               // see below
}

// `about`: how many paths there are, fewer where the rest is like these or like standing still; the
// least depth; 1 if there are pixels that show two surfaces; the longest displacement [px].

fn tiles_of(size: vec2u) -> vec2u {
    return (size + TILE - 1u) / TILE;
}
