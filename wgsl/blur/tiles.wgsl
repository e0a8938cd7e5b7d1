// Reconstruction filter over tiles (Guertin, McGuire, Nowrouzezahrai 2014): taps along the fastest motion
// around, and along the pixel's own, each weighted by whether its motion and depth let it be seen here.
//#include common/finite.wgsl
//#include common/frame.wgsl
//#include common/noise.wgsl
//#include common/path.wgsl
//#include common/shutter.wgsl

struct Tiles {
    count: vec2u,       // tiles across, down
    edge: u32,          // of a tile [px]; no streak reaches farther to either side
    unused: u32,
}

@group(1) @binding(0) var<uniform> tiles: Tiles;
@group(1) @binding(1) var color: texture_2d<f32>;       // linear, premultiplied by alpha and by weight
@group(1) @binding(2) var motion: texture_2d<f32>;      // to_prev, to_next [px]
@group(1) @binding(3) var depth: texture_2d<f32>;
@group(1) @binding(4) var weight: texture_2d<f32>;      // 0: keeps out of its neighbours' blur
@group(1) @binding(5) var linear: sampler;
@group(1) @binding(6) var<storage, read_write> rows: array<vec4f>;      // fastest motion of every tile's every row
@group(1) @binding(7) var<storage, read_write> fastest: array<vec4f>;   // of every tile
@group(1) @binding(8) var<storage, read_write> dominant: array<vec4f>;  // of what reaches every tile
@group(1) @binding(9) var output: Output;

override WEIGHTED: bool = false;    // read `weight`
override DEEP: bool = false;        // read `depth`
override PUBLISHED: bool = false;   // weights as printed, not divided by those of uniform motion

// The paper's constants.
const KAPPA: f32 = 40.0;            // the more, the less the pixel's own colour counts
const GAMMA: f32 = 1.5;             // motion [px] beyond SHORT from which the pixel's own direction is trusted
const SHORT: f32 = 0.5;             // no motion is taken to be shorter [px]
const FAR: f32 = 1e10;              // depth of nothing

/// The fastest motion of a row of a tile.
@compute @workgroup_size(WG_X, WG_Y)
fn fastest_of_rows(@builtin(global_invocation_id) id: vec3u) {
    if id.x >= tiles.count.x || id.y >= frame.size.y { return; }
    var most = -1.0;
    var found = vec4f(0.0);
    let end = min((id.x + 1u) * tiles.edge, frame.size.x);
    let nonsense = 4.0 * f32(frame.size.x + frame.size.y);  // a single bad vector must not rule its tile
    for (var x = id.x * tiles.edge; x < end; x++) {
        let way = motion_at(vec2u(x, id.y));
        let long = streak(path_of(way), delay_at(vec2f(vec2u(x, id.y)) + 0.5));
        if long > most && long < nonsense {
            most = long;
            found = way;
        }
    }
    rows[id.y * tiles.count.x + id.x] = found;
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
        let long = streak(path_of(way), delay_at(vec2f(middle_of(id.xy).x, f32(y) + 0.5)));
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
        let path = path_of(way);
        let delay = delay_at(middle_of(vec2u(at)));
        let along = displacement(path, shutter.span.y + delay) - displacement(path, shutter.span.x + delay);
        let straight = abs(by.x) + abs(by.y) < 2;
        let comes = along.x * f32(by.x) * along.y * f32(by.y) > 0.0;
        let long = streak(path, delay);
        if (straight || comes) && long > most {
            most = long;
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
    let times = shutter_times(x, frame.jitter * (noise - 0.5));
    let fast = held(path_of(dominant[tile_at(x, noise)]), times.delay);
    let own = held(path_of(motion_at(id.xy)), times.delay);
    let z = depth_at(id.xy);
    let trust = clamp((streak(own, times.delay) - SHORT) / GAMMA, 0.0, 1.0);
    let here = max(streak(own, times.delay), SHORT);
    let all = max(streak(fast, times.delay), SHORT);

    let still = all <= SHORT;
    let count = select(frame.samples, 0u, still);
    let limit = f32(tiles.edge);
    let size = vec2f(frame.size);
    let most = vec2i(frame.size) - 1;
    // The paper's weight of the pixel itself, and a quarter of it where a tap's is 1 instead of 4;
    // all are over the number of taps, so that no sum of finite colours overflows.
    let middle = select(0.25, 1.0, PUBLISHED) / (KAPPA * here);
    let share = 1.0 / f32(frame.samples);
    var sum = middle * textureLoad(color, id.xy, 0);
    var total = middle;
    if WEIGHTED { total *= textureLoad(weight, id.xy, 0).x; }
    for (var i = 0u; i < count; i++) {
        let t = shutter_time(times, i);
        var offset = displacement(fast, t);
        let far = length(offset);
        if i % 2u == 1u { offset = far * own_direction(displacement(own, t), offset, trust); }
        let at = x - offset;
        let px = vec2u(clamp(vec2i(floor(at)), vec2i(0), most));
        let path = path_of(motion_at(px));
        let there = clamp(streak(path, times.delay), SHORT, limit);
        let z_there = depth_at(px);
        let nearest = min(z, z_there);
        let front = clamp(1.0 - (z_there - z) / nearest, 0.0, 1.0);
        let behind = clamp(1.0 - (z - z_there) / nearest, 0.0, 1.0);
        let way = unit(offset);
        let along_here = select(1.0, abs(dot(unit(displacement(own, t)), way)), here > SHORT && far > 0.0);
        let along_there = select(1.0, abs(dot(unit(displacement(path, t)), way)), there > SHORT && far > 0.0);
        var w = front * cone(far, there) * along_there + behind * cone(far, here) * along_here
            + 2.0 * cylinder(far, min(there, here)) * max(along_here, along_there);
        if !PUBLISHED { w /= max(2.0 * cone(far, all) + 2.0 * cylinder(far, all), 1e-3); }
        w *= share;
        let uv = at / size;
        sum += w * textureSampleLevel(color, linear, uv, 0.0);
        if WEIGHTED { total += w * textureSampleLevel(weight, linear, uv, 0.0).x; } else { total += w; }
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
fn held(path: Path, delay: f32) -> Path {
    let part = min(1.0, f32(tiles.edge) / max(streak(path, delay), 1e-6));
    return Path(part * path.velocity, part * path.curvature);
}

/// The farthest it is from its place while the shutter is open [px].
fn streak(path: Path, delay: f32) -> f32 {
    let opens = shutter.span.x + delay;
    let closes = shutter.span.y + delay;
    let turn = length(displacement(path, turning(path, opens, closes)));
    return max(turn, max(length(displacement(path, opens)), length(displacement(path, closes))));
}

/// Motion of any finite length is taken, to where its square is finite too.
fn motion_at(px: vec2u) -> vec4f {
    return clamp(textureLoad(motion, px, 0), vec4f(-1e9), vec4f(1e9));
}

/// Index of a tile up to a quarter of an edge away on either side, so that no seam shows.
fn tile_at(x: vec2f, noise: f32) -> u32 {
    let other = fract(noise * 8.0 + 0.5);
    let at = x / f32(tiles.edge) + 0.5 * (vec2f(noise, other) - 0.5);
    let tile = clamp(vec2i(floor(at)), vec2i(0), vec2i(tiles.count) - 1);
    return u32(tile.y) * tiles.count.x + u32(tile.x);
}

/// The pixel's own direction; across the dominant one where it hardly moves.
fn own_direction(own: vec2f, dominant_way: vec2f, trust: f32) -> vec2f {
    let along = unit(dominant_way);
    var across = vec2f(-along.y, along.x);
    if dot(across, own) < 0.0 { across = -across; }
    return unit(mix(across, unit(own), trust));
}

fn unit(v: vec2f) -> vec2f {
    return v / max(length(v), 1e-6);
}

fn depth_at(px: vec2u) -> f32 {
    if !DEEP { return 1.0; }
    let z = textureLoad(depth, px, 0).x;
    return select(FAR, min(z, FAR), is_finite(z) && z > 0.0);
}

/// What of a streak of length `l` to either side lies at `far` from its middle, if it is brightest there.
fn cone(far: f32, l: f32) -> f32 {
    return clamp(1.0 - far / l, 0.0, 1.0);
}

/// The same if it is equally bright.
fn cylinder(far: f32, l: f32) -> f32 {
    return 1.0 - smoothstep(0.95 * l, 1.05 * l, far);
}
