// Reconstruction filter over tiles (Guertin, McGuire, Nowrouzezahrai 2014, after McGuire et al. 2012): taps along the
// dominant motion around and along the pixel's own, each weighted by whether its motion and depth let it be seen here.
// Names are the papers': TileMax, NeighborMax, f and b (foreground, background), cone, cylinder.
//#include common/backwards.wgsl
//#include common/frame.wgsl
//#include common/noise.wgsl
//#include common/shutter.wgsl
//#include common/wheel.wgsl
//#include methods/tiles_extent.wgsl

struct Tiles {
    count: vec2u,       // tiles across, down
    first: vec2i,       // the first one's column and row in the display window
    edge: u32,          // of a tile [px]; no blur extends farther to either side
    unused: u32,
}

@group(1) @binding(0) var<uniform> tiles: Tiles;
@group(1) @binding(1) var color: texture_2d<f32>;       // linear, premultiplied by alpha and by weight
@group(1) @binding(2) var motion: texture_2d<f32>;      // to_prev, to_next [px]
@group(1) @binding(3) var velocity_depth: texture_2d<f32>;  // direction and length of the blur extent [px], depth
@group(1) @binding(4) var weight: texture_2d<f32>;      // 0: stays out of its neighbours' blur
@group(1) @binding(5) var linear: sampler;
@group(1) @binding(6) var<storage, read_write> row_max: array<vec4f>;       // motion of every tile's every row
@group(1) @binding(7) var<storage, read_write> tile_max: array<vec4f>;      // motion of every tile
@group(1) @binding(8) var<storage, read_write> neighbor_max: array<vec4f>;  // motion of every tile and those around
@group(1) @binding(9) var output: Output;

override WEIGHTED: bool = false;    // read `weight`
override PUBLISHED: bool = false;   // weights as printed, not divided by those of uniform motion
override HAS_DEPTH: bool = true;    // else what moves farther is taken to be in front: see passing()
override TILES: bool = false;       // show the motion that every tile follows instead of the colour

// The paper's constants.
const KAPPA: f32 = 40.0;            // the greater, the less the pixel's own colour counts
const GAMMA: f32 = 1.5;             // extent beyond MIN_EXTENT [px] from which the pixel's own direction is trusted
const MIN_EXTENT: f32 = 0.5;        // shorter ones [px] are taken to be as long
const NEAR: f32 = 1.0;              // how far from a pixel a surface passes that is seen there [px]

/// The motion of greatest extent in a row of a tile.
@compute @workgroup_size(WG_X, WG_Y)
fn find_row_max(@builtin(global_invocation_id) id: vec3u) {
    if id.x >= tiles.count.x || id.y >= frame.size.y { return; }
    var greatest = -1.0;
    var found = begin_of(vec2u(id.x, 0u)).x;
    let end = begin_of(vec2u(id.x + 1u, 0u)).x;
    let nonsense = 4.0 * f32(frame.display.x + frame.display.y);    // a single bad vector must not rule its tile
    for (var x = found; x < end; x++) {
        let extent = textureLoad(velocity_depth, vec2u(x, id.y), 0).z;
        if extent > greatest && extent < nonsense {
            greatest = extent;
            found = x;
        }
    }
    row_max[id.y * tiles.count.x + id.x] =
        select(vec4f(0.0), textureLoad(motion, vec2u(found, id.y), 0), greatest >= 0.0);
}

/// TileMax: the motion of greatest extent in a tile.
@compute @workgroup_size(WG_X, WG_Y)
fn find_tile_max(@builtin(global_invocation_id) id: vec3u) {
    if any(id.xy >= tiles.count) { return; }
    var greatest = -1.0;
    var found = vec4f(0.0);
    let end = begin_of(id.xy + 1u).y;
    for (var y = begin_of(id.xy).y; y < end; y++) {
        let candidate = row_max[y * tiles.count.x + id.x];
        let delay = delay_at(vec2f(centre_of(id.xy).x, f32(y) + 0.5));
        let extent = length(blur_extent(trajectory_from(candidate), delay));
        if extent > greatest {
            greatest = extent;
            found = candidate;
        }
    }
    tile_max[id.y * tiles.count.x + id.x] = found;
}

/// NeighborMax: the motion of greatest extent in a tile and those around. Guertin's counts a diagonal neighbour only if
/// it leads this way; but pixels up to a quarter of an edge beyond a tile look it up, and some of them lie in the neighbour.
@compute @workgroup_size(WG_X, WG_Y)
fn find_neighbor_max(@builtin(global_invocation_id) id: vec3u) {
    if any(id.xy >= tiles.count) { return; }
    var greatest = -1.0;
    var found = vec4f(0.0);
    for (var i = 0u; i < 9u; i++) {
        let by = vec2i(vec2u(i % 3u, i / 3u)) - 1;
        let at = vec2i(id.xy) + by;
        if any(at < vec2i(0)) || any(at >= vec2i(tiles.count)) { continue; }
        let candidate = tile_max[u32(at.y) * tiles.count.x + u32(at.x)];
        let extent = blur_extent(trajectory_from(candidate), delay_at(centre_of(vec2u(at))));
        let is_beside = abs(by.x) + abs(by.y) < 2;
        let leads_here = extent.x * f32(by.x) * extent.y * f32(by.y) > 0.0;
        if (!PUBLISHED || is_beside || leads_here) && length(extent) > greatest {
            greatest = length(extent);
            found = candidate;
        }
    }
    neighbor_max[id.y * tiles.count.x + id.x] = found;
}

@compute @workgroup_size(WG_X, WG_Y)
fn main(@builtin(global_invocation_id) id: vec3u) {
    if any(id.xy >= frame.size) { return; }
    let x = vec2f(id.xy) + 0.5;
    let noise = pixel_noise(id.xy);
    if TILES {
        textureStore(output, id.xy, followed_color(id.xy));
        return;
    }
    let all = shutter_times(x, frame.jitter * (noise - 0.5));
    let greatest = trajectory_from(neighbor_max[tile_at(x, noise)]);
    let limit = f32(tiles.edge);
    let dominant = limited(greatest, all.delay, limit);
    let dominant_extent = blur_extent(dominant, all.delay);
    let reach = length(dominant_extent);
    let is_slow = reach <= MIN_EXTENT;
    if !PUBLISHED && (is_slow || !HAS_DEPTH) {  // where all motion is slow, no surface covers another
        textureStore(output, id.xy, passing(id.xy, all, greatest));
        return;
    }
    let times = with_adaptive_count(all, 4.0 * reach);      // to both sides, in two directions by turns
    let count = select(times.count, 0u, is_slow);           // published: slow motion does not blur

    // The paper's v_max is along `dominant`, its v_c is `odd_direction`, followed by every second tap.
    let own = textureLoad(velocity_depth, id.xy, 0);
    let own_extent = clamp(own.z, MIN_EXTENT, limit);
    let trust = clamp((own_extent - MIN_EXTENT) / GAMMA, 0.0, 1.0);
    let odd_direction = own_or_across(own.xy, dominant_extent, trust);
    // The paper's weight of the pixel itself, or a quarter of it where a tap's weight is 1 instead of 4. All
    // weights are over the number of taps, so that no sum of finite colours overflows.
    let centre_weight = select(0.25, 1.0, PUBLISHED) / (KAPPA * own_extent);
    let share = 1.0 / f32(times.count);
    var sum = centre_weight * textureLoad(color, id.xy, 0);
    var total = centre_weight;
    if WEIGHTED { total *= textureLoad(weight, id.xy, 0).x; }
    let texel = 1.0 / vec2f(frame.size);
    let last = vec2f(frame.size) - 1.0;
    for (var i = 0u; i < count; i++) {
        let t = shutter_time(times, i);
        let offset = displacement(dominant, t);
        let far = length(offset);
        let even_direction = offset / max(far, 1e-6);
        let direction = select(even_direction, odd_direction * sign(t), i % 2u == 1u);
        let at = x - far * direction;
        let tap = textureLoad(velocity_depth, vec2u(clamp(floor(at), vec2f(0.0), last)), 0);
        var w = weight_of(own, tap, far, direction, limit);
        if !PUBLISHED { w /= max(2.0 * cone(far, reach) + 2.0 * cylinder(far, reach), 1e-3); }
        w *= share;
        sum += w * textureSampleLevel(color, linear, at * texel, 0.0);
        if WEIGHTED { total += w * textureSampleLevel(weight, linear, at * texel, 0.0).x; } else { total += w; }
    }
    var result = sum / total;
    if is_slow || total <= 0.0 { result = pixel_itself(id.xy); }
    textureStore(output, id.xy, result);
}

/// The colour without depth, or where all motion is slow: along the pixel's own path, but at times when a surface that moves
/// farther really passes, that surface's. `dominant`: the motion around, along which it is looked for.
fn passing(px: vec2u, all: SampleTimes, dominant: Trajectory) -> vec4f {
    let reach = length(blur_extent(dominant, all.delay));
    let times = with_adaptive_count(all, 2.0 * reach);
    let is_static = reach < STATIC_EPSILON;
    let count = select(times.count, 0u, is_static);
    let x = vec2f(px) + 0.5;
    let own = trajectory_from(finite_motion(textureLoad(motion, px, 0)));
    let source = backwards(motion, own, x);
    let share = 1.0 / f32(times.count);
    let texel = 1.0 / vec2f(frame.size);
    let last = vec2f(frame.size) - 1.0;
    var sum = vec4f(0.0);
    var total = 0.0;
    for (var i = 0u; i < count; i++) {
        let t = shutter_time(times, i);
        let offset = displacement(dominant, t);
        let at = x - offset;
        let other = trajectory_from(finite_motion(textureLoad(motion, vec2u(clamp(floor(at), vec2f(0.0), last)), 0)));
        let speed = length(other.velocity);
        let apart = distance(other.velocity, own.velocity);
        let is_faster = speed > length(own.velocity) + 0.5 && apart > max(1.0, 0.25 * speed);
        let passes = is_faster && distance(displacement(other, t), offset) < NEAR;
        let from_here = select(x + displacement(source, t), at, passes) * texel;
        sum += share * textureSampleLevel(color, linear, from_here, 0.0);
        if WEIGHTED { total += share * textureSampleLevel(weight, linear, from_here, 0.0).x; } else { total += share; }
    }
    if is_static || total <= 0.0 { return pixel_itself(px); }
    return select(sum, sum / total, WEIGHTED);
}

/// The paper's weight of a tap that is `far` [px] from the pixel, of its velocities and depths `own` and those of the tap.
fn weight_of(own: vec4f, tap: vec4f, far: f32, direction: vec2f, limit: f32) -> f32 {
    let own_extent = clamp(own.z, MIN_EXTENT, limit);
    let tap_extent = clamp(tap.z, MIN_EXTENT, limit);
    let per_depth = 1.0 / min(own.w, tap.w);
    let foreground = clamp(1.0 - (tap.w - own.w) * per_depth, 0.0, 1.0);
    let background = clamp(1.0 - (own.w - tap.w) * per_depth, 0.0, 1.0);
    let own_along = select(1.0, abs(dot(own.xy, direction)), own_extent > MIN_EXTENT && far > 0.0);
    let tap_along = select(1.0, abs(dot(tap.xy, direction)), tap_extent > MIN_EXTENT && far > 0.0);
    return foreground * cone(far, tap_extent) * tap_along + background * cone(far, own_extent) * own_along
        + 2.0 * cylinder(far, min(tap_extent, own_extent)) * max(own_along, tap_along);
}

/// The pixel to the bit; without its weight, if pixels have weights.
fn pixel_itself(px: vec2u) -> vec4f {
    let own = textureLoad(color, px, 0);
    if !WEIGHTED { return own; }
    let counts = textureLoad(weight, px, 0).x;
    return select(vec4f(0.0), own / counts, counts > 0.0);
}

/// The motion that the pixel's tile follows, as a colour.
fn followed_color(px: vec2u) -> vec4f {
    let tile = vec2u((vec2i(px) + frame.origin - begin_of_first()) / i32(tiles.edge));
    let followed = neighbor_max[tile.y * tiles.count.x + tile.x];
    let extent = blur_extent(trajectory_from(followed), delay_at(centre_of(tile)));
    return vec4f(wheel_color(extent, f32(tiles.edge)), 1.0);
}

/// Delay of the rolling shutter at `x` [px].
fn delay_at(x: vec2f) -> f32 {
    return shutter_times(x, 0.0).delay;
}

/// Where the first tile begins, in the display window [px].
fn begin_of_first() -> vec2i {
    return tiles.first * i32(tiles.edge);
}

/// The first pixel of a tile, or of its part inside the image.
fn begin_of(tile: vec2u) -> vec2u {
    let begin = begin_of_first() + vec2i(tile * tiles.edge) - frame.origin;
    return vec2u(clamp(begin, vec2i(0), vec2i(frame.size)));
}

fn centre_of(tile: vec2u) -> vec2f {
    return (vec2f(vec2i(tile) + tiles.first) + 0.5) * f32(tiles.edge) - vec2f(frame.origin);
}

/// The trajectory scaled so that its extent is at most `limit` [px].
fn limited(trajectory: Trajectory, delay: f32, limit: f32) -> Trajectory {
    let factor = min(1.0, limit / max(length(blur_extent(trajectory, delay)), 1e-6));
    return Trajectory(factor * trajectory.velocity, factor * trajectory.half_acceleration);
}

/// Index of a tile, jittered by up to a quarter of an edge to either side so that no seams show.
fn tile_at(x: vec2f, noise: f32) -> u32 {
    let other_noise = fract(noise * 8.0 + 0.5);
    let at = (x + vec2f(frame.origin)) / f32(tiles.edge) + 0.5 * (vec2f(noise, other_noise) - 0.5);
    let tile = clamp(vec2i(floor(at)) - tiles.first, vec2i(0), vec2i(tiles.count) - 1);
    return u32(tile.y) * tiles.count.x + u32(tile.x);
}

/// The pixel's own direction; perpendicular to the dominant motion as far as its own is not trusted.
fn own_or_across(own: vec2f, dominant: vec2f, trust: f32) -> vec2f {
    let along = unit(dominant);
    var across = vec2f(-along.y, along.x);
    if dot(across, own) < 0.0 { across = -across; }
    return unit(mix(across, own, trust));
}

/// Share, at the distance `far`, of a blur of `extent` to either side that is brightest in its middle.
fn cone(far: f32, extent: f32) -> f32 {
    return clamp(1.0 - far / extent, 0.0, 1.0);
}

/// The same of a blur that is equally bright throughout.
fn cylinder(far: f32, extent: f32) -> f32 {
    return 1.0 - smoothstep(0.95 * extent, 1.05 * extent, far);
}
