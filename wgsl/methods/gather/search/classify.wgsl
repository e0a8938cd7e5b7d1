// Classification of blocks of pixels, an early out: at which times is one smooth surface all that can be visible?
// Such a time needs one search, in the front layer of the frame itself; most times of most pixels are such.
//#include common/depth.wgsl
//#include common/frame.wgsl
//#include common/loops.wgsl
//#include common/shutter.wgsl
//#include methods/gather/worklist.wgsl
//#include methods/gather/search/search.wgsl
//#include methods/gather/shading/active.wgsl

@group(1) @binding(3) var single_layer_mask: Mask;  // by block: words of bits, TIMES_PER_WORD a layer; last, 1 if all are set
@group(1) @binding(4) var<storage, read> active_cells: WorkList;
@group(1) @binding(5) var<storage, read_write> lists: array<atomic<u32>>;   // six WorkLists of blocks: PLAIN, others, CROWDED; those that moving light may come to; all 0 at first
@group(1) @binding(6) var<storage, read> light_changes: array<u32>;         // one word, then those of tiles: see active.wgsl

override MOVING_LIGHT: bool = false;
override WEIGHTED: bool = false;    // pixels have weights, and may show more than one in a block

alias Mask = texture_storage_2d_array<r32uint, write>;

const LISTS: u32 = 6u;

struct Block {
    low: vec2u,         // its first and its last pixel
    high: vec2u,
    is_crowded: bool,   // its tile is, in some frame
    a: Candidates,      // of the frame and its neighbours
    b: Candidates,
    c: Candidates,
}

/// One block, which joins one of the lists. The searches of all its pixels are made from its corners: a time has a single layer if they end on
/// surfaces that no edge is near, and if all other starts lead to the same. Edges are two pixels wide, so that none
/// hides between the corners.
@compute @workgroup_size(WG_X, WG_Y)
fn main(@builtin(local_invocation_index) local: u32,
        @builtin(workgroup_id) group: vec3u, @builtin(num_workgroups) groups: vec3u) {
    let k = work_index(local, group, groups);
    let down = TILE / BLOCK;        // blocks of a cell
    let across = CELL_TILES * down;
    let n = k / (across * down);
    let id = unpack_cell(active_cells.cells[n]) * vec2u(across, down) + vec2u(k % across, k / across % down);
    if n >= active_cells.count || any(id * BLOCK >= frame.size) { return; }
    let block = block_at(id);
    let times = sample_times(0.5 * vec2f(block.low + block.high) + 0.5, 0.0, block.a, block.b, block.c);
    // Jittered pixels have times of their own.
    let is_static = is_static_tile(block.a, block.b, block.c);
    let count = select(times.count, 0u, frame.jitter > 0.0 || is_static);
    let samples = turns_of(frame.samples, active_cells.count);
    var bits = 0u;
    var all_single = true;
    var i = 0u;
    loop {
        let is_single = has_single_layer(block, shutter_time(times, min(i, times.count - 1u)), i < count);
        bits |= u32(is_single) << (i % TIMES_PER_WORD);
        all_single = all_single && (is_single || i >= times.count);
        i++;
        if i % TIMES_PER_WORD == 0u || i >= samples {
            textureStore(single_layer_mask, id, (i - 1u) / TIMES_PER_WORD, vec4u(bits));
            bits = 0u;
        }
        if i >= samples { break; }
    }
    textureStore(single_layer_mask, id, (frame.samples - 1u) / TIMES_PER_WORD + 1u, vec4u(u32(all_single)));
    let kind = select(select(1u, 2u, block.is_crowded), 0u, is_static || (all_single && !WEIGHTED));
    join_list(id, kind + select(0u, 3u, MOVING_LIGHT && may_be_lit(block)));
}

fn block_at(id: vec2u) -> Block {
    let low = id * BLOCK;
    let a = load_candidates(low / TILE, 0u);
    let b = load_candidates(low / TILE, 1u);
    let c = load_candidates(low / TILE, 2u);
    let is_crowded = max(a.header.w, max(b.header.w, c.header.w)) > 0.0;
    return Block(low, min(low + BLOCK, frame.size) - 1u, is_crowded, a, b, c);
}

/// True if one smooth surface is all that can be visible at the time `t`: of the frame itself; away from its instant, of the neighbour on
/// the side of `t` too.
fn has_single_layer(block: Block, t: f32, wanted: bool) -> bool {
    var is_single = wanted;
    var deepest = 0.0;          // depth that the frame itself shows
    var f = 0u;
    loop {
        let candidates = candidates_of(block.low / TILE, f, block.a, block.b, block.c);
        is_single = corners_agree(block, t, f, candidates, is_single, &deepest);
        let word = scattered_at(block.low, t, f, is_single && block.is_crowded);
        let z = scattered_depth(word) * handicap_of(f);
        is_single = is_single && (word == 0u || z * SURFACE_DEPTH_RATIO >= deepest);
        let again = is_single && f == 0u && sources.count > 1u && abs(t) > TRUSTED_TIME;
        f = neighbour_of(t, false);
        if !again { break; }
    }
    return is_single;
}

/// True if searches in frame `f` from the corners end on smooth surfaces, not nearer than `deepest` if in a neighbour, and all
/// other starts that may lead nearer lead there too.
fn corners_agree(block: Block, t: f32, f: u32, candidates: Candidates, wanted: bool, deepest: ptr<function, f32>) -> bool {
    let u = t - offset_of(f);
    let layer = 2u * f;
    let handicap = handicap_of(f);
    let starts = seeds_at(candidates, u, may_be_there(candidates, u));
    let start = displacement5(unpack_trajectory(surface_of(vec2i(block.low), layer)), u);
    let visible_depth = *deepest;
    var is_single = wanted;
    var n = 0u;
    loop {
        let x = vec2f(select(block.low, block.high, vec2<bool>(n % 2u == 1u, n / 2u == 1u))) + 0.5;
        let found = iterate_fixed_point(x, start, u, layer);
        let z = depth_in(found.word) * handicap;
        *deepest = max(*deepest, z);
        let nearer = may_be_nearer(candidates, select(visible_depth, z, f == 0u) / handicap);
        let is_there = found.residual2 <= MAX_RESIDUAL * MAX_RESIDUAL;
        is_single = is_single && (found.word & EDGELESS) != 0u && is_there && z >= visible_depth;
        var seeds = Seeds(starts.pending & nearer & ~are_solution(starts, found.d), starts.x, starts.y);
        loop {
            let is_pending = seeds.pending != 0u;
            let converges = converges_to(x, next_seed(&seeds), found.d, u, layer);
            is_single = is_single && (!is_pending || converges);
            if !is_single || seeds.pending == 0u { break; }
        }
        n++;
        if !is_single || n >= 4u { break; }
    }
    return is_single;
}

fn handicap_of(f: u32) -> f32 {
    return select(NEIGHBOUR_DEPTH_BIAS, 1.0, f == 0u);
}

/// True if a place that a block shows may be where light changes: a surface goes there from its place in this frame.
fn may_be_lit(block: Block) -> bool {
    let way = max(way_of(block.a, 0u), max(way_of(block.b, 1u), way_of(block.c, 2u)));
    let reach = (way + f32(BLOCK)) / f32(LIGHT_TILE * LIGHT_SCALE) + 1.0;
    let distance = light_changes[1u + light_tile(block.low)] >> DISTANCE_BITS;
    return f32(distance) <= reach || reach >= f32(FAR_TILES);
}

/// The longest way of candidates of frame `f` from this frame's instant to another one of the exposure [px].
fn way_of(candidates: Candidates, f: u32) -> f32 {
    let window = abs(exposure_window(sources.offsets[f]));
    let times = abs(exposure_window(0.0));
    return candidates.header.z * max(times.x, times.y) / max(max(window.x, window.y), 1e-9);
}

/// Add a block to the list of its kind.
fn join_list(id: vec2u, kind: u32) {
    let section = kind * (arrayLength(&lists) / LISTS);
    let place = atomicAdd(&lists[section + COUNT_WORD], 1u);
    atomicStore(&lists[section + CELLS_WORD + place], pack_cell(id));
}

/// After all blocks: workgroups for all lists.
@compute @workgroup_size(1)
fn size_lists(@builtin(workgroup_id) group: vec3u) {
    let section = group.x * (arrayLength(&lists) / LISTS);
    let wanted = (atomicLoad(&lists[section + COUNT_WORD]) + BLOCKS_PER_GROUP - 1u) / BLOCKS_PER_GROUP;
    atomicStore(&lists[section], min(wanted, GROUPS_PER_ROW));
    atomicStore(&lists[section + 1u], 1u);
    atomicStore(&lists[section + 2u], (wanted + GROUPS_PER_ROW - 1u) / GROUPS_PER_ROW);
}

/// True if one step from the displacement `start` leads to the `solution`, not by way of an edge; or leaves the image.
fn converges_to(x: vec2f, start: vec2f, solution: vec2f, u: f32, layer: u32) -> bool {
    let state = warp_step(x, start, u, layer);
    return state.residual2 >= INFINITE || (depth_in(state.word) > 0.0 && same_solution(state.d, solution));
}
