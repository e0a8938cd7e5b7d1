// Information from the frames before and after a frame: paths of surfaces beyond them, and backgrounds that it hides.
// Where there is no such frame its textures are not read.
//#include common/depth.wgsl
//#include common/accelerations.wgsl
//#include common/frame.wgsl
//#include methods/gather/layers/gains.wgsl
//#include methods/gather/surface.wgsl

@group(1) @binding(12) var prev_color: texture_2d<f32>;      // stored as given
@group(1) @binding(15) var prev_weight: texture_2d<f32>;
@group(1) @binding(16) var next_color: texture_2d<f32>;      // stored as given
@group(1) @binding(19) var next_weight: texture_2d<f32>;

@group(1) @binding(24) var<storage, read> prev_gains: array<u32>;   // per pixel, see relight.wgsl
@group(1) @binding(25) var<storage, read> next_gains: array<u32>;

// The layers of the frames beyond the neighbours, of each its FRONT and BACK.
@group(1) @binding(21) var far_layer_colors: texture_2d_array<f32>;
@group(1) @binding(22) var far_surfaces: texture_2d_array<u32>;
@group(1) @binding(23) var far_mattes: texture_2d_array<u32>;

@group(1) @binding(5) var<uniform> neighbours: Neighbours;  // no overrides: each frame of a sequence would have its own pipelines

struct Neighbours {     // 1 or 0
    has_prev: u32,      // there is a frame before, and one after
    has_next: u32,
    own_is_prev: u32,   // the one before is the frame that is blurred, or the one after is
    own_is_next: u32,
    relit: u32,         // they have gains
    has_far_prev: u32,  // there is a frame beyond the one before, and beyond the one after
    has_far_next: u32,
}

override WEIGHTED: bool = false;        // read weights

struct SurfaceAround {
    trajectory: Trajectory5,
    depth_ratio: f32,       // of its depth in the frame that is blurred to that here, 1 if it is not known
}

/// The trajectory of the surface at the centre of `px` with these vectors, as far as the frames around tell.
fn surface_around(px: vec2i, motion: vec4f, z: f32) -> SurfaceAround {
    var before = Acceleration(vec2f(0.0), false, 1.0);
    var after = before;
    if neighbours.has_prev == 1u { before = acceleration_in(px, motion.xy, z, false); }
    if neighbours.has_next == 1u { after = acceleration_in(px, motion.zw, z, true); }
    let depth_ratio = select(
        select(1.0, after.depth_ratio, neighbours.own_is_next == 1u), before.depth_ratio, neighbours.own_is_prev == 1u);
    return SurfaceAround(trajectory_between(motion, before, after), depth_ratio);
}

struct Background {         // sums over the frames that show it
    color: vec4f,           // not premultiplied by weight
    count: f32,
}

const BACKGROUND_DEPTH_RATIO: f32 = 1.1;    // depth that a background may differ by from where it is expected
const BACKGROUND_RETURNS: f32 = 1.0;        // [px], see RETURNS

/// The background at the centre of `px`, of these vectors and this depth, as the frames around show it.
fn background_around(px: vec2i, motion: vec4f, z: f32) -> Background {
    var sum = Background(vec4f(0.0), 0.0);
    if neighbours.has_prev == 1u { look(&sum, px, motion.xy, z, false); }
    if neighbours.has_next == 1u { look(&sum, px, motion.zw, z, true); }
    let is_seen = sum.count > 0.0;
    if neighbours.has_far_prev == 1u && !is_seen { look_far(&sum, px, motion, z, 0u, -2.0); }
    if neighbours.has_far_next == 1u && !is_seen { look_far(&sum, px, motion, z, neighbours.has_far_prev, 2.0); }
    return sum;
}

/// The same in frame `f` of those beyond the neighbours, `u` frame intervals away.
fn look_far(sum: ptr<function, Background>, px: vec2i, motion: vec4f, z: f32, f: u32, u: f32) {
    let trajectory = trajectory_from(motion);
    let step = displacement(trajectory, u);
    let at = vec2f(px) + 0.5 + step;
    let is_inside = all(at >= vec2f(0.5)) && all(at <= vec2f(frame.size) - 0.5);
    let there = vec2i(clamp(at, vec2f(0.0), vec2f(frame.size) - 1.0));
    let surface = textureLoad(far_surfaces, there, 2u * f, 0);
    let ratio = unpack_depth(surface) / z;
    let off = displacement5(unpack_trajectory(surface), -sign(u)) + step - displacement(trajectory, 0.5 * u);
    let is_same = is_smooth(surface) && ratio < BACKGROUND_DEPTH_RATIO && ratio > 1.0 / BACKGROUND_DEPTH_RATIO
        && dot(off, off) < BACKGROUND_RETURNS * BACKGROUND_RETURNS;
    let corner = floor(at - 0.5);
    let share = at - 0.5 - corner;
    var color = vec4f(0.0);
    var counts = 0.0;
    for (var i = 0; i < select(0, 4, is_inside && is_same); i++) {
        let near = vec2i(i % 2, i / 2);
        let texel = inside(vec2i(corner) + near);
        let shares = mix(1.0 - share, share, vec2f(near));
        color += shares.x * shares.y * textureLoad(far_layer_colors, texel, 2u * f, 0);
        counts += shares.x * shares.y * unpack_matte(textureLoad(far_mattes, texel, f, 0), WEIGHTED).weight;
    }
    if counts > 0.5 {
        (*sum).color += color / counts;
        (*sum).count += 1.0;
    }
}

/// Add the colour of a neighbouring frame, if all of the 3 x 3 around the place is as deep as expected.
fn look(sum: ptr<function, Background>, px: vec2i, step: vec2f, z: f32, is_next: bool) {
    let at = vec2f(px) + 0.5 + step;
    let is_inside = all(at >= vec2f(0.5)) && all(at <= vec2f(frame.size) - 0.5);
    let there = vec2i(clamp(at, vec2f(0.0), vec2f(frame.size) - 1.0));
    var is_clear = is_inside;
    var i = 0;
    loop {
        let near = inside(there + vec2i(i % 3, i / 3) - 1);
        let given = depth_there(near, is_next);
        let ratio = valid_depth(given) / z;
        is_clear = is_clear && given > 0.0 && ratio < BACKGROUND_DEPTH_RATIO && ratio > 1.0 / BACKGROUND_DEPTH_RATIO;
        i++;
        if !is_clear || i >= 9 { break; }
    }
    let vectors = motion_there(there, is_next);
    let off = select(vectors.zw, vectors.xy, is_next) + step;
    var counts = 1.0;
    if WEIGHTED { counts = weight_around(at, is_next); }
    if is_clear && counts > 0.5 && dot(off, off) < BACKGROUND_RETURNS * BACKGROUND_RETURNS {
        (*sum).color += color_around(at, is_next) / counts;
        (*sum).count += 1.0;
    }
}

/// A neighbour's colour with its gains, bilinear, as samplers cannot filter storage textures.
fn color_around(at: vec2f, is_next: bool) -> vec4f {
    let c = corners_of(at);
    let above = mix(color_there(c.xy, is_next), color_there(c.zy, is_next), share_of(at).x);
    let below = mix(color_there(c.xw, is_next), color_there(c.zw, is_next), share_of(at).x);
    return mix(above, below, share_of(at).y);
}

fn color_there(px: vec2i, is_next: bool) -> vec4f {
    var color = vec4f(0.0);
    if is_next { color = textureLoad(next_color, px, 0); } else { color = textureLoad(prev_color, px, 0); }
    if neighbours.relit == 0u { return color; }
    let k = px.y * i32(frame.size.x) + px.x;
    var gain = 0u;
    if is_next { gain = next_gains[k]; } else { gain = prev_gains[k]; }
    return relit_color(color, gain);
}

/// Its weight, bilinear.
fn weight_around(at: vec2f, is_next: bool) -> f32 {
    let c = corners_of(at);
    let above = mix(weight_there(c.xy, is_next), weight_there(c.zy, is_next), share_of(at).x);
    let below = mix(weight_there(c.xw, is_next), weight_there(c.zw, is_next), share_of(at).x);
    return mix(above, below, share_of(at).y);
}

fn weight_there(px: vec2i, is_next: bool) -> f32 {
    if is_next { return textureLoad(next_weight, px, 0).x; }
    return textureLoad(prev_weight, px, 0).x;
}

/// The first and the last of the 2 x 2 pixels around a position [px], and how far it is from the first to the last.
fn corners_of(at: vec2f) -> vec4i {
    let low = vec2i(clamp(floor(at - 0.5), vec2f(0.0), vec2f(frame.size) - 1.0));
    return vec4i(low, min(low + 1, vec2i(frame.size) - 1));
}

fn share_of(at: vec2f) -> vec2f {
    return fract(at - 0.5);
}
