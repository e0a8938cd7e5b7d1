// Worklists: the cells that a pass has work in, so that it is dispatched indirectly over these alone. A cell is
// CELL_TILES tiles side by side. A workgroup takes one strip of a cell, and the same strips of all cells follow one
// another: so passes go along rows of pixels, which suits caches.
//#include common/frame.wgsl
//#include methods/gather/surface.wgsl

struct WorkList {
    groups: vec3u,      // workgroups of a pass over it
    count: u32,
    cells: array<u32>,  // see pack_cell()
}

const CELL_TILES: u32 = 2u;
const BLOCK: u32 = 4u;                  // side of a block of pixels, which some passes take in place of cells [px]
const STRIP_HEIGHT: u32 = 2u;           // [px]
const GROUPS_PER_ROW: u32 = 32768u;     // of a dispatch; devices take 65,535
// Offsets within a WorkList [words].
const COUNT_WORD: u32 = 3u;
const CELLS_WORD: u32 = 4u;

/// Cells across and down an image.
fn cells_of(size: vec2u) -> vec2u {
    return (size + vec2u(CELL_TILES * TILE, TILE) - 1u) / vec2u(CELL_TILES * TILE, TILE);
}

fn pack_cell(cell: vec2u) -> u32 {
    return cell.x | (cell.y << 16u);
}

fn unpack_cell(word: u32) -> vec2u {
    return vec2u(word & 0xffffu, word >> 16u);
}

/// Index of the cell of a workgroup, in passes of one workgroup per strip.
fn worklist_index(group: vec3u) -> u32 {
    return group.z * GROUPS_PER_ROW + group.x;
}

/// The pixel of an invocation in its strip of a cell; eight at once are blocks of 4 x 2, see swizzled_pixel().
fn pixel_in_strip(cell: u32, group: vec3u, local: u32) -> vec2u {
    let across = CELL_TILES * TILE;
    let row = local / (2u * across);
    let off = vec2u(local / 8u * 4u % across + local % 4u, row * 2u + local / 4u % 2u);
    return unpack_cell(cell) * vec2u(across, TILE) + vec2u(0u, group.y * STRIP_HEIGHT) + off;
}

/// Index of an invocation among all work, in passes that are dispatched over the whole image though the worklist is
/// shorter: the first ones have work.
fn work_index(local: u32, group: vec3u, groups: vec3u) -> u32 {
    return (interleaved_row(group.y, groups.y) * groups.x + group.x) * WG_X * WG_Y + local;
}
