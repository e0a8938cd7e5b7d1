// Lists of what a pass is for, so that it can be dispatched indirectly over that alone: cells, which are
// tiles side by side. Workgroups are strips of cells, the same strip of all cells after the other: so they
// go along rows, which caches like.
//#include common/frame.wgsl
//#include blur/gather_tile.wgsl

struct Listed {
    groups: vec3u,      // how many workgroups a pass over it takes
    count: u32,
    cells: array<u32>,  // see listed_as()
}

const CELL: u32 = 2u;           // tiles
const STRIP: u32 = 2u;          // height of a strip [px]
const IN_A_ROW: u32 = 32768u;   // cells; devices take 65,535 workgroups
// Where in it, in words.
const COUNT: u32 = 3u;
const CELLS: u32 = 4u;

fn cells_of(size: vec2u) -> vec2u {
    return (size + vec2u(CELL * TILE, TILE) - 1u) / vec2u(CELL * TILE, TILE);
}

fn listed_as(cell: vec2u) -> u32 {
    return cell.x | cell.y << 16u;
}

fn cell_in(word: u32) -> vec2u {
    return vec2u(word & 0xffffu, word >> 16u);
}

/// Where in the list the cell of a workgroup stands.
fn place_of(group: vec3u) -> u32 {
    return group.z * IN_A_ROW + group.x;
}

/// The pixel of an invocation of a strip: eight at once are blocks of 4 x 2, see swizzled_pixel().
fn pixel_in(word: u32, group: vec3u, local: u32) -> vec2u {
    let across = CELL * TILE;
    let row = local / (2u * across);
    let off = vec2u(local / 8u * 4u % across + local % 4u, row * 2u + local / 4u % 2u);
    return cell_in(word) * vec2u(across, TILE) + vec2u(0u, group.y * STRIP) + off;
}

/// Where in a list, or in parts of its cells, an invocation of a pass over the picture stands: the work is
/// in the first ones.
fn place_in_list(local: u32, group: vec3u, groups: vec3u) -> u32 {
    return (interleaved_row(group.y, groups.y) * groups.x + group.x) * WG_X * WG_Y + local;
}
