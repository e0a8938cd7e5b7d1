// Of the changes of light, those that are seen in the picture and are more than noise.
//#include common/frame.wgsl
//#include methods/gather/shading/light.wgsl
//#include methods/gather/shading/listed.wgsl

@group(1) @binding(0) var ratio: texture_2d<f32>;       // stored as rgba16float, by measure.wgsl
@group(1) @binding(1) var scalar: texture_2d<f32>;      // stored as r32float; of `find_gain` and `limit_ratio`: output of the pass before
@group(1) @binding(2) var light_here: texture_2d<f32>;      // stored as given
@group(1) @binding(3) var albedo: texture_2d<f32>;      // stored as given
@group(1) @binding(4) var coherence: texture_2d<f32>;   // stored as r32float; of `find_gain`: output of `find_coherence`
@group(1) @binding(5) var ratio_out: Ratio;
@group(1) @binding(6) var scalar_out: Scalar;
@group(1) @binding(7) var<storage, read_write> found: FoundTiles;

alias Ratio = texture_storage_2d<rgba16float, write>;
alias Scalar = texture_storage_2d<r32float, write>;

override HAS_ALBEDO: bool = true;   // else it is 1
override COLORS: bool = false;      // the light is the picture itself: texture that is out of register is no light

const LEAST: f32 = 0.1;         // change of the logarithm of light from which on it counts; twice of it counts wholly
const INCOHERENT: f32 = 0.45;   // coherence up to which a change of the picture does not count,
const COHERENT: f32 = 0.75;     // and from which on it counts wholly
const SHOWN: f32 = 0.02;        // light times albedo from which on a change is seen wholly [linear]
const MOST: f32 = 4.0;          // greatest change of the logarithm
const FALLOFF: f32 = 0.5;       // 1 / (2 sigma^2), sigma = 1 px
const RADIUS: i32 = 3;          // of that Gaussian [px]
const NARROW_FALLOFF: f32 = 2.0;    // sigma = 0.5 px

/// A Gaussian of half a pixel over visible pixels.
@compute @workgroup_size(WG_X, WG_Y)
fn smooth_ratio(@builtin(local_invocation_index) local: u32, @builtin(workgroup_id) group: vec3u) {
    let id = listed_pixel(group, local);
    if any(id >= frame.size) { return; }
    let px = vec2i(id);
    let own = textureLoad(ratio, px, 0);
    var sum = vec4f(0.0);
    for (var k = 0; k < 9; k++) {
        let by = vec2i(k % 3, k / 3) - 1;
        let near = inside(px + by);
        let there = textureLoad(ratio, near, 0);
        sum += exp(-NARROW_FALLOFF * f32(by.x * by.x + by.y * by.y)) * there.a * vec4f(there.rgb, 1.0);
    }
    let mean = select(own.rgb, sum.rgb / max(sum.a, 1e-6), !PULLED);
    textureStore(ratio_out, px, select(vec4f(0.0), vec4f(mean, 1.0), own.a > 0.0));
}

/// Of a Gaussian, by the distance along one axis [px]; up to RADIUS.
fn weight_of(distance: i32) -> f32 {
    let weights = vec4f(1.0, exp(-FALLOFF), exp(-4.0 * FALLOFF), exp(-9.0 * FALLOFF));
    return weights[abs(distance)];
}

/// The visibility of a change.
@compute @workgroup_size(WG_X, WG_Y)
fn find_peaks(@builtin(local_invocation_index) local: u32, @builtin(workgroup_id) group: vec3u) {
    let id = listed_pixel(group, local);
    if any(id >= frame.size) { return; }
    let px = vec2i(id);
    var sum = 0.0;
    var total = 0.0;
    for (var y = -RADIUS; y <= RADIUS; y++) {
        let of_row = weight_of(y);
        for (var x = -RADIUS; x <= RADIUS; x++) {
            let weight = of_row * weight_of(x);
            let near = inside(px + vec2i(x, y));
            sum += weight * dot(textureLoad(ratio, near, 0).rgb, LUMINANCE);
            total += weight;
        }
    }
    let here = valid_light(textureLoad(light_here, px, 0));
    let there = (here + dark()) * exp(textureLoad(ratio, px, 0).rgb) - dark();
    let brighter = max(here, there);
    var surface = vec3f(1.0);
    if HAS_ALBEDO { surface = valid_light(textureLoad(albedo, px, 0)); }
    let shown = dot(surface, vec3f(1.0 / 3.0)) * dot(brighter, vec3f(1.0 / 3.0)) / SHOWN;
    textureStore(scalar_out, px, vec4f(abs(sum / total) * min(shown, 1.0)));
}

/// The agreement in sign of the changes around: displaced texture has both signs.
@compute @workgroup_size(WG_X, WG_Y)
fn find_coherence(@builtin(local_invocation_index) local: u32, @builtin(workgroup_id) group: vec3u) {
    let id = listed_pixel(group, local);
    if any(id >= frame.size) { return; }
    var sum = 0.0;
    var absolute = 0.0;
    var total = 0.0;
    for (var y = -2 * RADIUS; y <= 2 * RADIUS; y++) {
        for (var x = -2 * RADIUS; x <= 2 * RADIUS; x++) {
            let weight = exp(-0.25 * FALLOFF * f32(x * x + y * y));     // sigma = 2 px
            let near = inside(vec2i(id) + vec2i(x, y));
            let change = dot(textureLoad(ratio, near, 0).rgb, LUMINANCE);
            sum += weight * change;
            absolute += weight * abs(change);
            total += weight;
        }
    }
    textureStore(scalar_out, id, vec4f(abs(sum) / max(absolute, 1e-4 * total)));
}

/// The greatest of 5 x 5, from 0 for pixels that do not count to 1.
@compute @workgroup_size(WG_X, WG_Y)
fn find_gain(@builtin(local_invocation_index) local: u32, @builtin(workgroup_id) group: vec3u) {
    let id = listed_pixel(group, local);
    if any(id >= frame.size) { return; }
    var most = 0.0;
    for (var k = 0; k < 25; k++) {
        let near = inside(vec2i(id) + vec2i(k % 5, k / 5) - 2);
        most = max(most, textureLoad(scalar, near, 0).x);
    }
    var gain = clamp((most - LEAST) / LEAST, 0.0, 1.0);
    if COLORS {
        var agreed = 0.0;
        for (var k = 0; k < 9; k++) {
            let near = inside(vec2i(id) + vec2i(k % 3, k / 3) - 1);
            agreed = max(agreed, textureLoad(coherence, near, 0).x);
        }
        gain *= clamp((agreed - INCOHERENT) / (COHERENT - INCOHERENT), 0.0, 1.0);
    }
    textureStore(scalar_out, id, vec4f(gain));
}

/// The changes that count.
@compute @workgroup_size(WG_X, WG_Y)
fn limit_ratio(@builtin(local_invocation_index) local: u32, @builtin(workgroup_id) group: vec3u) {
    let id = listed_pixel(group, local);
    if any(id >= frame.size) { return; }
    let px = vec2i(id);
    let own = textureLoad(ratio, px, 0);
    let rows = select(-RADIUS - 1, RADIUS, any(own.a * own.rgb != vec3f(0.0)));     // none where there is nothing to limit
    var sum = 0.0;
    var total = 1e-20;
    for (var y = -RADIUS; y <= rows; y++) {
        let of_row = weight_of(y);
        for (var x = -RADIUS; x <= RADIUS; x++) {
            let weight = of_row * weight_of(x);
            let near = inside(px + vec2i(x, y));
            sum += weight * textureLoad(scalar, near, 0).x;
            total += weight;
        }
    }
    let change = clamp(sum / total * own.a * own.rgb, vec3f(-MOST), vec3f(MOST));
    if any(change != vec3f(0.0)) {
        atomicMax(&found.any, 1u);
        for (var k = 0; k < 4; k++) {
            let near = vec2u(inside(px + 2 * vec2i(k & 1, k >> 1u) - 1));
            atomicOr(&found.tiles[light_tile(near)], CHANGES);
        }
    }
    textureStore(ratio_out, px, vec4f(change, own.a));
}
