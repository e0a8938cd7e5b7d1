// Tiles of pixels in which light changes, or beside one in which it does.
//#include common/frame.wgsl

const LIGHT_TILE: u32 = 16u;    // side [px]

fn light_tile(px: vec2u) -> u32 {
    let across = (frame.size.x + LIGHT_TILE - 1u) / LIGHT_TILE;
    return px.y / LIGHT_TILE * across + px.x / LIGHT_TILE;
}
