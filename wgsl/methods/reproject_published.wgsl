// Sample reprojection as published (Taylor): the samples of two frames, rounded to pixels and averaged over all
// cameras between the two. Samples that land on a pixel are linked to a list, which is then summed.
//#include common/camera.wgsl
//#include common/depth.wgsl
//#include common/finite.wgsl
//#include common/frame.wgsl
//#include common/loops.wgsl
//#include common/path.wgsl

struct Step {
    clip_from_pixel: mat4x4f,   // of the interpolated camera
    eye: vec4f,                 // its position in the world; the direction to it if it is orthographic
    time: f32,                  // share of the interval to the other frame; negative: to the previous one
}

struct Chunk {                  // steps of one source frame that are done together
    viewport: Viewport,
    world_from_pixel: mat4x4f,  // of the source's own camera
    eye: vec4f,
    bits: vec2u,                // of a sample's number: how many x has, how many x and y have
    steps: u32,
    first: u32,                 // 1: it is the first one of the image
    last: u32,                  // 1: it is the last one of the image
}

@group(1) @binding(0) var<uniform> chunk: Chunk;
@group(1) @binding(1) var<uniform> steps: array<Step, ROWS>;
@group(1) @binding(2) var color: texture_2d<f32>;       // of the source frame
@group(1) @binding(3) var motion: texture_2d<f32>;      // of the source frame: to_prev, to_next [px]
@group(1) @binding(4) var depth: texture_2d<f32>;       // of the source frame
@group(1) @binding(5) var normal: texture_2d<f32>;      // of the source frame, in the world
@group(1) @binding(6) var weight: texture_2d<f32>;      // of the source frame, 0: does not count
@group(1) @binding(7) var own: texture_2d<f32>;         // the frame itself, for pixels that no sample reached
@group(1) @binding(8) var<storage, read_write> heads: array<atomic<u32>>;   // of every pixel's list: number + 1; 0: it is empty, as it is before and after a chunk
@group(1) @binding(9) var<storage, read_write> links: array<u32>;           // by step and sample: number + 1 of the next one in the list
@group(1) @binding(10) var<storage, read_write> sums: array<atomic<u32>>;   // low words of r, g, b, a of every pixel; with LINES times UNIT
@group(1) @binding(11) var<storage, read_write> carries: array<atomic<u32>>;    // the high words
@group(1) @binding(12) var<storage, read_write> counts: array<atomic<u32>>; // weight of the sums, in shares of UNIT
@group(1) @binding(13) var output: Output;

override CAMERA: bool = false;      // move samples by the interpolated camera, not along the motion
override WEIGHTED: bool = false;
override COUNTS: bool = false;      // show the share of the steps that reached a pixel
override FACING: bool = false;      // drop surfaces that face away from the interpolated camera
override NORMALS: bool = false;     // by `normal`, not by the slope of the depth
override LINES: bool = false;       // the passes are `splat_lines` and `resolve`, not `link` and `resolve`
override NEAREST_ONLY: bool = false;    // of the samples on a pixel only the nearest counts; one step per chunk

// Colour in fixed point, so that the order of additions does not matter; 64 bits cannot overflow.
const STEPS_PER_UNIT: f32 = 16384.0;
const LARGEST: f32 = 262143.0;      // colour is clamped to 0..LARGEST [linear]
const UNIT: u32 = 1024u;            // weight of a sample that is on one pixel for a whole step
const MOST: u32 = 60000u;           // samples in one pixel's list: loops end soon after, see wgsl.md
const ROWS: u32 = 17u;              // steps of a chunk, and one more at which a line ends
const LONGEST: f32 = 4000.0;        // line of one step [px]; the points of longer ones have gaps

/// Link every sample to the list of the pixel that its position is rounded to, once per step.
@compute @workgroup_size(WG_X, WG_Y)
fn link(@builtin(global_invocation_id) id: vec3u) {
    if any(id.xy >= frame.size) { return; }
    let sample = sample_at(id.xy);
    let size = vec2i(frame.size);
    let pixels = frame.size.x * frame.size.y;
    let shift = chunk.bits.y;
    let index = id.y * frame.size.x + id.x;
    let number = 1u + (id.y << chunk.bits.x) + id.x;
    let count = select(0u, turns_of(chunk.steps, id.x), sample.counts);
    for (var k = 0u; k < count; k++) {
        let to = vec2i(floor(vec2f(id.xy) + 0.5 + displacement_at(sample, k)));
        if any(to < vec2i(0)) || any(to >= size) || faces_away(sample, k) { continue; }
        links[k * pixels + index] = atomicExchange(&heads[to.y * size.x + to.x], number + (k << shift));
    }
}

/// Sum every pixel's list, whose order does not matter; after the last chunk, the result.
@compute @workgroup_size(WG_X, WG_Y)
fn resolve(@builtin(global_invocation_id) id: vec3u) {
    if any(id.xy >= frame.size) { return; }
    let at = id.y * frame.size.x + id.x;
    let pixels = frame.size.x * frame.size.y;
    let row = frame.size.x;
    let bits = chunk.bits;
    let mask = vec2u((1u << chunk.bits.x) - 1u, (1u << chunk.bits.y) - 1u);
    var low = vec4u(0u);
    var high = vec4u(0u);
    var count = 0u;
    let before_first = turns_of(select(4u, 0u, chunk.first == 1u), id.x);   // a branch saves nothing, see wgsl.md
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
            let key = bitcast<u32>(depth_at_step(sample_at(px)));
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
    let after_last = turns_of(select(4u, 0u, chunk.last == 1u), id.x);
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

/// Draw a line of points from every sample's position at a step to that at the next; points share the step's weight.
@compute @workgroup_size(WG_X, WG_Y)
fn splat_lines(@builtin(global_invocation_id) id: vec3u) {
    if any(id.xy >= frame.size) { return; }
    let sample = sample_at(id.xy);
    let value = fixed(id.xy);
    let x = vec2f(id.xy) + 0.5;
    let count = select(0u, turns_of(chunk.steps, id.x), sample.counts);
    for (var k = 0u; k < count; k++) {
        let start = x + displacement_at(sample, k);
        let along = x + displacement_at(sample, k + 1u) - start;    // the last step of all ends where it begins
        if any(abs(start) > vec2f(1e6)) || any(abs(along) > vec2f(1e6)) || faces_away(sample, k) { continue; }
        let points = clamp(ceil(max(abs(along.x), abs(along.y))), 1.0, LONGEST);
        let share = u32(f32(UNIT) / points);
        for (var i = 0.0; i < points; i += 1.0) {
            let to = vec2i(floor(start + along * (i / points)));
            if any(to < vec2i(0)) || any(to >= vec2i(frame.size)) { continue; }
            add(u32(to.y) * frame.size.x + u32(to.x), value, share);
        }
    }
}

/// Add a share of a sample to a pixel: a product of 42 bits to a sum of 64.
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
    trajectory: Trajectory,     // without CAMERA; the rest is with it
    ndc: vec2f,
    here: vec4f,        // see homogeneous()
    world: vec4f,       // position in the world, up to a positive factor
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
        s.trajectory = trajectory_from(textureLoad(motion, px, 0));
        return s;
    }
    let viewport = chunk.viewport;
    s.ndc = ndc_of(viewport, px);
    let nothing_there = is_nothing(viewport, s.depth);
    s.here = homogeneous(viewport, s.ndc, s.depth, nothing_there);
    s.world = chunk.world_from_pixel * s.here;
    if FACING && !nothing_there {
        if NORMALS { s.normal = textureLoad(normal, px, 0).xyz; } else { s.normal = normal_from_depth(vec2i(px), s.world); }
        if !is_finite4(vec4f(s.normal, 0.0)) { s.normal = vec3f(0.0); }
    }
    return s;
}

/// The normal of the surface that the depths around `px` form, towards the source's camera; of any length.
fn normal_from_depth(px: vec2i, world: vec4f) -> vec3f {
    let right = tangent(px, vec2i(1, 0), world);
    let down = tangent(px, vec2i(0, 1), world);
    let n = cross(right, down);
    let towards_eye = dot(n, chunk.eye.xyz * world.w - world.xyz * chunk.eye.w);
    return select(-n, n, towards_eye > 0.0);
}

/// Of the vectors to the two neighbours' positions the shorter one, along `step`; 0 without neighbours.
fn tangent(px: vec2i, step: vec2i, world: vec4f) -> vec3f {
    let here = world.xyz / world.w;
    var best = vec3f(0.0);
    var least = 1e30;
    for (var side = -1; side <= 1; side += 2) {
        let there = px + side * step;
        if any(there < vec2i(0)) || any(there >= vec2i(frame.size)) { continue; }
        let z = textureLoad(depth, there, 0).x;
        if is_nothing(chunk.viewport, z) { continue; }
        let other = chunk.world_from_pixel * homogeneous(chunk.viewport, ndc_of(chunk.viewport, vec2u(there)), z, false);
        let difference = other.xyz / other.w - here;
        if length(difference) < least {
            least = length(difference);
            best = difference * f32(side);
        }
    }
    return best;
}

/// Displacement of the sample at step `k` [px].
fn displacement_at(s: Sample, k: u32) -> vec2f {
    if !CAMERA { return displacement(s.trajectory, steps[k].time); }
    let clip = steps[k].clip_from_pixel * s.here;
    if clip.w <= MIN_W { return vec2f(1e9); }
    return to_pixels(chunk.viewport, clip, s.ndc);
}

/// Depth at step 0 of the chunk, up to an increasing function; over 0.
fn depth_at_step(s: Sample) -> f32 {
    if !CAMERA { return valid_depth(s.depth); }
    let clip = steps[0].clip_from_pixel * s.here;
    if steps[0].eye.w == 0.0 { return clip.z / clip.w + 1.0; }
    return select(NO_DEPTH, clip.w / s.world.w, s.world.w > 0.0);
}

/// True if the surface faces away from the camera of step `k`.
fn faces_away(s: Sample, k: u32) -> bool {
    if !FACING { return false; }
    let eye = steps[k].eye;
    return dot(s.normal, eye.xyz * s.world.w - s.world.xyz * eye.w) < 0.0;
}
