// What a tile of a frame may show over the exposure: the few motions that stand for all in it.
//#include common/frame.wgsl
//#include common/path.wgsl

const TILE: u32 = 16u;          // side [px]
const PATHS: u32 = 4u;          // motions kept a tile
const LAYERS: u32 = 8u;         // of the texture that holds them: about, depths, from when, till when, then the paths

const NONE: f32 = 3e38;         // depth of nothing
const STILL: f32 = 0.01;        // what is displaced by less than this [px] needs no search
const HALF_MAX: f32 = 65504.0;  // largest finite f16

// `about`: how many paths there are, fewer where the rest is like these or like standing still; 1 if
// there are silhouettes; the longest displacement [px].

fn tiles_of(size: vec2u) -> vec2u {
    return (size + TILE - 1u) / TILE;
}

/// A place of a surface: all that the search needs in one texel, rgba32uint. Velocity, curvature in
/// half floats, depth; a depth under 0 is that of a pixel at a silhouette; in a far layer, 0 says that
/// there is none. The last bit of the depth says whether the pixel is calm.
fn packed(path: Path, depth: f32, calm: bool) -> vec4u {
    let curvature = clamp(path.curvature, vec2f(-HALF_MAX), vec2f(HALF_MAX));
    let bits = (bitcast<u32>(depth) & ~1u) | u32(calm);
    return vec4u(bitcast<vec2u>(path.velocity), pack2x16float(curvature), bits);
}

fn path_in(texel: vec4u) -> Path {
    return Path(bitcast<vec2f>(texel.xy), unpack2x16float(texel.z));
}

fn depth_in(texel: vec4u) -> f32 {
    return bitcast<f32>(texel.w & ~1u);
}

fn is_calm(texel: vec4u) -> bool {
    return (texel.w & 1u) == 1u;
}

/// Parts of the picture that a pass is for: cells, tiles side by side. Workgroups are strips of them, the
/// same one of all cells after the other: so they go along rows, which caches like.
struct Listed {
    groups: vec3u,      // of workgroups, to dispatch it indirectly
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

/// The pixel of an invocation of a strip: eight at once are blocks of 4 x 2, see spread().
fn pixel_in(word: u32, group: vec3u, local: u32) -> vec2u {
    let across = CELL * TILE;
    let row = local / (2u * across);
    let off = vec2u(local / 8u * 4u % across + local % 4u, row * 2u + local / 4u % 2u);
    return cell_in(word) * vec2u(across, TILE) + vec2u(0u, group.y * STRIP) + off;
}

/// Where in a list, or in parts of its cells, an invocation of a pass over the picture stands: the work is
/// in the first ones.
fn place_in_list(local: u32, group: vec3u, groups: vec3u) -> u32 {
    return (strand(group.y, groups.y) * groups.x + group.x) * WG_X * WG_Y + local;
}
