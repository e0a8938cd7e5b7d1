// Active tiles: those in which something moves, or into which something may move. Layers are separated in them and
// beside them; static tiles stay as they are. The result is a worklist of cells for every later pass.
//#include common/frame.wgsl
//#include common/shutter.wgsl
//#include methods/gather/motion.wgsl
//#include methods/gather/worklist.wgsl
//#include methods/gather/surface.wgsl

struct SourceFrame {
    offset: f32,        // [frame intervals]
    words: u32,         // of one section of `lists`
}

@group(1) @binding(0) var<uniform> source: SourceFrame;
@group(1) @binding(1) var motion: texture_2d<f32>;      // stored as given: of that frame: to_prev, to_next [px]
@group(1) @binding(2) var<storage, read_write> lists: array<atomic<u32>>;   // SECTIONS, all 0 at first

// The sections of `lists`. These are WorkLists:
const ACTIVE: u32 = 0u;         // cells with active tiles
const STATIC: u32 = 1u;         // all others
const SEPARATED: u32 = 2u;      // cells with active tiles and those with tiles beside these
const MOTION_ONLY: u32 = 3u;    // all others
const FLAGGED: u32 = 4u;        // the separated ones and those with tiles beside them
// These are tables:
const TILE_FLAGS: u32 = 5u;     // of every tile: 1 if it is active
const DISTANCES: u32 = 6u;      // of every cell: tiles to the nearest active one, MARGIN + 1 if that is farther than MARGIN
const SECTIONS: u32 = 7u;

override AT_EDGES: bool = false;    // only tiles that an edge of motion reaches are active

const EDGE: f32 = 4.0;          // px by which motion in a tile changes at an edge, from where it is by the ends of the exposure
const EDGE_RADIUS: i32 = 2;     // a silhouette takes the motions of pixels up to so far away [px]
const MARGIN: i32 = 2;          // tiles around a cell that are searched for active ones

/// Once per frame: all tiles that the motions of one tile lead to, and those beside it, become active.
@compute @workgroup_size(WG_X, WG_Y)
fn mark_active_tiles(@builtin(local_invocation_index) local: u32,
        @builtin(workgroup_id) group: vec3u, @builtin(num_workgroups) groups: vec3u) {
    let here = vec2i(swizzled_pixel(local, group, groups));
    let tiles = vec2i(tiles_of(frame.size));
    if any(here >= tiles) { return; }
    let corner = here * i32(TILE) - EDGE_RADIUS;
    let side = i32(TILE) + 2 * EDGE_RADIUS;
    let window = exposure_window(source.offset);
    var least = vec4f(MAX_MOTION);      // to_prev, to_next [px]
    var most = vec4f(-MAX_MOTION);
    var bend = vec2f(0.0);              // of half accelerations
    for (var i = 0; i < side * side; i++) {
        let px = inside(corner + vec2i(i % side, i / side));
        let vectors = clamp(textureLoad(motion, px, 0), vec4f(-MAX_MOTION), vec4f(MAX_MOTION));
        least = min(least, vectors);
        most = max(most, vectors);
        bend = max(bend, abs(0.5 * (vectors.xy + vectors.zw)));
    }
    bend = select(vec2f(0.0), MOST_BEND * bend, bend > vec2f(STATIC_EPSILON));
    let box = union_with_origin(displacement_box(least, most, window.x), displacement_box(least, most, window.y)) + vec4f(-bend, bend);
    // Those that sweep_overlaps() of the tile motions tells: between these two ends, not at them.
    let margin = 1.0 + f32(EDGE_RADIUS) / f32(TILE);
    let first = max(here + max(vec2i(floor(box.xy / f32(TILE) - margin)) + 1, vec2i(-MAX_TILE_RADIUS)), vec2i(0));
    let last = min(here + min(vec2i(ceil(box.zw / f32(TILE) + margin)) - 1, vec2i(MAX_TILE_RADIUS)), tiles - 1);
    let across = last.x - first.x + 1;
    // It may move and be back when the shutter opens and closes, so only pixels that cannot get away at all are static.
    // Both components together stay under STATIC_EPSILON.
    let u = max_abs_time(source.offset);
    let farthest = abs(union_with_origin(displacement_box(least, most, u), displacement_box(least, most, -u)));
    let is_static = all(farthest < vec4f(0.7 * STATIC_EPSILON));
    let count = select(across * (last.y - first.y + 1), 0, is_static || (AT_EDGES && !has_edge(least, most, window)));
    for (var i = 0; i < count; i++) {
        atomicStore(&lists[tile_flag_at(first + vec2i(i % across, i / across))], 1u);
    }
}

/// True if displacements by either end of the exposure differ much, of all motions between two.
fn has_edge(least: vec4f, most: vec4f, window: vec2f) -> bool {
    let opening = displacement_box(least, most, window.x);
    let closing = displacement_box(least, most, window.y);
    return any(max(opening.zw - opening.xy, closing.zw - closing.xy) > vec2f(EDGE));
}

/// After all frames: how far every cell is from the nearest active tile [tiles].
@compute @workgroup_size(WG_X, WG_Y)
fn find_distances(@builtin(global_invocation_id) id: vec3u) {
    if any(id.xy >= cells_of(frame.size)) { return; }
    let corner = vec2i(id.xy * vec2u(CELL_TILES, 1u));
    let across = i32(CELL_TILES) + 2 * MARGIN;
    var nearest = MARGIN + 1;
    for (var i = 0; i < across * (2 * MARGIN + 1); i++) {
        let off = vec2i(i % across, i / across) - MARGIN;
        let tile = clamp(corner + off, vec2i(0), vec2i(tiles_of(frame.size)) - 1);
        let away = abs(tile - clamp(tile, corner, corner + vec2i(i32(CELL_TILES) - 1, 0)));
        if atomicLoad(&lists[tile_flag_at(tile)]) != 0u { nearest = min(nearest, max(away.x, away.y)); }
    }
    atomicStore(&lists[distance_at(id.xy)], u32(nearest));
}

/// Last: add the cells of one row to the worklists, in one piece each, so that passes go along rows.
@compute @workgroup_size(WG_X, WG_Y)
fn build_worklists(@builtin(local_invocation_index) local: u32, @builtin(workgroup_id) group: vec3u) {
    let place = group.x * WG_X * WG_Y + local;
    let cells = cells_of(frame.size);
    // Nothing returns before these loops: see wgsl.md.
    let width = select(0u, cells.x, place < cells.y);
    let row = interleaved_row(min(place, cells.y - 1u), cells.y);
    var active_count = 0u;
    var separated_count = 0u;
    var flagged_count = 0u;
    for (var x = 0u; x < width; x++) {
        let nearest = atomicLoad(&lists[distance_at(vec2u(x, row))]);
        active_count += u32(nearest == 0u);
        separated_count += u32(nearest <= 1u);
        flagged_count += u32(nearest <= 2u);
    }
    var active_at = reserve(ACTIVE, active_count);
    var static_at = reserve(STATIC, width - active_count);
    var separated_at = reserve(SEPARATED, separated_count);
    var motion_only_at = reserve(MOTION_ONLY, width - separated_count);
    var flagged_at = reserve(FLAGGED, flagged_count);
    for (var x = 0u; x < width; x++) {
        let cell = vec2u(x, row);
        let nearest = atomicLoad(&lists[distance_at(cell)]);
        let is_active = nearest == 0u;
        let is_separated = nearest <= 1u;
        atomicStore(&lists[select(static_at, active_at, is_active)], pack_cell(cell));
        atomicStore(&lists[select(motion_only_at, separated_at, is_separated)], pack_cell(cell));
        if nearest <= 2u { atomicStore(&lists[flagged_at], pack_cell(cell)); }
        active_at += u32(is_active);
        static_at += u32(!is_active);
        separated_at += u32(is_separated);
        motion_only_at += u32(!is_separated);
        flagged_at += u32(nearest <= 2u);
    }
}

/// Index in `lists` at which the next `count` cells of a worklist go; it is made so much longer.
fn reserve(section: u32, count: u32) -> u32 {
    let at = section * source.words;
    let first = atomicAdd(&lists[at + COUNT_WORD], count);
    let total = first + count;
    atomicMax(&lists[at], min(total, GROUPS_PER_ROW));
    atomicMax(&lists[at + 1u], TILE / STRIP_HEIGHT);
    atomicMax(&lists[at + 2u], (total + GROUPS_PER_ROW - 1u) / GROUPS_PER_ROW);
    return at + CELLS_WORD + first;
}

/// Box (least, greatest) of the displacements by the time `u` of all motions between two [px].
fn displacement_box(least: vec4f, most: vec4f, u: f32) -> vec4f {
    let prev = 0.5 * u * (u - 1.0);     // displacement = prev * to_prev + next * to_next, as of trajectory_from()
    let next = 0.5 * u * (u + 1.0);
    let a = prev * least.xy;
    let b = prev * most.xy;
    let c = next * least.zw;
    let d = next * most.zw;
    return vec4f(min(a, b) + min(c, d), max(a, b) + max(c, d));
}

/// The box around two boxes and 0.
fn union_with_origin(a: vec4f, b: vec4f) -> vec4f {
    return vec4f(min(min(a.xy, b.xy), vec2f(0.0)), max(max(a.zw, b.zw), vec2f(0.0)));
}

fn tile_flag_at(tile: vec2i) -> u32 {
    return TILE_FLAGS * source.words + u32(tile.y) * tiles_of(frame.size).x + u32(tile.x);
}

fn distance_at(cell: vec2u) -> u32 {
    return DISTANCES * source.words + cell.y * cells_of(frame.size).x + cell.x;
}
