// Where what is at a place by some time was at a frame's instant.
//#include common/frame.wgsl
//#include common/path.wgsl
//#include common/shutter.wgsl
//#include blur/gather_tile.wgsl

struct Sources {
    offsets: vec4f,         // of the frames [frame intervals]; the first is 0, the frame itself
    places: vec4u,          // where their layers are
    count: u32,
}

@group(1) @binding(0) var<uniform> sources: Sources;
@group(1) @binding(1) var paths: texture_2d_array<u32>;     // see packed(), stored()
@group(1) @binding(2) var tiles: texture_2d_array<f32>;     // LAYERS a frame

const STEPS: u32 = 4u;          // of a search from the pixel's own path, at most
const FOUND: f32 = 0.5;         // a step shorter than this [px] ends the search
const MISS: f32 = 1.0;          // a sample farther than this [px] from the pixel is none of it
const SAME: f32 = 0.75;         // searches, and samples of one layer, closer than this [px] are one
const NEIGHBOUR: f32 = 1.1;     // a neighbouring frame's sample counts as this much farther
const TRUSTED: f32 = 0.25;      // times up to which the frame itself needs no second opinion [frame intervals]

// What gather_plain.wgsl writes: a bit a time, blocks of so many px a side, words of so many times.
const BLOCK: u32 = 4u;
const AT_ONCE: u32 = 32u;

struct Reach {          // what a tile may show of a frame, see gather_tile.wgsl
    about: vec4f,
    depths: vec4f,
    comes: vec4f,
    goes: vec4f,
    vx: vec4f,          // velocities, curvatures of its motions
    vy: vec4f,
    cx: vec4f,
    cy: vec4f,
}

fn reach(tile: vec2u, f: u32) -> Reach {
    let none = vec4f(0.0);
    if f >= sources.count { return Reach(none, vec4f(NONE), vec4f(NONE), vec4f(-NONE), none, none, none, none); }
    let first = f * LAYERS;
    let a = textureLoad(tiles, tile, first + 4u, 0);
    let b = textureLoad(tiles, tile, first + 5u, 0);
    let c = textureLoad(tiles, tile, first + 6u, 0);
    let d = textureLoad(tiles, tile, first + 7u, 0);
    return Reach(
        textureLoad(tiles, tile, first, 0),
        textureLoad(tiles, tile, first + 1u, 0),
        textureLoad(tiles, tile, first + 2u, 0),
        textureLoad(tiles, tile, first + 3u, 0),
        vec4f(a.x, b.x, c.x, d.x),
        vec4f(a.y, b.y, c.y, d.y),
        vec4f(a.z, b.z, c.z, d.z),
        vec4f(a.w, b.w, c.w, d.w),
    );
}

fn of_frame(f: u32, a: Reach, b: Reach, c: Reach) -> Reach {
    var here = a;
    if f == 1u { here = b; }
    if f == 2u { here = c; }
    return here;
}

/// Which of a tile's motions may come by the time `u`, and be nearer than `depth`.
fn worth(here: Reach, u: f32, depth: f32) -> vec4<bool> {
    return (here.depths < vec4f(depth)) & (here.comes <= vec4f(u)) & (vec4f(u) <= here.goes);
}

/// Displacements by the time `u` along a tile's motions, x and y [px].
fn displaced_x(here: Reach, u: f32) -> vec4f {
    return (here.vx + here.cx * u) * u;
}

fn displaced_y(here: Reach, u: f32) -> vec4f {
    return (here.vy + here.cy * u) * u;
}

struct Starts {         // displacements to search from
    left: vec4<bool>,
    x: vec4f,
    y: vec4f,
}

fn next_of(starts: ptr<function, Starts>) -> vec2f {
    let s = *starts;
    (*starts).left = s.left & vec4<bool>(false, s.left.x, any(s.left.xy), any(s.left.xyz));
    let later = select(vec2f(s.x.w, s.y.w), vec2f(s.x.z, s.y.z), s.left.z);
    return select(select(later, vec2f(s.x.y, s.y.y), s.left.y), vec2f(s.x.x, s.y.x), s.left.x);
}

/// The neighbour on the side of `t`, or the only one; the `second`, the other one.
fn neighbour_of(t: f32, second: bool) -> u32 {
    return select(1u, 2u, (sources.count == 3u && t > 0.0) != second);
}

/// Where in the textures a layer is: near, far, of the frames one after the other.
fn stored(layer: u32) -> u32 {
    let f = layer / 2u;
    let places = sources.places;
    return 2u * select(select(places.z, places.y, f == 1u), places.x, f == 0u) + layer % 2u;
}

fn offset_of(f: u32) -> f32 {
    return select(select(sources.offsets.z, sources.offsets.y, f == 1u), 0.0, f == 0u);
}

/// Whether nothing in the reach of a tile moves.
fn is_still(a: Reach, b: Reach, c: Reach) -> bool {
    return max(a.about.z, max(b.about.z, c.about.z)) < STILL;
}

/// The sample times of the pixel at `x`, moved by `shift` within their shares.
fn times_of(x: vec2f, shift: f32, a: Reach, b: Reach, c: Reach) -> SampleTimes {
    let streak = max(streak_of(a, 0u), max(streak_of(b, 1u), streak_of(c, 2u)));
    return with_adaptive_count(shutter_times(x, shift), streak);
}

/// How long a streak the longest motion of a frame leaves in the exposure [px].
fn streak_of(here: Reach, f: u32) -> f32 {
    let since = abs(exposure_window(sources.offsets[f]));
    return here.about.z * (shutter.span.y - shutter.span.x) / max(max(since.x, since.y), 1e-9);
}

fn inside(q: vec2f) -> bool {
    return all(q >= vec2f(0.0)) && all(q < vec2f(frame.size));
}

/// Whether two displacements, or two places, are the same.
fn alike(a: vec2f, b: vec2f) -> bool {
    return all(abs(a - b) < vec2f(SAME));
}

struct Place {
    texel: vec4u,       // see packed(): whose displacement it is
    d: vec2f,           // [px]
    miss: f32,          // squared distance from the pixel of what is there by the time `u` [px^2]
}

/// One step of the fixed point of d = displacement(x - d), in a layer, `u` after its frame's instant.
fn step_from(x: vec2f, d: vec2f, u: f32, layer: u32) -> Place {
    let q = x - d;
    let texel = textureLoad(paths, vec2i(floor(q)), layer, 0);
    let next = displacement(path_in(texel), u);
    let step = next - d;
    return Place(texel, next, select(NONE, dot(step, step), inside(q)));
}

/// Whether such steps have ended: at a place, or outside the picture.
fn has_ended(place: Place) -> bool {
    return place.miss < FOUND * FOUND || place.miss >= NONE;
}

/// The fixed point, from a displacement.
fn follow(x: vec2f, start: vec2f, u: f32, layer: u32) -> Place {
    var place = Place(vec4u(0u), start, NONE);
    var n = 0u;
    loop {
        place = step_from(x, place.d, u, layer);
        n++;
        if has_ended(place) || n >= STEPS { break; }
    }
    return place;
}
