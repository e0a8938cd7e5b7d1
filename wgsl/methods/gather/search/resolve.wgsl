// The image: for every pixel and every time of the exposure, the samples of up to three frames that are there by then
// are searched, the nearest ones composited front to back, and the results averaged.
//#include common/depth.wgsl
//#include common/frame.wgsl
//#include common/loops.wgsl
//#include common/noise.wgsl
//#include common/path.wgsl
//#include common/shutter.wgsl
//#include methods/gather/worklist.wgsl
//#include methods/gather/motion.wgsl
//#include methods/gather/search/moving_light.wgsl
//#include methods/gather/search/search.wgsl
//#include methods/gather/search/composite.wgsl
//#include methods/gather/search/hidden.wgsl
//#include methods/gather/search/visibility.wgsl

@group(1) @binding(3) var single_layer_mask: texture_2d_array<u32>; // bits of times, see the classification
@group(1) @binding(10) var output: Output;
@group(1) @binding(11) var<storage, read> worklist: WorkList;

override PLAIN: bool = false;       // the blocks have one layer at all times, or nothing moves there: one search is enough

const MAX_MISS: f32 = 8.0;              // if no search along the pixel's own path comes nearer than this [px], the surface there is hidden

// Loops are left from their end, and rare cases have a loop of their own over bits of times: see wgsl.md.

struct Pixel {          // common to all times of a pixel
    x: vec2f,           // its centre [px]
    block: vec2u,
    a: Candidates,      // of the frame and its neighbours
    b: Candidates,
    c: Candidates,
    trajectory: Trajectory5,    // its own
    times: SampleTimes,
    step: f32,          // the longest way of any surface there from sample to sample [px]
    share: f32,         // of a time, applied before adding, so that no sum of finite colours overflows
}

struct Times {          // the times of this turn, a bit each
    first: u32,         // sample of bit 0
    valid: u32,
    single: u32,        // those at which one search is enough
}

struct Exposure {       // sums over all times
    sum: Composite,
    accepted: f32,      // times at which a sample was found
    left_image: f32,    // those at which the pixel's path has left the picture
    hidden: f32,        // those at which another surface must be there that no frame shows
}

/// For blocks of active cells.
@compute @workgroup_size(CELL_TILES * TILE, STRIP_HEIGHT)
fn main(@builtin(local_invocation_index) local: u32, @builtin(workgroup_id) group: vec3u) {
    let in_block = local % (BLOCK * BLOCK);
    let k = worklist_index(group) * BLOCKS_PER_GROUP + local / (BLOCK * BLOCK);
    let id = unpack_cell(worklist.cells[k]) * BLOCK + vec2u(in_block % BLOCK, in_block / BLOCK);
    if k >= worklist.count || any(id >= frame.size) { return; }
    let pixel = pixel_at(id);
    let front = 0u;
    let starts = Starts(pixel.trajectory, surface_at(id, 1u), surface_at(id, 2u), surface_at(id, 3u), surface_at(id, 4u),
                        surface_at(id, 5u));
    let block_trajectory = unpack_trajectory(surface_of(vec2i(pixel.block * BLOCK), front));  // as classified
    let is_static = is_static_pixel(pixel);
    let samples = select(pixel.times.count, 0u, is_static);
    var exposure = Exposure(Composite(), select(0.0, f32(pixel.times.count), is_static), 0.0, 0.0);
    var first = 0u;
    loop {
        let valid = select(select(0u, (1u << (samples - first)) - 1u, samples > first), ~0u,
                           samples >= first + TIMES_PER_WORD);
        let single = textureLoad(single_layer_mask, pixel.block, first / TIMES_PER_WORD, 0).x & valid;
        var times = Times(first, valid, single);
        add_single(&exposure, &times, pixel, block_trajectory);
        if !PLAIN { add_layered(&exposure, times, pixel, starts); }
        first += TIMES_PER_WORD;
        if first >= samples { break; }
    }
    if !PLAIN {
        var sum = exposure.sum;
        add_hidden(&sum, id, exposure.hidden * pixel.share);
        exposure.sum = sum;
    }
    textureStore(output, id, result_of(exposure, pixel, id, is_static));
}

/// Add the visible surface at a time. (A pointer to a part of a variable cannot be handed on everywhere.)
fn add_time(exposure: ptr<function, Exposure>, one: Composite, share: f32) {
    var sum = (*exposure).sum;
    add(&sum, one, share);
    (*exposure).sum = sum;
}

fn pixel_at(id: vec2u) -> Pixel {
    let x = vec2f(id) + 0.5;
    let tile = id / TILE;
    let a = load_candidates(tile, 0u);
    let b = load_candidates(tile, 1u);
    let c = load_candidates(tile, 2u);
    let shift = frame.jitter * (pixel_noise(id) - 0.5);
    let times = sample_times(x, shift, a, b, c);
    let share = 1.0 / f32(times.count);
    let step = share * longest_blur(a, b, c);
    return Pixel(x, id / BLOCK, a, b, c, unpack_trajectory(surface_of(vec2i(id), 0u)), times, step, share);
}

/// True if nothing moves, nor does anything come here.
fn is_static_pixel(pixel: Pixel) -> bool {
    let longest = max_abs_time(0.0);
    let v = abs(pixel.trajectory.velocity) + abs(pixel.trajectory.half_acceleration) * longest;
    let stays = all(v * longest < vec2f(STATIC_EPSILON));
    let last_word = (frame.samples - 1u) / TIMES_PER_WORD + 1u;
    let all_single = textureLoad(single_layer_mask, pixel.block, last_word, 0).x == 1u;
    return is_static_tile(pixel.a, pixel.b, pixel.c) || (stays && all_single);
}

/// Add the times at which one search is enough. Those that show several weights are single no more.
fn add_single(exposure: ptr<function, Exposure>, times: ptr<function, Times>, pixel: Pixel, block_trajectory: Trajectory5) {
    let front = 0u;
    let first = (*times).first;
    var todo = (*times).single;
    loop {
        let t = time_in(pixel.times, first, todo);
        let found = iterate_fixed_point(pixel.x, displacement5(block_trajectory, t), t, front);
        let at = pixel.x - found.d;
        var is_even = true;     // of one weight
        var counts = 1.0;
        if WEIGHTED {
            let px = nearest_pixel(at);
            is_even = is_smooth(surface_of(vec2i(px), front));
            counts = matte_at(px, front / 2u).weight;
        }
        if todo != 0u && is_even {
            let duration = duration_in(pixel.times, first, todo);
            let around = around_in(pixel.times, first, todo);
            var color = passing(at, front, t, around, pixel.step);
            if MOVING_LIGHT { color += moving_light(color, 1.0, at, 0u, t, duration); }
            let residual = min(sqrt(found.residual2), HALF_MAX);    // a wild motion may end it anywhere
            var one = Composite(color, counts, 1.0, residual, 0.0, 0.0);
            if CONFIDENCE && MOVING_LIGHT { one.unlit = light_unknown(at, 0u, t, duration); }
            add_time(exposure, one, pixel.share);
            (*exposure).accepted += 1.0;
        }
        if !is_even { (*times).single &= ~(1u << firstTrailingBit(todo)); }
        todo &= todo - 1u;
        if todo == 0u { break; }
    }
}

/// Add all other times: samples of frames, composited front to back.
fn add_layered(exposure: ptr<function, Exposure>, times: Times, pixel: Pixel, starts: Starts) {
    var todo = ~times.single & times.valid;
    var unresolved = 0u;
    var far = 0u;           // of them, those at which no search came near
    loop {
        if todo != 0u {     // where it is 0, the loops within end at once
            let t = time_in(pixel.times, times.first, todo);
            let visible = resolve_visibility(pixel.x, starts, t, pixel.a, pixel.b, pixel.c);
            let duration = duration_in(pixel.times, times.first, todo);
            let around = around_in(pixel.times, times.first, todo);
            let result = composite_front_to_back(visible, t, duration, around, pixel.step);
            let is_covered = result.coverage > 0.5;
            if is_covered {
                add_time(exposure, result, pixel.share / result.coverage);
                (*exposure).accepted += 1.0;
            } else {
                let bit = todo & (~todo + 1u);
                unresolved |= bit;
                far |= select(0u, bit, visible.miss2 > MAX_MISS * MAX_MISS);
            }
        }
        todo &= todo - 1u;
        if todo == 0u { break; }
    }
    add_unresolved(exposure, times.first, unresolved, far, pixel);
}

/// Add the times at which no frame shows anything: a tap along the pixel's own trajectory; of the pixel itself, where its surface goes on
/// behind something nearer; where no search came near, hidden.
fn add_unresolved(exposure: ptr<function, Exposure>, first: u32, bits: u32, far: u32, pixel: Pixel) {
    var todo = bits;
    let z = abs(unpack_depth(surface_of(vec2i(pixel.x), 0u)));
    loop {
        if todo != 0u {
            let t = time_in(pixel.times, first, todo);
            let p = pixel.x - displacement5(pixel.trajectory, t);
            let is_far = (far & todo & (~todo + 1u)) != 0u;
            if is_far && is_inside(p) {
                (*exposure).hidden += 1.0;
            } else {
                let is_behind = abs(unpack_depth(surface_of(vec2i(nearest_pixel(p)), 0u))) * SURFACE_DEPTH_RATIO < z && is_inside(p);
                let at = select(at_border(p, first + firstTrailingBit(todo)), pixel.x, is_behind);
                var one = tap(at);
                if MOVING_LIGHT { one.color += moving_light(one.color, one.coverage, at, 0u, t, duration_in(pixel.times, first, todo)); }
                add_time(exposure, one, pixel.share);
            }
            if !is_inside(p) { (*exposure).left_image += 1.0; }
        }
        todo &= todo - 1u;
        if todo == 0u { break; }
    }
}

/// The mean over the exposure, or how sure it is.
fn result_of(exposure: Exposure, pixel: Pixel, id: vec2u, is_static: bool) -> vec4f {
    var result = max(exposure.sum.color, vec4f(0.0)) / exposure.sum.weight;
    if is_static || exposure.sum.weight <= 0.0 { result = static_color(id); }
    if CONFIDENCE {
        let accepted = exposure.accepted * pixel.share;
        var unlit = exposure.sum.unlit;
        if is_static { unlit = static_unlit(id); }
        result = vec4f(max(accepted - unlit, 0.0), exposure.sum.neighbours, exposure.sum.residual / max(accepted, 1e-9),
                       exposure.left_image * pixel.share);
    }
    return result;
}

/// For static cells.
@compute @workgroup_size(CELL_TILES * TILE, STRIP_HEIGHT)
fn copy_static(@builtin(local_invocation_index) local: u32, @builtin(workgroup_id) group: vec3u) {
    let k = worklist_index(group);
    let id = pixel_in_strip(worklist.cells[k], group, local);
    if k >= worklist.count || any(id >= frame.size) { return; }
    var result = static_color(id);
    if CONFIDENCE { result = vec4f(1.0 - static_unlit(id), 0.0, 0.0, 0.0); }
    textureStore(output, id, result);
}

/// The frame's own pixel; without moving light, to the bit.
fn static_color(px: vec2u) -> vec4f {
    let color = lit_color(px);
    if !WEIGHTED { return color; }
    let counts = textureLoad(own_weight, px, 0).x;
    return select(vec4f(0.0), color / counts, counts > 0.0);
}

/// Of the frame's own pixel, the mean over the exposure.
fn lit_color(px: vec2u) -> vec4f {
    let color = textureLoad(own_color, px, 0);
    let x = vec2f(px) + 0.5;
    if !MOVING_LIGHT || !is_light_moving(x) { return color; }
    let times = shutter_times(x, 0.0);
    let share = 1.0 / f32(times.count);
    var sum = vec4f(0.0);
    let count = turns_of(times.count, px.x);
    for (var i = 0u; i < count; i++) {
        sum += share * moving_light(color, 1.0, x, 0u, shutter_time(times, i), sample_duration(times, i));
    }
    return max(color + sum, vec4f(0.0));
}

/// Of the frame's own pixel, the share of the exposure in which its light is not known.
fn static_unlit(px: vec2u) -> f32 {
    let x = vec2f(px) + 0.5;
    if !MOVING_LIGHT || !is_light_moving(x) { return 0.0; }
    let times = shutter_times(x, 0.0);
    var sum = 0.0;
    let count = turns_of(times.count, px.x);
    for (var i = 0u; i < count; i++) {
        sum += light_unknown(x, 0u, shutter_time(times, i), sample_duration(times, i)) / f32(times.count);
    }
    return sum;
}

/// Time of the lowest set bit of a word whose bit 0 is sample `first`.
fn time_in(times: SampleTimes, first: u32, bits: u32) -> f32 {
    return shutter_time(times, index_in(times, first, bits));
}

/// For how long that sample stands [frame intervals].
fn duration_in(times: SampleTimes, first: u32, bits: u32) -> f32 {
    if !MOVING_LIGHT { return 0.0; }
    return sample_duration(times, index_in(times, first, bits));
}

/// The longest time around its own for which it stands [frame intervals].
fn around_in(times: SampleTimes, first: u32, bits: u32) -> f32 {
    return time_around(times, index_in(times, first, bits));
}

/// Its index.
fn index_in(times: SampleTimes, first: u32, bits: u32) -> u32 {
    return min(first + firstTrailingBit(bits), times.count - 1u);
}
