// The motions of every tile, then of every tile that they reach while the shutter is open.
//#include common/frame.wgsl
//#include common/path.wgsl
//#include common/shutter.wgsl
//#include blur/gather_tile.wgsl

struct Source {
    offset: f32,        // of the frame [frame intervals]
    first: u32,         // where its layers begin in `reaching`
}

@group(1) @binding(0) var<uniform> source: Source;
@group(1) @binding(1) var paths: texture_2d<f32>;       // velocity, curvature of the near layer
@group(1) @binding(2) var surface: texture_2d<f32>;     // depth; over 0: that of a far layer
@group(1) @binding(3) var<storage, read_write> contents: array<Tile>;     // of every tile's own pixels
@group(1) @binding(4) var reaching: Reaching;            // of all that reaches it, LAYERS a frame

alias Reaching = texture_storage_2d_array<rgba32float, write>;

const ALIKE: f32 = 0.5;         // displacements closer than this [px] stand for each other
const WILD: f32 = 1e5;          // motions beyond this [px] are errors
const FARTHEST: i32 = 16;       // tiles that a motion is followed over

/// From when to when, after its own instant, a frame's samples are shown [frame intervals].
fn shown() -> vec2f {
    let late = 0.5 * (abs(shutter.rolling.x) + abs(shutter.rolling.y));
    return shutter.span + vec2f(-late, late) - source.offset;
}

fn longest_time() -> f32 {
    let span = abs(shown());
    return max(span.x, span.y);
}

/// How far apart two motions come by the time `u`, at most, squared.
fn apart(a: vec4f, b: vec4f, u: f32) -> f32 {
    let d = length(a.xy - b.xy) + length(a.zw - b.zw) * u;
    return d * d * u * u;
}

/// The same to the most similar one of `chosen`; those not chosen yet are 0, which stands still.
fn unlike(path: vec4f, chosen: array<vec4f, 4>, u: f32) -> f32 {
    return min(min(apart(path, chosen[0], u), apart(path, chosen[1], u)),
               min(apart(path, chosen[2], u), apart(path, chosen[3], u)));
}

fn displaced(path: vec4f, u: f32) -> vec2f {
    return displacement(Path(path.xy, path.zw), u);
}

@compute @workgroup_size(WG_X, WG_Y)
fn local(@builtin(global_invocation_id) id: vec3u) {
    let tiles = tiles_of(frame.size);
    if any(id.xy >= tiles) { return; }
    let there = id.xy * TILE;
    let size = min(there + TILE, frame.size) - there;
    let pixels = size.x * size.y;
    let u = longest_time();
    var tile = Tile();
    tile.nearest = 3e38;
    for (var i = 0u; i < pixels; i++) {
        let seen = textureLoad(surface, there + vec2u(i % size.x, i / size.x), 0);
        tile.nearest = min(tile.nearest, seen.x);
        if seen.y > 0.0 { tile.split = 1u; }
    }
    var chosen = array<vec4f, 4>();
    for (var k = 0u; k < PATHS; k++) {
        var most = 0.0;
        for (var i = 0u; i < pixels; i++) {
            let path = textureLoad(paths, there + vec2u(i % size.x, i / size.x), 0);
            let least = unlike(path, chosen, u);
            if least > most && least < WILD * WILD {
                most = least;
                chosen[k] = path;
            }
        }
        if k == 0u { tile.longest = sqrt(most); }
        if most <= ALIKE * ALIKE { break; }
        tile.count = k + 1u;
    }
    tile.paths = chosen;
    contents[id.y * tiles.x + id.x] = tile;
}

@compute @workgroup_size(WG_X, WG_Y)
fn reach(@builtin(global_invocation_id) id: vec3u) {
    let tiles = tiles_of(frame.size);
    if any(id.xy >= tiles) { return; }
    let span = shown();
    let u = longest_time();
    let here = vec2i(id.xy);
    let low = max(here - FARTHEST, vec2i(0));
    let size = min(here + FARTHEST, vec2i(tiles) - 1) - low + 1;
    let count = size.x * size.y;
    var tile = Tile();
    tile.nearest = 3e38;
    for (var i = 0; i < count; i++) {
        let there = low + vec2i(i % size.x, i / size.x);
        let at = u32(there.y) * tiles.x + u32(there.x);
        // The box of all places that its motions lead to.
        let off = vec2f((here - there) * i32(TILE));
        var least = vec2f(0.0);
        var most = vec2f(0.0);
        let paths_there = contents[at].count;
        for (var k = 0u; k < paths_there; k++) {
            let path = contents[at].paths[k];
            let a = displaced(path, span.x);
            let b = displaced(path, span.y);
            least = min(least, min(a, b));
            most = max(most, max(a, b));
        }
        let margin = f32(TILE) + 2.0;
        if all(off + margin > least) && all(off - margin < most) {
            tile.nearest = min(tile.nearest, contents[at].nearest);
            tile.split = max(tile.split, contents[at].split);
            tile.longest = max(tile.longest, contents[at].longest);
        }
    }
    var chosen = array<vec4f, 4>();
    for (var k = 0u; k < PATHS; k++) {
        var best = 0.0;
        for (var i = 0; i < count; i++) {
            let there = low + vec2i(i % size.x, i / size.x);
            let at = u32(there.y) * tiles.x + u32(there.x);
            let off = vec2f((here - there) * i32(TILE));
            let paths_there = contents[at].count;
            for (var n = 0u; n < paths_there; n++) {
                let path = contents[at].paths[n];
                let least = unlike(path, chosen, u);
                if least > best && lands(path, span, off) {
                    best = least;
                    chosen[k] = path;
                }
            }
        }
        if best <= ALIKE * ALIKE { break; }
        tile.count = k + 1u;
    }
    let about = vec4f(f32(tile.count), tile.nearest, f32(tile.split), tile.longest);
    textureStore(reaching, id.xy, source.first, about);
    for (var k = 0u; k < PATHS; k++) { textureStore(reaching, id.xy, source.first + 1u + k, chosen[k]); }
}

/// Whether a tile moving along `path` touches the one that lies `off` [px] away.
fn lands(path: vec4f, span: vec2f, off: vec2f) -> bool {
    let a = displaced(path, span.x) - off;
    let way = displaced(path, span.y) - off - a;
    let bend = length(path.zw) * (span.y - span.x) * (span.y - span.x) * 0.25;
    let margin = f32(TILE) + 2.0 + bend;
    // The part of the way between two parallel sides, for both pairs of sides.
    let steps = select(way, vec2f(1e-6), abs(way) < vec2f(1e-6));
    let one = (-margin - a) / steps;
    let two = (margin - a) / steps;
    let enters = min(one, two);
    let leaves = max(one, two);
    return max(max(enters.x, enters.y), 0.0) <= min(min(leaves.x, leaves.y), 1.0);
}
