// Silhouettes as two layers. A renderer filters colours and vectors over the surfaces that a pixel shows; here these
// are separated again, as in matting: a front layer with its coverage, and its background.
//#include common/frame.wgsl
//#include common/path.wgsl
//#include methods/gather/worklist.wgsl
//#include methods/gather/surface.wgsl
//#include methods/gather/layers/edge_flags.wgsl
//#include methods/gather/layers/sides.wgsl
//#include methods/gather/layers/coverage.wgsl
//#include methods/gather/layers/around.wgsl
//#include methods/gather/layers/crowd.wgsl

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
const MOST_CONTRAST: f32 = 1.2; // of a front layer to the brightest pixel of it around,
const WIRE_CONTRAST: f32 = 2.0; // which may be half background in a wire
const LINES: f32 = 5.0;         // of a mask of 5 x 5 pixels, across an outline
const MASK_ERROR: f32 = 1.0;    // of the way of an outline between two masks [px]: in each, it lies half a pixel off at most
const OUTLINE_STEPS: i32 = 6;   // in which an outline is approached, by at most half a mask each

/// Those of a pixel and of the ones to its left and right together.
fn three_flags(px: vec2i) -> u32 {
    return flags_at(px - vec2i(1, 0)) | flags_at(px) | flags_at(px + vec2i(1, 0));
}

/// First pass: every pixel as one layer, which is copied to BACK after it, and the list of edge pixels, which
/// `separate_layers` corrects. Stores dominate the cost of this pass.
@compute @workgroup_size(CELL_TILES * TILE, STRIP_HEIGHT)
fn write_single_layer(@builtin(local_invocation_index) local: u32, @builtin(workgroup_id) group: vec3u) {
    let k = worklist_index(group);
    let px = vec2i(pixel_in_strip(worklist.cells[k], group, local));
    if k >= worklist.count || any(px >= vec2i(frame.size)) { return; }
    let counts = weight_at(px);
    let here = flags_at(px);
    let flags_around = three_flags(px - vec2i(0, 1)) | three_flags(px) | three_flags(px + vec2i(0, 1));
    var beside = vec2<bool>(false); // an edge in the 3 x 3, one that is separated
    if is_edge(flags_around) { beside = edges_beside(px); }
    var smooth_here = !beside.x;    // one surface of one weight in the 3 x 3
    if WEIGHTED {
        for (var i = 0; i < 9; i++) {
            smooth_here = smooth_here && weight_at(px + vec2i(i % 3, i / 3) - 1) == counts;
        }
    }
    let around = surface_around(px, textureLoad(motion, px, 0), flagged_depth(here));
    let z = flagged_depth(here) * around.depth_ratio;
    if !COPIED { textureStore(colors, px, FRONT, textureLoad(color, px, 0)); }
    let flags = SINGLE | select(0u, SMOOTH, smooth_here) | select(0u, EDGELESS, smooth_here && !is_edge(flags_around));
    textureStore(surfaces, px, FRONT, pack_surface(around.trajectory, select(z, -z, beside.y), flags));
    textureStore(mattes, px, pack_matte(Matte(z, false, 1.0, counts)));
    if is_separated(here, around_tile(px)) { edges.pixels[atomicAdd(&edges.count, 1u)] = pack_cell(vec2u(px)); }
}

/// True if there is an edge in the 3 x 3, where flags say so; and if one is separated. All are, but in some tiles.
fn edges_beside(px: vec2i) -> vec2<bool> {
    let low = inside(px - 1);
    let high = inside(px + 1);
    let around = around_tile(low) | around_tile(high) | around_tile(vec2i(low.x, high.y)) | around_tile(vec2i(high.x, low.y));
    var result = vec2<bool>(around == 0u);
    for (var i = 0; i < select(9, 0, around == 0u); i++) {
        let at = inside(px + vec2i(i % 3, i / 3) - 1);
        let flags = flags_at(at);
        result = result | vec2<bool>(is_visible_edge(flags, around_tile(at)), is_separated(flags, around_tile(at)));
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

/// Third pass: the two layers of edge pixels. The pure pixels around are front or back by their depth; the pixel's
/// coverage is where its own alpha, or its own filtered motion, is between theirs.
@compute @workgroup_size(WG_X, WG_Y)
fn separate_layers(@builtin(local_invocation_index) local: u32, @builtin(workgroup_id) group: vec3u) {
    let k = (group.y * GROUPS_PER_ROW + group.x) * WG_X * WG_Y + local;
    if k >= atomicLoad(&edges.count) { return; }
    let edge = edge_pixel(vec2i(unpack_cell(edges.pixels[k])));
    let around = sort_around(edge);
    let sides = sum_sides(edge, around);
    var split = one_layer(edge, around);
    if sides.front.total > 0.0 && sides.back.total > 0.0 && sides.back.weight > 0.0 {
        let axis = sides.front_motion - sides.back_motion;
        if dot(axis, axis) >= EDGE_MOTION * EDGE_MOTION && is_mixture(edge.motion - sides.back_motion, axis) {
            var outline = Outline(sides.back_motion, outline_rests(edge, around, sides));
            if !outline.is_found { outline = outline_of_turning(edge, around, sides); }
            if outline.is_found { // the pixel shows the same of both all the time
                split.front_motion = outline.steps;
                split.front_at = around.back_place.at;
                split.front_z = sides.front.depth / sides.front.total;
            } else {
                split_layers(&split, edge, around, sides, axis);
            }
        }
    }
    store_layers(edge, split);
}

struct Split {          // the layers of an edge pixel
    front: vec4f,
    back: vec4f,
    front_motion: vec4f,
    back_motion: vec4f,
    front_z: f32,
    back_z: f32,        // 0 if there is no back
    front_at: vec2i,    // the pixels whose paths bend as theirs
    back_at: vec2i,
    coverage: f32,
    told: u32,          // of the back: SEEN if it is not inferred, AROUND if neighbouring frames gave its colour
}

/// The layers of an edge pixel that shows one surface after all.
fn one_layer(edge: EdgePixel, around: Around) -> Split {
    return Split(edge.color, vec4f(0.0), edge.motion, edge.motion, edge.z, 0.0,
                 around.front_place.at, around.back_place.at, 1.0, 0u);
}

/// True if the outline of the front rests, as does what is behind it, while the front's surface moves: a body that turns about
/// itself. In the neighbouring frames the same pixels are in front as here, and not where the surface goes; half way, the body is.
fn outline_rests(edge: EdgePixel, around: Around, sides: Sides) -> bool {
    let back_rests = dot(sides.back_motion, sides.back_motion) < EDGE_MOTION * EDGE_MOTION;
    return back_rests && !sides.thin && outline_changes(edge, vec4f(0.0)) == 0u
        && outline_changes(edge, sides.front_motion) > 0u
        && (is_front_half_way(edge, around, sides.front_motion.xy) || is_front_half_way(edge, around, sides.front_motion.zw));
}

/// True if half a `step` [px] from the front leads to the front of the frame itself, too. Where spokes take each other's places, it
/// leads between them.
fn is_front_half_way(edge: EdgePixel, around: Around, step: vec2f) -> bool {
    let px = around.front_place.at + vec2i(round(0.5 * step));
    return flagged_depth(flags_at(inside(px))) < edge.between;
}

/// How many pixels of the 5 x 5 are in front in a neighbouring frame, where these vectors lead, and not here, or the reverse.
fn outline_changes(edge: EdgePixel, vectors: vec4f) -> u32 {
    var changes = 0u;
    for (var i = 0; i < 25; i++) {
        let px = edge.px + vec2i(i % 5, i / 5) - 2;
        let is_front = flagged_depth(flags_at(px)) < edge.between;
        let before = valid_depth(depth_there(inside(px + vec2i(round(vectors.xy))), false));
        let after = valid_depth(depth_there(inside(px + vec2i(round(vectors.zw))), true));
        changes += select(0u, neighbours.has_prev, (before < edge.between) != is_front);
        changes += select(0u, neighbours.has_next, (after < edge.between) != is_front);
    }
    return changes;
}

struct Outline {        // of the front around an edge pixel, in the frames around
    steps: vec4f,       // the way to it there, as vectors are [px]
    is_found: bool,     // all lines across it are the same there to within a pixel
}

struct Mask {           // of the 5 x 5 around an edge pixel
    axis: vec2i,        // across the outline, to the front: along x or y
    front: i32,         // pixels in front
}

/// The same of an outline that moves, as under a camera that does: the surface moves under it, by more than masks of pixels can err,
/// and it moves slower than that against the background. The way to it is found from the background's motion, and
/// again from the front's, each across the outline: where spokes take each other's places, the two lead to different ones.
fn outline_of_turning(edge: EdgePixel, around: Around, sides: Sides) -> Outline {
    let none = Outline(vec4f(0.0), false);
    if sides.thin { return none; }
    let mask = front_mask(edge);
    let led = outline_from(edge, mask, sides.front_motion);
    let off = both_ways(led.steps - sides.front_motion);
    if !led.is_found || length(off) <= MASK_ERROR { return none; }
    let across = abs(vec4f(vec4i(mask.axis, mask.axis)));
    let outline = outline_from(edge, mask, sides.back_motion);
    let again = outline_from(edge, mask, mix(sides.back_motion, sides.front_motion, across));
    let apart = again.steps - outline.steps;
    let is_same = outline.is_found && again.is_found && max(length(apart.xy), length(apart.zw)) <= MASK_ERROR;
    let drift = outline.steps - sides.back_motion;
    let bends = length(drift.xy + drift.zw) > MASK_ERROR;
    let drifts = length(both_ways(drift));
    let turns = drifts < length(both_ways(outline.steps - sides.front_motion));
    let deep = inside(around.front_place.at + 2 * mask.axis);
    let change = both_ways(textureLoad(motion, deep, 0) - textureLoad(motion, around.front_place.at, 0));
    let turns_within = flagged_depth(flags_at(deep)) >= edge.between || dot(change, off) < 0.0;
    let is_outline = is_same && turns && !bends && (turns_within || drifts <= 2.0 * MASK_ERROR);
    return Outline(outline.steps, is_outline);
}

/// What vectors lead to between the frame before and the one after.
fn both_ways(vectors: vec4f) -> vec2f {
    return vectors.zw - vectors.xy;
}

fn front_mask(edge: EdgePixel) -> Mask {
    var inward = vec2i(0);
    var front = 0;
    for (var i = 0; i < 25; i++) {
        let off = vec2i(i % 5, i / 5) - 2;
        let is_front = i32(flagged_depth(flags_at(edge.px + off)) < edge.between);
        inward += is_front * sign(off);
        front += is_front;
    }
    let axis = select(vec2i(0, sign(inward.y)), vec2i(sign(inward.x), 0), abs(inward.x) >= abs(inward.y));
    return Mask(axis, front);
}

/// The outline in the frames around, nearest to where these vectors lead.
fn outline_from(edge: EdgePixel, mask: Mask, vectors: vec4f) -> Outline {
    var outline = Outline(vectors, true);
    if neighbours.has_prev == 1u {
        let there = outline_in(edge, mask, vectors.xy, false);
        outline = Outline(vec4f(there.xy, outline.steps.zw), there.z <= LINES);
    }
    if neighbours.has_next == 1u {
        let there = outline_in(edge, mask, vectors.zw, true);
        outline = Outline(vec4f(outline.steps.xy, there.xy), outline.is_found && there.z <= LINES);
    }
    return outline;
}

/// The step to it in one frame, and how many pixels of the 5 x 5 are on another side there. A pixel more in front in each of the five
/// lines across is a pixel of the way.
fn outline_in(edge: EdgePixel, mask: Mask, vectors: vec2f, is_next: bool) -> vec3f {
    var step = vec2i(round(vectors));
    var rest = 0.0;
    var changes = 0.0;
    for (var k = 0; k < OUTLINE_STEPS; k++) {
        step += i32(round(rest)) * mask.axis;
        var front = 0;
        changes = 0.0;
        for (var i = 0; i < 25; i++) {
            let px = edge.px + vec2i(i % 5, i / 5) - 2;
            let is_front = valid_depth(depth_there(inside(px + step), is_next)) < edge.between;
            front += i32(is_front);
            changes += f32(is_front != (flagged_depth(flags_at(px)) < edge.between));
        }
        rest = f32(mask.front - front) / LINES;
        if abs(rest) <= 0.5 { break; }
    }
    return vec3f(vec2f(step) + rest * vec2f(mask.axis), changes);
}

/// The two layers of a pixel whose motion is between those of the two sides, along `axis`.
fn split_layers(split: ptr<function, Split>, edge: EdgePixel, around: Around, sides: Sides, axis: vec4f) {
    let back_z = sides.back.depth / sides.back.total;
    let seen = background_around(edge.px, sides.back_motion, back_z);
    let seen_around = seen.count > 0.0;
    let background = select(sides.back.color / sides.back.weight, seen.color / max(seen.count, 1.0), seen_around);
    let coverage = measured_coverage(edge, sides, axis, background);
    let measured = coverage.share;
    let front_z = sides.front.depth / sides.front.total;
    (*split).told = select(0u, AROUND, seen_around);
    (*split).back_z = back_z;
    if measured < 1.0 - FULL {      // all background, whatever the one sample of the depth says
        (*split).told = SEEN;
        (*split).coverage = 0.0;
        (*split).back = select(background, edge.color / edge.counts, edge.counts > 0.0);
        (*split).front = vec4f(0.0);
        (*split).front_motion = sides.front_motion;
        if sides.thin { (*split).front_at = sides.purest; }
        if edge.z >= edge.between { (*split).back_z = edge.z; }
        (*split).front_z = front_z;
    } else {
        let share = select(measured, 1.0, measured > FULL);
        // Together they are the pixel's colour: light that would be below black in front, or too bright, is behind.
        let behind = (1.0 - share) * edge.counts;
        let rest = edge.color - behind * background;
        let contrast = select(MOST_CONTRAST, WIRE_CONTRAST, sides.thin);
        let most = select(contrast * share * edge.counts * sides.brightest, vec4f(INFINITE), seen_around);
        let front = max(min(rest, most), vec4f(0.0));
        (*split).coverage = share;
        (*split).front = front;
        (*split).back = background + select(vec4f(0.0), (rest - front) / max(behind, 1e-6), behind > 0.0);
        (*split).back_motion = sides.back_motion;
        if measured <= FULL { (*split).front_motion = sides.front_motion; }
        if measured <= FULL && sides.thin { (*split).front_at = sides.purest; }
        if measured <= FULL || edge.z >= edge.between { (*split).front_z = front_z; }
    }
    if coverage.is_guess {      // both surfaces have the pixel's colour
        (*split).front = (*split).coverage * edge.color;
        (*split).back = edge.color / edge.counts;
    }
    if is_unfiltered(edge.px) { // vectors are those of the middles of pixels
        let nearest = nearest_front(edge);
        (*split).front_motion = textureLoad(motion, nearest, 0);
        if edge.z >= edge.between { (*split).back_motion = edge.motion; }
    }
}

/// Write both layers. The bends of their paths come from the nearest pure pixels: filtered vectors lead to mixtures.
fn store_layers(edge: EdgePixel, split: Split) {
    let front_path = with_bend_of(split.front_at, split.front_motion);
    let back_path = with_bend_of(split.back_at, split.back_motion);
    textureStore(colors, edge.px, FRONT, split.front);
    let z = split.front_z * front_path.depth_ratio;
    let back_z = split.back_z * back_path.depth_ratio;
    let has_back = back_z > 0.0;
    let by_color = is_unfiltered(edge.px);
    textureStore(surfaces, edge.px, FRONT, pack_surface(front_path.trajectory, -z, select(0u, BY_COLOR, by_color)));
    if has_back { textureStore(colors, edge.px, BACK, split.back); }     // else nobody reads it
    textureStore(surfaces, edge.px, BACK,
                 pack_surface(back_path.trajectory, max(back_z, 0.0), select(SINGLE, split.told, has_back)));
    textureStore(mattes, edge.px, pack_matte(Matte(z, has_back, split.coverage, split.coverage * edge.counts)));
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
