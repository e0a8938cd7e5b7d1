// Where, and when, one opaque surface is all there is to see. Such a time of a pixel needs one search, in the
// frame itself; most times of most pixels are such.
//#include common/frame.wgsl
//#include common/loops.wgsl
//#include common/shutter.wgsl
//#include blur/gather_listed.wgsl
//#include blur/gather_search.wgsl

@group(1) @binding(3) var plain: Plain;     // bits of times, AT_ONCE a layer, then whether all are set; a texel a block
@group(1) @binding(4) var<storage, read> moving: Listed;    // cells, see gather_live.wgsl

alias Plain = texture_storage_2d_array<r32uint, write>;

/// One block. All searches of its pixels are made from its corners: a time is plain if they end on calm
/// ground, and no other start leads elsewhere. Silhouettes are marked two pixels wide, so that none hides between.
@compute @workgroup_size(WG_X, WG_Y)
fn main(@builtin(local_invocation_index) local: u32,
        @builtin(workgroup_id) group: vec3u, @builtin(num_workgroups) groups: vec3u) {
    let k = place_in_list(local, group, groups);
    let down = TILE / BLOCK;        // blocks of a cell
    let across = CELL * down;
    let n = k / (across * down);
    let id = cell_in(moving.cells[n]) * vec2u(across, down) + vec2u(k % across, k / across % down);
    let low = id * BLOCK;
    let tile = low / TILE;
    if n >= moving.count || any(low >= frame.size) { return; }
    let high = min(low + BLOCK, frame.size) - 1u;
    let reach0 = reach(tile, 0u);
    let reach1 = reach(tile, 1u);
    let reach2 = reach(tile, 2u);
    let times = times_of(0.5 * vec2f(low + high) + 0.5, 0.0, reach0, reach1, reach2);
    // Jittered pixels have times of their own.
    let count = select(times.count, 0u, frame.jitter > 0.0 || is_still(reach0, reach1, reach2));
    let samples = turns_of(frame.samples, moving.count);
    var bits = 0u;
    var all_plain = true;
    var i = 0u;
    loop {
        let t = shutter_time(times, min(i, times.count - 1u));
        var is_plain = i < count;
        var deepest = 0.0;      // that the frame itself shows
        var f = 0u;
        loop {          // that frame; then the neighbour, where there is a second opinion
            let u = t - offset_of(f);
            let layer = stored(2u * f);
            let handicap = select(NEIGHBOUR, 1.0, f == 0u);
            let here = of_frame(f, reach0, reach1, reach2);
            let dx = displaced_x(here, u);
            let dy = displaced_y(here, u);
            let start = displacement(path_in(textureLoad(paths, low, layer, 0)), u);
            let seen = deepest;
            var n = 0u;
            loop {
                let x = vec2f(select(low, high, vec2<bool>(n % 2u == 1u, n / 2u == 1u))) + 0.5;
                let found = follow(x, start, u, layer);
                let z = depth_in(found.texel) * handicap;
                deepest = max(deepest, z);
                let wanted = worth(here, u, select(seen, z, f == 0u) / handicap);
                is_plain = is_plain && z > 0.0 && found.miss <= MISS * MISS && z >= seen;
                let known = (abs(dx - found.d.x) < vec4f(SAME)) & (abs(dy - found.d.y) < vec4f(SAME));
                var todo = Starts(wanted & !known, dx, dy);
                loop {
                    let any_left = any(todo.left);
                    let ends = leads(x, next_of(&todo), found.d, u, layer);
                    is_plain = is_plain && (!any_left || ends);
                    if !is_plain || !any(todo.left) { break; }
                }
                n++;
                if !is_plain || n >= 4u { break; }
            }
            let again = is_plain && f == 0u && sources.count > 1u && abs(t) > TRUSTED;
            f = neighbour_of(t, false);
            if !again { break; }
        }
        bits |= u32(is_plain) << (i % AT_ONCE);
        all_plain = all_plain && (is_plain || i >= times.count);
        i++;
        if i % AT_ONCE == 0u || i >= samples {
            textureStore(plain, id, (i - 1u) / AT_ONCE, vec4u(bits));
            bits = 0u;
        }
        if i >= samples { break; }
    }
    textureStore(plain, id, (frame.samples - 1u) / AT_ONCE + 1u, vec4u(u32(all_plain)));
}

/// Whether a search from `start` goes where another one went, `first`, not by way of a silhouette; or
/// leaves the picture.
fn leads(x: vec2f, start: vec2f, first: vec2f, u: f32, layer: u32) -> bool {
    let place = step_from(x, start, u, layer);
    return place.miss >= NONE || (depth_in(place.texel) > 0.0 && alike(place.d, first));
}
