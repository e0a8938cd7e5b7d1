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
@group(1) @binding(1) var near_color: texture_2d_array<f32>;    // premultiplied by alpha, coverage, weight
@group(1) @binding(2) var near_path: texture_2d_array<f32>;     // velocity, curvature
@group(1) @binding(3) var far_color: texture_2d_array<f32>;
@group(1) @binding(4) var far_path: texture_2d_array<f32>;
@group(1) @binding(5) var surface: texture_2d_array<f32>;       // near depth, far depth, coverage, weight
@group(1) @binding(6) var<storage, read> tiles: array<Tile>;    // of the frames, one after the other
@group(1) @binding(7) var own: texture_2d<f32>;                 // the frame as it came
@group(1) @binding(8) var own_weight: texture_2d<f32>;
@group(1) @binding(9) var linear: sampler;
@group(1) @binding(10) var output: Output;

override WEIGHTED: bool = false;
override CONFIDENCE: bool = false;  // show how sure the result is instead of it

const STILL: f32 = 0.01;        // paths shorter than this [px] need no search
const STEPS: u32 = 4u;          // of a search, at most
const FOUND: f32 = 0.25;        // a step shorter than this [px] ends the search
const MISS: f32 = 1.0;          // a sample farther than this [px] from the pixel is none of it
const SAME: f32 = 0.75;         // samples of one layer closer than this [px] are one
const SAME_PLACE: f32 = 2.0;    // the same across frames, by their place in the frame itself
const BEHIND: f32 = 1.05;       // ratio of depths that makes two surfaces
const NEIGHBOUR: f32 = 1.1;     // a neighbouring frame's sample counts as this much farther
const GUESSED: f32 = 1.2;       // and a background that was only inferred as this much
const NONE: f32 = 3e38;         // depth of no sample

struct Sample {
    depth: f32,         // that it competes with
    miss: f32,          // distance of its place from the pixel [px]
    at: vec2f,          // where in its frame [px]
    home: vec2f,        // where that is in the frame itself [px]
    source: u32,        // frame
    far: u32,           // 1: of the far layer
    plain: bool,        // one opaque surface all around
    true_depth: f32,
}

struct Seen {           // the nearest ones, in order
    a: Sample,
    b: Sample,
    c: Sample,
}

@compute @workgroup_size(WG_X, WG_Y)
fn main(@builtin(global_invocation_id) id: vec3u) {
    if any(id.xy >= frame.size) { return; }
    let x = vec2f(id.xy) + 0.5;
    let across = tiles_of(frame.size);
    let tile = (id.y / TILE) * across.x + id.x / TILE;
    let stride = across.x * across.y;
    let source_count = sources.count;

    // What the tile may show of each frame, and the pixel's own paths there.
    var longest = 0.0;
    var counts = vec3u(0u);
    var nearest = vec3f(NONE);
    var splits = vec3u(0u);
    var paths = array<vec4f, 3>();
    var far_paths = array<vec4f, 3>();
    for (var f = 0u; f < source_count; f++) {
        let at = f * stride + tile;
        longest = max(longest, tiles[at].longest);
        counts[f] = tiles[at].count;
        nearest[f] = tiles[at].nearest;
        splits[f] = tiles[at].split;
        paths[f] = textureLoad(near_path, id.xy, f, 0);
        far_paths[f] = textureLoad(far_path, id.xy, f, 0);
    }
    let times = shutter_times(x, frame.jitter * (pixel_noise(id.xy) - 0.5));
    let still = longest < STILL;
    let samples = select(frame.samples, 0u, still);

    var sum = vec4f(0.0);
    var total = 0.0;
    var accepted = 0.0;
    var others = 0.0;
    var missed = 0.0;
    var left = 0.0;
    for (var i = 0u; i < samples; i++) {
        let t = shutter_time(times, i);
        var seen = Seen(nothing(), nothing(), nothing());
        for (var s = 0u; s < source_count; s++) {
            // The frame itself, then the neighbour on the side of `t`, then the other one.
            let f = select(s, 3u - s, s > 0u && source_count == 3u && t > 0.0);
            let u = t - sources.offsets[f];
            let handicap = select(NEIGHBOUR, 1.0, s == 0u);
            // Nothing there could be nearer than what is seen already.
            let closed = s > 0u && seen.a.plain && seen.a.depth <= nearest[f] * handicap;
            let layers = select(1u + splits[f], 0u, closed);
            for (var layer = 0u; layer < layers; layer++) {
                let seeds = counts[f] + select(1u, 2u, splits[f] > 0u);
                let first = moved(paths[f], u);
                for (var k = 0u; k < seeds; k++) {
                    var d = first;
                    if k > 0u {
                        if k <= counts[f] {
                            d = moved(tiles[f * stride + tile].paths[k - 1u], u);
                        } else {
                            d = moved(far_paths[f], u);
                        }
                        let apart = d - first;
                        if dot(apart, apart) < FOUND * FOUND { continue; }
                    }
                    // The fixed point of q = x - displacement(q).
                    var miss = NONE;
                    var q = x;
                    var path = vec4f(0.0);
                    for (var n = 0u; n < STEPS; n++) {
                        q = x - d;
                        if !inside(q) {
                            miss = NONE;
                            break;
                        }
                        if layer == 0u {
                            path = textureLoad(near_path, vec2u(q), f, 0);
                        } else {
                            path = textureLoad(far_path, vec2u(q), f, 0);
                        }
                        let next = moved(path, u);
                        miss = distance(next, d);
                        d = next;
                        if miss < FOUND { break; }
                    }
                    if miss > MISS { continue; }
                    let there = textureLoad(surface, vec2u(q), f, 0);
                    if layer == 1u && there.y <= 0.0 { continue; }
                    let z = select(there.x, there.y, layer == 1u);
                    let place = x - d;
                    let home = place + moved(path, -sources.offsets[f]);
                    let guess = select(1.0, GUESSED, layer == 1u);
                    insert(&seen, Sample(z * handicap * guess, miss, place, home, f, layer, there.y == 0.0, z));
                }
            }
        }

        // Front to back.
        var clear = 1.0;
        var color = vec4f(0.0);
        var weight = 0.0;
        var last = nothing();
        for (var n = 0u; n < 3u; n++) {
            let now = seen.a;
            seen.a = seen.b;
            seen.b = seen.c;
            seen.c = nothing();
            if now.depth >= NONE || clear < 0.01 { break; }
            let same_frame = now.source == last.source;
            var step = BEHIND;
            if !same_frame { step *= NEIGHBOUR; }
            if same_frame && now.far != last.far { step = 0.0; }
            if n > 0u && last.depth < NONE && now.depth < last.depth * step { continue; }
            var part = fetch(now);
            if part.cover < 0.01 { continue; }
            color += clear * part.color;
            weight += clear * part.weight;
            if CONFIDENCE {
                missed += clear * part.cover * now.miss;
                if now.source > 0u { others += clear * part.cover; }
            }
            clear *= 1.0 - part.cover;
            last = now;
        }
        if clear < 0.5 {
            sum += color / (1.0 - clear);
            total += weight / (1.0 - clear);
            accepted += 1.0;
        } else {
            // The pixel's own path through the frame.
            let q = x - moved(paths[0], t);
            sum += textureSampleLevel(own, linear, q / vec2f(frame.size), 0.0);
            if WEIGHTED {
                total += textureSampleLevel(own_weight, linear, q / vec2f(frame.size), 0.0).x;
            } else {
                total += 1.0;
            }
            if !inside(q) { left += 1.0; }
        }
    }
    var result = textureLoad(own, id.xy, 0);
    if samples > 0u {
        result = select(vec4f(0.0), sum / total, total > 0.0);
    } else if WEIGHTED {
        let counted = textureLoad(own_weight, id.xy, 0).x;
        result = select(vec4f(0.0), result / counted, counted > 0.0);
    }
    if CONFIDENCE {
        result = vec4f(1.0, 0.0, 0.0, 0.0);
        if samples > 0u { result = vec4f(accepted, others, missed / max(accepted, 1.0) * f32(samples), left) / f32(samples); }
    }
    textureStore(output, id.xy, result);
}

fn nothing() -> Sample {
    return Sample(NONE, NONE, vec2f(-9.0), vec2f(-9.0), 99u, 0u, false, NONE);
}

fn inside(q: vec2f) -> bool {
    return all(q >= vec2f(0.0)) && all(q < vec2f(frame.size));
}

fn moved(path: vec4f, u: f32) -> vec2f {
    return displacement(Path(path.xy, path.zw), u);
}

/// Whether `new` shows the same as `old`, which then stays, or is bettered.
fn is_known(old: ptr<function, Sample>, new_: Sample) -> bool {
    if (*old).depth >= NONE || (*old).far != new_.far { return false; }
    if (*old).source != new_.source {
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
    if now.plain {
        part.color = textureSampleLevel(near_color, linear, now.at / size, now.source, 0.0);
        part.weight = 1.0;
        if WEIGHTED { part.weight = textureSampleLevel(surface, linear, now.at / size, now.source, 0.0).w; }
        part.cover = 1.0;
        return part;
    }
    let corner = floor(now.at - 0.5);
    let share = now.at - 0.5 - corner;
    var shares = 0.0;
    for (var i = 0u; i < 4u; i++) {
        let step = vec2f(vec2u(i & 1u, i >> 1u));
        let px = vec2u(clamp(corner + step, vec2f(0.0), size - 1.0));
        let both = mix(1.0 - share, share, step);
        let amount = both.x * both.y;
        let there = textureLoad(surface, px, now.source, 0);
        if now.far == 0u {
            if there.x > now.true_depth * BEHIND { continue; }
            part.color += amount * textureLoad(near_color, px, now.source, 0);
            part.weight += amount * there.w;
            part.cover += amount * there.z;
        } else if there.y > 0.0 {
            part.color += amount * textureLoad(far_color, px, now.source, 0);
            part.weight += amount;
            shares += amount;
        } else if there.x >= now.true_depth / BEHIND && there.x <= now.true_depth * BEHIND {
            part.color += amount * textureLoad(near_color, px, now.source, 0);
            part.weight += amount * there.w;
            shares += amount;
        }
    }
    if now.far == 1u && shares > 1e-4 {
        part.color /= shares;
        part.weight /= shares;
        part.cover = 1.0;
    }
    return part;
}
