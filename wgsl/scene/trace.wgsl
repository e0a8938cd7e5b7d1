// The nearest hit of a ray among rigid bodies at an instant, and the radiance that comes from there.
//#include common/color.wgsl
//#include common/frame.wgsl
//#include common/loops.wgsl
//#include scene/pattern.wgsl
//#include scene/backdrop.wgsl

struct Body {
    size: vec4f,            // half extents [scene units]; w unused
    color: vec4f,           // first colour; w: emitted radiance, times the colour
    other: vec4f,           // the pattern's second colour; w: gloss 0..1
    repeats: vec2f,         // of the pattern [per scene unit; spheres: per turn]
    pattern: u32,           // PLAIN, CHECKER, ... in pattern.wgsl
    object: u32,            // object index, 0: the world
}

struct Pose {               // rows of an affine matrix: of a body body_from_world,
    x: vec4f,               // of the camera world_from_picture (see camera_ray)
    y: vec4f,
    z: vec4f,
}

struct Scene {
    sun: vec4f,             // direction towards it; w: strength
    sky: vec4f,             // radiance straight up; w: strength of the ambient light
    horizon: vec4f,         // radiance level and below
    first: f32,             // time of the first row of poses [frame intervals]
    step: f32,              // between two rows [frame intervals]
    rows: u32,
    bodies: u32,
    spheres: u32,           // bodies come by shape: spheres, boxes, cylinders, rings
    boxes: u32,
    pixel: f32,             // width of a pixel at distance 1 [scene units]
    rays: u32,              // antialiasing: rays per side of a pixel, this number squared in all
    cylinders: u32,
    backdrop: Backdrop,           // where BACKDROP
    bounds: array<vec4u, MOST_BODIES>,  // box around a body in all rows; x, y, z: its low and high end as two f16
}

@group(1) @binding(0) var<uniform> scene: Scene;
@group(1) @binding(1) var<storage, read> bodies: array<Body>;
@group(1) @binding(2) var poses: texture_2d<f32>;   // three texels each, the camera first, then the bodies

const BACKGROUND_DEPTH: f32 = 1e10; // where nothing is hit, as Blender writes it, and the files written here
const CLOSE: f32 = 1e-3;            // hits nearer than this to a ray's start are the surface it left [scene units]
const MOST_BODIES: u32 = 1024u;     // bounds are uniforms, poses rows of a texture: storage is a third slower on lavapipe
const RING_STEPS: u32 = 64u;        // of sphere tracing towards a ring's surface, at most
const RING_CLOSE: f32 = 1e-4;       // distance from it that counts as a hit [scene units]

override INSTANT: bool = false;     // all rays are of one instant, whose poses are the only row
override RINGS: bool = false;       // there are rings among the bodies
override BACKDROP: bool = false;      // bodies are the solids of volumes on a backdrop, and lit as those are

const SHADE: f32 = 0.18;            // share of the sunlight that is left in a shadow

struct Ray {
    origin: vec3f,
    direction: vec3f,       // its length is 1 along the view axis, so distance along it is depth
}

struct Hit {
    depth: f32,             // BACKGROUND_DEPTH if nothing was hit
    body: u32,
    pose: Pose,             // of the body, as fetching it again is expensive
}

struct Instant {            // a time, as a place between two rows of poses
    row: u32,
    after: f32,             // 0..1 towards the next row
}

/// The instant of time `t` [frame intervals]; before the first row and after the last one it is theirs.
fn instant(t: f32) -> Instant {
    let x = clamp((t - scene.first) / scene.step, 0.0, f32(scene.rows - 1u));
    let row = min(u32(x), scene.rows - 2u);
    return Instant(row, x - f32(row));
}

fn pose(index: u32, now: Instant) -> Pose {
    return Pose(pose_row(3u * index, now), pose_row(3u * index + 1u, now), pose_row(3u * index + 2u, now));
}

fn pose_row(column: u32, now: Instant) -> vec4f {
    let before = textureLoad(poses, vec2u(column, now.row), 0);
    if INSTANT { return before; }
    return mix(before, textureLoad(poses, vec2u(column, now.row + 1u), 0), now.after);
}

fn transformed(p: Pose, v: vec4f) -> vec3f {
    return vec3f(dot(p.x, v), dot(p.y, v), dot(p.z, v));
}

/// The ray through `x` [px]; `camera` as pose(0u, ...) has it.
fn camera_ray(x: vec2f, camera: Pose) -> Ray {
    let ndc = (x / vec2f(frame.size) * 2.0 - 1.0) * vec2f(1.0, -1.0);
    return Ray(transformed(camera, vec4f(0.0, 0.0, 0.0, 1.0)), transformed(camera, vec4f(ndc, 1.0, 0.0)));
}

/// The nearest hit of a ray. Poses are expensive to fetch and a ray passes near few bodies, so their
/// bounds are tested first, 32 bodies at a time with a bit each. Loop form: see wgsl.md.
fn nearest(ray: Ray, now: Instant) -> Hit {
    var hit = Hit(BACKGROUND_DEPTH, 0u, Pose());
    let boxes = scene.spheres;
    let cylinders = boxes + scene.boxes;
    let rings = cylinders + scene.cylinders;
    let end = turns_of(scene.bodies, bitcast<u32>(ray.direction.x));
    var first = 0u;
    loop {
        var near = sift(first, min(end - first, 32u), ray);
        loop {
            let index = first + min(firstTrailingBit(near), 31u);
            let p = pose(index + 1u, now);
            let local = in_body(p, ray);
            var t = box(local);
            if index < boxes { t = sphere(local); }
            if index >= cylinders { t = cylinder(local); }
            if RINGS { t = select(t, ring(local, bodies[index].size.xyz, index >= rings), index >= rings); }
            if near != 0u && t >= CLOSE && t < hit.depth { hit = Hit(t, index, p); }
            near &= near - 1u;
            if near == 0u { break; }
        }
        first += 32u;
        if first >= end { break; }
    }
    return hit;
}

/// Slab tests of `count` bodies from `first` on. Bit i: the ray meets the bounding box of body first + i.
fn sift(first: u32, count: u32, ray: Ray) -> u32 {
    let inverse = 1.0 / away_from_0(ray.direction);
    var near = 0u;
    var i = 0u;
    loop {
        let bounds = scene.bounds[first + i].xyz;
        let x = (unpack2x16float(bounds.x) - ray.origin.x) * inverse.x;
        let y = (unpack2x16float(bounds.y) - ray.origin.y) * inverse.y;
        let z = (unpack2x16float(bounds.z) - ray.origin.z) * inverse.z;
        let enter = max(max(min(x.x, x.y), min(y.x, y.y)), max(min(z.x, z.y), 0.0));
        let leave = min(max(x.x, x.y), min(max(y.x, y.y), max(z.x, z.y)));
        near |= select(0u, 1u << i, enter <= leave && i < count);
        i++;
        if i >= count { break; }
    }
    return near;
}

/// The same, but no component is too small to divide by.
fn away_from_0(x: vec3f) -> vec3f {
    return select(x, vec3f(1e-12), abs(x) < vec3f(1e-12));
}

fn in_body(p: Pose, ray: Ray) -> Ray {
    return Ray(transformed(p, vec4f(ray.origin, 1.0)), transformed(p, vec4f(ray.direction, 0.0)));
}

// Depth at which a ray hits a unit body, in the body's own space; below CLOSE where it does not.

fn sphere(ray: Ray) -> f32 {
    let a = dot(ray.direction, ray.direction);
    let b = dot(ray.origin, ray.direction);
    let discriminant = b * b - a * (dot(ray.origin, ray.origin) - 1.0);
    let root = sqrt(max(discriminant, 0.0));
    let enter = (-b - root) / a;
    let t = select((-b + root) / a, enter, enter >= CLOSE);
    return select(t, 0.0, discriminant <= 0.0);
}

fn box(ray: Ray) -> f32 {
    let safe = away_from_0(ray.direction);
    let a = (-1.0 - ray.origin) / safe;
    let b = (1.0 - ray.origin) / safe;
    let near = min(a, b);
    let far = max(a, b);
    let enter = max(near.x, max(near.y, near.z));
    let leave = min(far.x, min(far.y, far.z));
    let t = select(leave, enter, enter >= CLOSE);
    return select(t, 0.0, leave < enter);
}

fn cylinder(ray: Ray) -> f32 {
    let o = ray.origin;
    let d = ray.direction;
    let a = max(dot(d.xy, d.xy), 1e-12);
    let b = dot(o.xy, d.xy);
    let discriminant = b * b - a * (dot(o.xy, o.xy) - 1.0);
    let root = sqrt(max(discriminant, 0.0));
    let dz = select(d.z, 1e-12, abs(d.z) < 1e-12);
    let caps = vec2f((-1.0 - o.z) / dz, (1.0 - o.z) / dz);
    let enter = max((-b - root) / a, min(caps.x, caps.y));
    let leave = min((-b + root) / a, max(caps.x, caps.y));
    let t = select(leave, enter, enter >= CLOSE);
    return select(t, 0.0, discriminant <= 0.0 || leave < enter);
}

/// A torus about y of half extents `size`, by sphere tracing; no steps if it is not `there`.
fn ring(ray: Ray, size: vec3f, there: bool) -> f32 {
    let o = ray.origin * size;
    let d = ray.direction * size;
    let a = dot(d, d);
    let b = dot(o, d);
    let discriminant = b * b - a * (dot(o, o) - size.x * size.x);   // of the sphere around it
    let half = sqrt(max(discriminant, 0.0));
    let leave = (-b + half) / a;
    var t = max((-b - half) / a, CLOSE);
    var met = false;
    for (var i = 0u; i < select(0u, RING_STEPS, there && discriminant > 0.0); i++) {
        let p = o + t * d;
        let signed_distance = length(vec2f(length(p.xz) - (size.x - size.y), p.y)) - size.y;
        met = signed_distance < RING_CLOSE;
        if met || t > leave { break; }
        t += signed_distance * inverseSqrt(a);
    }
    return select(0.0, t, met);
}

struct Surface {
    at: vec3f,              // in the body's own space, where it is a unit sphere, cube or cylinder
    normal: vec3f,          // in that space, not normalised
    world_normal: vec3f,    // a unit vector, towards where the ray came from
}

fn surface(hit: Hit, ray: Ray) -> Surface {
    let p = hit.pose;
    let local = in_body(p, ray);
    let at = local.origin + hit.depth * local.direction;
    let side = abs(at);
    let most = max(side.x, max(side.y, side.z));
    var normal = select(vec3f(0.0), sign(at), side >= vec3f(most));
    if hit.body < scene.spheres { normal = at; }
    if hit.body >= scene.spheres + scene.boxes {
        let cap = abs(at.z) > dot(at.xy, at.xy);    // whichever surface, cap or side, is closer
        normal = select(vec3f(at.xy, 0.0), vec3f(0.0, 0.0, sign(at.z)), cap);
    }
    if RINGS && hit.body >= scene.spheres + scene.boxes + scene.cylinders {
        let size = bodies[hit.body].size.xyz;
        let q = at * size;
        let inward = 1.0 - (size.x - size.y) / max(length(q.xz), 1e-9);
        normal = size * vec3f(q.x * inward, q.y, q.z * inward);
    }
    let n = normalize(normal.x * p.x.xyz + normal.y * p.y.xyz + normal.z * p.z.xyz);
    return Surface(at, normal, select(n, -n, dot(n, ray.direction) > 0.0));
}

/// The hit's normal in the world, towards where the ray came from.
fn world_normal(hit: Hit, ray: Ray, now: Instant) -> vec3f {
    return surface(hit, ray).world_normal;
}

/// Radiance along the ray, towards its origin: sun with its shadow, ambient light, specular highlight, emission.
fn radiance(hit: Hit, ray: Ray, now: Instant) -> vec3f {
    let view = normalize(ray.direction);
    if BACKDROP { return staged(hit, ray, view, now); }
    if hit.depth >= BACKGROUND_DEPTH { return mix(scene.horizon.rgb, scene.sky.rgb, smoothstep(0.0, 0.6, view.y)); }
    let lit = lighting(hit, ray, view, now);
    return lit.color * (lit.sun + lit.ambient + lit.emitted) + vec3f(lit.specular * scene.sun.w);
}

struct Lighting {       // where a ray met a surface
    color: vec3f,
    sun: f32,           // light that is multiplied by the colour: with its shadow,
    ambient: f32,
    emitted: f32,
    specular: f32,      // times the sun's strength
}

fn lighting(hit: Hit, ray: Ray, view: vec3f, now: Instant) -> Lighting {
    let body = bodies[hit.body];
    let met = surface(hit, ray);
    let n = met.world_normal;
    let cosine = max(abs(dot(n, view)), 0.15);
    var lies = FLAT;
    if hit.body < scene.spheres { lies = BALL; }
    if hit.body >= scene.spheres + scene.boxes && met.normal.z == 0.0 { lies = TUBE; }
    let color = pattern_color(body.pattern, body.color.rgb, body.other.rgb, met.at, met.normal,
                              body.size.xyz, body.repeats, lies, hit.depth * scene.pixel / cosine);
    let at = ray.origin + hit.depth * ray.direction;
    let towards = scene.sun.xyz;
    var sun = max(dot(n, towards), 0.0);
    let blocked = nearest(Ray(at + 4.0 * CLOSE * n, towards), now).depth < BACKGROUND_DEPTH;
    sun *= select(1.0, SHADE, blocked) * scene.sun.w;
    let ambient = scene.sky.w * mix(0.55, 1.0, 0.5 + 0.5 * n.y);
    let specular = body.other.w * pow(max(dot(reflect(view, n), towards), 0.0), 40.0) * select(1.0, 0.0, blocked);
    return Lighting(color, sun, ambient, body.color.w, specular);
}

/// The same for the solids of volumes, shaded as the method "volume" shades the volumes.
fn staged(hit: Hit, ray: Ray, view: vec3f, now: Instant) -> vec3f {
    let backdrop = scene.backdrop;
    let light = backdrop.light.xyz;
    let there = hit.depth < BACKGROUND_DEPTH;
    let body = bodies[hit.body];
    let at = ray.origin + hit.depth * ray.direction;
    let n = surface(hit, ray).world_normal;
    let is_ground = there && body.pattern == GROUND;
    let pixel = hit.depth * scene.pixel;
    let away = normalize(view.xz + vec2f(0.0, 1e-9));
    let width = max(pixel * max(abs(away.yx), abs(away) / max(abs(view.y), 1e-3)), vec2f(1e-6));
    let blocked = nearest(Ray(at + 4.0 * CLOSE * n, light), now).depth < BACKGROUND_DEPTH;
    var ground = ground_color(backdrop, at.xz, width) * select(1.0, 0.3, blocked);
    ground = haze(backdrop, select(backdrop.tint.rgb, ground, is_ground), view.y);
    let color = material(body.color.rgb, n, light, view);
    return linear_from_srgb(select(ground, color, there && !is_ground));
}
