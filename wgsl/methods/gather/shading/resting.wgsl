// Where light rests.
//#include methods/gather/shading/active.wgsl

@group(1) @binding(21) var<storage, read> found: array<u32>;    // one word, then those of tiles: see active.wgsl

/// True near changes of light. The outputs of flow and of its means are known there, and in the tiles beside these.
fn is_near(px: vec2u) -> bool {
    return (found[1u + light_tile(px)] & NEAR) != 0u;
}

/// True where textures of passes over tiles near changes are 0, and in all tiles beside it.
fn is_black_around(px: vec2u) -> bool {
    return (found[1u + light_tile(px)] >> DISTANCE_BITS) > u32(NEAR_TILES) + 1u;
}
