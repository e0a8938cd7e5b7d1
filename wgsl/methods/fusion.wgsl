// A trail of samples along the motion, filtered, and fused with the sharp image by which way a surface faces (Chen 2016).
//#include common/backwards.wgsl
//#include common/facing.wgsl
//#include common/finite.wgsl
//#include common/frame.wgsl
//#include common/noise.wgsl
//#include common/shutter.wgsl

struct Fusion {
    facing: Facing,
    leading: vec2f,         // weights on surfaces that face their motion: of the sharp colour, of the whole trail
    trailing: vec2f,        // the same on all others
    newest: f32,            // share of the trail that is its newest sample
    fading: f32,            // the paper's tau: weight of a sample over that of the next newer one
    middle: f32,            // of the exposure, when the sharp colour is taken [frame intervals]
    unused: f32,
}

@group(1) @binding(0) var<uniform> fusion: Fusion;
@group(1) @binding(1) var color: texture_2d<f32>;       // linear, premultiplied by alpha and by weight
@group(1) @binding(2) var soft: texture_2d<f32>;        // the same through the Gaussian
@group(1) @binding(3) var motion: texture_2d<f32>;      // to_prev, to_next [px]
@group(1) @binding(4) var depth: texture_2d<f32>;
@group(1) @binding(5) var normal: texture_2d<f32>;      // in the world
@group(1) @binding(6) var weight: texture_2d<f32>;      // 0: stays out of its neighbours' blur
@group(1) @binding(7) var soft_weight: texture_2d<f32>; // the same through the Gaussian
@group(1) @binding(8) var linear: sampler;
@group(1) @binding(9) var output: Output;

override NORMALS: bool = false;     // read `normal`
override WEIGHTED: bool = false;    // read `weight`
override PUBLISHED: bool = false;   // the paper's equal steps over half the displacement from the previous frame

const FADE_LENGTH: f32 = 1.0;       // blur shorter than this [px] fades into the sharp colour

@compute @workgroup_size(WG_X, WG_Y)
fn main(@builtin(global_invocation_id) id: vec3u) {
    if any(id.xy >= frame.size) { return; }
    let x = vec2f(id.xy) + 0.5;
    let vectors = textureLoad(motion, id.xy, 0);
    var trajectory = trajectory_from(vectors);
    if PUBLISHED { trajectory = Trajectory(-vectors.xy, vec2f(0.0)); }

    let times = shutter_times(x, frame.jitter * (pixel_noise(id.xy) - 0.5));
    var open = shutter.span + times.delay;
    var middle = fusion.middle + times.delay;
    if PUBLISHED { open = vec2f(-0.5, 0.0); middle = 0.0; }
    let opening = displacement(trajectory, open.x);
    let closing = displacement(trajectory, open.y);
    let turn = displacement(trajectory, slowest_time(trajectory, open.x, open.y));
    let farthest2 = max(dot(turn, turn), max(dot(opening, opening), dot(closing, closing)));
    let is_static = farthest2 < STATIC_EPSILON * STATIC_EPSILON;
    let count = select(frame.samples, 0u, is_static);       // the paper's N

    var weights = select(fusion.trailing, fusion.leading, faces_motion(id.xy, trajectory.velocity));
    if !PUBLISHED {
        let blur_length = max(distance(opening, closing), max(distance(opening, turn), distance(turn, closing)));
        let faded = weights.y * max(0.0, 1.0 - blur_length / FADE_LENGTH);
        weights += vec2f(faded, -faded);
    }
    let texel = 1.0 / vec2f(frame.size);
    let uv = x * texel;
    var source = Trajectory(-trajectory.velocity, vec2f(0.0));
    if !PUBLISHED { source = backwards(motion, trajectory, x); }
    let here = uv + texel * displacement(source, middle);
    var sum = weights.x * textureSampleLevel(color, linear, here, 0.0);
    var total = 0.0;
    if WEIGHTED { total = weights.x * textureSampleLevel(weight, linear, here, 0.0).x; }
    var share = weights.y * fusion.newest;
    for (var i = 1u; i <= count; i++) {     // the newest first
        var t = shutter_time(times, frame.samples - i);
        if PUBLISHED { t = -0.5 * f32(i - 1u) / f32(frame.samples); }
        let at = uv + texel * displacement(source, t);
        sum += share * textureSampleLevel(soft, linear, at, 0.0);
        if WEIGHTED { total += share * textureSampleLevel(soft_weight, linear, at, 0.0).x; }
        share *= fusion.fading;
    }
    var all = weights.x + weights.y;
    if is_static || (WEIGHTED && total <= 0.0) {    // the pixel itself, to the bit
        sum = textureLoad(color, id.xy, 0);
        if WEIGHTED { total = textureLoad(weight, id.xy, 0).x; }
        all = 1.0;
    }
    if WEIGHTED { sum = select(vec4f(0.0), sum / total * all, total > 0.0); }
    textureStore(output, id.xy, sum);
}

/// Equations 4 and 5: whether the angle between motion and normal is under 90 degrees.
fn faces_motion(px: vec2u, velocity: vec2f) -> bool {
    if NORMALS {
        let n = textureLoad(normal, px, 0);
        if is_finite4(n) && any(n.xyz != vec3f(0.0)) { return normal_faces_motion(fusion.facing, n.xyz, velocity); }
    }
    return slope_faces_motion(fusion.facing, depth, px, velocity);
}
