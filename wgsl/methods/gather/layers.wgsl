// Silhouettes as two layers. A renderer filters colours and vectors over the surfaces that a pixel shows; here these
// are separated again, as in matting: a front layer with its coverage, and what is behind it.
//#include common/frame.wgsl
//#include common/path.wgsl
//#include methods/gather/worklist.wgsl
//#include methods/gather/surface.wgsl
//#include methods/gather/edge_flags.wgsl
//#include methods/gather/coverage.wgsl
//#include methods/gather/around.wgsl
//#include methods/gather/crowd.wgsl

@group(1) @binding(0) var color: texture_2d<f32>;       // of one frame, premultiplied by alpha and weight
@group(1) @binding(3) var weight: texture_2d<f32>;
@group(1) @binding(4) var edge_flags: texture_2d<u32>;  // stored as r32uint, by edges.wgsl: depth and flags
@group(1) @binding(6) var colors: Color;                // FRONT, premultiplied by coverage too, and BACK
@group(1) @binding(7) var surfaces: Packed;             // FRONT and BACK, see pack_surface()
@group(1) @binding(8) var mattes: Mattes;               // see pack_matte()
@group(1) @binding(9) var<storage, read> worklist: WorkList;
@group(1) @binding(10) var<storage, read_write> edges: EdgeList;
@group(1) @binding(11) var<storage, read_write> edge_groups: array<u32>;    // workgroups of `separate_layers`, for an indirect dispatch

struct EdgeList {       // the edge pixels, which may show two surfaces
    count: atomic<u32>,
    pixels: array<u32>, // packed as cells are
}

alias Color = texture_storage_2d_array<rgba32float, write>;
alias Packed = texture_storage_2d_array<rgba32uint, write>;
alias Mattes = texture_storage_2d<r32uint, write>;  // rg32uint if WEIGHTED

override COPIED: bool = false;      // `colors` has the frame's pixels already

const FRONT: u32 = 0u;          // layers of an array
const BACK: u32 = 1u;

const FULL: f32 = 0.98;         // coverage from which on it is taken for 1, and below 1 less it for 0
const MOST_CONTRAST: f32 = 2.0; // of a front layer to the brightest pixel of it around, which may be half background
const MATTE_CONTRAST: f32 = 0.5;    // difference of the alphas of front and back from which on alpha tells coverage

fn color_at(px: vec2i) -> vec4f {
    return textureLoad(color, clamped(px), 0);
}

fn flags_at(px: vec2i) -> u32 {
    let at = clamped(px);
    return textureLoad(edge_flags, at, 0).x;
}

/// Those of a pixel and of the ones to its left and right together.
fn three_flags(px: vec2i) -> u32 {
    return flags_at(px - vec2i(1, 0)) | flags_at(px) | flags_at(px + vec2i(1, 0));
}

fn weight_at(px: vec2i) -> f32 {
    if !WEIGHTED { return 1.0; }
    return textureLoad(weight, clamped(px), 0).x;
}

/// First pass: every pixel as one layer, which is copied to BACK after it, and the list of edge pixels, which
/// `separate_layers` corrects. Stores are what costs in this pass.
@compute @workgroup_size(CELL_TILES * TILE, STRIP_HEIGHT)
fn write_single_layer(@builtin(local_invocation_index) local: u32, @builtin(workgroup_id) group: vec3u) {
    let k = worklist_index(group);
    let px = vec2i(pixel_in_strip(worklist.cells[k], group, local));
    if k >= worklist.count || any(px >= vec2i(frame.size)) { return; }
    let counts = weight_at(px);
    let here = flags_at(px);
    var near_edge = is_edge(three_flags(px - vec2i(0, 1)) | three_flags(px) | three_flags(px + vec2i(0, 1)));
    var smooth_here = !near_edge;   // one surface of one weight in the 3 x 3
    if WEIGHTED {
        for (var i = 0; i < 9; i++) {
            smooth_here = smooth_here && weight_at(px + vec2i(i % 3, i / 3) - 1) == counts;
        }
    }
    if near_edge { near_edge = is_near_separated(px); }
    let around = surface_around(px, textureLoad(motion, px, 0), flagged_depth(here));
    let z = flagged_depth(here) * around.depth_ratio;
    if !COPIED { textureStore(colors, px, FRONT, textureLoad(color, px, 0)); }
    let flags = SINGLE | select(0u, SMOOTH, smooth_here);
    textureStore(surfaces, px, FRONT, pack_surface(around.trajectory, select(z, -z, near_edge), flags));
    textureStore(mattes, px, pack_matte(Matte(z, false, 1.0, counts)));
    if is_edge(here) && !is_in_crowd(px) { edges.pixels[atomicAdd(&edges.count, 1u)] = pack_cell(vec2u(px)); }
}

/// True if an edge of the 3 x 3 is separated, where there are edges: all are, but in crowds.
fn is_near_separated(px: vec2i) -> bool {
    let low = clamped(px - 1);
    let high = clamped(px + 1);
    let has_crowd = is_in_crowd(low) || is_in_crowd(high) || is_in_crowd(vec2i(low.x, high.y)) || is_in_crowd(vec2i(high.x, low.y));
    var result = !has_crowd;
    for (var i = 0; i < select(0, 9, has_crowd); i++) {
        let at = clamped(px + vec2i(i % 3, i / 3) - 1);
        result = result || (is_edge(flags_at(at)) && !is_in_crowd(at));
    }
    return result;
}

/// Second pass: workgroups for the list of edge pixels.
@compute @workgroup_size(1)
fn size_dispatch() {
    let wanted = (atomicLoad(&edges.count) + WG_X * WG_Y - 1u) / (WG_X * WG_Y);
    edge_groups[0] = min(wanted, GROUPS_PER_ROW);
    edge_groups[1] = (wanted + GROUPS_PER_ROW - 1u) / GROUPS_PER_ROW;
    edge_groups[2] = 1u;
}

struct Side {           // weighted sums over the pixels on one side of an edge
    total: f32,         // of the shares
    motion: vec4f,
    depth: f32,
    color: vec4f,
    weight: f32,        // of the colour
}

fn add(side: ptr<function, Side>, share: f32, motion_there: vec4f, z: f32, color_there: vec4f, weight_there: f32) {
    (*side).total += share;
    (*side).motion += share * motion_there;
    (*side).depth += share * z;
    (*side).color += share * color_there;
    (*side).weight += share * weight_there;
}

struct Place {          // the nearest pure pixel of a side
    at: vec2i,
    distance2: f32,     // [px^2]
}

struct Neighbour {      // a pixel of the 5 x 5 around an edge pixel
    at: vec2i,
    distance2: f32,     // [px^2]
    z: f32,
    counts: bool,
    is_front: bool,
    is_pure: bool,      // it shows one surface
}

fn neighbour(px: vec2i, i: i32, between: f32) -> Neighbour {
    let off = vec2i(i % 5, i / 5) - 2;
    let at = px + off;
    let flags = flags_at(at);
    let z = flagged_depth(flags);
    let distance2 = f32(off.x * off.x + off.y * off.y);
    let is_inside = all(at >= vec2i(0)) && all(at < vec2i(frame.size));
    // The corners are too far away for a background: they may show another one.
    let counts = is_inside && (z < between || distance2 < 8.0);
    return Neighbour(at, distance2, z, counts, z < between, !is_edge(flags));
}

/// Third pass: the two layers of edge pixels. The pure pixels around are front or back by their depth; the pixel's
/// coverage is where its own alpha, or its own filtered motion, is between theirs.
@compute @workgroup_size(WG_X, WG_Y)
fn separate_layers(@builtin(local_invocation_index) local: u32, @builtin(workgroup_id) group: vec3u) {
    let k = (group.y * GROUPS_PER_ROW + group.x) * WG_X * WG_Y + local;
    if k >= atomicLoad(&edges.count) { return; }
    let px = vec2i(unpack_cell(edges.pixels[k]));
    let counts = weight_at(px);
    var nearest = NO_DEPTH;
    var farthest = 0.0;
    for (var i = 0; i < 9; i++) {
        let z = flagged_depth(flags_at(px + vec2i(i % 3, i / 3) - 1));
        nearest = min(nearest, z);
        farthest = max(farthest, z);
    }
    let own_color = textureLoad(color, px, 0);
    let own_motion = textureLoad(motion, px, 0);
    // One layer, if there are not two after all.
    var z = flagged_depth(flags_at(px));
    var front = own_color;
    var front_motion = own_motion;
    var back = vec4f(0.0);
    var back_motion = own_motion;
    var back_depth = 0.0;
    var coverage = 1.0;
    var back_seen = false;      // the back layer is not inferred
    var seen_around = false;    // its colour is that of neighbouring frames

    let between = select(sqrt(nearest * farthest), 1.5 * nearest, farthest >= NO_DEPTH);    // depth of neither
    // The back is as deep as the pixel itself, or as the nearest background beside it, above or below.
    var behind_z = select(INFINITE, z, z >= between);
    for (var i = 1; i < select(0, 9, behind_z >= INFINITE); i += 2) {
        let z_there = flagged_depth(flags_at(px + vec2i(i % 3, i / 3) - 1));
        behind_z = min(behind_z, select(INFINITE, z_there, z_there >= between));
    }
    var front_place = Place(px, INFINITE);
    var back_place = Place(px, INFINITE);
    var front_bits = 0u;        // of the 5 x 5, all that are in front
    var back_bits = 0u;
    var pure_bits = 0u;         // those that show one surface
    for (var i = 0; i < 25; i++) {
        var there = neighbour(px, i, between);
        let is_another = max(there.z, behind_z) > BACKGROUND_DEPTH_RATIO * min(there.z, behind_z);
        there.counts = there.counts && (there.is_front || behind_z >= INFINITE || !is_another);
        front_bits |= select(0u, 1u << u32(i), there.counts && there.is_front);
        back_bits |= select(0u, 1u << u32(i), there.counts && !there.is_front);
        pure_bits |= select(0u, 1u << u32(i), there.is_pure);
        if there.counts && there.is_pure && there.is_front && there.distance2 < front_place.distance2 {
            front_place = Place(there.at, there.distance2);
        }
        if there.counts && there.is_pure && !there.is_front && there.distance2 < back_place.distance2 {
            back_place = Place(there.at, there.distance2);
        }
    }
    let thin = (front_bits & pure_bits) == 0u;                  // no pure pixel is in front: a wire
    let no_pure_background = (back_bits & pure_bits) == 0u;
    var front_side = Side();
    var back_side = Side();
    var brightest = own_color / max(counts, 1e-9);
    var todo = (front_bits & (pure_bits | select(0u, ~0u, thin))) | (back_bits & (pure_bits | select(0u, ~0u, no_pure_background)));
    loop {
        let there = neighbour(px, i32(min(firstTrailingBit(todo), 24u)), between);
        let motion_there = textureLoad(motion, clamped(there.at), 0);
        let color_there = color_at(there.at);
        // The farther away, the smaller the share.
        let share = select(0.0, 1.0 / (1.0 + there.distance2 * there.distance2), todo != 0u);
        let weight_there = weight_at(there.at);
        if todo != 0u && there.is_front { brightest = max(brightest, color_there / max(weight_there, 1e-9)); }
        add(&front_side, select(0.0, share, there.is_front), motion_there, there.z, color_there, weight_there);
        add(&back_side, select(share, 0.0, there.is_front), motion_there, there.z, color_there, weight_there);
        todo &= todo - 1u;
        if todo == 0u { break; }
    }
    let background_motion = back_side.motion / back_side.total;
    var foreground_motion = select(front_side.motion / front_side.total, background_motion, thin);
    var purest = px;
    var most = 0.0;
    for (var i = 0; i < select(0, 9, thin); i++) {      // of a wire, the motion that differs most from the background's
        let there = neighbour(px, i % 3 + i / 3 * 5 + 6, between);
        let motion_there = textureLoad(motion, clamped(there.at), 0);
        let difference2 = dot(motion_there - background_motion, motion_there - background_motion);
        if there.counts && there.is_front && difference2 > most {
            most = difference2;
            purest = there.at;
            foreground_motion = motion_there;
        }
    }

    if front_side.total > 0.0 && back_side.total > 0.0 && back_side.weight > 0.0 {
        let axis = foreground_motion - background_motion;
        if dot(axis, axis) >= EDGE_MOTION * EDGE_MOTION && is_mixture(own_motion - background_motion, axis) {
            // Where alphas differ they tell coverage better than vectors, which some renderers do not filter.
            let front_alpha = select(front_side.color.a / max(front_side.weight, 1e-9), 1.0, thin);
            let back_alpha = back_side.color.a / back_side.weight;
            let by_alpha = front_alpha - back_alpha > MATTE_CONTRAST && counts > 0.0;
            let by_vector = dot(own_motion - background_motion, axis) / dot(axis, axis);
            back_depth = back_side.depth / back_side.total;
            let seen = background_around(px, background_motion, back_depth);
            seen_around = seen.count > 0.0;
            let background = select(back_side.color / back_side.weight, seen.color / max(seen.count, 1.0), seen_around);
            var measured = clamp(select(by_vector,
                (own_color.a / counts - back_alpha) / (front_alpha - back_alpha), by_alpha), 0.0, 1.0);
            if !by_alpha && !thin && counts > 0.0 && !are_filtered(px, background_motion, axis) {
                measured = coverage_by_color(own_color / counts, front_side.color / max(front_side.weight, 1e-9), background,
                                             measured);
            }
            measured = round(measured * f32(WHOLE)) / f32(WHOLE);
            if measured < 1.0 - FULL {      // all background, whatever the one sample of the depth says
                back_seen = true;
                coverage = 0.0;
                back = select(background, own_color / counts, counts > 0.0);
                front = vec4f(0.0);
                front_motion = foreground_motion;
                if thin { front_place.at = purest; }
                if z >= between { back_depth = z; }
                z = front_side.depth / front_side.total;
            } else {
                coverage = select(measured, 1.0, measured > FULL);
                // Together they are the pixel's colour: what would be less than black in front, or too bright, is behind.
                let behind = (1.0 - coverage) * counts;
                let rest = own_color - behind * background;
                let most = select(MOST_CONTRAST * coverage * counts * brightest, vec4f(INFINITE), seen_around);
                front = max(min(rest, most), vec4f(0.0));
                back = background + select(vec4f(0.0), (rest - front) / max(behind, 1e-6), behind > 0.0);
                back_motion = background_motion;
                if measured <= FULL { front_motion = foreground_motion; }
                if measured <= FULL && thin { front_place.at = purest; }
                if measured <= FULL || z >= between { z = front_side.depth / front_side.total; }
            }
        }
    }
    // The bends of the two paths come from the nearest pure pixels: filtered vectors lead to mixtures.
    let front_path = with_bend_of(front_place.at, front_motion);
    let back_path = with_bend_of(back_place.at, back_motion);
    textureStore(colors, px, FRONT, front);
    z *= front_path.depth_ratio;
    back_depth *= back_path.depth_ratio;
    let has_back = back_depth > 0.0;
    let told = select(select(0u, AROUND, seen_around), SEEN, back_seen);
    textureStore(surfaces, px, FRONT, pack_surface(front_path.trajectory, -z, 0u));
    if has_back { textureStore(colors, px, BACK, back); }     // else nobody reads it
    textureStore(surfaces, px, BACK, pack_surface(back_path.trajectory, max(back_depth, 0.0), select(SINGLE, told, has_back)));
    textureStore(mattes, px, pack_matte(Matte(z, has_back, coverage, coverage * counts)));
}

/// The trajectory of these vectors, bent as that of the surface at `px` is.
fn with_bend_of(px: vec2i, vectors: vec4f) -> SurfaceAround {
    let parabola = trajectory_from(vectors);
    let there = surface_around(px, textureLoad(motion, px, 0), flagged_depth(flags_at(px)));
    let bend = there.trajectory;
    let trajectory = Trajectory5(parabola.velocity, parabola.half_acceleration, bend.third, bend.has_kink);
    return SurfaceAround(trajectory, there.depth_ratio);
}

/// For cells far from all that moves: searches may pass over them, but nobody reads their colours.
@compute @workgroup_size(CELL_TILES * TILE, STRIP_HEIGHT)
fn copy_motion_only(@builtin(local_invocation_index) local: u32, @builtin(workgroup_id) group: vec3u) {
    let k = worklist_index(group);
    let px = vec2i(pixel_in_strip(worklist.cells[k], group, local));
    if k >= worklist.count || any(px >= vec2i(frame.size)) { return; }
    let trajectory = trajectory5_from(trajectory_from(textureLoad(motion, px, 0)));
    let z = flagged_depth(bitcast<u32>(depth_at(px)));
    textureStore(surfaces, px, FRONT, pack_surface(trajectory, z, SINGLE));
}
