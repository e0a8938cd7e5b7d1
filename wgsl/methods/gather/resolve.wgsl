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
//#include methods/gather/moving_light.wgsl
//#include methods/gather/search.wgsl
//#include methods/gather/composite.wgsl
//#include methods/gather/hidden.wgsl
//#include methods/gather/visibility.wgsl

@group(1) @binding(3) var single_layer_mask: texture_2d_array<u32>; // bits of times, see the classification
@group(1) @binding(10) var output: Output;
@group(1) @binding(11) var<storage, read> worklist: WorkList;

override PLAIN: bool = false;       // the blocks have one layer at all times, or nothing moves there: one search is enough

const MAX_MISS: f32 = 8.0;              // if no search along the pixel's own path comes nearer than this [px], what is there is hidden

// Loops are left from their end, and what is rare has a loop of its own over bits of times: see lavapipe.md.

/// For blocks of active cells.
@compute @workgroup_size(CELL_TILES * TILE, STRIP_HEIGHT)
fn main(@builtin(local_invocation_index) local: u32, @builtin(workgroup_id) group: vec3u) {
    let in_block = local % (BLOCK * BLOCK);
    let k = worklist_index(group) * BLOCKS_PER_GROUP + local / (BLOCK * BLOCK);
    let id = unpack_cell(worklist.cells[k]) * BLOCK + vec2u(in_block % BLOCK, in_block / BLOCK);
    if k >= worklist.count || any(id >= frame.size) { return; }
    let x = vec2f(id) + 0.5;
    let tile = id / TILE;
    let candidates0 = load_candidates(tile, 0u);
    let candidates1 = load_candidates(tile, 1u);
    let candidates2 = load_candidates(tile, 2u);
    let front = 0u;
    let trajectory = unpack_trajectory(surface_of(vec2i(id), front));
    let starts = Starts(trajectory, surface_at(id, 2u), surface_at(id, 3u), surface_at(id, 4u), surface_at(id, 5u));
    let block_trajectory = unpack_trajectory(surface_of(vec2i(id / BLOCK * BLOCK), front));  // as classified
    let shift = frame.jitter * (pixel_noise(id) - 0.5);
    let times = sample_times(x, shift, candidates0, candidates1, candidates2);
    let share = 1.0 / f32(times.count);     // applied before adding, so that no sum of finite colours overflows

    // Static: nothing moves, nor does anything come here.
    let longest = max_abs_time(0.0);
    let v = abs(trajectory.velocity) + abs(trajectory.half_acceleration) * longest;
    let stays = all(v * longest < vec2f(STATIC_EPSILON));
    let last_word = (frame.samples - 1u) / TIMES_PER_WORD + 1u;
    let all_single = textureLoad(single_layer_mask, id / BLOCK, last_word, 0).x == 1u;
    let is_static = is_static_tile(candidates0, candidates1, candidates2) || (stays && all_single);
    let samples = select(times.count, 0u, is_static);

    var sum = Composite();
    var accepted = select(0.0, f32(times.count), is_static);
    var left_image = 0.0;
    var hidden = 0.0;       // times at which another surface must be there that no frame shows
    var first = 0u;         // time of this turn's words of bits
    loop {
        let valid = select(select(0u, (1u << (samples - first)) - 1u, samples > first), ~0u,
                           samples >= first + TIMES_PER_WORD);
        var single = textureLoad(single_layer_mask, id / BLOCK, first / TIMES_PER_WORD, 0).x & valid;
        var todo = single;
        loop {              // times at which one search is enough
            let t = time_in(times, first, todo);
            let found = iterate_fixed_point(x, displacement5(block_trajectory, t), t, front);
            let px = nearest_pixel(x - found.d);
            var is_even = true;     // of one weight
            var counts = 1.0;
            if WEIGHTED {
                is_even = is_smooth(surface_of(vec2i(px), front));
                counts = matte_at(px, front / 2u).weight;
            }
            if todo != 0u && is_even {
                var color = resampled(x - found.d, front, true);
                if MOVING_LIGHT { color += moving_light(x - found.d, 0u, t, duration_in(times, first, todo)); }
                let residual = min(sqrt(found.residual2), HALF_MAX);    // a wild motion may end it anywhere
                var one = Composite(color, counts, 1.0, residual, 0.0, 0.0);
                if CONFIDENCE && MOVING_LIGHT {
                    one.unlit = light_unknown(x - found.d, 0u, t, duration_in(times, first, todo));
                }
                add(&sum, one, share);
                accepted += 1.0;
            }
            if !is_even { single &= ~(1u << firstTrailingBit(todo)); }
            todo &= todo - 1u;
            if todo == 0u { break; }
        }
        if !PLAIN {
            todo = ~single & valid;
            var unresolved = 0u;
            var far = 0u;       // of them, those at which no search came near
            loop {              // all others
                if todo != 0u {     // where it is 0, the loops within end at once
                    let t = time_in(times, first, todo);
                    let visible = resolve_visibility(x, starts, t, candidates0, candidates1, candidates2);
                    let result = composite_front_to_back(visible, t, duration_in(times, first, todo));
                    let is_covered = result.coverage > 0.5;
                    if is_covered {
                        add(&sum, result, share / result.coverage);
                        accepted += 1.0;
                    } else {
                        let bit = todo & (~todo + 1u);
                        unresolved |= bit;
                        far |= select(0u, bit, visible.miss2 > MAX_MISS * MAX_MISS);
                    }
                }
                todo &= todo - 1u;
                if todo == 0u { break; }
            }
            loop {              // of them, those at which no frame shows anything: a tap along the pixel's own trajectory
                if unresolved != 0u {
                    let t = time_in(times, first, unresolved);
                    let p = x - displacement5(trajectory, t);
                    let is_far = (far & unresolved & (~unresolved + 1u)) != 0u;
                    if is_far && is_inside(p) {
                        hidden += 1.0;
                    } else {
                        let at = at_border(p, first + firstTrailingBit(unresolved));
                        var one = tap(at);
                        if MOVING_LIGHT { one.color += moving_light(at, 0u, t, duration_in(times, first, unresolved)); }
                        add(&sum, one, share);
                    }
                    if !is_inside(p) { left_image += 1.0; }
                }
                unresolved &= unresolved - 1u;
                if unresolved == 0u { break; }
            }
        }
        first += TIMES_PER_WORD;
        if first >= samples { break; }
    }
    if !PLAIN { add_hidden(&sum, id, hidden * share); }
    var result = max(sum.color, vec4f(0.0)) / sum.weight;
    if is_static || sum.weight <= 0.0 { result = static_color(id); }
    if CONFIDENCE {
        let share_accepted = max(accepted * share, 1e-9);
        if is_static { sum.unlit = static_unlit(id); }
        result = vec4f(max(accepted * share - sum.unlit, 0.0), sum.neighbours, sum.residual / share_accepted, left_image * share);
    }
    textureStore(output, id, result);
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
    if !MOVING_LIGHT { return color; }
    let x = vec2f(px) + 0.5;
    let times = shutter_times(x, 0.0);
    let share = 1.0 / f32(times.count);
    var sum = vec4f(0.0);
    let count = turns_of(times.count, px.x);
    for (var i = 0u; i < count; i++) {
        sum += share * moving_light(x, 0u, shutter_time(times, i), sample_duration(times, i));
    }
    return max(color + sum, vec4f(0.0));
}

/// Of the frame's own pixel, the share of the exposure in which its light is not known.
fn static_unlit(px: vec2u) -> f32 {
    if !MOVING_LIGHT { return 0.0; }
    let x = vec2f(px) + 0.5;
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
    return shutter_time(times, min(first + firstTrailingBit(bits), times.count - 1u));
}

/// For how long that sample stands [frame intervals].
fn duration_in(times: SampleTimes, first: u32, bits: u32) -> f32 {
    if !MOVING_LIGHT { return 0.0; }
    return sample_duration(times, min(first + firstTrailingBit(bits), times.count - 1u));
}
