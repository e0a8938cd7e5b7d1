// Reconstruction filter over tiles (Guertin, McGuire, Nowrouzezahrai 2014): taps along the fastest motion
// around, and along the pixel's own, each weighted by whether its motion and depth let it be seen here.
//#include common/frame.wgsl
//#include common/noise.wgsl
//#include common/shutter.wgsl
//#include common/wheel.wgsl
//#include blur/tiles_streak.wgsl

struct Tiles {
    count: vec2u,       // tiles across, down
    edge: u32,          // of a tile [px]; no streak reaches farther to either side
    unused: u32,
}

@group(1) @binding(0) var<uniform> tiles: Tiles;
@group(1) @binding(1) var color: texture_2d<f32>;       // linear, premultiplied by alpha and by weight
@group(1) @binding(2) var motion: texture_2d<f32>;      // to_prev, to_next [px]
@group(1) @binding(3) var moves: texture_2d<f32>;       // direction and length [px] of the streak, depth
@group(1) @binding(4) var weight: texture_2d<f32>;      // 0: keeps out of its neighbours' blur
@group(1) @binding(5) var linear: sampler;
@group(1) @binding(6) var<storage, read_write> rows: array<vec4f>;      // fastest motion of every tile's every row
@group(1) @binding(7) var<storage, read_write> fastest: array<vec4f>;   // of every tile
@group(1) @binding(8) var<storage, read_write> dominant: array<vec4f>;  // of what reaches every tile
@group(1) @binding(9) var output: Output;

override WEIGHTED: bool = false;    // read `weight`
override PUBLISHED: bool = false;   // weights as printed, not divided by those of uniform motion
override TILES: bool = false;       // show what every tile follows instead of the colour

// The paper's constants.
const KAPPA: f32 = 40.0;            // the more, the less the pixel's own colour counts
const GAMMA: f32 = 1.5;             // motion [px] beyond SHORT from which the pixel's own direction is trusted
const SHORT: f32 = 0.5;             // no motion is taken to be shorter [px]

/// The fastest motion of a row of a tile.
@compute @workgroup_size(WG_X, WG_Y)
fn fastest_of_rows(@builtin(global_invocation_id) id: vec3u) {
    if id.x >= tiles.count.x || id.y >= frame.size.y { return; }
    var most = -1.0;
    var found = id.x * tiles.edge;
    let end = min((id.x + 1u) * tiles.edge, frame.size.x);
    let nonsense = 4.0 * f32(frame.size.x + frame.size.y);  // a single bad vector must not rule its tile
    for (var x = found; x < end; x++) {
        let long = textureLoad(moves, vec2u(x, id.y), 0).z;
        if long > most && long < nonsense {
            most = long;
            found = x;
        }
    }
    rows[id.y * tiles.count.x + id.x] = select(vec4f(0.0), textureLoad(motion, vec2u(found, id.y), 0), most >= 0.0);
}

/// The fastest motion of a tile.
@compute @workgroup_size(WG_X, WG_Y)
fn fastest_of_tiles(@builtin(global_invocation_id) id: vec3u) {
    if any(id.xy >= tiles.count) { return; }
    var most = -1.0;
    var found = vec4f(0.0);
    let end = min((id.y + 1u) * tiles.edge, frame.size.y);
    for (var y = id.y * tiles.edge; y < end; y++) {
        let way = rows[y * tiles.count.x + id.x];
        let long = length(streak(trajectory_from(way), delay_at(vec2f(middle_of(id.xy).x, f32(y) + 0.5))));
        if long > most {
            most = long;
            found = way;
        }
    }
    fastest[id.y * tiles.count.x + id.x] = found;
}

/// The fastest motion around a tile; a diagonal neighbour's only if it comes this way.
@compute @workgroup_size(WG_X, WG_Y)
fn dominant_of_tiles(@builtin(global_invocation_id) id: vec3u) {
    if any(id.xy >= tiles.count) { return; }
    var most = -1.0;
    var found = vec4f(0.0);
    for (var i = 0u; i < 9u; i++) {
        let by = vec2i(vec2u(i % 3u, i / 3u)) - 1;
        let at = vec2i(id.xy) + by;
        if any(at < vec2i(0)) || any(at >= vec2i(tiles.count)) { continue; }
        let way = fastest[u32(at.y) * tiles.count.x + u32(at.x)];
        let far = streak(trajectory_from(way), delay_at(middle_of(vec2u(at))));
        let straight = abs(by.x) + abs(by.y) < 2;
        let comes = far.x * f32(by.x) * far.y * f32(by.y) > 0.0;
        if (straight || comes) && length(far) > most {
            most = length(far);
            found = way;
        }
    }
    dominant[id.y * tiles.count.x + id.x] = found;
}

@compute @workgroup_size(WG_X, WG_Y)
fn main(@builtin(global_invocation_id) id: vec3u) {
    if any(id.xy >= frame.size) { return; }
    let x = vec2f(id.xy) + 0.5;
    let noise = pixel_noise(id.xy);
    if TILES {
        let tile = id.xy / tiles.edge;
        let way = dominant[tile.y * tiles.count.x + tile.x];
        let shown = wheel_color(streak(trajectory_from(way), delay_at(middle_of(tile))), f32(tiles.edge));
        textureStore(output, id.xy, vec4f(shown, 1.0));
        return;
    }
    let most_times = shutter_times(x, frame.jitter * (noise - 0.5));
    let limit = f32(tiles.edge);
    let fast = held(trajectory_from(dominant[tile_at(x, noise)]), most_times.delay, limit);
    let way = streak(fast, most_times.delay);
    let all = max(length(way), SHORT);
    let times = with_adaptive_count(most_times, 4.0 * all);    // to both sides, in two directions by turns
    let still = all <= SHORT;
    let count = select(times.count, 0u, still);

    let own = textureLoad(moves, id.xy, 0);
    let here = clamp(own.z, SHORT, limit);
    let trust = clamp((here - SHORT) / GAMMA, 0.0, 1.0);
    let odd = own_direction(own.xy, way, trust);
    let z = own.w;
    // The paper's weight of the pixel itself, and a quarter of it where a tap's is 1 instead of 4;
    // all are over the number of taps, so that no sum of finite colours overflows.
    let middle = select(0.25, 1.0, PUBLISHED) / (KAPPA * here);
    let share = 1.0 / f32(times.count);
    var sum = middle * textureLoad(color, id.xy, 0);
    var total = middle;
    if WEIGHTED { total *= textureLoad(weight, id.xy, 0).x; }
    let texel = 1.0 / vec2f(frame.size);
    let most = vec2f(frame.size) - 1.0;
    for (var i = 0u; i < count; i++) {
        let t = shutter_time(times, i);
        let along = displacement(fast, t);
        let far = length(along);
        let even_way = along / max(far, 1e-6);
        let toward = select(even_way, odd * sign(t), i % 2u == 1u);
        let at = x - far * toward;
        let other = textureLoad(moves, vec2u(clamp(floor(at), vec2f(0.0), most)), 0);
        let there = clamp(other.z, SHORT, limit);
        let nearest = 1.0 / min(z, other.w);
        let front = clamp(1.0 - (other.w - z) * nearest, 0.0, 1.0);
        let behind = clamp(1.0 - (z - other.w) * nearest, 0.0, 1.0);
        let along_here = select(1.0, abs(dot(own.xy, toward)), here > SHORT && far > 0.0);
        let along_there = select(1.0, abs(dot(other.xy, toward)), there > SHORT && far > 0.0);
        var w = front * cone(far, there) * along_there + behind * cone(far, here) * along_here
            + 2.0 * cylinder(far, min(there, here)) * max(along_here, along_there);
        if !PUBLISHED { w /= max(2.0 * cone(far, all) + 2.0 * cylinder(far, all), 1e-3); }
        w *= share;
        sum += w * textureSampleLevel(color, linear, at * texel, 0.0);
        if WEIGHTED { total += w * textureSampleLevel(weight, linear, at * texel, 0.0).x; } else { total += w; }
    }
    var result = sum / total;
    if still || total <= 0.0 {      // to the bit
        result = textureLoad(color, id.xy, 0);
        if WEIGHTED {
            let counted = textureLoad(weight, id.xy, 0).x;
            result = select(vec4f(0.0), result / counted, counted > 0.0);
        }
    }
    textureStore(output, id.xy, result);
}

fn delay_at(x: vec2f) -> f32 {
    return shutter_times(x, 0.0).delay;
}

fn middle_of(tile: vec2u) -> vec2f {
    return (vec2f(tile) + 0.5) * f32(tiles.edge);
}

/// The path made so short that its streak reaches a tile's edge at most.
fn held(path: Trajectory, delay: f32, limit: f32) -> Trajectory {
    let part = min(1.0, limit / max(length(streak(path, delay)), 1e-6));
    return Trajectory(part * path.velocity, part * path.half_acceleration);
}

/// Index of a tile up to a quarter of an edge away on either side, so that no seam shows.
fn tile_at(x: vec2f, noise: f32) -> u32 {
    let other = fract(noise * 8.0 + 0.5);
    let at = x / f32(tiles.edge) + 0.5 * (vec2f(noise, other) - 0.5);
    let tile = clamp(vec2i(floor(at)), vec2i(0), vec2i(tiles.count) - 1);
    return u32(tile.y) * tiles.count.x + u32(tile.x);
}

/// The pixel's own direction after time 0; across the dominant one where it hardly moves.
fn own_direction(own: vec2f, dominant_way: vec2f, trust: f32) -> vec2f {
    let along = unit(dominant_way);
    var across = vec2f(-along.y, along.x);
    if dot(across, own) < 0.0 { across = -across; }
    return unit(mix(across, own, trust));
}

/// What of a streak of length `l` to either side lies at `far` from its middle, if it is brightest there.
fn cone(far: f32, l: f32) -> f32 {
    return clamp(1.0 - far / l, 0.0, 1.0);
}

/// The same if it is equally bright.
fn cylinder(far: f32, l: f32) -> f32 {
    return 1.0 - smoothstep(0.95 * l, 1.05 * l, far);
}
