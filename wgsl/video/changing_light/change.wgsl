// The difference between the light of a picture and its mean over the exposure, where the same is seen in another light before
// or after it, or where neither shows it. Between two pictures, light is taken to change evenly. Where a picture stands,
// this tells how far, and changed.wgsl takes each pixel's own light of the neighbours, which averages noise and jitter.
//#include common/frame.wgsl

struct End {
    gained: vec3f,      // light at the end of a way, less that at its start; none for noise
    same: f32,          // 0 to 1: how far the same is seen there
    near: f32,          // 0 to 1: how far light there is little apart
}

struct Light {
    factors: vec2f,     // from the ways to the previous and the next picture to those in `motion`
    shares: vec2f,      // of their light in the exposure
    exist: vec2u,       // 1: there is such a picture
    begins: u32,        // 1: the first change of the exposure
    whole: u32,         // 1: the picture is all of the exposure, so that static areas are known
}

@group(1) @binding(0) var<uniform> light: Light;
@group(1) @binding(1) var here: texture_2d<f32>;        // stored as rgba32float, as reduce.wgsl leaves them
@group(1) @binding(2) var previous: texture_2d<f32>;
@group(1) @binding(3) var next: texture_2d<f32>;
@group(1) @binding(4) var linear: sampler;
@group(1) @binding(5) var motion: texture_2d<f32>;      // to_prev, to_next [px]
@group(1) @binding(6) var holdout: texture_2d<f32>;     // 1 stays as it is; of one pixel, 0, where nothing does
@group(1) @binding(7) var<storage, read_write> sums: array<vec4f>;      // of the changes so far, linear, and of the shares
@group(1) @binding(8) var changes: Output;              // the same, for changed.wgsl
@group(1) @binding(9) var standing: Output;             // shares of the neighbours' light at a pixel that stands

override STEP: u32 = 4u;

const PREVIOUS: u32 = 0u;
const NEXT: u32 = 1u;
const SIDE: i32 = 5;            // of a patch [small px]
const RADIUS: i32 = 2;
const UNLIKE: f32 = 0.5;        // share of the variance that another brightness and contrast do not explain: something else
const LEAST: f32 = 1.5e-5;      // variance of one level of 255, added to every variance
const NEAR: f32 = 0.1;          // mean difference of places that may as well show something else, as a fade does little harm,
const NOISE: f32 = 0.0157;      // and of nothing
const STILL: f32 = 1.0;         // px of motion, standard deviation of static areas,
const JITTER: f32 = 3.0;        // and of motion there and back

@compute @workgroup_size(WG_X, WG_Y)
fn main(@builtin(global_invocation_id) id: vec3u) {
    if any(id.xy >= frame.size) { return; }
    let px = min(STEP * id.xy + STEP / 2u, textureDimensions(motion) - 1u);
    let ways = textureLoad(motion, px, 0) / light.factors.xxyy / f32(STEP);
    let index = id.y * frame.size.x + id.x;
    var back = End(vec3f(0.0), 1.0, 0.0);
    var ahead = back;
    if light.exist.x == 1u { back = toward(PREVIOUS, vec2i(id.xy), ways.xy); }
    if light.exist.y == 1u { ahead = toward(NEXT, vec2i(id.xy), ways.zw); }
    let lost = (1.0 - back.same) * (1.0 - ahead.same);  // a thing that neither shows is not there all the time
    let full = f32(STEP) * ways;
    let rests = vec2f(resting(full.xy, full.zw), resting(full.zw, full.xy));
    let stands = f32(light.whole) * rests * vec2f(back.near, ahead.near);
    let moving = (1.0 - stands) * (vec2f(back.same, ahead.same) + lost);
    let change = light.shares.x * moving.x * back.gained + light.shares.y * moving.y * ahead.gained;
    let before = select(sums[index], vec4f(0.0), light.begins == 1u);
    let free = 1.0 - held(id.xy);
    let sum = before + vec4f(free * change, dot(light.shares, vec2f(light.exist)));
    sums[index] = sum;
    textureStore(changes, id.xy, sum);
    textureStore(standing, id.xy, vec4f(free * light.shares * stands, 0.0, 0.0));
}

/// How far a pixel rests that has this way to a neighbour and that to the other [px], 0 to 1: one that hardly moves, or seems
/// to move there and back, as in noise and jitter. True motion goes on.
fn resting(way: vec2f, other: vec2f) -> f32 {
    let on = (way - other) / (2.0 * STILL);
    let back = (way + other) / (2.0 * JITTER);
    return exp(-min(dot(way, way) / (STILL * STILL), dot(on, on) + dot(back, back)) / 2.0);
}

/// The most that is held out of the pixels that a small pixel's change reaches.
fn held(small: vec2u) -> f32 {
    let size = textureDimensions(holdout);
    if all(size == vec2u(1u)) { return textureLoad(holdout, vec2u(0u), 0).x; }
    let middle = STEP * small + STEP / 2u;
    let end = min(middle + STEP, size);
    var most = 0.0;
    for (var y = max(middle.y, STEP) - STEP; y < end.y; y++) {
        for (var x = max(middle.x, STEP) - STEP; x < end.x; x++) {
            most = max(most, textureLoad(holdout, vec2u(x, y), 0).x);
        }
    }
    return most;
}

/// The light at the end of a way [small px].
fn toward(other: u32, px: vec2i, way: vec2f) -> End {
    let last = vec2i(frame.size) - 1;
    let to = vec2f(px) + way;
    if any(to < vec2f(0.0)) || any(to > vec2f(last)) { return End(vec3f(0.0), 1.0, 0.0); }
    var apart = vec3f(0.0);
    var totals = vec2f(0.0);    // of grey, here and there
    var squares = vec3f(0.0);   // of grey here, there, and their product
    for (var k = 0; k < SIDE * SIDE; k++) {
        let by = vec2i(k % SIDE, k / SIDE) - RADIUS;
        let at = clamp(px + by, vec2i(0), last);
        let own = textureLoad(here, at, 0).rgb;
        let found = between(other, to + vec2f(by));
        let greys = vec2f(dot(own, vec3f(1.0 / 3.0)), dot(found, vec3f(1.0 / 3.0)));
        apart += found - own;
        totals += greys;
        squares += greys.xyx * greys.xyy;
    }
    let count = f32(SIDE * SIDE);
    let means = totals / count;
    let spread = squares / count - means.xyx * means.xyy;
    let both = max(spread.z, 0.0);
    let unlike = (1.0 - both * both / ((spread.x + LEAST) * (spread.y + LEAST))) / UNLIKE;
    let far = dot(abs(apart), vec3f(1.0 / 3.0)) / count;
    let lit = exp(-unlike * unlike * unlike * unlike);
    let near = exp(-far * far / (NEAR * NEAR));
    let own = textureLoad(here, px, 0).rgb;
    let found = between(other, to);
    let gained = (1.0 - exp(-far * far / (NOISE * NOISE))) * (found * found - own * own);
    return End(gained, max(lit, near), near);
}

/// Another picture between its pixels, whose centres are whole numbers.
fn between(other: u32, at: vec2f) -> vec3f {
    let place = (at + 0.5) / vec2f(frame.size);
    if other == NEXT { return textureSampleLevel(next, linear, place, 0.0).rgb; }
    return textureSampleLevel(previous, linear, place, 0.0).rgb;
}
