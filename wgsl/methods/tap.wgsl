// The mean colour along each pixel's own trajectory (Rosado 2007, GPU Gems 3, chapter 27).
//#include common/backwards.wgsl
//#include common/frame.wgsl
//#include common/noise.wgsl
//#include common/shutter.wgsl

@group(1) @binding(0) var color: texture_2d<f32>;       // linear, premultiplied by alpha and by weight
@group(1) @binding(1) var motion: texture_2d<f32>;      // to_prev, to_next [px]
@group(1) @binding(2) var weight: texture_2d<f32>;      // 0: stays out of its neighbours' blur
@group(1) @binding(3) var linear: sampler;
@group(1) @binding(4) var output: Output;
@group(1) @binding(5) var bends: texture_2d<u32>;       // see common/trajectory5.wgsl

override CURVED: bool = true;       // the parabola through three positions; else a line along their mean velocity
override FIVE_POSITIONS: bool = false;  // read `bends`; else no path leaves its parabola
override WEIGHTED: bool = false;    // read `weight`
override PUBLISHED: bool = false;   // Rosado's own: equal taps along half the displacement from the previous frame

@compute @workgroup_size(WG_X, WG_Y)
fn main(@builtin(global_invocation_id) id: vec3u) {
    if any(id.xy >= frame.size) { return; }
    let x = vec2f(id.xy) + 0.5;
    var trajectory = trajectory_from(textureLoad(motion, id.xy, 0));
    if !CURVED { trajectory.half_acceleration = vec2f(0.0); }
    if PUBLISHED { trajectory = Trajectory(-textureLoad(motion, id.xy, 0).xy, vec2f(0.0)); }

    // Static pixels take no taps. Loop form: see wgsl.md.
    let shift = frame.jitter * (pixel_noise(id.xy) - 0.5);
    let all = shutter_times(x, shift);
    let opens = shutter.span.x + all.delay;
    let closes = shutter.span.y + all.delay;
    let opening = displacement(trajectory, opens);
    let closing = displacement(trajectory, closes);
    let turn = displacement(trajectory, slowest_time(trajectory, opens, closes));
    let farthest2 = max(dot(turn, turn), max(dot(opening, opening), dot(closing, closing)));
    let is_static = !PUBLISHED && farthest2 < STATIC_EPSILON * STATIC_EPSILON;
    let times = with_adaptive_count(all, distance(opening, turn) + distance(turn, closing));
    let count = select(times.count, 0u, is_static);

    let share = 1.0 / f32(times.count);     // applied before adding, so that no sum of finite colours overflows
    let texel = 1.0 / vec2f(frame.size);
    let uv = x * texel;
    var source = Trajectory(-trajectory.velocity, vec2f(0.0));
    if CURVED && !PUBLISHED { source = backwards(motion, trajectory, x); }
    var bent = trajectory5_from(source);
    if FIVE_POSITIONS {
        let told = trajectory_with(textureLoad(motion, id.xy, 0), textureLoad(bends, id.xy, 0).x);
        bent = backwards5(motion, told, x);
    }
    var sum = vec4f(0.0);
    var total = 0.0;
    for (var i = 0u; i < count; i++) {
        var t = shutter_time(times, i);
        if PUBLISHED { t = -0.5 * f32(i) * share; }
        var moved = displacement(source, t);
        if FIVE_POSITIONS { moved = displacement5(bent, t); }
        let at = uv + texel * moved;
        sum += share * textureSampleLevel(color, linear, at, 0.0);
        if WEIGHTED { total += share * textureSampleLevel(weight, linear, at, 0.0).x; }
    }
    if is_static || (WEIGHTED && total <= 0.0) {    // the pixel itself, to the bit
        sum = textureLoad(color, id.xy, 0);
        if WEIGHTED { total = textureLoad(weight, id.xy, 0).x; }
    }
    if WEIGHTED { sum = select(vec4f(0.0), sum / total, total > 0.0); }
    textureStore(output, id.xy, sum);
}
