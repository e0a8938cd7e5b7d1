// The two sides of an edge pixel: which pixels around it are in front and which behind, and the mean surface of either.
//#include common/depth.wgsl
//#include common/frame.wgsl
//#include methods/gather/layers/around.wgsl
//#include methods/gather/layers/edge_flags.wgsl

@group(1) @binding(0) var color: texture_2d<f32>;       // stored as given: of one frame, premultiplied by alpha and weight
@group(1) @binding(3) var weight: texture_2d<f32>;
@group(1) @binding(4) var edge_flags: texture_2d<u32>;  // stored as r32uint, by edges.wgsl: depth and flags

fn color_at(px: vec2i) -> vec4f {
    let at = inside(px);
    return textureLoad(color, at, 0);
}

fn flags_at(px: vec2i) -> u32 {
    let at = inside(px);
    return textureLoad(edge_flags, at, 0).x;
}

fn weight_at(px: vec2i) -> f32 {
    if !WEIGHTED { return 1.0; }
    return textureLoad(weight, inside(px), 0).x;
}

struct EdgePixel {      // a pixel that may show two surfaces
    px: vec2i,
    counts: f32,        // its weight
    color: vec4f,
    motion: vec4f,
    z: f32,
    between: f32,       // depth of neither of the two
}

fn edge_pixel(px: vec2i) -> EdgePixel {
    var nearest = NO_DEPTH;
    var farthest = 0.0;
    for (var i = 0; i < 9; i++) {
        let z = flagged_depth(flags_at(px + vec2i(i % 3, i / 3) - 1));
        nearest = min(nearest, z);
        farthest = max(farthest, z);
    }
    let between = select(sqrt(nearest * farthest), 1.5 * nearest, farthest >= NO_DEPTH);
    return EdgePixel(px, weight_at(px), textureLoad(color, px, 0), textureLoad(motion, px, 0),
                     flagged_depth(flags_at(px)), between);
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

struct Around {         // the 5 x 5, a bit each
    front: u32,         // all that are in front
    back: u32,
    pure: u32,          // those that show one surface
    front_place: Place,
    back_place: Place,
}

fn sort_around(edge: EdgePixel) -> Around {
    // The back is as deep as the pixel itself, or as the nearest background beside it, above or below.
    var behind_z = select(INFINITE, edge.z, edge.z >= edge.between);
    for (var i = 1; i < select(0, 9, behind_z >= INFINITE); i += 2) {
        let z = flagged_depth(flags_at(edge.px + vec2i(i % 3, i / 3) - 1));
        behind_z = min(behind_z, select(INFINITE, z, z >= edge.between));
    }
    var around = Around(0u, 0u, 0u, Place(edge.px, INFINITE), Place(edge.px, INFINITE));
    for (var i = 0; i < 25; i++) {
        var there = neighbour(edge.px, i, edge.between);
        let is_another = max(there.z, behind_z) > BACKGROUND_DEPTH_RATIO * min(there.z, behind_z);
        there.counts = there.counts && (there.is_front || behind_z >= INFINITE || !is_another);
        around.front |= select(0u, 1u << u32(i), there.counts && there.is_front);
        around.back |= select(0u, 1u << u32(i), there.counts && !there.is_front);
        around.pure |= select(0u, 1u << u32(i), there.is_pure);
        if there.counts && there.is_pure && there.is_front && there.distance2 < around.front_place.distance2 {
            around.front_place = Place(there.at, there.distance2);
        }
        if there.counts && there.is_pure && !there.is_front && there.distance2 < around.back_place.distance2 {
            around.back_place = Place(there.at, there.distance2);
        }
    }
    return around;
}

/// The pixel of the 5 x 5 in front that is nearest, itself if it is in front.
fn nearest_front(edge: EdgePixel) -> vec2i {
    var place = Place(edge.px, INFINITE);
    for (var i = 0; i < 25; i++) {
        let there = neighbour(edge.px, i, edge.between);
        if there.counts && there.is_front && there.distance2 < place.distance2 {
            place = Place(there.at, there.distance2);
        }
    }
    return place.at;
}

/// The share of a pixel that the front of its 3 x 3 covers if surfaces end half way between the middles of pixels, evenly softened.
fn front_around(edge: EdgePixel) -> f32 {
    var sum = 0.0;
    for (var i = 0; i < 9; i++) {
        let off = vec2i(i % 3, i / 3) - 1;
        let weights = 2 - abs(off);
        let is_front = flagged_depth(flags_at(edge.px + off)) < edge.between;
        sum += select(0.0, f32(weights.x * weights.y) / 16.0, is_front);
    }
    return sum;
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

struct Sides {
    front: Side,
    back: Side,
    front_motion: vec4f,    // the mean; of a wire, the motion that differs most from the background's
    back_motion: vec4f,
    thin: bool,             // no pure pixel is in front: a wire
    purest: vec2i,          // the pixel that gave a wire's motion
    brightest: vec4f,       // of the front's pixels and the edge pixel itself
}

fn sum_sides(edge: EdgePixel, around: Around) -> Sides {
    let thin = (around.front & around.pure) == 0u;
    let no_pure_background = (around.back & around.pure) == 0u;
    var front = Side();
    var back = Side();
    var brightest = edge.color / max(edge.counts, 1e-9);
    var todo = (around.front & (around.pure | select(0u, ~0u, thin)))
        | (around.back & (around.pure | select(0u, ~0u, no_pure_background)));
    loop {
        let there = neighbour(edge.px, i32(min(firstTrailingBit(todo), 24u)), edge.between);
        let at = inside(there.at);
        let vectors = textureLoad(motion, at, 0);
        let shown = color_at(at);
        // The farther away, the smaller the share.
        let share = select(0.0, 1.0 / (1.0 + there.distance2 * there.distance2), todo != 0u);
        let counts = weight_at(at);
        if todo != 0u && there.is_front { brightest = max(brightest, shown / max(counts, 1e-9)); }
        add(&front, select(0.0, share, there.is_front), vectors, there.z, shown, counts);
        add(&back, select(share, 0.0, there.is_front), vectors, there.z, shown, counts);
        todo &= todo - 1u;
        if todo == 0u { break; }
    }
    let back_motion = back.motion / back.total;
    let front_motion = select(front.motion / front.total, back_motion, thin);
    var sides = Sides(front, back, front_motion, back_motion, thin, edge.px, brightest);
    find_wire(&sides, edge);
    return sides;
}

/// The pixel of a wire whose motion differs most from the background's.
fn find_wire(sides: ptr<function, Sides>, edge: EdgePixel) {
    var most = 0.0;
    for (var i = 0; i < select(0, 9, (*sides).thin); i++) {
        let there = neighbour(edge.px, i % 3 + i / 3 * 5 + 6, edge.between);
        let at = inside(there.at);
        let vectors = textureLoad(motion, at, 0);
        let difference = vectors - (*sides).back_motion;
        let difference2 = dot(difference, difference);
        if there.counts && there.is_front && difference2 > most {
            most = difference2;
            (*sides).purest = there.at;
            (*sides).front_motion = vectors;
        }
    }
}
