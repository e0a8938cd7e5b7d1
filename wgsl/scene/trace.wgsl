// What a ray meets among rigid bodies at an instant, and the light that comes from there.
//#include common/frame.wgsl
//#include scene/pattern.wgsl

struct Body {
    size: vec4f,            // half extents [scene units]; w unused
    color: vec4f,           // first colour; w: light it gives off, times the colour
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
    sky: vec4f,             // straight up; w: strength of the light from all round
    horizon: vec4f,         // level and below
    first: f32,             // time of the first row of poses [frame intervals]
    step: f32,              // between two rows [frame intervals]
    rows: u32,
    bodies: u32,
    spheres: u32,           // bodies come by shape: spheres, boxes, cylinders
    boxes: u32,
    pixel: f32,             // width of a pixel at distance 1
    rays: u32,              // a pixel's rays for antialiasing: this number squared
}

@group(1) @binding(0) var<uniform> scene: Scene;
@group(1) @binding(1) var<storage, read> bodies: array<Body>;
@group(1) @binding(2) var<storage, read> poses: array<Pose>;    // by row, the camera first, then the bodies

const FAR: f32 = 1e10;      // depth where nothing is, as Blender writes it
const CLOSE: f32 = 1e-3;    // hits nearer than this to a ray's start are the surface it left [scene units]
const SHADE: f32 = 0.18;    // share of the sun that is left in a shadow's core

struct Ray {
    origin: vec3f,
    direction: vec3f,       // its length is 1 along the view axis, so distance along it is depth
}

struct Hit {
    depth: f32,             // FAR: nothing
    body: u32,
    at: vec3f,              // in the body's own space, where it is a unit sphere, cube or cylinder
    normal: vec3f,          // there, not normalised
}

struct Instant {            // where among the rows of poses
    row: u32,               // index of the row's first pose
    after: f32,             // 0..1 towards the next row
}

fn instant(t: f32) -> Instant {
    let x = clamp((t - scene.first) / scene.step, 0.0, f32(scene.rows - 1u));
    let row = min(u32(x), scene.rows - 2u);
    return Instant(row * (scene.bodies + 1u), x - f32(row));
}

fn pose(index: u32, now: Instant) -> Pose {
    let a = poses[now.row + index];
    let b = poses[now.row + scene.bodies + 1u + index];
    return Pose(mix(a.x, b.x, now.after), mix(a.y, b.y, now.after), mix(a.z, b.z, now.after));
}

fn moved(p: Pose, v: vec4f) -> vec3f {
    return vec3f(dot(p.x, v), dot(p.y, v), dot(p.z, v));
}

/// The ray through `x` [px].
fn camera_ray(x: vec2f, now: Instant) -> Ray {
    let ndc = (x / vec2f(frame.size) * 2.0 - 1.0) * vec2f(1.0, -1.0);
    let camera = pose(0u, now);
    return Ray(moved(camera, vec4f(0.0, 0.0, 0.0, 1.0)), moved(camera, vec4f(ndc, 1.0, 0.0)));
}

fn nearest(ray: Ray, now: Instant) -> Hit {
    var hit = Hit(FAR, 0u, vec3f(0.0), vec3f(0.0));
    for (var i = 0u; i < scene.spheres; i++) { hit = sphere(hit, i, ray, now); }
    let cylinders = scene.spheres + scene.boxes;
    for (var i = scene.spheres; i < cylinders; i++) { hit = box(hit, i, ray, now); }
    for (var i = cylinders; i < scene.bodies; i++) { hit = cylinder(hit, i, ray, now); }
    return hit;
}

fn sphere(best: Hit, index: u32, ray: Ray, now: Instant) -> Hit {
    let p = pose(index + 1u, now);
    let o = moved(p, vec4f(ray.origin, 1.0));
    let d = moved(p, vec4f(ray.direction, 0.0));
    let a = dot(d, d);
    let b = dot(o, d);
    let miss = b * b - a * (dot(o, o) - 1.0);
    let root = sqrt(max(miss, 0.0));
    var t = (-b - root) / a;
    if t < CLOSE { t = (-b + root) / a; }
    if miss <= 0.0 || t < CLOSE || t >= best.depth { return best; }
    let at = o + t * d;
    return Hit(t, index, at, at);
}

fn box(best: Hit, index: u32, ray: Ray, now: Instant) -> Hit {
    let p = pose(index + 1u, now);
    let o = moved(p, vec4f(ray.origin, 1.0));
    let d = moved(p, vec4f(ray.direction, 0.0));
    let safe = select(d, vec3f(1e-12), abs(d) < vec3f(1e-12));
    let a = (-1.0 - o) / safe;
    let b = (1.0 - o) / safe;
    let near = min(a, b);
    let far = max(a, b);
    let enter = max(near.x, max(near.y, near.z));
    let leave = min(far.x, min(far.y, far.z));
    let t = select(leave, enter, enter >= CLOSE);
    if leave < enter || t < CLOSE || t >= best.depth { return best; }
    let at = o + t * d;
    let side = abs(at);
    let most = max(side.x, max(side.y, side.z));
    return Hit(t, index, at, select(vec3f(0.0), sign(at), side >= vec3f(most)));
}

fn cylinder(best: Hit, index: u32, ray: Ray, now: Instant) -> Hit {
    let p = pose(index + 1u, now);
    let o = moved(p, vec4f(ray.origin, 1.0));
    let d = moved(p, vec4f(ray.direction, 0.0));
    let a = max(dot(d.xy, d.xy), 1e-12);
    let b = dot(o.xy, d.xy);
    let miss = b * b - a * (dot(o.xy, o.xy) - 1.0);
    let root = sqrt(max(miss, 0.0));
    let dz = select(d.z, 1e-12, abs(d.z) < 1e-12);
    let caps = vec2f((-1.0 - o.z) / dz, (1.0 - o.z) / dz);
    let enter = max((-b - root) / a, min(caps.x, caps.y));
    let leave = min((-b + root) / a, max(caps.x, caps.y));
    let t = select(leave, enter, enter >= CLOSE);
    if miss <= 0.0 || leave < enter || t < CLOSE || t >= best.depth { return best; }
    let at = o + t * d;
    let cap = abs(at.z) > dot(at.xy, at.xy);    // of the two surfaces, the one that at is closer to
    return Hit(t, index, at, select(vec3f(at.xy, 0.0), vec3f(0.0, 0.0, sign(at.z)), cap));
}

/// The hit's normal in the world, towards where the ray came from.
fn world_normal(hit: Hit, ray: Ray, now: Instant) -> vec3f {
    let p = pose(hit.body + 1u, now);
    let n = normalize(hit.normal.x * p.x.xyz + hit.normal.y * p.y.xyz + hit.normal.z * p.z.xyz);
    return select(n, -n, dot(n, ray.direction) > 0.0);
}

/// Light that comes along the ray backwards: sun with shadow, light from all round, gloss.
fn radiance(hit: Hit, ray: Ray, now: Instant) -> vec3f {
    let view = normalize(ray.direction);
    if hit.depth >= FAR { return mix(scene.horizon.rgb, scene.sky.rgb, smoothstep(0.0, 0.6, view.y)); }
    let body = bodies[hit.body];
    let n = world_normal(hit, ray, now);
    let facing = max(abs(dot(n, view)), 0.15);
    var lies = FLAT;
    if hit.body < scene.spheres { lies = BALL; }
    if hit.body >= scene.spheres + scene.boxes && hit.normal.z == 0.0 { lies = TUBE; }
    let color = pattern_color(body.pattern, body.color.rgb, body.other.rgb, hit.at, hit.normal,
                              body.size.xyz, body.repeats, lies, hit.depth * scene.pixel / facing);
    let at = ray.origin + hit.depth * ray.direction;
    let towards = scene.sun.xyz;
    var sun = max(dot(n, towards), 0.0);
    let blocked = nearest(Ray(at + 4.0 * CLOSE * n, towards), now).depth < FAR;
    sun *= select(1.0, SHADE, blocked) * scene.sun.w;
    let round = scene.sky.w * mix(0.55, 1.0, 0.5 + 0.5 * n.y);
    let shine = body.other.w * pow(max(dot(reflect(view, n), towards), 0.0), 40.0) * select(1.0, 0.0, blocked);
    return color * (sun + round + body.color.w) + vec3f(shine * scene.sun.w);
}
