// Motion of light over the surfaces to another frame: dense inverse search (Kroeger, Timofte, Dai and Van Gool,
// "Fast Optical Flow using Dense Inverse Search", 2016) of small pictures without texture. Patches on a grid are
// compared without their means; each starts from the coarser level, from standing still, and from its neighbours.
//#include common/frame.wgsl
//#include methods/gather/shading/light.wgsl
//#include methods/gather/shading/listed.wgsl
//#include methods/gather/shading/resting.wgsl

@group(1) @binding(0) var here: texture_2d<f32>;        // stored as rgba16float: a level of pyramid.wgsl
@group(1) @binding(1) var there: texture_2d<f32>;       // stored as rgba16float: its `squares`
@group(1) @binding(2) var coarse: texture_2d<f32>;      // stored as rgba16float: by `write_flow`, of the coarser level; 1 x 1: there is none
@group(1) @binding(3) var patches: texture_2d<f32>;     // stored as rgba32float; of `propagate` and `write_flow`: output of the pass before
@group(1) @binding(4) var patches_out: Patches;         // flow [px], squared difference
@group(1) @binding(5) var flow_out: Flow;

alias Patches = texture_storage_2d<rgba32float, write>;
alias Flow = texture_storage_2d<rgba16float, write>;

override IS_COARSE: bool = false;                   // see COARSE of flow.py
override APART: i32 = select(2, 1, IS_COARSE);      // from one pixel of a patch that is compared to the next [px]
override TAPS: i32 = PATCH / APART;                 // along a side; the gradients are those of all pixels

const PATCH: i32 = 12;          // side [px]
const STRIDE: i32 = 4;          // from one patch to the next [px]
const EVERY: i32 = 2;           // px of a coarse level from one to the next whose flow is told: patches begin at the others
const STEPS: i32 = 8;           // most of a search
const SHORT: f32 = 0.02;        // a step shorter than this ends it [px]
const FLAT: f32 = 1e-5;         // mean squared gradient below which a patch does not tell its motion
const STILL: f32 = 1e-6;        // mean squared difference below which a patch stays where it is
const UNLIKE: f32 = 10.0;      // inverse difference of brightness from which on a patch counts less

/// Patches along a side of this many pixels.
fn patches_along(size: vec2i) -> vec2i {
    return max(size - PATCH + STRIDE - 1, vec2i(0)) / STRIDE + 1;
}

fn corner_of(patch_index: vec2i, size: vec2i) -> vec2i {
    return max(min(STRIDE * patch_index, size - PATCH), vec2i(0));
}

struct Patch {
    corner: vec2i,
    mean: f32,
    inverse: vec3f,     // of the matrix of gradients: xx, xy, yy
    is_flat: bool,
}

fn patch_at(corner: vec2i, last: vec2i) -> Patch {
    var sum = 0.0;
    var m = vec3f(0.0);
    for (var k = 0; k < TAPS * TAPS; k++) {
        let px = min(corner + APART * vec2i(k % TAPS, k / TAPS), last);
        let a = textureLoad(here, px, 0).xyz;
        sum += a.x;
        m += vec3f(a.y * a.y, a.y * a.z, a.z * a.z);
    }
    let count = f32(TAPS * TAPS);
    let is_flat = m.x + m.z < FLAT * count;
    // A little is added, so that along an edge without corners a patch stays where it is.
    let held = m + (0.001 * (m.x + m.z) + 1e-9) * vec3f(1.0, 0.0, 1.0);
    let inverse = vec3f(held.z, -held.y, held.x) / (held.x * held.z - held.y * held.y);
    return Patch(corner, sum / count, inverse, is_flat);
}

/// Between pixels, of which (0, 0) is the first one's middle; edges repeat.
fn brightness_there(at: vec2f, last: vec2i) -> f32 {
    let near = clamp(at, vec2f(0.0), vec2f(last));
    let px = vec2i(near);
    let share = near - vec2f(px);
    let square = textureLoad(there, px, 0);
    let pair = mix(square.xz, square.yw, share.x);
    return mix(pair.x, pair.y, share.y);
}

struct Compared {
    cost: f32,
    step: vec2f,
}

/// The difference of the patch from its moved copy, and the step that reduces it.
fn compare(one: Patch, by: vec2f, last: vec2i) -> Compared {
    var sum = 0.0;
    var sum2 = 0.0;
    var slope = vec2f(0.0);
    var slope_sum = vec2f(0.0);
    for (var k = 0; k < TAPS * TAPS; k++) {
        let px = min(one.corner + APART * vec2i(k % TAPS, k / TAPS), last);
        let a = textureLoad(here, px, 0).xyz;
        let d = brightness_there(vec2f(px) + by, last) - a.x;
        sum += d;
        sum2 += d * d;
        slope += a.yz * d;
        slope_sum += a.yz;
    }
    let mean = sum / f32(TAPS * TAPS);
    let force = slope - mean * slope_sum;
    let step = -vec2f(one.inverse.x * force.x + one.inverse.y * force.y,
                      one.inverse.y * force.x + one.inverse.z * force.y);
    return Compared(sum2 - mean * sum, step);
}

struct Best {
    flow: vec2f,
    found: Compared,
}

fn take(best: ptr<function, Best>, one: Patch, flow: vec2f, last: vec2i) {
    if all(abs(flow - (*best).flow) < vec2f(0.05)) { return; }
    let found = compare(one, flow, last);
    if found.cost < (*best).found.cost { *best = Best(flow, found); }
}

/// Gauss and Newton's steps from the best start, while they help.
fn descend(best: ptr<function, Best>, one: Patch, last: vec2i) {
    let start = (*best).flow;
    for (var i = 0; i < STEPS; i++) {
        let step = (*best).found.step;
        let flow = (*best).flow + step;
        let far = flow - start;
        if dot(step, step) < SHORT * SHORT || dot(far, far) > f32(PATCH * PATCH) { break; }
        let found = compare(one, flow, last);
        if found.cost >= (*best).found.cost { break; }
        *best = Best(flow, found);
    }
}

/// At a pixel of this level [px of it].
fn coarse_flow(px: vec2i, last: vec2i) -> vec2f {
    let size = vec2i(textureDimensions(coarse));
    if all(size == vec2i(1)) { return vec2f(0.0); }
    let near = clamp(px / (2 * EVERY), vec2i(0), size - 1);
    return 2.0 * textureLoad(coarse, near, 0).xy;
}

/// False for a pixel of a level that is far from all changes. On coarse levels, patches are larger than that distance.
fn counts(px: vec2i) -> bool {
    return IS_COARSE || is_near(in_frame(vec2u(px), textureDimensions(here)));
}

/// Each patch by itself.
@compute @workgroup_size(WG_X, WG_Y)
fn search(@builtin(global_invocation_id) id: vec3u) {
    let size = vec2i(textureDimensions(here));
    if any(vec2i(id.xy) >= patches_along(size)) { return; }
    let last = size - 1;
    if !counts(min(corner_of(vec2i(id.xy), size) + PATCH / 2, last)) {
        textureStore(patches_out, id.xy, vec4f(0.0));
        return;
    }
    let one = patch_at(corner_of(vec2i(id.xy), size), last);
    let middle = one.corner + PATCH / 2;
    var best = Best(vec2f(0.0), compare(one, vec2f(0.0), last));
    let moves = !one.is_flat && best.found.cost > STILL * f32(TAPS * TAPS);
    if one.is_flat { best.flow = coarse_flow(middle, last); }
    if moves {
        take(&best, one, coarse_flow(middle, last), last);
        for (var k = 0; k < 4; k++) {
            take(&best, one, coarse_flow(middle + PATCH * (2 * vec2i(k % 2, k / 2) - 1), last), last);
        }
        descend(&best, one, last);
    }
    textureStore(patches_out, id.xy, vec4f(best.flow, best.found.cost, f32(moves)));
}

/// Each patch from the results of its neighbours.
@compute @workgroup_size(WG_X, WG_Y)
fn propagate(@builtin(global_invocation_id) id: vec3u) {
    let size = vec2i(textureDimensions(here));
    let count = patches_along(size);
    if any(vec2i(id.xy) >= count) { return; }
    let last = size - 1;
    let index = id.xy;
    let own = textureLoad(patches, index, 0);
    var best = Best(own.xy, Compared(own.z, vec2f(0.0)));
    if own.w > 0.0 {
        let one = patch_at(corner_of(vec2i(id.xy), size), last);
        best.found = compare(one, own.xy, last);
        for (var k = 0; k < 9; k++) {
            let near = clamp(vec2i(id.xy) + 2 * (vec2i(k % 3, k / 3) - 1), vec2i(0), count - 1);
            take(&best, one, textureLoad(patches, near, 0).xy, last);
        }
        descend(&best, one, last);
    }
    textureStore(patches_out, id.xy, vec4f(best.flow, best.found.cost, own.w));
}

/// The flow of a coarse level, of the last of EVERY x EVERY pixels [px of it]: the middles of the finer level's patches are there.
@compute @workgroup_size(WG_X, WG_Y)
fn write_flow(@builtin(global_invocation_id) id: vec3u) {
    let size = vec2i(textureDimensions(here));
    let px = min(EVERY * vec2i(id.xy) + EVERY - 1, size - 1);
    if any(EVERY * vec2i(id.xy) >= size) { return; }
    textureStore(flow_out, id.xy, vec4f(flow_at(px), 0.0, 0.0));
}

/// That of the finest level, in tiles close to changes.
@compute @workgroup_size(WG_X, WG_Y)
fn write_finest(@builtin(local_invocation_index) local: u32, @builtin(workgroup_id) group: vec3u) {
    let id = listed_pixel(group, local);
    if any(id >= frame.size) { return; }
    textureStore(flow_out, id, vec4f(flow_at(vec2i(id)), 0.0, 0.0));
}

/// The mean of the patches over a pixel, those most that it is alike by; far from all changes none.
fn flow_at(px: vec2i) -> vec2f {
    let size = vec2i(textureDimensions(here));
    let count = patches_along(size);
    let own = textureLoad(here, px, 0).x;
    let first = px / STRIDE - PATCH / STRIDE + 1;
    let along = select(vec2i(PATCH / STRIDE), vec2i(PATCH / STRIDE + 1), px >= size - PATCH);   // at the picture's end, one more
    let turns = select(0, along.x * along.y, counts(px));
    var sum = vec3f(0.0);
    for (var k = 0; k < turns; k++) {
        let index = clamp(first + vec2i(k % along.x, k / along.x), vec2i(0), count - 1);
        let corner = corner_of(index, size);
        let covers = all(px >= corner) && all(px < corner + PATCH);
        let flow = textureLoad(patches, index, 0).xy;
        let found = brightness_there(vec2f(px) + flow, size - 1);
        sum += select(0.0, 1.0 / max(1.0, UNLIKE * abs(found - own)), covers) * vec3f(flow, 1.0);
    }
    return sum.xy / max(sum.z, 1e-6);
}
