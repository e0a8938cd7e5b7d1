// For every pixel and every time of the exposure: which samples of three frames are there by then, and
// which of them is seen. Two-layer silhouettes, nearest first.
//#include common/frame.wgsl
//#include common/noise.wgsl
//#include common/path.wgsl
//#include common/shutter.wgsl
//#include blur/gather_tile.wgsl

struct Sources {
    offsets: vec4f,         // of the frames [frame intervals]; the first is 0, the frame itself
    count: u32,
}

@group(1) @binding(0) var<uniform> sources: Sources;
@group(1) @binding(1) var colors: texture_2d_array<f32>;    // premultiplied by alpha, coverage, weight; near, far, a frame
@group(1) @binding(2) var paths: texture_2d_array<u32>;     // see packed(); near, far, a frame
@group(1) @binding(3) var surfaces: texture_2d_array<f32>;  // near depth, far depth, coverage, weight
@group(1) @binding(4) var tiles: texture_2d_array<f32>;     // LAYERS a frame
@group(1) @binding(5) var own: texture_2d<f32>;             // the frame as it came
@group(1) @binding(6) var own_weight: texture_2d<f32>;
@group(1) @binding(7) var linear: sampler;
@group(1) @binding(8) var bends: texture_2d_array<u32>;     // second differences of the near colours
@group(1) @binding(9) var output: Output;

override WEIGHTED: bool = false;
override CONFIDENCE: bool = false;  // show how sure the result is instead of it

const STILL: f32 = 0.01;        // paths shorter than this [px] need no search
const STEPS: u32 = 4u;          // of a search, at most
const FOUND: f32 = 0.25;        // a step shorter than this [px] ends the search
const MISS: f32 = 1.0;          // a sample farther than this [px] from the pixel is none of it
const SAME: f32 = 0.75;         // searches, and samples of one layer, closer than this [px] are one
const BEHIND: f32 = 1.05;       // ratio of depths that makes two surfaces
const NEIGHBOUR: f32 = 1.1;     // a neighbouring frame's sample counts as this much farther
const GUESSED: f32 = 1.2;       // and a background that was only inferred as this much
const TRUSTED: f32 = 0.25;      // times up to which the frame itself needs no second opinion [frame intervals]
const ROUNDS: u32 = 6u;         // near layers of three frames, then their far layers

struct Sample {
    depth: f32,         // that it competes with
    true_depth: f32,
    miss: f32,          // squared distance of its place from the pixel [px^2]
    at: vec2f,          // where in its frame [px]
    layer: u32,         // near, far, of the frames one after the other
}

struct Seen {           // the nearest ones
    solid: Sample,      // opaque
    edge: Sample,       // at a silhouette
    second: Sample,     // the silhouette behind that
}

struct Reach {          // what a tile may show of a frame, see gather_tile.wgsl
    about: vec4f,
    depths: vec4f,
    comes: vec4f,
    goes: vec4f,
}

// lavapipe executes the body of every `if` and of every loop at least once, and that of a `for` once more
// than it has turns. So all searches of a time share one loop, and short loops are left from their end.

@compute @workgroup_size(WG_X, WG_Y)
fn main(@builtin(local_invocation_index) local: u32,
        @builtin(workgroup_id) group: vec3u, @builtin(num_workgroups) groups: vec3u) {
    let id = spread(local, group, groups);
    if any(id.xy >= frame.size) { return; }
    let x = vec2f(id.xy) + 0.5;
    let tile = id.xy / TILE;
    let reach0 = reach(tile, 0u);
    let reach1 = reach(tile, 1u);
    let reach2 = reach(tile, 2u);
    let path = path_in(textureLoad(paths, id.xy, 0u, 0));
    let longest = max(reach0.about.z, max(reach1.about.z, reach2.about.z));
    let streak = max(streak_of(reach0, 0u), max(streak_of(reach1, 1u), streak_of(reach2, 2u)));
    let times = enough_times(shutter_times(x, frame.jitter * (pixel_noise(id.xy) - 0.5)), streak);
    let share = 1.0 / f32(times.count);     // before adding, so that no sum of finite colours overflows

    let still = longest < STILL;
    let samples = select(times.count, 0u, still);

    var sum = vec4f(0.0);
    var total = 0.0;
    var accepted = select(0.0, f32(times.count), still);
    var others = 0.0;
    var missed = 0.0;
    var left = 0.0;
    for (var i = 0u; i < samples; i++) {
        let t = shutter_time(times, i);
        let seen = search(x, tile, t, reach0, reach1, reach2);

        // Front to back: silhouettes by the texels of their own surface, then what is opaque.
        let edge = seen.edge.depth < seen.solid.depth / BEHIND;
        let second = edge && seen.second.depth < seen.solid.depth / BEHIND && is_behind(seen.second, seen.edge);
        let solid = seen.solid.depth < NONE;
        var whole = solid && seen.solid.layer % 2u == 0u;
        if WEIGHTED { whole = whole && is_calm(textureLoad(paths, nearest_to(seen.solid.at), seen.solid.layer, 0)); }
        let texels = 4u * (u32(edge) + u32(second) + u32(solid && !whole));
        var clear = 1.0;
        var color = vec4f(0.0);
        var weight = 0.0;
        var part = Part();
        var n = 0u;
        loop {
            var now = seen.solid;
            if edge && n < 4u { now = seen.edge; }
            if second && n / 4u == 1u { now = seen.second; }
            if n < texels { add(&part, now, n % 4u); }
            if n < texels && n % 4u == 3u {
                if now.layer % 2u == 1u && part.cover > 1e-4 {
                    part.color /= part.cover;
                    part.weight /= part.cover;
                    part.cover = 1.0;
                }
                color += clear * part.color;
                weight += clear * part.weight;
                if CONFIDENCE {
                    missed += clear * part.cover * sqrt(now.miss);
                    if now.layer > 1u { others += clear * part.cover; }
                }
                clear *= 1.0 - part.cover;
                part = Part();
            }
            n++;
            if n >= texels { break; }
        }
        if whole {
            color += clear * resampled(seen.solid.at, seen.solid.layer);
            var counts = 1.0;
            if WEIGHTED { counts = textureLoad(surfaces, nearest_to(seen.solid.at), seen.solid.layer / 2u, 0).w; }
            weight += clear * counts;
            if CONFIDENCE {
                missed += clear * sqrt(seen.solid.miss);
                if seen.solid.layer > 1u { others += clear; }
            }
            clear = 0.0;
        }
        if clear < 0.5 {
            sum += share / (1.0 - clear) * color;
            total += share / (1.0 - clear) * weight;
            accepted += 1.0;
        } else {        // the pixel's own path through the frame
            let q = x - displacement(path, t);
            sum += share * textureSampleLevel(own, linear, q / vec2f(frame.size), 0.0);
            if WEIGHTED {
                total += share * textureSampleLevel(own_weight, linear, q / vec2f(frame.size), 0.0).x;
            } else {
                total += share;
            }
            if !inside(q) { left += 1.0; }
        }
    }
    var result = max(sum, vec4f(0.0)) / total;
    if still || total <= 0.0 {      // to the bit
        result = textureLoad(own, id.xy, 0);
        if WEIGHTED {
            let counted = textureLoad(own_weight, id.xy, 0).x;
            result = select(vec4f(0.0), result / counted, counted > 0.0);
        }
    }
    if CONFIDENCE {
        result = vec4f(accepted, others, missed / max(accepted, 1.0) * f32(times.count), left) * share;
    }
    textureStore(output, id.xy, result);
}

fn nothing() -> Sample {
    return Sample(NONE, NONE, NONE, vec2f(-9.0), 99u);
}

fn reach(tile: vec2u, f: u32) -> Reach {
    if f >= sources.count { return Reach(vec4f(0.0), vec4f(NONE), vec4f(NONE), vec4f(-NONE)); }
    let first = f * LAYERS;
    return Reach(
        textureLoad(tiles, tile, first, 0),
        textureLoad(tiles, tile, first + 1u, 0),
        textureLoad(tiles, tile, first + 2u, 0),
        textureLoad(tiles, tile, first + 3u, 0),
    );
}

/// How long a streak the longest motion of a frame leaves in the exposure [px].
fn streak_of(here: Reach, f: u32) -> f32 {
    let since = abs(shown(sources.offsets[f]));
    return here.about.z * (shutter.span.y - shutter.span.x) / max(max(since.x, since.y), 1e-9);
}

fn of_frame(f: u32, a: vec4f, b: vec4f, c: vec4f) -> vec4f {
    return select(select(c, b, f == 1u), a, f == 0u);
}

fn inside(q: vec2f) -> bool {
    return all(q >= vec2f(0.0)) && all(q < vec2f(frame.size));
}

/// The pixel in the picture nearest to a place.
fn nearest_to(q: vec2f) -> vec2u {
    return vec2u(clamp(q, vec2f(0.0), vec2f(frame.size) - 1.0));
}

/// Whether two displacements, or two places, are the same.
fn alike(a: vec2f, b: vec2f) -> bool {
    return all(abs(a - b) < vec2f(SAME));
}

/// Samples that are at `x` by the time `t`, searched for in the near layer of the frame itself; then of
/// the neighbour on the side of `t`, or the only one, if that is far from the frame's instant or nothing opaque was found;
/// then of the other one, if still nothing was. What the frame itself does not show is also searched for
/// behind silhouettes.
fn search(x: vec2f, tile: vec2u, t: f32, a: Reach, b: Reach, c: Reach) -> Seen {
    let count = sources.count;
    let offsets = sources.offsets;
    let parted = max(a.about.y, max(b.about.y, c.about.y)) > 0.0;
    var solid = nothing();
    var edge = nothing();
    var second = nothing();
    var hidden = false;         // the frame itself shows nothing opaque
    var round = 0u;
    var f = 0u;
    var u = t;                  // since that frame's instant
    var k = 0u;                 // 0: from the pixel's own path; else from one of the tile's
    var first = vec2f(NONE);    // what the former led to
    loop {
        let handicap = select(NEIGHBOUR, 1.0, f == 0u);
        let layer = 2u * f + round / 3u;
        let seed = textureLoad(tiles, tile, f * LAYERS + 3u + max(k, 1u), 0);
        var d = displacement(Path(seed.xy, seed.zw), u);
        if k == 0u { d = vec2f(0.0); }      // one step leads to the own path's
        // The fixed point of d = displacement(x - d).
        let steps = STEPS + u32(k == 0u);
        let known = alike(d, first);
        var texel = vec4u(0u);
        var miss = NONE;
        var n = 0u;
        loop {
            let q = x - d;
            texel = textureLoad(paths, vec2i(floor(q)), layer, 0);
            let next = displacement(path_in(texel), u);
            let step = next - d;
            miss = select(NONE, dot(step, step), inside(q));
            d = next;
            n++;
            if miss < FOUND * FOUND || miss >= NONE || n >= steps || alike(d, first) { break; }
        }
        if k == 0u { first = d; }

        let z = depth_in(texel);
        let guess = select(1.0, GUESSED, round >= 3u && !is_calm(texel));
        let found = Sample(abs(z) * handicap * guess, abs(z), miss, x - d, layer);
        let hit = miss <= MISS * MISS && !known;
        let is_solid = is_same(found, solid);
        let better = select(found.depth < solid.depth, found.miss < solid.miss, is_solid);
        if hit && z > 0.0 && better { solid = found; }
        if hit && z < 0.0 {
            let is_edge = is_same(found, edge);
            let is_second = is_same(found, second);
            let in_front = !is_edge && !is_second && found.depth < edge.depth;
            let behind = !is_edge && !in_front && select(
                found.depth < second.depth && is_behind(found, edge), found.miss < second.miss, is_second);
            if in_front && is_behind(edge, found) { second = edge; }
            if in_front || (is_edge && found.miss < edge.miss) { edge = found; }
            if behind { second = found; }
        }

        // The next of the tile's motions that may come by then, and be nearer than what is seen already.
        let depths = of_frame(f, a.depths, b.depths, c.depths) * handicap;
        let comes = of_frame(f, a.comes, b.comes, c.comes);
        let goes = of_frame(f, a.goes, b.goes, c.goes);
        let worth = vec4<bool>(k < 1u, k < 2u, k < 3u, k < 4u) & (depths < vec4f(solid.depth))
            & (comes <= vec4f(u)) & (vec4f(u) <= goes);
        k = select(select(select(select(0u, 4u, worth.w), 3u, worth.z), 2u, worth.y), 1u, worth.x);
        if round >= 3u || k == 0u {
            let none = solid.depth >= NONE;
            if round == 0u { hidden = none; }
            round++;
            let opinion = round < count && (none || (round == 1u && abs(t) > TRUSTED));
            if round < 3u && !opinion { round = 3u; }
            let neighbour = round % 3u;
            if round >= 3u && !(hidden && parted && neighbour < count) { round = ROUNDS; }
            f = select(neighbour, 3u - neighbour, neighbour > 0u && count == 3u && t > 0.0);
            u = t - select(select(offsets.z, offsets.y, f == 1u), 0.0, f == 0u);
            k = 0u;
            first = vec2f(NONE);
        }
        if round >= ROUNDS { break; }
    }
    return Seen(solid, edge, second);
}

fn is_same(a: Sample, b: Sample) -> bool {
    return a.layer == b.layer && alike(a.at, b.at);
}

/// Whether `b` is another surface behind that of `a`: neighbouring frames show the same one again.
fn is_behind(b: Sample, a: Sample) -> bool {
    return b.depth >= a.depth * BEHIND * select(NEIGHBOUR, 1.0, a.layer == b.layer);
}

struct Part {
    color: vec4f,
    weight: f32,
    cover: f32,
}

/// One of the four texels around a sample, if it is of the same surface.
fn add(part: ptr<function, Part>, now: Sample, i: u32) {
    let source = now.layer / 2u;
    let is_far = now.layer % 2u == 1u;
    let corner = floor(now.at - 0.5);
    let share = now.at - 0.5 - corner;
    let step = vec2f(vec2u(i & 1u, i >> 1u));
    let px = nearest_to(corner + step);
    let both = mix(1.0 - share, share, step);
    let there = textureLoad(surfaces, px, source, 0);
    let is_split = there.y > 0.0;
    let from_far = is_far && is_split;
    let z = there.x;
    // Near: what is not behind it. Far: guessed backgrounds, and what lies as deep.
    let too_far = z > now.true_depth * BEHIND;
    let too_near = is_far && z < now.true_depth / BEHIND;
    let counts = from_far || !(too_far || too_near);
    let amount = select(0.0, both.x * both.y, counts);
    (*part).color += amount * textureLoad(colors, px, 2u * source + u32(from_far), 0);
    (*part).weight += amount * select(there.w, 1.0, from_far);
    (*part).cover += amount * select(there.z, 1.0, is_far);
}

/// Catmull-Rom interpolation where the texel is calm, linear elsewhere: what is between two texels differs
/// from the line by their second differences, of which the nearest texel's stand for both.
fn resampled(at: vec2f, layer: u32) -> vec4f {
    let f = fract(at - 0.5);
    let bend = textureLoad(bends, nearest_to(at), layer / 2u, 0);
    let across = vec4f(unpack2x16float(bend.x), unpack2x16float(bend.y));
    let down = vec4f(unpack2x16float(bend.z), unpack2x16float(bend.w));
    let share = 0.5 * f * (1.0 - f);
    return textureSampleLevel(colors, linear, at / vec2f(frame.size), layer, 0.0) - share.x * across - share.y * down;
}
