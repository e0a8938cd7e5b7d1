// Silhouettes as two layers. A renderer mixes colours and vectors of the surfaces that a pixel shows;
// here they are parted again: a near layer with its coverage, and what is behind it.
//#include common/finite.wgsl
//#include common/frame.wgsl
//#include common/path.wgsl
//#include blur/gather_listed.wgsl
//#include blur/gather_tile.wgsl

@group(1) @binding(0) var color: texture_2d<f32>;       // of one frame, premultiplied by alpha and weight
@group(1) @binding(1) var motion: texture_2d<f32>;      // to_prev, to_next [px]
@group(1) @binding(2) var depth: texture_2d<f32>;
@group(1) @binding(3) var weight: texture_2d<f32>;
@group(1) @binding(4) var marked: texture_2d<u32>;      // what `mark` wrote: depth and flags
@group(1) @binding(5) var marks: Marks;
@group(1) @binding(6) var near_color: Color;            // premultiplied by coverage too
@group(1) @binding(7) var near_path: Packed;            // see packed()
@group(1) @binding(8) var far_color: Color;
@group(1) @binding(9) var far_path: Packed;
@group(1) @binding(10) var surface: Exact;              // near depth; far depth, 0 where there is none; coverage; weight
@group(1) @binding(11) var<storage, read> listed: Listed;   // the cells to work on
@group(1) @binding(12) var<storage, read_write> mixed: Mixed;
@group(1) @binding(13) var<storage, read_write> needed: array<u32>;     // workgroups of `part`, to dispatch it indirectly

struct Mixed {          // pixels that may show two surfaces
    count: atomic<u32>,
    pixels: array<u32>, // as cells are in a Listed
}

alias Marks = texture_storage_2d<r32uint, write>;
alias Color = texture_storage_2d<rgba32float, write>;
alias Packed = texture_storage_2d<rgba32uint, write>;
alias Exact = texture_storage_2d<rgba32float, write>;

override WEIGHTED: bool = false;

// The last two bits of a marked depth.
const FLAGS: u32 = 3u;
const MIXED: u32 = 1u;          // two surfaces may show
const BRIGHT: u32 = 2u;         // some channel is beyond WHITE
const FAR: f32 = 8589934592.0;  // depth of what has none; a power of two, the last bits are 0
const APART: f32 = 1.1;         // ratio of depths that makes two surfaces
const DIFFERENT: f32 = 0.5;     // of their motions [px]
const WHITE: f32 = 1.0;
const WHOLE: f32 = 0.98;        // coverage from here on is all
const TELLING: f32 = 0.5;       // alphas farther apart than this tell coverage

fn held(px: vec2i) -> vec2i {
    return clamp(px, vec2i(0), vec2i(frame.size) - 1);
}

fn depth_at(px: vec2i) -> f32 {
    let z = textureLoad(depth, held(px), 0).x;
    return select(FAR, min(z, FAR), is_finite(z) && z > 0.0);
}

fn color_at(px: vec2i) -> vec4f {
    return textureLoad(color, held(px), 0);
}

fn mark_at(px: vec2i) -> u32 {
    return textureLoad(marked, held(px), 0).x;
}

fn is_mixed(mark: u32) -> bool {
    return (mark & MIXED) != 0u;
}

fn marked_depth(mark: u32) -> f32 {
    return bitcast<f32>(mark & ~FLAGS);
}

fn weight_at(px: vec2i) -> f32 {
    if !WEIGHTED { return 1.0; }
    return textureLoad(weight, held(px), 0).x;
}

/// Around one pixel: depths lie apart, and so do motions.
@compute @workgroup_size(CELL * TILE, STRIP)
fn mark(@builtin(local_invocation_index) local: u32, @builtin(workgroup_id) group: vec3u) {
    let k = place_of(group);
    let px = vec2i(pixel_in(listed.cells[k], group, local));
    if k >= listed.count || any(px >= vec2i(frame.size)) { return; }
    var nearest = FAR;
    var farthest = 0.0;
    for (var i = 0; i < 9; i++) {
        let z = depth_at(px + vec2i(i % 3, i / 3) - 1);
        nearest = min(nearest, z);
        farthest = max(farthest, z);
    }
    let here = textureLoad(motion, px, 0);
    var most = 0.0;
    let count = select(0, 9, farthest > nearest * APART);
    for (var i = 0; i < count; i++) {
        let other = textureLoad(motion, held(px + vec2i(i % 3, i / 3) - 1), 0) - here;
        most = max(most, dot(other, other));
    }
    let bright = any(abs(textureLoad(color, px, 0)) > vec4f(WHITE));
    let flags = select(0u, MIXED, most > DIFFERENT * DIFFERENT) | select(0u, BRIGHT, bright);
    textureStore(marks, px, vec4u((bitcast<u32>(depth_at(px)) & ~FLAGS) | flags));
}

/// The two layers of every pixel that shows one surface, and a list of all others.
@compute @workgroup_size(CELL * TILE, STRIP)
fn split(@builtin(local_invocation_index) local: u32, @builtin(workgroup_id) group: vec3u) {
    let k = place_of(group);
    let px = vec2i(pixel_in(listed.cells[k], group, local));
    if k >= listed.count || any(px >= vec2i(frame.size)) { return; }
    let counts = weight_at(px);
    var beside = false;
    var calm = true;        // one surface and weight, nothing beyond white, in the 3 x 3
    let here = mark_at(px);
    for (var i = 0; i < 9; i++) {
        let at = px + vec2i(i % 3, i / 3) - 1;
        let mark = mark_at(at);
        calm = calm && (mark & FLAGS) == 0u && weight_at(at) == counts;
        beside = beside || is_mixed(mark);
    }
    let path = trajectory_from(textureLoad(motion, px, 0));
    let z = marked_depth(here);
    textureStore(near_color, px, textureLoad(color, px, 0));
    textureStore(near_path, px, packed(path, select(z, -z, beside), calm));
    textureStore(far_path, px, packed(path, 0.0, false));
    textureStore(surface, px, vec4f(z, 0.0, 1.0, counts));
    if is_mixed(here) { mixed.pixels[atomicAdd(&mixed.count, 1u)] = listed_as(vec2u(px)); }
}

@compute @workgroup_size(1)
fn count() {
    let wanted = (atomicLoad(&mixed.count) + WG_X * WG_Y - 1u) / (WG_X * WG_Y);
    needed[0] = min(wanted, IN_A_ROW);
    needed[1] = (wanted + IN_A_ROW - 1u) / IN_A_ROW;
    needed[2] = 1u;
}

struct Side {       // the mean of what lies on one side of a silhouette
    total: f32,
    motion: vec4f,
    depth: f32,
    color: vec4f,
    counted: f32,   // weight of the colour
}

fn add(side: ptr<function, Side>, share: f32, way: vec4f, z: f32, shown: vec4f, weight: f32) {
    (*side).total += share;
    (*side).motion += share * way;
    (*side).depth += share * z;
    (*side).color += share * shown;
    (*side).counted += share * weight;
}

struct Around {         // one of the 5 x 5 around a pixel that shows two surfaces
    at: vec2i,
    distance2: f32,
    z: f32,
    counts: bool,
    is_front: bool,
    is_pure: bool,      // it shows one
}

fn around(px: vec2i, i: i32, between: f32) -> Around {
    let off = vec2i(i % 5, i / 5) - 2;
    let at = px + off;
    let mark = mark_at(at);
    let z = marked_depth(mark);
    let distance2 = f32(off.x * off.x + off.y * off.y);
    let inside = all(at >= vec2i(0)) && all(at < vec2i(frame.size));
    // The corners are too far away for a background: it may be another one.
    return Around(at, distance2, z, inside && (z < between || distance2 < 8.0), z < between, !is_mixed(mark));
}

/// The two layers of the pixels that show two surfaces: all others have them already.
@compute @workgroup_size(WG_X, WG_Y)
fn part(@builtin(local_invocation_index) local: u32, @builtin(workgroup_id) group: vec3u) {
    let k = (group.y * IN_A_ROW + group.x) * WG_X * WG_Y + local;
    if k >= atomicLoad(&mixed.count) { return; }
    let px = vec2i(cell_in(mixed.pixels[k]));
    let counts = weight_at(px);
    var nearest = FAR;
    var farthest = 0.0;
    for (var i = 0; i < 9; i++) {
        let z = marked_depth(mark_at(px + vec2i(i % 3, i / 3) - 1));
        nearest = min(nearest, z);
        farthest = max(farthest, z);
    }
    let own = textureLoad(color, px, 0);
    let own_motion = textureLoad(motion, px, 0);
    var z = marked_depth(mark_at(px));
    var near = own;
    var near_motion = own_motion;
    var far = vec4f(0.0);
    var far_motion = own_motion;
    var far_z = 0.0;
    var coverage = 1.0;
    var seen = false;       // the far layer is no guess

    let between = select(sqrt(nearest * farthest), 1.5 * nearest, farthest >= FAR);
    var thin = true;        // a wire: nothing near is unmixed
    var no_back = true;     // nothing behind is
    for (var i = 0; i < 25; i++) {
        let there = around(px, i, between);
        thin = thin && !(there.counts && there.is_front && there.is_pure);
        no_back = no_back && !(there.counts && !there.is_front && there.is_pure);
    }
    var front = Side();
    var back = Side();
    for (var i = 0; i < 25; i++) {
        let there = around(px, i, between);
        let wanted = there.counts && (there.is_pure || select(no_back, thin, there.is_front));
        let way = select(vec4f(0.0), textureLoad(motion, held(there.at), 0), wanted);
        let shown = select(vec4f(0.0), color_at(there.at), wanted);
        // The less the farther it is.
        let share = select(0.0, 1.0 / (1.0 + there.distance2 * there.distance2), wanted);
        let weight = weight_at(there.at);
        add(&front, select(0.0, share, there.is_front), way, there.z, shown, weight);
        add(&back, select(share, 0.0, there.is_front), way, there.z, shown, weight);
    }
    let behind = back.motion / back.total;
    var before = select(front.motion / front.total, behind, thin);
    var most = 0.0;
    for (var i = 0; i < select(0, 9, thin); i++) {     // of a wire, the motion most unlike the background's
        let there = around(px, i % 3 + i / 3 * 5 + 6, between);
        let way = textureLoad(motion, held(there.at), 0);
        let apart = dot(way - behind, way - behind);
        if there.counts && there.is_front && apart > most {
            most = apart;
            before = way;
        }
    }

    if front.total > 0.0 && back.total > 0.0 && back.counted > 0.0 {
        let way = before - behind;
        if dot(way, way) >= DIFFERENT * DIFFERENT {
            // What is opaque before what is not tells its share better than vectors, which some renderers do not mix.
            let opaque = select(front.color.a / max(front.counted, 1e-9), 1.0, thin);
            let clear = back.color.a / back.counted;
            let by_alpha = opaque - clear > TELLING && counts > 0.0;
            let part = clamp(select(dot(own_motion - behind, way) / dot(way, way),
                (own.a / counts - clear) / (opaque - clear), by_alpha), 0.0, 1.0);
            far_z = back.depth / back.total;
            if part < 1.0 - WHOLE {     // all background, whatever the depth's one sample says
                seen = true;
                coverage = 0.0;
                far = select(back.color / back.counted, own / counts, counts > 0.0);
                near = vec4f(0.0);
                near_motion = before;
                if z >= between { far_z = z; }
                z = front.depth / front.total;
            } else {
                coverage = select(part, 1.0, part > WHOLE);
                far = back.color / back.counted;
                near = max(own - (1.0 - coverage) * counts * far, vec4f(0.0));
                far_motion = behind;
                if part <= WHOLE { near_motion = before; }
                if part <= WHOLE || z >= between { z = front.depth / front.total; }
            }
        }
    }
    textureStore(near_color, px, near);
    textureStore(near_path, px, packed(trajectory_from(near_motion), -z, false));
    if far_z > 0.0 { textureStore(far_color, px, far); }        // else nobody reads it
    textureStore(far_path, px, packed(trajectory_from(far_motion), max(far_z, 0.0), seen));
    textureStore(surface, px, vec4f(z, far_z, coverage, coverage * counts));
}

/// Pixels far from all that moves, whose colours nobody reads: searches pass over them.
@compute @workgroup_size(CELL * TILE, STRIP)
fn whole(@builtin(local_invocation_index) local: u32, @builtin(workgroup_id) group: vec3u) {
    let k = place_of(group);
    let px = vec2i(pixel_in(listed.cells[k], group, local));
    if k >= listed.count || any(px >= vec2i(frame.size)) { return; }
    let path = trajectory_from(textureLoad(motion, px, 0));
    textureStore(near_path, px, packed(path, marked_depth(bitcast<u32>(depth_at(px))), false));
    textureStore(far_path, px, packed(path, 0.0, false));
}
