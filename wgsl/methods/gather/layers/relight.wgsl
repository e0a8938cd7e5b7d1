// The light of a neighbouring frame made that of the frame: a shadow may lie elsewhere there. What the frame hides is taken from
// its neighbours, so it gets the ratio of the light that the frame shows on the same surface beside it.
//#include common/depth.wgsl
//#include common/frame.wgsl
//#include common/shutter.wgsl
//#include methods/gather/layers/gains.wgsl
//#include methods/gather/surface.wgsl
//#include methods/gather/worklist.wgsl

struct RelitFrame {
    offset: f32,        // [frame intervals]
}

@group(1) @binding(0) var<uniform> source: RelitFrame;
@group(1) @binding(1) var color: texture_2d<f32>;               // stored as given: of the neighbour, premultiplied by alpha and weight
@group(1) @binding(2) var weight: texture_2d<f32>;
@group(1) @binding(3) var front_surface: texture_2d<u32>;       // stored as rgba32uint: see pack_surface()
@group(1) @binding(4) var own_color: texture_2d<f32>;           // of the frame itself, for samples between pixels
@group(1) @binding(5) var own_weight: texture_2d<f32>;
@group(1) @binding(6) var own_surface: texture_2d<u32>;         // stored as rgba32uint: before its edges are separated
@group(1) @binding(7) var<storage, read> worklist: WorkList;
@group(1) @binding(8) var<storage, read_write> hidden: HiddenList;
@group(1) @binding(9) var<storage, read_write> groups: array<u32>;      // workgroups of `relight`, for an indirect dispatch
@group(1) @binding(10) var<storage, read_write> changes: array<atomic<u32>>;    // per tile, its pixels whose light changes; then 1 if it changes near; all 0 at first
@group(1) @binding(11) var relit: Color;                        // the neighbour's front layer
@group(1) @binding(12) var<storage, read_write> gains: array<u32>;      // per pixel, see pack_gain(); all 0 at first
@group(1) @binding(13) var linear: sampler;
@group(1) @binding(14) var own_texels: texture_2d<f32>;         // stored as given: the same, for pixels

struct HiddenList {     // squares of SQUARE x SQUARE pixels of the neighbour of which the frame does not show all
    count: atomic<u32>,
    squares: array<atomic<u32>>,    // packed as cells are; then per square, 1 if it is listed; all 0 at first
}

alias Color = texture_storage_2d<rgba32float, write>;

override WEIGHTED: bool = false;    // pixels have weights

const SHOWN_DEPTH_RATIO: f32 = 1.15;    // depths of a surface in two frames differ by less
const SHOWN_RETURNS: f32 = 1.0;         // and its vectors lead there and back within this [px]
const SQUARE: u32 = 2u;                 // side of the squares with one gain [px]
const REVEALED_TIMES: u32 = 4u;         // of the exposure at which a pixel is looked for
const FARTHEST: i32 = 32;               // how far from a hidden pixel its surface is looked for, across and down [px]
const LIGHT_TILES: i32 = 2;             // as many tiles
const SLOPE: f32 = 0.01;                // depth ratio that a pixel of distance adds
const LEAST_PLACES: u32 = 2u;           // at which both frames show it: one may be a small shadow
const TRUSTED: f32 = 8.0;               // distance at which a single place counts half [px]
const SAME_MOTION: f32 = 1.0;           // of it; motions over a surface differ by less [px],
const BEND: f32 = 0.1;                  // and as much more per pixel of distance
const LEAST_LIGHT: f32 = 0.01;          // added to both, so that noise in the dark makes no ratio
const LEAST_CHANGE: f32 = 0.1;          // natural logarithm of a ratio up to which light is the same; from twice that on, it is another
const CHANGED_PIXELS: u32 = 16u;        // whose light is another, from which on it counts that light changes in a tile
const SPREAD: f32 = 0.5;                // share of the ratios' standard deviation that a change has to exceed too

struct Shown {          // a pixel of the neighbour, seen in the frame
    at: vec2f,          // where its surface is there [px]
    z: f32,
    is_there: bool,     // and the frame shows it there
    is_hidden: bool,    // something else is there
    surface: vec4u,     // of the neighbour's pixel
    own: vec4u,         // the frame's own surface there
}

fn shown(px: vec2i) -> Shown {
    let surface = textureLoad(front_surface, px, 0);
    let step = displacement_of(surface, -source.offset);
    let at = vec2f(px) + 0.5 + step;
    let is_inside = all(at >= vec2f(0.5)) && all(at <= vec2f(frame.size) - 0.5);
    let own = own_at(at);
    let z = abs(unpack_depth(surface));
    let off = step + displacement_of(own, source.offset);
    let is_same = are_alike(abs(unpack_depth(own)), z, SHOWN_DEPTH_RATIO) && dot(off, off) < SHOWN_RETURNS * SHOWN_RETURNS;
    let is_shown = is_same && is_smooth(own);
    let is_single = (surface.w & SINGLE) != 0u;
    return Shown(at, z, is_inside && is_shown && is_smooth(surface), is_inside && is_single && !is_shown, surface, own);
}

fn own_at(at: vec2f) -> vec4u {
    let px = vec2i(clamp(at, vec2f(0.0), vec2f(frame.size) - 1.0));
    return textureLoad(own_surface, px, 0);
}

/// First pass: the pixels that the frame hides and that appear while it is exposed, and the tiles in which light changes.
@compute @workgroup_size(CELL_TILES * TILE, STRIP_HEIGHT)
fn find_hidden(@builtin(local_invocation_index) local: u32, @builtin(workgroup_id) group: vec3u) {
    let k = worklist_index(group);
    let px = vec2i(pixel_in_strip(worklist.cells[k], group, local));
    if k >= worklist.count || any(px >= vec2i(frame.size)) { return; }
    let here = shown(px);
    if appears(px, here) { list_hidden(vec2u(px)); }
    let there = vec2i(here.at);
    if here.is_there && differ(own_light(there), light_there(px), exp(2.0 * LEAST_CHANGE)) {
        atomicAdd(&changes[tile_index(px / i32(TILE))], 1u);
    }
}

fn list_hidden(px: vec2u) {
    gains[px.y * frame.size.x + px.x] = WANTS_GAIN;
    let squares = squares_of(frame.size);
    let square = px / SQUARE;
    let flag = squares.x * squares.y + square.y * squares.x + square.x;
    if atomicExchange(&hidden.squares[flag], 1u) == 0u {
        atomicStore(&hidden.squares[atomicAdd(&hidden.count, 1u)], pack_cell(square));
    }
}

fn squares_of(size: vec2u) -> vec2u {
    return (size + SQUARE - 1u) / SQUARE;
}

/// True if at some time of the exposure, the surface that hides a pixel in the frame does not hide it.
fn appears(px: vec2i, here: Shown) -> bool {
    let window = exposure_window(0.0);
    var covered = 0u;
    let count = select(0u, REVEALED_TIMES, here.is_hidden);
    for (var i = 0u; i < count; i++) {
        let t = mix(window.x, window.y, f32(i) / f32(REVEALED_TIMES - 1u));
        let x = vec2f(px) + 0.5 + displacement_of(here.surface, t - source.offset);
        let first = displacement_of(own_at(x - displacement_of(here.own, t)), t);
        let cover = own_at(x - first);
        let step = displacement_of(cover, t) - first;
        let off = x - first - here.at;
        let is_found = dot(step, step) < SHOWN_RETURNS * SHOWN_RETURNS && dot(off, off) > SHOWN_RETURNS * SHOWN_RETURNS;
        covered += u32(is_found && is_smooth(cover) && unpack_depth(cover) < here.z * SURFACE_DEPTH_RATIO);
    }
    return covered < count;
}

/// Second pass: the tiles near those in which light changes.
@compute @workgroup_size(WG_X, WG_Y)
fn spread_changes(@builtin(global_invocation_id) id: vec3u) {
    let tiles = vec2i(tiles_of(frame.size));
    let tile = min(vec2i(id.xy), tiles - 1);
    let low = max(tile - LIGHT_TILES, vec2i(0));
    let high = min(tile + LIGHT_TILES, tiles - 1);
    var found = 0u;
    for (var y = low.y; y <= high.y; y++) {
        for (var x = low.x; x <= high.x; x++) { found |= u32(atomicLoad(&changes[tile_index(vec2i(x, y))]) >= CHANGED_PIXELS); }
    }
    atomicStore(&changes[tiles.x * tiles.y + tile_index(tile)], found);
}

fn tile_index(tile: vec2i) -> i32 {
    return tile.y * i32(tiles_of(frame.size).x) + tile.x;
}

/// The light of a pixel of the neighbour; of the frame itself.
fn light_there(px: vec2i) -> vec3f {
    let found = max(textureLoad(color, px, 0).rgb, vec3f(0.0));
    if !WEIGHTED { return found; }
    return found / max(textureLoad(weight, px, 0).x, 1e-6);
}

fn own_light(px: vec2i) -> vec3f {
    let found = max(textureLoad(own_texels, px, 0).rgb, vec3f(0.0));
    if !WEIGHTED { return found; }
    return found / max(textureLoad(own_weight, px, 0).x, 1e-6);
}

/// True if a colour's ratio of the two is beyond `most` or its inverse.
fn differ(a: vec3f, b: vec3f, most: f32) -> bool {
    let low = min(a, b) + LEAST_LIGHT;
    return any(max(a, b) + LEAST_LIGHT > most * low);
}

fn log_ratio(a: vec3f, b: vec3f) -> vec3f {
    return log((a + LEAST_LIGHT) / (b + LEAST_LIGHT));
}

/// Third pass: workgroups for the list.
@compute @workgroup_size(1)
fn size_dispatch() {
    let wanted = (atomicLoad(&hidden.count) + WG_X * WG_Y - 1u) / (WG_X * WG_Y);
    groups[0] = min(wanted, GROUPS_PER_ROW);
    groups[1] = (wanted + GROUPS_PER_ROW - 1u) / GROUPS_PER_ROW;
    groups[2] = 1u;
}

struct Light {          // weighted sums over places of one surface that both frames show
    count: u32,         // of the places
    total: f32,         // of the weights
    own: vec3f,
    there: vec3f,       // in the neighbour
    change: vec3f,      // logarithms of their ratios
    change2: vec3f,     // their squares
}

/// Last: a square of the list, by the first of its hidden pixels.
@compute @workgroup_size(WG_X, WG_Y)
fn relight(@builtin(local_invocation_index) local: u32, @builtin(workgroup_id) group: vec3u) {
    let k = (group.y * GROUPS_PER_ROW + group.x) * WG_X * WG_Y + local;
    if k >= atomicLoad(&hidden.count) { return; }
    let corner = vec2i(unpack_cell(atomicLoad(&hidden.squares[k])) * SQUARE);
    var px = corner;
    for (var i = 3; i >= 0; i--) {
        let at = corner + vec2i(i % 2, i / 2);
        if wants_gain(at) { px = at; }
    }
    let tiles = vec2i(tiles_of(frame.size));
    let changes_near = atomicLoad(&changes[tiles.x * tiles.y + tile_index(px / i32(TILE))]) != 0u;
    let surface = textureLoad(front_surface, px, 0);
    let z = abs(unpack_depth(surface));
    let count = select(0, 9, changes_near);
    var sum = Light();
    for (var i = 0; i < count; i++) { look_along(&sum, px, surface, vec2i(i % 3, i / 3) - 1); }
    let gain = pack_gain(log_gain(sum));
    for (var i = 0; i < 4; i++) {
        let at = corner + vec2i(i % 2, i / 2);
        if wants_gain(at) { give_gain(at, select(0u, gain, are_alike(z, depth_of(at), SURFACE_DEPTH_RATIO))); }
    }
}

fn wants_gain(px: vec2i) -> bool {
    let is_inside = all(vec2u(px) < frame.size);
    return is_inside && gains[select(0, px.y * i32(frame.size.x) + px.x, is_inside)] == WANTS_GAIN;
}

fn give_gain(px: vec2i, gain: u32) {
    gains[px.y * i32(frame.size.x) + px.x] = gain;
    if gain != 0u { textureStore(relit, px, relit_color(textureLoad(color, px, 0), gain)); }
}

fn depth_of(px: vec2i) -> f32 {
    return abs(unpack_depth(textureLoad(front_surface, px, 0)));
}

fn are_alike(a: f32, b: f32, ratio: f32) -> bool {
    return max(a, b) < ratio * min(a, b);
}

/// Add the nearest place of a pixel's surface in one direction that the frame shows, by the inverse square of its distance.
fn look_along(sum: ptr<function, Light>, px: vec2i, surface: vec4u, along: vec2i) {
    let z = abs(unpack_depth(surface));
    let motion = displacement_of(surface, -source.offset);
    var far = 1;
    var at = px;
    var own_at = vec2f(0.0);
    var is_found = false;
    var goes_on = any(along != vec2i(0));
    loop {
        at = px + far * along;
        let is_inside = all(at >= vec2i(0)) && all(at < vec2i(frame.size));
        let there = shown(inside(at));
        let distance = f32(far) * length(vec2f(along));
        let off = displacement_of(there.surface, -source.offset) - motion;
        let moves_alike = dot(off, off) < (SAME_MOTION + BEND * distance) * (SAME_MOTION + BEND * distance);
        goes_on = goes_on && is_inside && moves_alike && are_alike(there.z, z, SURFACE_DEPTH_RATIO + SLOPE * distance);
        is_found = goes_on && there.is_there;
        own_at = there.at;
        far = max(far + 1, far * 7 / 5);
        if !goes_on || is_found || far >= FARTHEST { break; }
    }
    let away = vec2f(at - px);
    add_light(sum, inside(at), own_at, select(0.0, 1.0 / dot(away, away), is_found));
}

fn add_light(sum: ptr<function, Light>, px: vec2i, own_at: vec2f, share: f32) {
    let place = own_at / vec2f(frame.size);
    var own = max(textureSampleLevel(own_color, linear, place, 0.0).rgb, vec3f(0.0));
    if WEIGHTED { own /= max(textureSampleLevel(own_weight, linear, place, 0.0).x, 1e-6); }
    let there = light_there(px);
    let change = log_ratio(own, there);
    (*sum).count += u32(share > 0.0);
    (*sum).total += share;
    (*sum).own += share * own;
    (*sum).there += share * there;
    (*sum).change += share * change;
    (*sum).change2 += share * change * change;
}

/// The logarithm of a hidden pixel's gain: 0 where the frames agree, or where the places do not.
fn log_gain(sum: Light) -> vec3f {
    let ratio = log_ratio(sum.own / sum.total, sum.there / sum.total);
    let mean = sum.change / sum.total;
    let spread = sqrt(max(sum.change2 / sum.total - mean * mean, vec3f(0.0)));
    let change = abs(ratio) - SPREAD * spread;
    let certain = clamp(max(max(change.x, change.y), change.z) / LEAST_CHANGE - 1.0, 0.0, 1.0);
    let trust = sum.total / (sum.total + 1.0 / (TRUSTED * TRUSTED));
    return select(vec3f(0.0), trust * certain * ratio, sum.count >= LEAST_PLACES);
}
