// A Gaussian at half the size, along one axis a pass.
//#include common/frame.wgsl
//#include methods/gather/shading/listed.wgsl
//#include methods/gather/shading/light.wgsl

@group(1) @binding(0) var source: texture_2d<f32>;        // stored as rgba32float; of `down`: output of `across`
@group(1) @binding(1) var output: Blurred;

alias Blurred = texture_storage_2d<rgba32float, write>;

override SIGMA: f32 = 5.0;      // [px of the whole image]
override REACH: i32 = i32(ceil(1.5 * SIGMA));   // [px of the half one]

/// Of every square of 2 x 2 pixels one is read, each of the four in turn.
@compute @workgroup_size(WG_X, WG_Y)
fn across(@builtin(local_invocation_index) local: u32, @builtin(workgroup_id) group: vec3u) {
    let id = listed_half(group, local);
    if any(id >= half_size()) { return; }
    let first = 2 * vec2i(id);
    var weights = begun();
    var sum = textureLoad(source, first, 0);
    for (var k = 1; k <= REACH; k++) {
        weights = next(weights);
        let turn = vec2i(k & 1, (k >> 1u) & 1);
        let ahead = inside(first + turn + vec2i(2 * k, 0));
        let behind = inside(first + turn - vec2i(2 * k, 0));
        sum += weights.x * (textureLoad(source, ahead, 0) + textureLoad(source, behind, 0));
    }
    textureStore(output, id, sum / weights.w);
}

@compute @workgroup_size(WG_X, WG_Y)
fn down(@builtin(local_invocation_index) local: u32, @builtin(workgroup_id) group: vec3u) {
    let id = listed_half(group, local);
    if any(id >= half_size()) { return; }
    let last = vec2i(half_size()) - 1;
    var weights = begun();
    var sum = textureLoad(source, id, 0);
    for (var k = 1; k <= REACH; k++) {
        weights = next(weights);
        let ahead = min(vec2i(id) + vec2i(0, k), last);
        let behind = max(vec2i(id) - vec2i(0, k), vec2i(0));
        sum += weights.x * (textureLoad(source, ahead, 0) + textureLoad(source, behind, 0));
    }
    textureStore(output, id, sum / weights.w);
}

/// A weight, 1 at first; its ratio to the one before, and that of the next one; the sum of all up to there, on both sides.
fn begun() -> vec4f {
    let s = 0.25 * SIGMA * SIGMA;       // [square of 2 px]
    return vec4f(1.0, exp(-0.5 / s), exp(-1.0 / s), 1.0);
}

/// exp(-(k + 1)^2 / 2 s) = exp(-k^2 / 2 s) exp(-(2 k + 1) / 2 s).
fn next(w: vec4f) -> vec4f {
    let weight = w.x * w.y;
    return vec4f(weight, w.y * w.z, w.z, w.w + 2.0 * weight);
}
