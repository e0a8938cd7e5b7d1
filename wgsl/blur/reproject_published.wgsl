// Sample reprojection as published (Taylor): the samples of two frames, rounded to pixels and counted
// at every camera between the two. Samples that land on a pixel are linked to a list, which is then summed.
//#include common/camera.wgsl
//#include common/finite.wgsl
//#include common/frame.wgsl
//#include common/path.wgsl

struct Step {
    clip_from_pixel: mat4x4f,   // of the interpolated camera
    eye: vec4f,                 // its place in the world; a direction where it is orthographic
    time: f32,                  // share of the way to the other frame; negative: to the previous one
}

struct Chunk {                  // steps of one source that are done together
    viewport: Viewport,
    world_from_pixel: mat4x4f,  // of the source's own camera
    eye: vec4f,
    bits: vec2u,                // of a sample's number: those of x, those of x and y
    steps: u32,
    first: u32,                 // 1: the first, the last of a picture
    last: u32,
}

@group(1) @binding(0) var<uniform> chunk: Chunk;
@group(1) @binding(1) var<uniform> steps: array<Step, ROWS>;
@group(1) @binding(2) var color: texture_2d<f32>;       // of the source frame
@group(1) @binding(3) var motion: texture_2d<f32>;      // of the source frame: to_prev, to_next [px]
@group(1) @binding(4) var depth: texture_2d<f32>;       // of the source frame
@group(1) @binding(5) var normal: texture_2d<f32>;      // of the source frame, in the world
@group(1) @binding(6) var weight: texture_2d<f32>;      // of the source frame, 0: is not moved
@group(1) @binding(7) var own: texture_2d<f32>;         // the frame itself, for pixels that nothing reached
@group(1) @binding(8) var<storage, read_write> heads: array<atomic<u32>>;   // of a pixel's list: number + 1; 0: empty, as a chunk finds and leaves it
@group(1) @binding(9) var<storage, read_write> links: array<u32>;           // per sample and step: the next one + 1
@group(1) @binding(10) var<storage, read_write> sums: array<atomic<u32>>;   // r, g, b, a per pixel, low words; of lines times UNIT
@group(1) @binding(11) var<storage, read_write> carries: array<atomic<u32>>;    // the high words
@group(1) @binding(12) var<storage, read_write> counts: array<atomic<u32>>; // in shares of UNIT
@group(1) @binding(13) var output: Output;

override CAMERA: bool = false;      // move by the interpolated camera, not along the motion
override WEIGHTED: bool = false;
override COUNTS: bool = false;      // show the share of the steps that reached a pixel
override FACING: bool = false;      // leave out surfaces that face away from the interpolated camera
override NORMALS: bool = false;     // read `normal` for that, not the depth's slope
override LINES: bool = false;       // `lines` and then `gather`, not `link` and `gather`
override NEAREST_ONLY: bool = false;    // of the samples on a pixel, the nearest; one step a chunk

// Fixed point, so that the order of additions does not matter: 64 bits cannot overflow.
const STEPS_PER_UNIT: f32 = 16384.0;
const LARGEST: f32 = 262143.0;      // colour beyond this, and below 0, is held to the range [linear]
const UNIT: u32 = 1024u;            // what a sample counts that lies on one pixel for a whole step
const MOST: u32 = 60000u;           // samples in one pixel's list: lavapipe ends loops soon after
const ROWS: u32 = 17u;             // steps of a chunk, and one more where a line ends
const LONGEST: f32 = 4000.0;        // line in one step [px]; beyond it, points have gaps

/// Link every sample to the pixels that it is rounded to, one a step.
@compute @workgroup_size(WG_X, WG_Y)
fn link(@builtin(global_invocation_id) id: vec3u) {
    if any(id.xy >= frame.size) { return; }
    let sample = sample_at(id.xy);
    let size = vec2i(frame.size);
    let pixels = frame.size.x * frame.size.y;
    let shift = chunk.bits.y;
    let index = id.y * frame.size.x + id.x;
    let number = 1u + (id.y << chunk.bits.x) + id.x;
    let count = select(0u, chunk.steps, sample.counts);
    for (var k = 0u; k < count; k++) {
        let to = vec2i(floor(vec2f(id.xy) + 0.5 + way(sample, k)));
        if any(to < vec2i(0)) || any(to >= size) || turned_away(sample, k) { continue; }
        links[k * pixels + index] = atomicExchange(&heads[to.y * size.x + to.x], number + (k << shift));
    }
}

/// Sum a pixel's list: any order gives the same bits.
@compute @workgroup_size(WG_X, WG_Y)
fn gather(@builtin(global_invocation_id) id: vec3u) {
    if any(id.xy >= frame.size) { return; }
    let at = id.y * frame.size.x + id.x;
    let pixels = frame.size.x * frame.size.y;
    let row = frame.size.x;
    let bits = chunk.bits;
    let mask = vec2u((1u << chunk.bits.x) - 1u, (1u << chunk.bits.y) - 1u);
    var low = vec4u(0u);
    var high = vec4u(0u);
    var count = 0u;
    let before_first = select(4u, 0u, chunk.first == 1u);   // only loops not entered save time everywhere
    for (var c = 0u; c < before_first; c++) {
        low[c] = atomicLoad(&sums[4u * at + c]);
        high[c] = atomicLoad(&carries[4u * at + c]);
        count = atomicLoad(&counts[at]);
    }
    var best = vec2u(0xffffffffu);      // bits of depth, number
    var next = atomicLoad(&heads[at]);
    for (var turn = 0u; next != 0u && turn < MOST; turn++) {
        let number = next - 1u;
        let px = vec2u(number & mask.x, (number & mask.y) >> bits.x);
        next = links[(number >> bits.y) * pixels + px.y * row + px.x];
        if NEAREST_ONLY {
            let key = bitcast<u32>(depth_then(sample_at(px)));
            if key < best.x || (key == best.x && number < best.y) { best = vec2u(key, number); }
        } else {
            let before = low;
            low += fixed(px);
            high += select(vec4u(0u), vec4u(1u), low < before);
            count += UNIT;
        }
    }
    if NEAREST_ONLY && best.y != 0xffffffffu {
        let before = low;
        low += fixed(vec2u(best.y & mask.x, best.y >> chunk.bits.x));
        high += select(vec4u(0u), vec4u(1u), low < before);
        count += UNIT;
    }
    atomicStore(&heads[at], 0u);
    let after_last = select(4u, 0u, chunk.last == 1u);
    for (var c = 0u; c < after_last; c++) {
        atomicStore(&sums[4u * at + c], low[c]);
        atomicStore(&carries[4u * at + c], high[c]);
        atomicStore(&counts[at], count);
    }
    if after_last > 0u { return; }
    let share = f32(count) / f32(UNIT);
    var result = textureLoad(own, id.xy, 0);
    let whole = STEPS_PER_UNIT * select(1.0, f32(UNIT), LINES);
    if count > 0u { result = (vec4f(high) * 4294967296.0 + vec4f(low)) / (share * whole); }
    if COUNTS { result = vec4f(vec3f(share / (2.0 * f32(frame.samples))), 1.0); }
    textureStore(output, id.xy, result);
}

/// Draw every sample from its place at a step to that at the next; each pixel has its share of the step.
@compute @workgroup_size(WG_X, WG_Y)
fn lines(@builtin(global_invocation_id) id: vec3u) {
    if any(id.xy >= frame.size) { return; }
    let sample = sample_at(id.xy);
    let value = fixed(id.xy);
    let x = vec2f(id.xy) + 0.5;
    let count = select(0u, chunk.steps, sample.counts);
    for (var k = 0u; k < count; k++) {
        let start = x + way(sample, k);
        let along = x + way(sample, k + 1u) - start;     // the last step of all ends where it begins
        if any(abs(start) > vec2f(1e6)) || any(abs(along) > vec2f(1e6)) || turned_away(sample, k) { continue; }
        let points = clamp(ceil(max(abs(along.x), abs(along.y))), 1.0, LONGEST);
        let share = u32(f32(UNIT) / points);
        for (var i = 0.0; i < points; i += 1.0) {
            let to = vec2i(floor(start + along * (i / points)));
            if any(to < vec2i(0)) || any(to >= vec2i(frame.size)) { continue; }
            add(u32(to.y) * frame.size.x + u32(to.x), value, share);
        }
    }
}

/// Add a share of a sample to a pixel: 42 bits to 64.
fn add(at: u32, value: vec4u, share: u32) {
    let low = value * share;
    let high = ((value >> vec4u(16u)) * share + (((value & vec4u(0xffffu)) * share) >> vec4u(16u))) >> vec4u(16u);
    for (var c = 0u; c < 4u; c++) {
        let before = atomicAdd(&sums[4u * at + c], low[c]);
        let more = high[c] + select(0u, 1u, before + low[c] < before);
        if more > 0u { atomicAdd(&carries[4u * at + c], more); }
    }
    atomicAdd(&counts[at], share);
}

/// The colour at `px` in fixed point.
fn fixed(px: vec2u) -> vec4u {
    return vec4u(clamp(textureLoad(color, px, 0), vec4f(0.0), vec4f(LARGEST)) * STEPS_PER_UNIT + 0.5);
}

struct Sample {
    path: Trajectory,         // without a camera
    ndc: vec2f,
    here: vec4f,        // homogeneous pixel
    place: vec4f,       // in the world, up to a positive factor
    normal: vec3f,      // in the world; 0 where none is known
    depth: f32,
    counts: bool,
}

fn sample_at(px: vec2u) -> Sample {
    var s: Sample;
    s.depth = textureLoad(depth, px, 0).x;
    s.counts = true;
    if WEIGHTED { s.counts = textureLoad(weight, px, 0).x > 0.0; }
    if !CAMERA {
        s.path = trajectory_from(textureLoad(motion, px, 0));
        return s;
    }
    let viewport = chunk.viewport;
    s.ndc = ndc_of(viewport, px);
    let nothing_there = is_nothing(viewport, s.depth);
    s.here = homogeneous(viewport, s.ndc, s.depth, nothing_there);
    s.place = chunk.world_from_pixel * s.here;
    if FACING && !nothing_there {
        if NORMALS { s.normal = textureLoad(normal, px, 0).xyz; } else { s.normal = slope(vec2i(px), s.place); }
        if !is_finite4(vec4f(s.normal, 0.0)) { s.normal = vec3f(0.0); }
    }
    return s;
}

/// The normal that the depths around `px` have, towards the source's camera.
fn slope(px: vec2i, place: vec4f) -> vec3f {
    let right = tangent(px, vec2i(1, 0), place);
    let down = tangent(px, vec2i(0, 1), place);
    let n = cross(right, down);
    let seen = dot(n, chunk.eye.xyz * place.w - place.xyz * chunk.eye.w);
    return select(-n, n, seen > 0.0);
}

/// Of the ways to the places of both neighbours the shorter one; 0 without neighbours.
fn tangent(px: vec2i, step: vec2i, place: vec4f) -> vec3f {
    let here = place.xyz / place.w;
    var best = vec3f(0.0);
    var least = 1e30;
    for (var side = -1; side <= 1; side += 2) {
        let there = px + side * step;
        if any(there < vec2i(0)) || any(there >= vec2i(frame.size)) { continue; }
        let z = textureLoad(depth, there, 0).x;
        if is_nothing(chunk.viewport, z) { continue; }
        let other = chunk.world_from_pixel * homogeneous(chunk.viewport, ndc_of(chunk.viewport, vec2u(there)), z, false);
        let apart = other.xyz / other.w - here;
        if length(apart) < least {
            least = length(apart);
            best = apart * f32(side);
        }
    }
    return best;
}

/// How far the sample has moved at step `k` [px].
fn way(s: Sample, k: u32) -> vec2f {
    if !CAMERA { return displacement(s.path, steps[k].time); }
    let clip = steps[k].clip_from_pixel * s.here;
    if clip.w <= MIN_W { return vec2f(1e9); }
    return to_pixels(chunk.viewport, clip, s.ndc);
}

/// Depth at step 0 of the chunk, as positive floats in their order.
fn depth_then(s: Sample) -> f32 {
    if !CAMERA { return select(1e30, s.depth, is_finite(s.depth) && s.depth > 0.0); }
    let clip = steps[0].clip_from_pixel * s.here;
    if steps[0].eye.w == 0.0 { return clip.z / clip.w + 1.0; }
    return select(1e30, clip.w / s.place.w, s.place.w > 0.0);
}

/// Whether the surface faces away from the camera of step `k`.
fn turned_away(s: Sample, k: u32) -> bool {
    if !FACING { return false; }
    let eye = steps[k].eye;
    return dot(s.normal, eye.xyz * s.place.w - s.place.xyz * eye.w) < 0.0;
}
