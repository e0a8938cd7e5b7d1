// For every pixel and every time of the exposure: which samples of three frames are there by then, and
// which of them is seen. Two-layer silhouettes, nearest first.
//#include common/frame.wgsl
//#include common/noise.wgsl
//#include common/path.wgsl
//#include common/shutter.wgsl
//#include blur/gather_listed.wgsl
//#include blur/gather_search.wgsl

@group(1) @binding(3) var plain: texture_2d_array<u32>;     // bits of times, see gather_plain.wgsl
@group(1) @binding(4) var colors: texture_2d_array<f32>;    // premultiplied by alpha, coverage, weight; near, far, a frame
@group(1) @binding(5) var surfaces: texture_2d_array<f32>;  // near depth, far depth, coverage, weight
@group(1) @binding(6) var bends: texture_2d<u32>;           // second differences of the frame's own near colours
@group(1) @binding(7) var own: texture_2d<f32>;             // the frame as it came
@group(1) @binding(8) var own_weight: texture_2d<f32>;
@group(1) @binding(9) var linear: sampler;
@group(1) @binding(10) var output: Output;
@group(1) @binding(11) var<storage, read> listed: Listed;   // the cells to work on

override WEIGHTED: bool = false;
override CONFIDENCE: bool = false;  // show how sure the result is instead of it

const BEHIND: f32 = 1.05;       // ratio of depths that makes two surfaces
const GUESSED: f32 = 1.2;       // and a background that was only inferred as this much
const SPARED: u32 = 2u;         // steps by which a search from a tile's motion is shorter than one from nowhere
const ASTRAY: f32 = 0.5;        // of the way back to where the first one led: a longer step ends such a search
const ROUNDS: u32 = 6u;         // near, far of the frame itself; near of the neighbours; far of these

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

// lavapipe executes the body of every `if` and of every loop at least once, and that of a `for` once more
// than it has turns. So loops are left from their end, and what is rare has a loop of its own over bits of times.

@compute @workgroup_size(CELL * TILE, STRIP)
fn main(@builtin(local_invocation_index) local: u32, @builtin(workgroup_id) group: vec3u) {
    let k = place_of(group);
    let id = pixel_in(listed.cells[k], group, local);
    if k >= listed.count || any(id >= frame.size) { return; }
    let x = vec2f(id) + 0.5;
    let tile = id / TILE;
    let reach0 = reach(tile, 0u);
    let reach1 = reach(tile, 1u);
    let reach2 = reach(tile, 2u);
    let here = stored(0u);
    let path = path_in(textureLoad(paths, id, here, 0));
    let start = path_in(textureLoad(paths, id / BLOCK * BLOCK, here, 0));    // see gather_plain.wgsl
    let times = times_of(x, frame.jitter * (pixel_noise(id) - 0.5), reach0, reach1, reach2);
    let share = 1.0 / f32(times.count);     // before adding, so that no sum of finite colours overflows

    // Nothing moves, nor does anything come here.
    let longest = max(abs(exposure_window(0.0).x), abs(exposure_window(0.0).y));
    let rests = all((abs(path.velocity) + abs(path.half_acceleration) * longest) * longest < vec2f(STILL));
    let all_plain = textureLoad(plain, id / BLOCK, (frame.samples - 1u) / AT_ONCE + 1u, 0).x == 1u;
    let still = is_still(reach0, reach1, reach2) || (rests && all_plain);
    let samples = select(times.count, 0u, still);

    var sum = Shown();
    var accepted = select(0.0, f32(times.count), still);
    var left = 0.0;
    var first = 0u;         // time of this turn's words of bits
    loop {
        let valid = select(select(0u, (1u << (samples - first)) - 1u, samples > first), ~0u, samples >= first + AT_ONCE);
        var bits = textureLoad(plain, id / BLOCK, first / AT_ONCE, 0).x & valid;
        var todo = bits;
        loop {              // times at which one search is enough
            let t = time_in(times, first, todo);
            let found = follow(x, displacement(start, t), t, here);
            let px = nearest_to(x - found.d);
            var is_even = true;
            var counts = 1.0;
            if WEIGHTED {
                is_even = is_calm(textureLoad(paths, px, here, 0));
                counts = textureLoad(surfaces, px, here / 2u, 0).w;
            }
            if todo != 0u && is_even {
                add(&sum, Shown(resampled(x - found.d, here, true), counts, 1.0, sqrt(found.miss), 0.0), share);
                accepted += 1.0;
            }
            if !is_even { bits &= ~(1u << firstTrailingBit(todo)); }
            todo &= todo - 1u;
            if todo == 0u { break; }
        }
        todo = ~bits & valid;
        var lost = 0u;
        loop {              // all others
            let got = composed(search(x, path, time_in(times, first, todo), reach0, reach1, reach2));
            let is_seen = got.cover > 0.5;
            if todo != 0u && is_seen {
                add(&sum, got, share / got.cover);
                accepted += 1.0;
            }
            if !is_seen { lost |= todo & (~todo + 1u); }
            todo &= todo - 1u;
            if todo == 0u { break; }
        }
        loop {              // of them, those that show nothing: the pixel's own path through the frame
            let q = x - displacement(path, time_in(times, first, lost));
            if lost != 0u {
                var counts = 1.0;
                if WEIGHTED { counts = textureSampleLevel(own_weight, linear, q / vec2f(frame.size), 0.0).x; }
                let color = textureSampleLevel(own, linear, q / vec2f(frame.size), 0.0);
                add(&sum, Shown(color, counts, 1.0, 0.0, 0.0), share);
                if !inside(q) { left += 1.0; }
            }
            lost &= lost - 1u;
            if lost == 0u { break; }
        }
        first += AT_ONCE;
        if first >= samples { break; }
    }
    var result = max(sum.color, vec4f(0.0)) / sum.weight;
    if still || sum.weight <= 0.0 { result = unmoved(id); }
    if CONFIDENCE {
        let times_seen = max(accepted * share, 1e-9);
        result = vec4f(accepted * share, sum.others, sum.missed / times_seen, left * share);
    }
    textureStore(output, id, result);
}

/// Where nothing moves.
@compute @workgroup_size(CELL * TILE, STRIP)
fn rest(@builtin(local_invocation_index) local: u32, @builtin(workgroup_id) group: vec3u) {
    let k = place_of(group);
    let id = pixel_in(listed.cells[k], group, local);
    if k >= listed.count || any(id >= frame.size) { return; }
    var result = unmoved(id);
    if CONFIDENCE { result = vec4f(1.0, 0.0, 0.0, 0.0); }
    textureStore(output, id, result);
}

/// The frame's own pixel, to the bit.
fn unmoved(px: vec2u) -> vec4f {
    let color = textureLoad(own, px, 0);
    if !WEIGHTED { return color; }
    let counted = textureLoad(own_weight, px, 0).x;
    return select(vec4f(0.0), color / counted, counted > 0.0);
}

/// The time of the lowest of 32 bits, of which `first` is the time of the first.
fn time_in(times: SampleTimes, first: u32, bits: u32) -> f32 {
    return shutter_time(times, min(first + firstTrailingBit(bits), times.count - 1u));
}

struct Shown {
    color: vec4f,
    weight: f32,
    cover: f32,
    missed: f32,        // distance from the pixel of what is shown [px]
    others: f32,        // how much of it is the neighbours'
}

fn add(sum: ptr<function, Shown>, one: Shown, share: f32) {
    (*sum).color += share * one.color;
    (*sum).weight += share * one.weight;
    (*sum).cover += share * one.cover;
    (*sum).missed += share * one.missed;
    (*sum).others += share * one.others;
}

/// Front to back: silhouettes by the texels of their own surface, then what is opaque.
fn composed(seen: Seen) -> Shown {
    let edge = seen.edge.depth < seen.solid.depth / BEHIND;
    let second = edge && seen.second.depth < seen.solid.depth / BEHIND && is_behind(seen.second, seen.edge);
    let solid = seen.solid.depth < NONE;
    let at = seen.solid.at;
    let layer = stored(seen.solid.layer);
    var whole = solid && seen.solid.layer % 2u == 0u;
    if WEIGHTED { whole = whole && is_calm(textureLoad(paths, nearest_to(at), layer, 0)); }
    let parts = u32(edge) + u32(second) + u32(solid && !whole);
    var sum = Shown();
    var n = 0u;
    loop {
        var now = seen.solid;
        if second && n == 1u { now = seen.second; }
        if edge && n == 0u { now = seen.edge; }
        var part = Shown();
        var i = 0u;
        loop {
            if n < parts { add_texel(&part, now, i); }
            i++;
            if n >= parts || i >= 4u { break; }
        }
        if now.layer % 2u == 1u && part.cover > 1e-4 {
            part.color /= part.cover;
            part.weight /= part.cover;
            part.cover = 1.0;
        }
        part.missed = part.cover * sqrt(now.miss);
        part.others = select(0.0, part.cover, now.layer > 1u);
        add(&sum, part, 1.0 - sum.cover);
        n++;
        if n >= parts { break; }
    }
    if whole {
        var counts = 1.0;
        if WEIGHTED { counts = textureLoad(surfaces, nearest_to(at), layer / 2u, 0).w; }
        let others = select(0.0, 1.0, seen.solid.layer > 1u);
        add(&sum, Shown(resampled(at, layer, seen.solid.layer == 0u), counts, 1.0, sqrt(seen.solid.miss), others), 1.0 - sum.cover);
    }
    return sum;
}

fn nothing() -> Sample {
    return Sample(NONE, NONE, NONE, vec2f(-9.0), 99u);
}

/// The pixel in the picture nearest to a place.
fn nearest_to(q: vec2f) -> vec2u {
    return vec2u(clamp(q, vec2f(0.0), vec2f(frame.size) - 1.0));
}

/// Samples that are at `x` by the time `t`. They are searched for in the near layer of the frame itself, and in
/// its far layer where that shows nothing opaque; then, or far from the frame's instant, in the near layer of
/// the neighbour on the side of `t`, and of the other one if the background was at best inferred; at
/// last in their far layers, where it still was and no silhouette is before it.
fn search(x: vec2f, path: Trajectory, t: f32, a: Reach, b: Reach, c: Reach) -> Seen {
    let count = sources.count;
    let parted = max(a.about.y, max(b.about.y, c.about.y)) > 0.0;
    var solid = nothing();
    var edge = nothing();
    var second = nothing();
    var hidden = false;         // the frame itself shows nothing opaque
    var round = 0u;
    var f = 0u;
    var u = t;                  // since that frame's instant
    loop {
        let is_far = round == 1u || round > 3u;
        let layer = 2u * f + u32(is_far);
        let handicap = select(NEIGHBOUR, 1.0, f == 0u);
        let here = of_frame(f, a, b, c);
        var todo = Starts(vec4<bool>(!is_far), displaced_x(here, u), displaced_y(here, u));
        var own = true;             // from the pixel's own path; then from the tile's
        var first = vec2f(NONE);    // where the former led to
        var is_first = false;       // and something is there
        loop {
            // In a neighbour, one step from here leads to the pixel's own path.
            var place = Place(vec4u(0u), select(vec2f(0.0), displacement(path, u), f == 0u), NONE);
            var n = u32(f == 0u);
            if !own {
                place.d = next_of(&todo);
                n = SPARED;
            }
            // A turn is a step: from one start until something is there, then from the next.
            var hit = false;
            loop {
                let back = place.d - first;
                place = step_from(x, place.d, u, stored(layer));
                n++;
                let again = alike(place.d, first);
                let farther = !own && depth_in(place.texel) * handicap >= solid.depth;     // it leads to what is seen
                let astray = !own && place.miss > ASTRAY * ASTRAY * dot(back, back);
                let ended = has_ended(place) || n > STEPS || again || farther || astray;
                hit = place.miss <= MISS * MISS && !(again && is_first) && !farther;
                if ended && (own || hit || !any(todo.left)) { break; }
                if ended {
                    place.d = next_of(&todo);
                    n = SPARED;
                }
            }
            if own {
                first = place.d;
                is_first = hit;
            }

            let z = depth_in(place.texel);
            let guess = select(1.0, GUESSED, is_far && !is_calm(place.texel));
            let found = Sample(abs(z) * handicap * guess, abs(z), place.miss, x - place.d, layer);
            if hit && z > 0.0 && found.depth < solid.depth { solid = found; }
            if hit && z < 0.0 {
                let in_front = found.depth < edge.depth;
                if in_front && is_behind(edge, found) { second = edge; }
                if !in_front && found.depth < second.depth && is_behind(found, edge) { second = found; }
                if in_front { edge = found; }
            }

            let known = (abs(todo.x - first.x) < vec4f(SAME)) & (abs(todo.y - first.y) < vec4f(SAME));
            todo.left = todo.left & worth(here, u, solid.depth / handicap) & !known;
            own = false;
            if !any(todo.left) { break; }
        }
        let none = solid.depth >= NONE;
        if round == 0u { hidden = none; }
        let inferred = none || solid.layer == 1u;
        let behind = hidden && parted;
        let farther = behind && inferred && (none || edge.depth >= NONE);
        round++;
        if round == 1u && !behind { round = 2u; }
        if round == 2u && !(count > 1u && (hidden || abs(t) > TRUSTED)) { round = ROUNDS; }
        if round == 3u && !(count > 2u && inferred) { round = 4u; }
        if round == 4u && !farther { round = ROUNDS; }
        if round == 5u && !(farther && count > 2u) { round = ROUNDS; }
        f = select(neighbour_of(t, round % 2u == 1u), 0u, round < 2u);
        u = t - offset_of(f);
        if round >= ROUNDS { break; }
    }
    return Seen(solid, edge, second);
}

/// Whether `b` is another surface behind that of `a`: neighbouring frames show the same one again.
fn is_behind(b: Sample, a: Sample) -> bool {
    return b.depth >= a.depth * BEHIND * select(NEIGHBOUR, 1.0, a.layer == b.layer);
}

/// One of the four texels around a sample, if it is of the same surface.
fn add_texel(part: ptr<function, Shown>, now: Sample, i: u32) {
    let near = stored(now.layer / 2u * 2u);
    let is_far = now.layer % 2u == 1u;
    let corner = floor(now.at - 0.5);
    let share = now.at - 0.5 - corner;
    let step = vec2f(vec2u(i & 1u, i >> 1u));
    let px = nearest_to(corner + step);
    let both = mix(1.0 - share, share, step);
    let there = textureLoad(surfaces, px, near / 2u, 0);
    let is_split = there.y > 0.0;
    let from_far = is_far && is_split;
    let z = there.x;
    // Near: what is not behind it. Far: guessed backgrounds, and what lies as deep.
    let too_far = z > now.true_depth * BEHIND;
    let too_near = is_far && z < now.true_depth / BEHIND;
    let counts = from_far || !(too_far || too_near);
    let amount = select(0.0, both.x * both.y, counts);
    (*part).color += amount * textureLoad(colors, px, near + u32(from_far), 0);
    (*part).weight += amount * select(there.w, 1.0, from_far);
    (*part).cover += amount * select(there.z, 1.0, is_far);
}

/// Catmull-Rom interpolation where the frame's own texel is calm, linear elsewhere: what is between two texels
/// differs from the line by their second differences, of which the nearest texel's stand for both.
fn resampled(at: vec2f, layer: u32, is_own: bool) -> vec4f {
    let f = fract(at - 0.5);
    let bend = textureLoad(bends, nearest_to(at), 0);
    let across = vec4f(unpack2x16float(bend.x), unpack2x16float(bend.y));
    let down = vec4f(unpack2x16float(bend.z), unpack2x16float(bend.w));
    let share = select(vec2f(0.0), 0.5 * f * (1.0 - f), is_own);
    return textureSampleLevel(colors, linear, at / vec2f(frame.size), layer, 0.0) - share.x * across - share.y * down;
}
