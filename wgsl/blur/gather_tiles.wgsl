// The motions of every tile, then of every tile that they reach while the shutter is open.
//#include common/frame.wgsl
//#include common/path.wgsl
//#include common/shutter.wgsl
//#include blur/gather_moving.wgsl
//#include blur/gather_listed.wgsl
//#include blur/gather_tile.wgsl

struct Source {
    offset: f32,        // of the frame [frame intervals]
    first: u32,         // where its layers begin in `reaching`
}

@group(1) @binding(0) var<uniform> source: Source;
@group(1) @binding(1) var near: texture_2d<u32>;        // see packed()
@group(1) @binding(2) var content: texture_2d_array<f32>;   // what `local` wrote
@group(1) @binding(3) var contents: Vectors;            // of every tile's own pixels, HELD layers
@group(1) @binding(4) var reaching: Vectors;            // of all that reaches it, LAYERS a frame
@group(1) @binding(5) var<storage, read_write> farthest: atomic<u32>;   // bits of the longest displacement of all
@group(1) @binding(6) var<storage, read> moving: Listed;    // cells, see gather_live.wgsl
@group(1) @binding(7) var<storage, read> resting: Listed;
@group(1) @binding(8) var wide_box: texture_2d<f32>;    // what `widen` wrote
@group(1) @binding(9) var wide_boxes: Boxes;            // around the boxes of WIDE x WIDE tiles

alias Vectors = texture_storage_2d_array<rgba32float, write>;
alias Boxes = texture_storage_2d<rgba32float, write>;

// Layers of `contents`, after the paths.
const BOX: u32 = 4u;            // least, greatest displacement of any while the frame is shown [px]
const DEPTHS: u32 = 5u;         // the least depth of what moves like each path
const ABOUT: u32 = 6u;          // see gather_tile.wgsl
const HELD: u32 = 7u;

const WIDE: i32 = 4;
const ALIKE: f32 = 0.5;         // displacements closer than this [px] stand for each other

/// The same to the most similar one of `chosen`; those not chosen yet are 0, which stands still.
fn unlike(path: vec4f, chosen: array<vec4f, 4>, u: f32) -> f32 {
    return min(min(apart(path, chosen[0], u), apart(path, chosen[1], u)),
               min(apart(path, chosen[2], u), apart(path, chosen[3], u)));
}

/// Which of `chosen` is most like `path`.
fn most_alike(path: vec4f, chosen: array<vec4f, 4>, u: f32) -> vec4<bool> {
    let d = vec4f(apart(path, chosen[0], u), apart(path, chosen[1], u),
                  apart(path, chosen[2], u), apart(path, chosen[3], u));
    let least = min(min(d.x, d.y), min(d.z, d.w));
    return d == vec4f(least);
}

@compute @workgroup_size(WG_X, WG_Y)
fn clear(@builtin(global_invocation_id) id: vec3u) {
    if all(id.xy == vec2u(0u)) { atomicStore(&farthest, 0u); }
}

/// The few motions of a tile's own pixels.
@compute @workgroup_size(WG_X, WG_Y)
fn local(@builtin(local_invocation_index) local: u32,
        @builtin(workgroup_id) group: vec3u, @builtin(num_workgroups) groups: vec3u) {
    let k = place_in_list(local, group, groups);
    let n = k / CELL;
    let moves = n < moving.count;
    let cell = cell_in(select(resting.cells[n - moving.count], moving.cells[n], moves));
    let id = cell * vec2u(CELL, 1u) + vec2u(k % CELL, 0u);
    if n >= moving.count + resting.count || id.x >= tiles_of(frame.size).x { return; }
    let corner = id * TILE;
    let end = min(corner + TILE, frame.size) - 1u;
    let pixels = select(0u, TILE * TILE, moves);        // some twice in tiles that are cut off
    let span = exposure_window(source.offset);
    let u = longest_time(source.offset);
    var paths = array<vec4f, 4>();      // the longest, then always the most different
    var box = vec4f(0.0);
    var count = 0.0;
    var longest = 0.0;
    var more = true;
    for (var k = 0u; k < PATHS && more; k++) {
        let chosen = paths;
        var most = 0.0;
        var found = vec4f(0.0);
        for (var i = 0u; i < pixels; i++) {
            let path = as_vec4(path_in(textureLoad(near, min(corner + vec2u(i % TILE, i / TILE), end), 0)));
            let least = unlike(path, chosen, u);
            if least > most && least < WILD * WILD {
                most = least;
                found = path;
            }
        }
        if k == 0u { longest = sqrt(most); }
        more = most > ALIKE * ALIKE;
        if more {
            count += 1.0;
            paths[k] = found;
            let a = displaced(found, span.x);
            let b = displaced(found, span.y);
            box = vec4f(min(box.xy, min(a, b)), max(box.zw, max(a, b)));
        }
    }
    var split = 0.0;
    var depths = vec4f(NONE);
    for (var i = 0u; i < pixels; i++) {
        let texel = textureLoad(near, min(corner + vec2u(i % TILE, i / TILE), end), 0);
        let z = abs(depth_in(texel));
        if depth_in(texel) < 0.0 { split = 1.0; }
        depths = min(depths, select(vec4f(NONE), vec4f(z), most_alike(as_vec4(path_in(texel)), paths, u)));
    }
    for (var k = 0u; k < PATHS; k++) { textureStore(contents, id, k, paths[k]); }
    textureStore(contents, id, BOX, box);
    textureStore(contents, id, DEPTHS, depths);
    textureStore(contents, id, ABOUT, vec4f(count, split, longest, 0.0));
    atomicMax(&farthest, bitcast<u32>(longest));
}

/// The boxes of many tiles as one, so that `reach` need not look at each.
@compute @workgroup_size(WG_X, WG_Y)
fn widen(@builtin(global_invocation_id) id: vec3u) {
    let first = vec2i(id.xy) * WIDE;
    let tiles = vec2i(tiles_of(frame.size));
    if any(first >= tiles) { return; }
    var box = vec4f(0.0);
    for (var i = 0; i < WIDE * WIDE; i++) {
        let one = textureLoad(content, min(first + vec2i(i % WIDE, i / WIDE), tiles - 1), BOX, 0);
        box = vec4f(min(box.xy, one.xy), max(box.zw, one.zw));
    }
    textureStore(wide_boxes, id.xy, box);
}

/// The few motions that lead to a tile, from wherever they come.
@compute @workgroup_size(WG_X, WG_Y)
fn reach(@builtin(local_invocation_index) local: u32,
        @builtin(workgroup_id) group: vec3u, @builtin(num_workgroups) groups: vec3u) {
    let k = place_in_list(local, group, groups);
    let tiles = tiles_of(frame.size);
    let id = cell_in(moving.cells[k / CELL]) * vec2u(CELL, 1u) + vec2u(k % CELL, 0u);
    if k / CELL >= moving.count || id.x >= tiles.x { return; }
    let span = exposure_window(source.offset);
    let u = longest_time(source.offset);
    let around = min(i32(ceil(bitcast<f32>(atomicLoad(&farthest)) / f32(TILE))) + 1, FARTHEST);
    let here = vec2i(id);
    let low = max(here - around, vec2i(0));
    let high = min(here + around, vec2i(tiles) - 1);
    let lowest = low / WIDE;
    let highest = high / WIDE;
    var first = here;       // of the tiles that may lead here
    var last = here;
    for (var wide = lowest; wide.y <= highest.y; wide = after(wide, lowest, highest)) {
        let box = textureLoad(wide_box, wide, 0);
        let side = f32((WIDE - 1) * i32(TILE));
        let off = vec2f((here - wide * WIDE) * i32(TILE));
        if meets(vec4f(box.xy, box.zw + side), off) {
            first = min(first, wide * WIDE);
            last = max(last, wide * WIDE + WIDE - 1);
        }
    }
    let least = max(first, low);
    let most = min(last, high);
    first = here;           // of those that do, and move
    last = here;
    var split = 0.0;
    var longest = 0.0;
    for (var tile = least; tile.y <= most.y; tile = after(tile, least, most)) {
        let there = other(tile, here);
        if there.leads {
            let about = textureLoad(content, there.at, ABOUT, 0);
            split = max(split, about.y);
            longest = max(longest, about.z);
            if there.count > 0u {
                first = min(first, tile);
                last = max(last, tile);
            }
        }
    }
    var chosen = array<vec4f, 4>();
    var chosen_count = 0u;
    var more = true;
    for (var k = 0u; k < PATHS && more; k++) {
        var best = 0.0;
        var found = vec4f(0.0);
        for (var tile = first; tile.y <= last.y; tile = after(tile, first, last)) {
            let there = other(tile, here);
            for (var n = 0u; n < there.count; n++) {
                let path = textureLoad(content, there.at, n, 0);
                let least = unlike(path, chosen, u);
                let when = lands(path, span, there.off);
                if least > best && when.x <= when.y {
                    best = least;
                    found = path;
                }
            }
        }
        more = best > ALIKE * ALIKE;
        if more {
            chosen[k] = found;
            chosen_count = k + 1u;
        }
    }
    var depths = vec4f(NONE);
    var comes = vec4f(1.0);
    var goes = vec4f(0.0);
    for (var tile = first; tile.y <= last.y; tile = after(tile, first, last)) {
        let there = other(tile, here);
        for (var n = 0u; n < there.count; n++) {
            let path = textureLoad(content, there.at, n, 0);
            let when = lands(path, span, there.off);
            if when.x <= when.y {
                let alike = most_alike(path, chosen, u);
                depths = min(depths, select(vec4f(NONE), vec4f(textureLoad(content, there.at, DEPTHS, 0)[n]), alike));
                comes = min(comes, select(vec4f(1.0), vec4f(when.x), alike));
                goes = max(goes, select(vec4f(0.0), vec4f(when.y), alike));
            }
        }
    }
    // The nearest first.
    for (var i = 0u; i < PATHS; i++) {
        for (var k = 0u; k + 1u < chosen_count; k++) {
            if depths[k] > depths[k + 1u] {
                let path = chosen[k];
                chosen[k] = chosen[k + 1u];
                chosen[k + 1u] = path;
                let z = depths[k];
                depths[k] = depths[k + 1u];
                depths[k + 1u] = z;
                let a = comes[k];
                comes[k] = comes[k + 1u];
                comes[k + 1u] = a;
                let b = goes[k];
                goes[k] = goes[k + 1u];
                goes[k + 1u] = b;
            }
        }
    }
    let about = vec4f(f32(chosen_count), split, longest, 0.0);
    textureStore(reaching, id, source.first, about);
    textureStore(reaching, id, source.first + 1u, depths);
    let none = depths >= vec4f(NONE);
    textureStore(reaching, id, source.first + 2u, select(span.x + (span.y - span.x) * comes, vec4f(NONE), none));
    textureStore(reaching, id, source.first + 3u, select(span.x + (span.y - span.x) * goes, vec4f(-NONE), none));
    for (var k = 0u; k < PATHS; k++) { textureStore(reaching, id, source.first + 4u + k, chosen[k]); }
}

/// The tile that comes after another one, row by row of those from `first` to `last`.
fn after(tile: vec2i, first: vec2i, last: vec2i) -> vec2i {
    return select(vec2i(tile.x + 1, tile.y), vec2i(first.x, tile.y + 1), tile.x >= last.x);
}

struct Other {
    at: vec2i,
    off: vec2f,         // from there to here [px]
    leads: bool,        // some of its motions may lead here
    count: u32,         // of its paths, if so
}

fn other(there: vec2i, here: vec2i) -> Other {
    let off = vec2f((here - there) * i32(TILE));
    let leads = meets(textureLoad(content, there, BOX, 0), off);
    return Other(there, off, leads, select(0u, u32(textureLoad(content, there, ABOUT, 0).x), leads));
}

/// Whether any motion of a tile, by its box, leads to the one that lies `off` [px] away.
fn meets(box: vec4f, off: vec2f) -> bool {
    let margin = f32(TILE) + 2.0;
    return all(off + margin > box.xy) && all(off - margin < box.zw);
}

/// From when to when, in shares of the `span`, a tile moving along `path` touches the one that lies
/// `off` [px] away; the second is less where it never does.
fn lands(path: vec4f, span: vec2f, off: vec2f) -> vec2f {
    let a = displaced(path, span.x) - off;
    let way = displaced(path, span.y) - off - a;
    let bend = length(path.zw) * (span.y - span.x) * (span.y - span.x) * 0.25;
    let margin = f32(TILE) + bend;
    // The part of the way between two parallel sides, for both pairs of sides.
    let steps = select(way, vec2f(1e-6), abs(way) < vec2f(1e-6));
    let one = (-margin - a) / steps;
    let two = (margin - a) / steps;
    let enters = min(one, two);
    let leaves = max(one, two);
    return vec2f(max(max(enters.x, enters.y), 0.0), min(min(leaves.x, leaves.y), 1.0));
}
