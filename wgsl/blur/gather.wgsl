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
@group(1) @binding(8) var output: Output;

override WEIGHTED: bool = false;
override CONFIDENCE: bool = false;  // show how sure the result is instead of it

const STILL: f32 = 0.01;        // paths shorter than this [px] need no search
const STEPS: u32 = 4u;          // of a search, at most
const FOUND: f32 = 0.25;        // a step shorter than this [px] ends the search
const MISS: f32 = 1.0;          // a sample farther than this [px] from the pixel is none of it
const SAME: f32 = 0.75;         // searches, and samples of one layer, closer than this [px] are one
const SAME_PLACE: f32 = 2.0;    // the same across frames, by their place in the frame itself
const BEHIND: f32 = 1.05;       // ratio of depths that makes two surfaces
const NEIGHBOUR: f32 = 1.1;     // a neighbouring frame's sample counts as this much farther
const GUESSED: f32 = 1.2;       // and a background that was only inferred as this much
const TRUSTED: f32 = 0.25;     // times up to which the frame itself needs no second opinion [frame intervals]
const NONE: f32 = 3e38;         // depth of no sample

struct Sample {
    depth: f32,         // that it competes with
    true_depth: f32,
    miss: f32,          // distance of its place from the pixel [px]
    plain: bool,        // one opaque surface all around
    calm: bool,         // and of one weight, nothing brighter than white
    at: vec2f,          // where in its frame [px]
    home: vec2f,        // where that is in the frame itself [px]
    layer: u32,         // near, far, of the frames one after the other
}

struct Seen {           // the nearest ones, in order
    a: Sample,
    b: Sample,
    c: Sample,
}

// Throughout, `for (; condition; condition = false)` is an `if` that also saves time on lavapipe.

@compute @workgroup_size(WG_X, WG_Y)
fn main(@builtin(global_invocation_id) id: vec3u) {
    if any(id.xy >= frame.size) { return; }
    let x = vec2f(id.xy) + 0.5;
    let tile = id.xy / TILE;
    let source_count = sources.count;
    let offsets = sources.offsets;

    // What the tile may show of each frame, and the pixel's own paths there.
    let about0 = textureLoad(tiles, tile, 0u, 0);
    var about1 = vec4f(0.0, NONE, 0.0, 0.0);
    var about2 = about1;
    let path0 = path_in(textureLoad(paths, id.xy, 0u, 0));
    let depths0 = textureLoad(tiles, tile, 1u, 0);
    var depths1 = vec4f(0.0);
    var depths2 = vec4f(0.0);
    var path1 = path0;
    var path2 = path0;
    if source_count > 1u {
        about1 = textureLoad(tiles, tile, LAYERS, 0);
        depths1 = textureLoad(tiles, tile, LAYERS + 1u, 0);
        path1 = path_in(textureLoad(paths, id.xy, 2u, 0));
    }
    if source_count > 2u {
        about2 = textureLoad(tiles, tile, 2u * LAYERS, 0);
        depths2 = textureLoad(tiles, tile, 2u * LAYERS + 1u, 0);
        path2 = path_in(textureLoad(paths, id.xy, 4u, 0));
    }
    let times = shutter_times(x, frame.jitter * (pixel_noise(id.xy) - 0.5));
    let still = max(about0.w, max(about1.w, about2.w)) < STILL;
    let samples = select(frame.samples, 0u, still);

    let share = 1.0 / f32(frame.samples);   // before adding, so that no sum of finite colours overflows
    var sum = vec4f(0.0);
    var total = 0.0;
    var accepted = 0.0;
    var others = 0.0;
    var missed = 0.0;
    var left = 0.0;
    for (var i = 0u; i < samples; i++) {
        let t = shutter_time(times, i);
        var seen = Seen(nothing(), nothing(), nothing());
        var settled = false;        // an opaque sample was found
        var solid = NONE;           // the depth of the nearest such
        for (var s = 0u; s < source_count && !(settled && abs(t) <= TRUSTED); s++) {
            // The frame itself, then the neighbour on the side of `t`, then the other one.
            let f = select(s, 3u - s, s > 0u && source_count == 3u && t > 0.0);
            let about = select(select(about2, about1, f == 1u), about0, f == 0u);
            let depths = select(select(depths2, depths1, f == 1u), depths0, f == 0u);
            let path_here = chosen(f, path0, path1, path2);
            let offset = select(select(offsets.z, offsets.y, f == 1u), 0.0, f == 0u);
            let u = t - offset;
            let handicap = select(NEIGHBOUR, 1.0, s == 0u);
            let first = displacement(path_here, u);
            let seeds = u32(about.x) + select(1u, 2u, about.z > 0.0);
            for (var layer = 0u; layer < 1u + u32(about.z) && !(settled && layer == 1u); layer++) {
                var d = first;
                var base = first;
                var bound = about.y;
                // The nearest first: once none could be nearer than what is seen already, the search ends.
                for (var k = 0u; k < seeds && solid > bound * handicap; k++) {
                    var miss = NONE;
                    var q = x;
                    var texel = vec4u(0u);
                    var going = k == 0u || !alike(d, base);
                    // The fixed point of q = x - displacement(q).
                    for (var n = 0u; n < STEPS && going; n++) {
                        q = x - d;
                        texel = textureLoad(paths, vec2i(floor(q)), 2u * f + layer, 0);
                        let next = displacement(path_in(texel), u);
                        miss = distance(next, d);
                        going = miss >= FOUND && inside(q) && (k == 0u || !alike(next, base));
                        d = next;
                    }
                    if k == 0u { base = d; }
                    let z = depth_in(texel);
                    var hit = miss <= MISS && inside(q) && z != 0.0;
                    for (; hit; hit = false) {
                        let place = x - d;
                        let home = place + displacement(path_in(texel), -offset);
                        let plain = layer == 0u && z > 0.0;
                        if plain {
                            settled = true;
                            solid = min(solid, z * handicap);
                        }
                        let guess = select(1.0, GUESSED, layer == 1u && !is_calm(texel));
                        let found = Sample(abs(z) * handicap * guess, abs(z), miss, plain, is_calm(texel), place, home, 2u * f + layer);
                        var others_known = seen.a.depth < NONE;
                        if !others_known { seen.a = found; }
                        for (; others_known; others_known = false) { insert(&seen, found); }
                    }
                    let more = k < u32(about.x);
                    bound = select(NONE, select(select(depths.w, depths.z, k == 2u), select(depths.y, depths.x, k == 0u), k < 2u), more);
                    var next_seed = k + 1u < seeds && solid > bound * handicap;
                    for (; next_seed; next_seed = false) {
                        let seed = textureLoad(tiles, tile, f * LAYERS + 2u + min(k, PATHS - 1u), 0);
                        d = displacement(Path(seed.xy, seed.zw), u);
                        var own_far = !more;
                        for (; own_far; own_far = false) {
                            d = displacement(path_in(textureLoad(paths, id.xy, 2u * f + 1u, 0)), u);
                        }
                    }
                }
            }
        }

        // Front to back.
        var clear = 1.0;
        var color = vec4f(0.0);
        var weight = 0.0;
        var last = nothing();
        for (var n = 0u; n < 3u && seen.a.depth < NONE && clear >= 0.01; n++) {
            let now = seen.a;
            seen.a = seen.b;
            seen.b = seen.c;
            seen.c.depth = NONE;
            let same_frame = now.layer / 2u == last.layer / 2u;
            var apart = select(BEHIND * NEIGHBOUR, BEHIND, same_frame);
            if last.depth >= NONE || (same_frame && now.layer != last.layer) { apart = 0.0; }
            var another = now.depth >= last.depth * apart;
            for (; another; another = false) {
                let part = fetch(now);
                if part.cover >= 0.01 {
                    color += clear * part.color;
                    weight += clear * part.weight;
                    if CONFIDENCE {
                        missed += clear * part.cover * now.miss;
                        if now.layer > 1u { others += clear * part.cover; }
                    }
                    clear *= 1.0 - part.cover;
                    last = now;
                }
            }
        }
        var nobody = clear >= 0.5;
        if !nobody {
            sum += share / (1.0 - clear) * color;
            total += share / (1.0 - clear) * weight;
            accepted += 1.0;
        }
        for (; nobody; nobody = false) {        // the pixel's own path through the frame
            let q = x - displacement(path0, t);
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
    if total <= 0.0 {       // to the bit
        result = textureLoad(own, id.xy, 0);
        if WEIGHTED {
            let counted = textureLoad(own_weight, id.xy, 0).x;
            result = select(vec4f(0.0), result / counted, counted > 0.0);
        }
    }
    if CONFIDENCE {
        result = vec4f(1.0, 0.0, 0.0, 0.0);
        if samples > 0u { result = vec4f(accepted, others, missed / max(accepted, 1.0) * f32(samples), left) / f32(samples); }
    }
    textureStore(output, id.xy, result);
}

fn nothing() -> Sample {
    return Sample(NONE, NONE, NONE, false, false, vec2f(-9.0), vec2f(-9.0), 99u);
}

fn inside(q: vec2f) -> bool {
    return all(q >= vec2f(0.0)) && all(q < vec2f(frame.size));
}

/// Whether two displacements lead to the same place.
fn alike(a: vec2f, b: vec2f) -> bool {
    return all(abs(a - b) < vec2f(SAME));
}

fn chosen(f: u32, a: Path, b: Path, c: Path) -> Path {
    if f == 0u { return a; }
    if f == 1u { return b; }
    return c;
}

/// Whether `new` shows the same as `old`, which then stays, or is bettered.
fn is_known(old: ptr<function, Sample>, new_: Sample) -> bool {
    if (*old).depth >= NONE || (*old).layer % 2u != new_.layer % 2u { return false; }
    if (*old).layer != new_.layer {
        return all(abs((*old).home - new_.home) < vec2f(SAME_PLACE));
    }
    if any(abs((*old).at - new_.at) >= vec2f(SAME)) { return false; }
    if new_.miss < (*old).miss { *old = new_; }
    return true;
}

fn insert(seen: ptr<function, Seen>, found: Sample) {
    var new_ = found;
    var a = (*seen).a;
    var b = (*seen).b;
    var c = (*seen).c;
    let known = is_known(&a, new_) || is_known(&b, new_) || is_known(&c, new_);
    if !known {
        if new_.depth < a.depth {
            c = b;
            b = a;
            a = new_;
        } else if new_.depth < b.depth {
            c = b;
            b = new_;
        } else if new_.depth < c.depth {
            c = new_;
        }
    }
    *seen = Seen(a, b, c);
}

struct Part {
    color: vec4f,
    weight: f32,
    cover: f32,
}

/// The colour of a sample, from the texels of its own surface.
fn fetch(now: Sample) -> Part {
    let size = vec2f(frame.size);
    var part = Part();
    let source = now.layer / 2u;
    let is_far = now.layer % 2u == 1u;
    let simple = now.plain && (now.calm || !WEIGHTED);
    if simple {
        part.weight = 1.0;
        if WEIGHTED { part.weight = textureLoad(surfaces, vec2u(now.at), source, 0).w; }
        part.cover = 1.0;
    }
    var smooth_ = simple && !now.calm;
    for (; smooth_; smooth_ = false) {
        part.color = textureSampleLevel(colors, linear, now.at / size, now.layer, 0.0);
    }
    var sharp = simple && now.calm;
    for (; sharp; sharp = false) { part.color = cubic(now.at, now.layer); }
    let corner = floor(now.at - 0.5);
    let share = now.at - 0.5 - corner;
    let count = select(4u, 0u, simple);
    for (var i = 0u; i < count; i++) {
        let step = vec2f(vec2u(i & 1u, i >> 1u));
        let px = vec2u(clamp(corner + step, vec2f(0.0), size - 1.0));
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
        part.color += amount * textureLoad(colors, px, 2u * source + u32(from_far), 0);
        part.weight += amount * select(there.w, 1.0, from_far);
        part.cover += amount * select(there.z, 1.0, is_far);
    }
    if is_far && part.cover > 1e-4 {
        part.color /= part.cover;
        part.weight /= part.cover;
        part.cover = 1.0;
    }
    return part;
}

/// Catmull-Rom interpolation by five bilinear samples; the corners of the 4 x 4, which weigh next to
/// nothing, are left out.
fn cubic(at: vec2f, layer: u32) -> vec4f {
    let one = floor(at - 0.5) + 0.5;
    let f = at - one;
    let w0 = f * (-0.5 + f * (1.0 - 0.5 * f));
    let w2 = f * (0.5 + f * (2.0 - 1.5 * f));
    let w3 = f * f * (-0.5 + 0.5 * f);
    let middle = 1.0 - w0 - w3;         // of the two inner texels together
    let texel = 1.0 / vec2f(frame.size);
    let inner = (one + w2 / middle) * texel;
    let first = (one - 1.0) * texel;
    let last = (one + 2.0) * texel;
    let both = middle.x * middle.y;
    let sum = both * textureSampleLevel(colors, linear, inner, layer, 0.0)
        + w0.x * middle.y * textureSampleLevel(colors, linear, vec2f(first.x, inner.y), layer, 0.0)
        + w3.x * middle.y * textureSampleLevel(colors, linear, vec2f(last.x, inner.y), layer, 0.0)
        + w0.y * middle.x * textureSampleLevel(colors, linear, vec2f(inner.x, first.y), layer, 0.0)
        + w3.y * middle.x * textureSampleLevel(colors, linear, vec2f(inner.x, last.y), layer, 0.0);
    return sum / (both + (w0.x + w3.x) * middle.y + (w0.y + w3.y) * middle.x);
}
