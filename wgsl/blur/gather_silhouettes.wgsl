// Silhouettes as two layers. A renderer mixes colours and vectors of the surfaces that a pixel shows;
// here they are parted again: a near layer with its coverage, and what is behind it.
//#include common/finite.wgsl
//#include common/frame.wgsl
//#include common/path.wgsl
//#include blur/gather_tile.wgsl

@group(1) @binding(0) var color: texture_2d<f32>;       // of one frame, premultiplied by alpha and weight
@group(1) @binding(1) var motion: texture_2d<f32>;      // to_prev, to_next [px]
@group(1) @binding(2) var depth: texture_2d<f32>;
@group(1) @binding(3) var weight: texture_2d<f32>;
@group(1) @binding(4) var marked: texture_2d<u32>;      // what `mark` wrote: MIXED, BRIGHT
@group(1) @binding(5) var marks: Marks;
@group(1) @binding(6) var near_color: Color;            // premultiplied by coverage too
@group(1) @binding(7) var near_path: Packed;            // see packed()
@group(1) @binding(8) var far_color: Color;
@group(1) @binding(9) var far_path: Packed;
@group(1) @binding(10) var surface: Exact;              // near depth; far depth, 0 where there is none; coverage; weight
@group(1) @binding(11) var bend: Packed;                // second differences of the colour, across, down, where calm

alias Marks = texture_storage_2d<r32uint, write>;
alias Color = texture_storage_2d<rgba32float, write>;
alias Packed = texture_storage_2d<rgba32uint, write>;
alias Exact = texture_storage_2d<rgba32float, write>;

override WEIGHTED: bool = false;

const MIXED: u32 = 1u;          // two surfaces may show
const BRIGHT: u32 = 2u;         // some channel is over WHITE
const FAR: f32 = 1e10;          // depth of what has none
const APART: f32 = 1.1;         // ratio of depths that makes two surfaces
const DIFFERENT: f32 = 0.5;     // of their motions [px]
const WHITE: f32 = 1.0;
const WHOLE: f32 = 0.98;        // coverage from here on is all

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

fn is_mixed(px: vec2i) -> bool {
    return (textureLoad(marked, px, 0).x & MIXED) != 0u;
}

fn weight_at(px: vec2i) -> f32 {
    if !WEIGHTED { return 1.0; }
    return textureLoad(weight, held(px), 0).x;
}

/// Around one pixel: depths lie apart, and so do motions.
@compute @workgroup_size(WG_X, WG_Y)
fn mark(@builtin(global_invocation_id) id: vec3u) {
    if any(id.xy >= frame.size) { return; }
    let px = vec2i(id.xy);
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
    let bright = any(textureLoad(color, px, 0) > vec4f(WHITE));
    textureStore(marks, px, vec4u(select(0u, MIXED, most > DIFFERENT * DIFFERENT) | select(0u, BRIGHT, bright)));
}

struct Side {       // the mean of what lies on one side of a silhouette
    total: f32,
    motion: vec4f,
    depth: f32,
    color: vec4f,
    counted: f32,   // weight of the colour
}

/// The two layers of every pixel.
@compute @workgroup_size(WG_X, WG_Y)
fn split(@builtin(global_invocation_id) call: vec3u,
        @builtin(workgroup_id) group: vec3u, @builtin(num_workgroups) groups: vec3u) {
    let id = spread(call, group, groups);
    if any(id.xy >= frame.size) { return; }
    let px = vec2i(id.xy);
    let counts = weight_at(px);
    var beside = false;
    var calm = true;        // one surface and weight, nothing brighter than white, in the 3 x 3
    for (var i = 0; i < 9; i++) {
        let at = px + vec2i(i % 3, i / 3) - 1;
        let mark = textureLoad(marked, held(at), 0).x;
        calm = calm && mark == 0u && weight_at(at) == counts;
        beside = beside || (mark & MIXED) != 0u;
    }
    let own = textureLoad(color, px, 0);
    let across = select(vec4f(0.0), color_at(px - vec2i(1, 0)) - 2.0 * own + color_at(px + vec2i(1, 0)), calm);
    let down = select(vec4f(0.0), color_at(px - vec2i(0, 1)) - 2.0 * own + color_at(px + vec2i(0, 1)), calm);
    let own_motion = textureLoad(motion, px, 0);
    var z = depth_at(px);
    var near = own;
    var near_motion = own_motion;
    var far = vec4f(0.0);
    var far_motion = own_motion;
    var far_z = 0.0;
    var coverage = 1.0;
    var seen = false;       // the far layer is no guess

    let mixed = is_mixed(px);
    var nearest = FAR;
    var farthest = 0.0;
    var i = 0;
    loop {          // short loops are left from their end, see gather.wgsl
        let other = depth_at(px + vec2i(i % 3, i / 3) - 1);
        nearest = min(nearest, other);
        farthest = max(farthest, other);
        i++;
        if i >= 9 || !mixed { break; }
    }
    let between = select(sqrt(nearest * farthest), 1.5 * nearest, farthest >= FAR);
    var front = Side();
    var back = Side();
    i = 0;
    loop {
        if mixed { collect(px, i, between, true, true, true, &front, &back); }
        i++;
        if i >= 25 || !mixed { break; }
    }
    let thin = front.total == 0.0;      // a wire: nothing near is unmixed
    let no_back = back.total == 0.0;
    let more = mixed && (thin || no_back);
    i = 0;
    loop {
        if more { collect(px, i, between, false, thin, no_back, &front, &back); }
        i++;
        if i >= 25 || !more { break; }
    }

    if mixed && front.total > 0.0 && back.total > 0.0 && back.counted > 0.0 {
        let behind = back.motion / back.total;
        var before = front.motion / front.total;
        if thin { before = most_different(px, between, behind, thin); }
        let way = before - behind;
        if dot(way, way) >= DIFFERENT * DIFFERENT {
            let part = clamp(dot(own_motion - behind, way) / dot(way, way), 0.0, 1.0);
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
    textureStore(near_path, px, packed(path_of(near_motion), select(z, -z, beside), calm));
    textureStore(far_color, px, far);
    textureStore(far_path, px, packed(path_of(far_motion), max(far_z, 0.0), seen));
    textureStore(bend, px, vec4u(
        pack2x16float(across.xy), pack2x16float(across.zw), pack2x16float(down.xy), pack2x16float(down.zw)));
    textureStore(surface, px, vec4f(z, far_z, coverage, coverage * counts));
}

/// Add pixel `i` of the 5 x 5 around `px` to its side, the less the farther it is.
fn collect(px: vec2i, i: i32, between: f32, pure_only: bool, to_front: bool, to_back: bool,
           front: ptr<function, Side>, back: ptr<function, Side>) {
    let off = vec2i(i % 5, i / 5) - 2;
    let at = px + off;
    if any(at < vec2i(0)) || any(at >= vec2i(frame.size)) { return; }
    if pure_only && is_mixed(at) { return; }
    let z = depth_at(at);
    let is_front = z < between;
    if !select(to_back, to_front, is_front) { return; }
    let distance2 = f32(off.x * off.x + off.y * off.y);
    let share = 1.0 / (1.0 + distance2 * distance2);
    let way = share * textureLoad(motion, at, 0);
    if is_front {
        (*front).total += share;
        (*front).motion += way;
        (*front).depth += share * z;
    } else {
        (*back).total += share;
        (*back).motion += way;
        (*back).depth += share * z;
        (*back).color += share * textureLoad(color, at, 0);
        (*back).counted += share * weight_at(at);
    }
}

/// Of the near motions in the 3 x 3, the one most unlike that of the background; of a `thin` thing.
fn most_different(px: vec2i, between: f32, behind: vec4f, thin: bool) -> vec4f {
    var found = behind;
    var most = 0.0;
    var i = 0;
    loop {
        let at = held(px + vec2i(i % 3, i / 3) - 1);
        let way = textureLoad(motion, at, 0);
        let apart = dot(way - behind, way - behind);
        if apart > most && depth_at(at) < between {
            most = apart;
            found = way;
        }
        i++;
        if i >= 9 || !thin { break; }
    }
    return found;
}
