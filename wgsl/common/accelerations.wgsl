// Evidence of the frames before and after a frame about the paths of its surfaces. Where there is no such neighbour its textures
// are empty: their depth is 0.
//#include common/depth.wgsl
//#include common/frame.wgsl
//#include common/trajectory5.wgsl

@group(1) @binding(13) var prev_motion: texture_2d<f32>;     // stored as given: to_prev, to_next [px]
@group(1) @binding(14) var prev_depth: texture_2d<f32>;      // stored as given
@group(1) @binding(17) var next_motion: texture_2d<f32>;     // stored as given
@group(1) @binding(18) var next_depth: texture_2d<f32>;      // stored as given

const RETURNS: f32 = 1.5;               // a surface is found again where its vector leads back within this [px]
const SAME_DEPTH_RATIO: f32 = 1.15;     // and its depth has not changed by more: it may come nearer
const MOST_DEPTH_CHANGE: f32 = 1.5;     // the same, for its depth there to be believed

/// The vectors of a pixel of the neighbouring frame before or after. (A texture that lavapipe reads from storage is no parameter.)
fn motion_there(px: vec2i, is_next: bool) -> vec4f {
    if is_next { return textureLoad(next_motion, px, 0); }
    return textureLoad(prev_motion, px, 0);
}

/// Its depth as it was given.
fn depth_there(px: vec2i, is_next: bool) -> f32 {
    if is_next { return textureLoad(next_depth, px, 0).x; }
    return textureLoad(prev_depth, px, 0).x;
}

/// Half the acceleration in a neighbouring frame of what is displaced by `step` [px] up to it: where it is by then, or beside a
/// silhouette, in the one of the four pixels around whose vector leads back best.
fn acceleration_in(px: vec2i, step: vec2f, z: f32, is_next: bool) -> Acceleration {
    let at = vec2f(px) + 0.5 + step;
    let is_inside = all(at >= vec2f(0.0)) && all(at < vec2f(frame.size));
    let beside = select(vec2f(-1.0), vec2f(1.0), fract(at) >= vec2f(0.5));
    var result = Acceleration(vec2f(0.0), false, 1.0);
    var least = RETURNS * RETURNS;
    var i = 0;
    loop {
        let place = at + beside * vec2f(vec2i(i & 1, i >> 1u));
        let there = vec2i(clamp(place, vec2f(0.0), vec2f(frame.size) - 1.0));
        let vectors = motion_there(there, is_next);
        let given = depth_there(there, is_next);
        let ratio = valid_depth(given) / z;
        let off = select(vectors.zw, vectors.xy, is_next) + step;
        let returns = is_inside && given > 0.0 && dot(off, off) < least;
        let change = max(ratio, 1.0 / ratio);
        let is_known = returns && change < SAME_DEPTH_RATIO;
        if is_known || (i == 0 && returns && change < MOST_DEPTH_CHANGE) { result.depth_ratio = ratio; }
        if is_known {
            result.half = 0.5 * (vectors.xy + vectors.zw);
            result.is_known = true;
            least = dot(off, off);
        }
        i++;
        if i > 3 || (i == 1 && (is_known || !is_inside)) { break; }
    }
    return result;
}
