// What the light of a picture differs from its mean over the exposure, where the same is seen in another light before
// or after it. Between two pictures, light is taken to change evenly.
//#include common/frame.wgsl

struct Light {
    ways: vec4f,        // from the motion to the ways to the previous and to the next picture
    shares: vec2f,      // of their light in the exposure; 0: there is none
    part: f32,          // of the exposure that this picture stands for
    begins: u32,        // 1: the first picture of the exposure
}

@group(1) @binding(0) var<uniform> light: Light;
@group(1) @binding(1) var here: texture_2d<f32>;        // as reduce.wgsl leaves them
@group(1) @binding(2) var prev: texture_2d<f32>;
@group(1) @binding(3) var next: texture_2d<f32>;
@group(1) @binding(4) var motion: texture_2d<f32>;      // to_prev, to_next [px]
@group(1) @binding(5) var holdout: texture_2d<f32>;     // 1 stays as it is; of one pixel, 0, where nothing does
@group(1) @binding(6) var<storage, read_write> changes: array<vec4f>;   // of all small pixels, linear

override STEP: u32 = 4u;

const SIDE: i32 = 5;            // of a patch [small px]
const RADIUS: i32 = 2;
const UNLIKE: f32 = 0.0314;     // deviation that another brightness and contrast do not explain: something else
const FAR: f32 = 0.235;         // mean difference of something else,
const NOISE: f32 = 0.0157;      // and of nothing
const LEAST: f32 = 1.5e-5;      // variance

@compute @workgroup_size(WG_X, WG_Y)
fn main(@builtin(global_invocation_id) id: vec3u) {
    if any(id.xy >= frame.size) { return; }
    let px = min(STEP * id.xy + STEP / 2u, textureDimensions(motion) - 1u);
    let ways = light.ways * textureLoad(motion, px, 0) / f32(STEP);
    var change = vec3f(0.0);
    if light.shares.x > 0.0 { change += light.shares.x * toward(prev, vec2i(id.xy), ways.xy); }
    if light.shares.y > 0.0 { change += light.shares.y * toward(next, vec2i(id.xy), ways.zw); }
    let held = textureLoad(holdout, min(px, textureDimensions(holdout) - 1u), 0).x;
    let index = id.y * frame.size.x + id.x;
    let before = select(changes[index].xyz, vec3f(0.0), light.begins == 1u);
    changes[index] = vec4f(before + light.part * (1.0 - held) * change, 0.0);
}

/// Difference of the light at the end of a way, as far as the same is seen there.
fn toward(other: texture_2d<f32>, px: vec2i, way: vec2f) -> vec3f {
    let last = vec2i(frame.size) - 1;
    let to = vec2f(px) + way;
    if any(to < vec2f(0.0)) || any(to > vec2f(last)) { return vec3f(0.0); }
    var apart = vec3f(0.0);
    var sums = vec2f(0.0);      // of grey, here and there
    var squares = vec3f(0.0);   // of grey here, there, and their product
    for (var k = 0; k < SIDE * SIDE; k++) {
        let by = vec2i(k % SIDE, k / SIDE) - RADIUS;
        let own = textureLoad(here, clamp(px + by, vec2i(0), last), 0).rgb;
        let found = between(other, to + vec2f(by));
        let greys = vec2f(dot(own, vec3f(1.0 / 3.0)), dot(found, vec3f(1.0 / 3.0)));
        apart += found - own;
        sums += greys;
        squares += greys.xyx * greys.xyy;
    }
    let count = f32(SIDE * SIDE);
    let means = sums / count;
    let spread = squares / count - means.xyx * means.xyy;
    let along = max(spread.z, 0.0);
    let unlike = max(spread.x - along * along / max(spread.y, LEAST), 0.0);
    let far = dot(abs(apart), vec3f(1.0 / 3.0)) / count;
    let same = exp(-unlike / (UNLIKE * UNLIKE) - far * far / (FAR * FAR)) * (1.0 - exp(-far * far / (NOISE * NOISE)));
    let own = textureLoad(here, px, 0).rgb;
    let found = between(other, to);
    return same * (found * found - own * own);
}

/// A small picture between its pixels, whose centres are whole numbers.
fn between(picture: texture_2d<f32>, at: vec2f) -> vec3f {
    let last = vec2i(frame.size) - 1;
    let inside = clamp(at, vec2f(0.0), vec2f(last));
    let a = vec2i(inside);
    let b = min(a + 1, last);
    let t = fract(inside);
    let top = mix(textureLoad(picture, a, 0).rgb, textureLoad(picture, vec2i(b.x, a.y), 0).rgb, t.x);
    let low = mix(textureLoad(picture, vec2i(a.x, b.y), 0).rgb, textureLoad(picture, b, 0).rgb, t.x);
    return mix(top, low, t.y);
}
