// Which tiles need work: those that something moves in or may move to. Silhouettes are parted in them
// and beside them; all other tiles stay as they are.
//#include common/frame.wgsl
//#include common/shutter.wgsl
//#include blur/gather_moving.wgsl
//#include blur/gather_listed.wgsl
//#include blur/gather_tile.wgsl

struct Survey {
    offset: f32,        // of the frame [frame intervals]
    words: u32,         // of one list
}

@group(1) @binding(0) var<uniform> source: Survey;
@group(1) @binding(1) var motion: texture_2d<f32>;      // of that frame: to_prev, to_next [px]
@group(1) @binding(2) var<storage, read_write> lists: array<atomic<u32>>;   // all 0 at first, each a Listed

// The lists, one after the other.
const MOVING: u32 = 0u;         // cells with tiles that are live
const RESTING: u32 = 1u;        // all others
const PARTED: u32 = 2u;         // those with live tiles and those with tiles beside these
const WHOLE: u32 = 3u;          // all others
const MARKED: u32 = 4u;         // the parted ones and those with tiles beside them
const LIVE: u32 = 5u;           // no list: 1 for every tile that is live
const NEAR: u32 = 6u;           // no list: how many tiles away from every cell one is live
const LISTS: u32 = 7u;

const HELPED: i32 = 2;          // pixels whose motions silhouettes may take, to every side of theirs
const BESIDE: i32 = 2;          // tiles, see MARKED

/// All tiles that the motions of one tile lead to in one frame, and those beside: they are live.
@compute @workgroup_size(WG_X, WG_Y)
fn survey(@builtin(local_invocation_index) local: u32,
        @builtin(workgroup_id) group: vec3u, @builtin(num_workgroups) groups: vec3u) {
    let here = vec2i(swizzled_pixel(local, group, groups));
    let tiles = vec2i(tiles_of(frame.size));
    if any(here >= tiles) { return; }
    let corner = here * i32(TILE) - HELPED;
    let side = i32(TILE) + 2 * HELPED;
    let span = exposure_window(source.offset);
    var least = vec4f(WILD);        // to_prev, to_next [px]
    var most = vec4f(-WILD);
    for (var i = 0; i < side * side; i++) {
        let px = clamp(corner + vec2i(i % side, i / side), vec2i(0), vec2i(frame.size) - 1);
        let way = clamp(textureLoad(motion, px, 0), vec4f(-WILD), vec4f(WILD));
        least = min(least, way);
        most = max(most, way);
    }
    let box = both(between(least, most, span.x), between(least, most, span.y));
    let margin = 1.0 + 2.0 / f32(TILE);     // as in `meets` of gather_tiles.wgsl
    let first = max(here + max(vec2i(floor(box.xy / f32(TILE) - margin)), vec2i(-FARTHEST)), vec2i(0));
    let last = min(here + min(vec2i(ceil(box.zw / f32(TILE) + margin)), vec2i(FARTHEST)), tiles - 1);
    let across = last.x - first.x + 1;
    // By the ends of the exposure it may be back. Both components together stay under STILL.
    let u = longest_time(source.offset);
    let is_still = all(abs(both(between(least, most, u), between(least, most, -u))) < vec4f(0.7 * STILL));
    let count = select(across * (last.y - first.y + 1), 0, is_still);
    for (var i = 0; i < count; i++) {
        atomicStore(&lists[live_at(first + vec2i(i % across, i / across))], 1u);
    }
}

/// How near something live is to a cell [tiles], when every frame was surveyed.
@compute @workgroup_size(WG_X, WG_Y)
fn near(@builtin(global_invocation_id) id: vec3u) {
    if any(id.xy >= cells_of(frame.size)) { return; }
    let corner = vec2i(id.xy * vec2u(CELL, 1u));
    let across = i32(CELL) + 2 * BESIDE;
    var nearest = BESIDE + 1;
    for (var i = 0; i < across * (2 * BESIDE + 1); i++) {
        let off = vec2i(i % across, i / across) - BESIDE;
        let tile = clamp(corner + off, vec2i(0), vec2i(tiles_of(frame.size)) - 1);
        let away = abs(tile - clamp(tile, corner, corner + vec2i(i32(CELL) - 1, 0)));
        if atomicLoad(&lists[live_at(tile)]) != 0u { nearest = min(nearest, max(away.x, away.y)); }
    }
    atomicStore(&lists[near_at(id.xy)], u32(nearest));
}

/// What one row of cells adds to the lists, in one piece: passes shall go along rows.
@compute @workgroup_size(WG_X, WG_Y)
fn list(@builtin(local_invocation_index) local: u32, @builtin(workgroup_id) group: vec3u) {
    let place = group.x * WG_X * WG_Y + local;
    let cells = cells_of(frame.size);
    // Nothing returns before these loops: where eight at once have returned, lavapipe goes on to 65,535 turns.
    let width = select(0u, cells.x, place < cells.y);
    let row = interleaved_row(min(place, cells.y - 1u), cells.y);
    var within = vec2u(0u);         // how many are live, parted, marked
    var marks = 0u;
    for (var x = 0u; x < width; x++) {
        let nearest = atomicLoad(&lists[near_at(vec2u(x, row))]);
        within += vec2u(vec2<bool>(nearest == 0u, nearest <= 1u));
        marks += u32(nearest <= 2u);
    }
    var moving = reserved(MOVING, within.x);
    var resting = reserved(RESTING, width - within.x);
    var parted = reserved(PARTED, within.y);
    var whole = reserved(WHOLE, width - within.y);
    var marked = reserved(MARKED, marks);
    for (var x = 0u; x < width; x++) {
        let cell = vec2u(x, row);
        let nearest = atomicLoad(&lists[near_at(cell)]);
        let is_moving = nearest == 0u;
        let is_parted = nearest <= 1u;
        atomicStore(&lists[select(resting, moving, is_moving)], listed_as(cell));
        atomicStore(&lists[select(whole, parted, is_parted)], listed_as(cell));
        if nearest <= 2u { atomicStore(&lists[marked], listed_as(cell)); }
        moving += u32(is_moving);
        resting += u32(!is_moving);
        parted += u32(is_parted);
        whole += u32(!is_parted);
        marked += u32(nearest <= 2u);
    }
}

/// Where the next `count` cells of a list go.
fn reserved(list: u32, count: u32) -> u32 {
    let at = list * source.words;
    let first = atomicAdd(&lists[at + COUNT], count);
    let most = first + count;
    atomicMax(&lists[at], min(most, IN_A_ROW));
    atomicMax(&lists[at + 1u], TILE / STRIP);
    atomicMax(&lists[at + 2u], (most + IN_A_ROW - 1u) / IN_A_ROW);
    return at + CELLS + first;
}

/// Least and greatest displacement by the time `u` of motions that lie between two.
fn between(least: vec4f, most: vec4f, u: f32) -> vec4f {
    let prev = 0.5 * u * (u - 1.0);     // what the ways to the previous and to the next frame count for
    let next = 0.5 * u * (u + 1.0);
    let a = prev * least.xy;
    let b = prev * most.xy;
    let c = next * least.zw;
    let d = next * most.zw;
    return vec4f(min(a, b) + min(c, d), max(a, b) + max(c, d));
}

fn both(a: vec4f, b: vec4f) -> vec4f {
    return vec4f(min(min(a.xy, b.xy), vec2f(0.0)), max(max(a.zw, b.zw), vec2f(0.0)));
}

fn live_at(tile: vec2i) -> u32 {
    return LIVE * source.words + u32(tile.y) * tiles_of(frame.size).x + u32(tile.x);
}

fn near_at(cell: vec2u) -> u32 {
    return NEAR * source.words + cell.y * cells_of(frame.size).x + cell.x;
}
