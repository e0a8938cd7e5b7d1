// Candidate motions of every tile. First the motions within each tile are clustered to a few; then each tile gathers
// those clusters, of itself and of all tiles around, whose sweep over the exposure meets it. McGuire et al. (2012)
// keep one motion per tile, TileMax and NeighborMax; this keeps MOTIONS, with depths and the times at which they come.
//#include common/frame.wgsl
//#include common/path.wgsl
//#include common/shutter.wgsl
//#include methods/gather/motion.wgsl
//#include methods/gather/worklist.wgsl
//#include methods/gather/surface.wgsl

struct SourceFrame {
    offset: f32,        // [frame intervals]
    first: u32,         // its first layer in `tile_candidates`
}

@group(1) @binding(0) var<uniform> source: SourceFrame;
@group(1) @binding(1) var front_surface: texture_2d<u32>;   // stored as rgba32uint: see pack_surface()
@group(1) @binding(2) var tile_motions: texture_2d_array<f32>;      // output of `cluster_motions`
@group(1) @binding(3) var tile_motions_out: Layers;     // of every tile's own pixels, MOTION_LAYERS
@group(1) @binding(4) var tile_candidates: Packed;      // of all that may come into it, CANDIDATE_LAYERS per frame
@group(1) @binding(5) var<storage, read_write> max_displacement: atomic<u32>;   // bits of the greatest of all tiles [px]
@group(1) @binding(6) var<storage, read> active_cells: WorkList;
@group(1) @binding(7) var<storage, read> static_cells: WorkList;
@group(1) @binding(8) var coarse_boxes: texture_2d<f32>;    // output of `coarsen`
@group(1) @binding(9) var coarse_boxes_out: Boxes;      // around the boxes of COARSE x COARSE tiles
@group(1) @binding(10) var<storage, read_write> scattering: array<atomic<u32>>; // a WorkList of the tiles of this frame to scatter; then a flag for each; all 0 at first

alias Layers = texture_storage_2d_array<rgba32float, write>;
alias Packed = texture_storage_2d_array<rgba32uint, write>;
alias Boxes = texture_storage_2d<rgba32float, write>;

// Layers of `tile_motions`, after the MOTIONS trajectories.
const BOX: u32 = 4u;            // least, greatest displacement of any while the frame is exposed [px]
const MIN_DEPTH: u32 = 5u;      // the least depth of the pixels of each cluster
const HEADER: u32 = 6u;         // as of the candidates, see CANDIDATE_LAYERS
const MOTION_LAYERS: u32 = 7u;

const COARSE: i32 = 4;          // tiles per side of a coarse box
const MERGE_DISTANCE: f32 = 0.5;    // motions closer than this [px] are one
// A tile is crowded if a motion is farther than this [px] from all candidates, and than this share of the longest one. Motions
// along one line are never farther than 1/4. Neither is a simple number, so that rounding rarely decides.
const CROWDED_DISTANCE: f32 = 3.1;
const CROWDED_SHARE: f32 = 0.34;

/// The foreground's surface of a pixel.
fn front_at(px: vec2u) -> vec4u {
    return textureLoad(front_surface, px, 0);
}

/// Squared distance [px^2] to the nearest of the clusters' motions. Those not found yet are 0, standing still, so that
/// static content needs no cluster.
fn distance2_to_clusters(trajectory: vec4f, clusters: array<vec4f, 4>, u: f32) -> f32 {
    return min(min(trajectory_distance2(trajectory, clusters[0], u), trajectory_distance2(trajectory, clusters[1], u)),
               min(trajectory_distance2(trajectory, clusters[2], u), trajectory_distance2(trajectory, clusters[3], u)));
}

/// The nearest of the clusters; several if they are equally near.
fn nearest_cluster(trajectory: vec4f, clusters: array<vec4f, 4>, u: f32) -> vec4<bool> {
    let d = vec4f(trajectory_distance2(trajectory, clusters[0], u), trajectory_distance2(trajectory, clusters[1], u),
                  trajectory_distance2(trajectory, clusters[2], u), trajectory_distance2(trajectory, clusters[3], u));
    let least = min(min(d.x, d.y), min(d.z, d.w));
    return d == vec4f(least);
}

/// Squared distance [px^2] to the nearest of the clusters' motions, all found, and of standing still.
fn missed_distance2(trajectory: vec4f, clusters: array<vec4f, 4>, u: f32) -> f32 {
    return min(distance2_to_clusters(trajectory, clusters, u), trajectory_distance2(trajectory, vec4f(0.0), u));
}

@compute @workgroup_size(WG_X, WG_Y)
fn clear(@builtin(global_invocation_id) id: vec3u) {
    if all(id.xy == vec2u(0u)) { atomicStore(&max_displacement, 0u); }
}

/// Farthest-point clustering of the motions of a tile's own pixels (Gonzalez 1985): the first cluster is at the
/// longest motion, each further one at the motion farthest from all before.
@compute @workgroup_size(WG_X, WG_Y)
fn cluster_motions(@builtin(local_invocation_index) local: u32,
        @builtin(workgroup_id) group: vec3u, @builtin(num_workgroups) groups: vec3u) {
    let k = work_index(local, group, groups);
    let n = k / CELL_TILES;
    let is_active = n < active_cells.count;
    let cell = unpack_cell(select(static_cells.cells[n - active_cells.count], active_cells.cells[n], is_active));
    let id = cell * vec2u(CELL_TILES, 1u) + vec2u(k % CELL_TILES, 0u);
    if n >= active_cells.count + static_cells.count || id.x >= tiles_of(frame.size).x { return; }
    let corner = id * TILE;
    let end = min(corner + TILE, frame.size) - 1u;
    let pixels = select(0u, TILE * TILE, is_active);    // those of tiles that are cut off count several times
    let window = exposure_window(source.offset);
    let u = max_abs_time(source.offset);
    var motions = array<vec4f, 4>();
    var box = vec4f(0.0);
    var count = 0.0;
    var longest = 0.0;
    var more = true;
    for (var k = 0u; k < MOTIONS && more; k++) {
        let clusters = motions;
        var farthest = 0.0;
        var found = vec4f(0.0);
        for (var i = 0u; i < pixels; i++) {
            let px = min(corner + vec2u(i % TILE, i / TILE), end);
            let trajectory = as_vec4(unpack_trajectory(front_at(px)), u);
            let distance2 = distance2_to_clusters(trajectory, clusters, u);
            if distance2 > farthest && distance2 < MAX_MOTION * MAX_MOTION {
                farthest = distance2;
                found = trajectory;
            }
        }
        if k == 0u { longest = sqrt(farthest); }
        more = farthest > MERGE_DISTANCE * MERGE_DISTANCE;
        if more {
            count += 1.0;
            motions[k] = found;
            let a = displacement4(found, window.x);
            let b = displacement4(found, window.y);
            box = vec4f(min(box.xy, min(a, b)), max(box.zw, max(a, b)));
        }
    }
    var has_edge = 0.0;
    var min_depth = vec4f(INFINITE);
    for (var i = 0u; i < pixels; i++) {
        let surface = front_at(min(corner + vec2u(i % TILE, i / TILE), end));
        let z = abs(unpack_depth(surface));
        if unpack_depth(surface) < 0.0 { has_edge = 1.0; }
        let is_nearest = nearest_cluster(as_vec4(unpack_trajectory(surface), u), motions, u);
        min_depth = min(min_depth, select(vec4f(INFINITE), vec4f(z), is_nearest));
    }
    for (var k = 0u; k < MOTIONS; k++) { textureStore(tile_motions_out, id, k, motions[k]); }
    textureStore(tile_motions_out, id, BOX, box);
    textureStore(tile_motions_out, id, MIN_DEPTH, min_depth);
    textureStore(tile_motions_out, id, HEADER, vec4f(count, has_edge, longest, 0.0));
    atomicMax(&max_displacement, bitcast<u32>(longest));
}

/// One box around those of many tiles, so that `gather_candidates` need not look at each.
@compute @workgroup_size(WG_X, WG_Y)
fn coarsen(@builtin(global_invocation_id) id: vec3u) {
    let first = vec2i(id.xy) * COARSE;
    let tiles = vec2i(tiles_of(frame.size));
    if any(first >= tiles) { return; }
    var box = vec4f(0.0);
    for (var i = 0; i < COARSE * COARSE; i++) {
        let one = textureLoad(tile_motions, min(first + vec2i(i % COARSE, i / COARSE), tiles - 1), BOX, 0);
        box = vec4f(min(box.xy, one.xy), max(box.zw, one.zw));
    }
    textureStore(coarse_boxes_out, id.xy, box);
}

struct Receiver {       // a tile that gathers, and from where
    here: vec2i,
    window: vec2f,      // of the exposure [frame intervals]
    u: f32,             // the time of it that is farthest from the frame's instant
    first: vec2i,       // corners of the tiles around from which something may come
    last: vec2i,
}

struct Gathered {       // motions that come into a tile
    motions: array<vec4f, 4>,
    count: u32,         // of the motions
    min_depth: vec4f,   // of each
    t_enter: vec4f,     // when the first of it enters the tile and the last leaves it, in shares of the exposure
    t_exit: vec4f,
    missed: f32,        // greatest squared distance of a motion from all of them [px^2]
}

/// The candidates of one tile: clusters of all motions, from wherever they come, whose sweep meets it.
@compute @workgroup_size(WG_X, WG_Y)
fn gather_candidates(@builtin(local_invocation_index) local: u32,
        @builtin(workgroup_id) group: vec3u, @builtin(num_workgroups) groups: vec3u) {
    let k = work_index(local, group, groups);
    let id = unpack_cell(active_cells.cells[k / CELL_TILES]) * vec2u(CELL_TILES, 1u) + vec2u(k % CELL_TILES, 0u);
    if k / CELL_TILES >= active_cells.count || id.x >= tiles_of(frame.size).x { return; }
    let here = vec2i(id);
    var tile = Receiver(here, exposure_window(source.offset), max_abs_time(source.offset), here, here);
    find_coarse_range(&tile);
    let edge_and_longest = narrow_range(&tile);
    var gathered = Gathered(array<vec4f, 4>(), 0u, vec4f(INFINITE), vec4f(1.0), vec4f(0.0), 0.0);
    cluster_what_comes(&gathered, tile);
    measure_what_comes(&gathered, tile);
    let longest2 = trajectory_distance2(gathered.motions[0], vec4f(0.0), tile.u);
    let most_missed = max(CROWDED_DISTANCE * CROWDED_DISTANCE, CROWDED_SHARE * CROWDED_SHARE * longest2);
    let is_crowded = abs(source.offset) <= 1.0 && gathered.missed > most_missed;
    sort_by_depth(&gathered);
    scatter_what_is_missed(gathered, tile, is_crowded);
    let header = vec4f(f32(gathered.count), edge_and_longest, f32(is_crowded));
    store_candidates(id, header, gathered, tile.window);
}

/// The range of tiles around a tile from which something may come, by coarse boxes.
fn find_coarse_range(tile: ptr<function, Receiver>) {
    let here = (*tile).here;
    let longest_of_all = bitcast<f32>(atomicLoad(&max_displacement));
    let radius = min(i32(ceil(longest_of_all / f32(TILE))) + 1, MAX_TILE_RADIUS);
    let low = max(here - radius, vec2i(0));
    let high = min(here + radius, vec2i(tiles_of(frame.size)) - 1);
    let coarse_low = low / COARSE;
    let coarse_high = high / COARSE;
    var first = here;
    var last = here;
    for (var coarse = coarse_low; coarse.y <= coarse_high.y; coarse = after(coarse, coarse_low, coarse_high)) {
        let box = textureLoad(coarse_boxes, coarse, 0);
        let side = f32((COARSE - 1) * i32(TILE));
        let off = vec2f((here - coarse * COARSE) * i32(TILE));
        if sweep_overlaps(vec4f(box.xy, box.zw + side), off) {
            first = min(first, coarse * COARSE);
            last = max(last, coarse * COARSE + COARSE - 1);
        }
    }
    (*tile).first = max(first, low);
    (*tile).last = min(last, high);
}

/// The same by the tiles' own boxes, and if they move. Of all that may reach the tile: 1 if an edge does, and the greatest
/// displacement [px].
fn narrow_range(tile: ptr<function, Receiver>) -> vec2f {
    let here = (*tile).here;
    let least = (*tile).first;
    let most = (*tile).last;
    var first = here;
    var last = here;
    var edge_and_longest = vec2f(0.0);
    for (var at = least; at.y <= most.y; at = after(at, least, most)) {
        let other = source_tile(at, here);
        if other.may_reach {
            edge_and_longest = max(edge_and_longest, textureLoad(tile_motions, other.at, HEADER, 0).yz);
            if other.count > 0u {
                first = min(first, at);
                last = max(last, at);
            }
        }
    }
    (*tile).first = first;
    (*tile).last = last;
    return edge_and_longest;
}

/// Farthest-point clustering of all the motions that come.
fn cluster_what_comes(gathered: ptr<function, Gathered>, tile: Receiver) {
    var motions = array<vec4f, 4>();
    var count = 0u;
    var more = true;
    for (var k = 0u; k < MOTIONS && more; k++) {
        var farthest = 0.0;
        var found = vec4f(0.0);
        for (var at = tile.first; at.y <= tile.last.y; at = after(at, tile.first, tile.last)) {
            let other = source_tile(at, tile.here);
            for (var n = 0u; n < other.count; n++) {
                let trajectory = textureLoad(tile_motions, other.at, n, 0);
                let distance2 = distance2_to_clusters(trajectory, motions, tile.u);
                let interval = sweep_interval(trajectory, tile.window, other.off);
                if distance2 > farthest && interval.x <= interval.y {
                    farthest = distance2;
                    found = trajectory;
                }
            }
        }
        more = farthest > MERGE_DISTANCE * MERGE_DISTANCE;
        if more {
            motions[k] = found;
            count = k + 1u;
        }
    }
    (*gathered).motions = motions;
    (*gathered).count = count;
}

/// The depths and times of each cluster, and the motions far from all of them.
fn measure_what_comes(gathered: ptr<function, Gathered>, tile: Receiver) {
    let motions = (*gathered).motions;
    var min_depth = vec4f(INFINITE);
    var t_enter = vec4f(1.0);
    var t_exit = vec4f(0.0);
    var missed = 0.0;
    for (var at = tile.first; at.y <= tile.last.y; at = after(at, tile.first, tile.last)) {
        let other = source_tile(at, tile.here);
        for (var n = 0u; n < other.count; n++) {
            let trajectory = textureLoad(tile_motions, other.at, n, 0);
            let interval = sweep_interval(trajectory, tile.window, other.off);
            if interval.x <= interval.y {
                let nearest = nearest_cluster(trajectory, motions, tile.u);
                let z = textureLoad(tile_motions, other.at, MIN_DEPTH, 0)[n];
                min_depth = min(min_depth, select(vec4f(INFINITE), vec4f(z), nearest));
                t_enter = min(t_enter, select(vec4f(1.0), vec4f(interval.x), nearest));
                t_exit = max(t_exit, select(vec4f(0.0), vec4f(interval.y), nearest));
                missed = max(missed, missed_distance2(trajectory, motions, tile.u));
            }
        }
    }
    (*gathered).min_depth = min_depth;
    (*gathered).t_enter = t_enter;
    (*gathered).t_exit = t_exit;
    (*gathered).missed = missed;
}

/// The nearest first.
fn sort_by_depth(gathered: ptr<function, Gathered>) {
    for (var i = 0u; i < MOTIONS; i++) {
        for (var k = 0u; k + 1u < (*gathered).count; k++) {
            if (*gathered).min_depth[k] > (*gathered).min_depth[k + 1u] { swap_with_next(gathered, k); }
        }
    }
}

fn swap_with_next(gathered: ptr<function, Gathered>, k: u32) {
    let trajectory = (*gathered).motions[k];
    (*gathered).motions[k] = (*gathered).motions[k + 1u];
    (*gathered).motions[k + 1u] = trajectory;
    let z = (*gathered).min_depth[k];
    (*gathered).min_depth[k] = (*gathered).min_depth[k + 1u];
    (*gathered).min_depth[k + 1u] = z;
    let a = (*gathered).t_enter[k];
    (*gathered).t_enter[k] = (*gathered).t_enter[k + 1u];
    (*gathered).t_enter[k + 1u] = a;
    let b = (*gathered).t_exit[k];
    (*gathered).t_exit[k] = (*gathered).t_exit[k + 1u];
    (*gathered).t_exit[k + 1u] = b;
}

/// List the tiles from which motions come that are far from all clusters, if the tile is crowded.
fn scatter_what_is_missed(gathered: Gathered, tile: Receiver, is_crowded: bool) {
    let end = select(tile.first.y - 1, tile.last.y, is_crowded);
    for (var at = tile.first; at.y <= end; at = after(at, tile.first, tile.last)) {
        let other = source_tile(at, tile.here);
        var is_source = false;
        for (var n = 0u; n < other.count; n++) {
            let trajectory = textureLoad(tile_motions, other.at, n, 0);
            let interval = sweep_interval(trajectory, tile.window, other.off);
            let distance2 = missed_distance2(trajectory, gathered.motions, tile.u);
            is_source = is_source || (distance2 > CROWDED_DISTANCE * CROWDED_DISTANCE && interval.x <= interval.y);
        }
        if is_source { scatter_from(vec2u(at)); }
    }
}

/// Write the candidates of a tile, see CANDIDATE_LAYERS.
fn store_candidates(tile: vec2u, header: vec4f, gathered: Gathered, window: vec2f) {
    let duration = window.y - window.x;
    var times = vec4u();
    var velocities = vec4u();
    var half_accelerations = vec4u();
    for (var k = 0u; k < MOTIONS; k++) {
        let interval = vec2f(window.x + duration * gathered.t_enter[k] - TIME_SLACK,
                             window.x + duration * gathered.t_exit[k] + TIME_SLACK);
        times[k] = pack_halves(select(interval, vec2f(INFINITE, -INFINITE), gathered.min_depth[k] >= INFINITE));
        velocities[k] = pack_halves(gathered.motions[k].xy);
        half_accelerations[k] = pack_halves(gathered.motions[k].zw);
    }
    textureStore(tile_candidates, tile, source.first, bitcast<vec4u>(header));
    textureStore(tile_candidates, tile, source.first + 1u, bitcast<vec4u>(gathered.min_depth));
    textureStore(tile_candidates, tile, source.first + 2u, times);
    textureStore(tile_candidates, tile, source.first + 3u, velocities);
    textureStore(tile_candidates, tile, source.first + 4u, half_accelerations);
}

/// Add a tile to the list of those to scatter, if it is not in it.
fn scatter_from(tile: vec2u) {
    let flag = arrayLength(&scattering) / 2u + tile.y * tiles_of(frame.size).x + tile.x;
    if atomicExchange(&scattering[flag], 1u) == 0u {
        let place = atomicAdd(&scattering[COUNT_WORD], 1u);
        atomicStore(&scattering[CELLS_WORD + place], pack_cell(tile));
        atomicMax(&scattering[0], min(place + 1u, GROUPS_PER_ROW));
        atomicMax(&scattering[1], 1u);
        atomicMax(&scattering[2], place / GROUPS_PER_ROW + 1u);
    }
}

/// The tile that follows another one, row by row of those from `first` to `last`.
fn after(tile: vec2i, first: vec2i, last: vec2i) -> vec2i {
    return select(vec2i(tile.x + 1, tile.y), vec2i(first.x, tile.y + 1), tile.x >= last.x);
}

struct SourceTile {     // a tile, seen from another one, `here`
    at: vec2i,
    off: vec2f,         // from it to `here` [px]
    may_reach: bool,    // some of its motions may lead to `here`
    count: u32,         // of its motions, if so
}

fn source_tile(at: vec2i, here: vec2i) -> SourceTile {
    let off = vec2f((here - at) * i32(TILE));
    let may_reach = sweep_overlaps(textureLoad(tile_motions, at, BOX, 0), off);
    return SourceTile(at, off, may_reach, select(0u, u32(textureLoad(tile_motions, at, HEADER, 0).x), may_reach));
}

/// True if the sweep of a tile, by the box of its displacements, may overlap the tile that is `off` [px] away.
fn sweep_overlaps(box: vec4f, off: vec2f) -> bool {
    let margin = f32(TILE) + 2.0;
    return all(off + margin > box.xy) && all(off - margin < box.zw);
}

/// Times at which a tile moving along `trajectory` overlaps the one that is `off` [px] away, in shares of the `window`: t_enter,
/// t_exit; t_exit < t_enter if it never does. A slab test of the line from its first to its last position
/// against a square, which is larger by the greatest distance of the trajectory from that line.
fn sweep_interval(trajectory: vec4f, window: vec2f, off: vec2f) -> vec2f {
    let start = displacement4(trajectory, window.x) - off;
    let sweep = displacement4(trajectory, window.y) - off - start;
    let duration = window.y - window.x;
    let bend = length(trajectory.zw) * (duration * duration * 0.25 + MOST_BEND);
    let margin = f32(TILE) + bend;
    let divisor = select(sweep, vec2f(1e-6), abs(sweep) < vec2f(1e-6));
    let a = (-margin - start) / divisor;
    let b = (margin - start) / divisor;
    let t_enter = min(a, b);
    let t_exit = max(a, b);
    return vec2f(max(max(t_enter.x, t_enter.y), 0.0), min(min(t_exit.x, t_exit.y), 1.0));
}
