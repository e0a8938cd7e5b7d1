// Into a crowded tile come more motions than its candidates stand for. The pixels of the tiles from which the others come are
// scattered to where they are at slices of the exposure: each block of pixels then knows one that is there, from which a
// search may start. Of 2 x 2 pixels the nearest stands for all. Of a neighbouring frame, only those count that the
// frame itself hides.
//#include common/depth.wgsl
//#include common/frame.wgsl
//#include common/path.wgsl
//#include common/shutter.wgsl
//#include methods/gather/tiles/scattered.wgsl

struct ScatteredFrame {
    offset: f32,        // [frame intervals]
    index: u32,         // of `count` frames; 0: the frame itself
    count: u32,
}

@group(1) @binding(0) var<uniform> source: ScatteredFrame;
@group(1) @binding(1) var front_surface: texture_2d<u32>;           // stored as rgba32uint: see pack_surface()
@group(1) @binding(2) var own_surface: texture_2d<u32>;             // of the frame itself
@group(1) @binding(3) var tile_candidates: texture_2d_array<u32>;   // CANDIDATE_LAYERS per frame
@group(1) @binding(4) var<storage, read> worklist: WorkList;        // of tiles
@group(1) @binding(5) var<storage, read_write> scattered: array<atomic<u32>>;   // see scattered.wgsl

/// One tile of the list.
@compute @workgroup_size(TILE / 2u, TILE / 2u)
fn main(@builtin(local_invocation_id) local: vec3u, @builtin(workgroup_id) group: vec3u) {
    let k = worklist_index(group);
    let corner = unpack_cell(worklist.cells[k]) * TILE + 2u * local.xy;
    if k >= worklist.count || any(corner >= frame.size) { return; }
    var px = corner;
    var surface = textureLoad(front_surface, px, 0);
    for (var i = 1u; i < 4u; i++) {
        let other = min(corner + vec2u(i % 2u, i / 2u), frame.size - 1u);
        let at = textureLoad(front_surface, other, 0);
        let is_nearer = known_depth(abs(unpack_depth(at))) < known_depth(abs(unpack_depth(surface)));
        px = select(px, other, is_nearer);
        surface = select(surface, at, is_nearer);
    }
    let trajectory = unpack_trajectory(surface);
    let slices = slice_count(arrayLength(&scattered), source.count);
    let moves = any(abs(trajectory.velocity) + abs(trajectory.half_acceleration) > vec2f(LEAST_SCATTERED));
    let x = vec2f(px) + 0.5;
    let counts = moves && (source.index == 0u || is_hidden_at(x + displacement5(trajectory, -source.offset), abs(unpack_depth(surface))));
    for (var i = 0u; i < select(0u, slices, counts); i++) {
        let to = x + displacement5(trajectory, slice_time(i, slices) - source.offset);
        let at = vec2u(clamp(to, vec2f(0.0), vec2f(frame.size) - 1.0));
        let is_inside = all(to >= vec2f(0.0)) && all(to < vec2f(frame.size));
        if is_inside {
            let header = textureLoad(tile_candidates, at / TILE, source.index * CANDIDATE_LAYERS, 0);
            let word = pack_scattered(px, at / BLOCK, abs(unpack_depth(surface)));
            if header.w != 0u && word != 0u {
                atomicMax(&scattered[scattered_index(source.index, i, slices, at / BLOCK)], word);
            }
        }
    }
}

/// True if the frame itself shows something nearer than `depth` at a position [px].
fn is_hidden_at(at: vec2f, depth: f32) -> bool {
    let is_inside = all(at >= vec2f(0.0)) && all(at < vec2f(frame.size));
    let own = textureLoad(own_surface, vec2u(clamp(at, vec2f(0.0), vec2f(frame.size) - 1.0)), 0);
    return is_inside && abs(unpack_depth(own)) * SURFACE_DEPTH_RATIO < depth;
}
