// Ray marching of motion-blurred density (Cusa 2022): spheres on circular orbits and rotating tori.
//#include common/color.wgsl
//#include common/frame.wgsl
//#include common/hash.wgsl
//#include scene/density.wgsl
//#include scene/backdrop.wgsl

@group(1) @binding(1) var<uniform> scene: Volumes;
@group(1) @binding(2) var<storage, read> tiles: array<vec2u>;  // of the workgroups: their places in the image, in workgroups
@group(1) @binding(3) var output: Output;

// The tiles that a volume, or a shadow, can reach are known before the dispatch. Loop form: see wgsl.md.
override CLOUD: bool = true;
override SHADOW: bool = true;

override ORBITS: u32 = 1;           // number of orbiting spheres; they come first
override TORI: u32 = 1;             // number of tori
override ROLLING: bool = false;     // every pixel has its own delay
override BLENDED: bool = true;      // normals are blended with the same weights everywhere, not by density

struct Volume {
    turn: vec4f,        // rows of a 2 x 2 matrix into the plane of rotation, in which the body is at angle 0
    centre: vec3f,
    opacity: f32,
    color: vec3f,
    normal_weight: f32, // of its gradient among those of all volumes
    small: f32,         // radius of a sphere, minor radius of a torus
    large: f32,         // radius of an orbit, major radius of a torus
    lead: f32,          // orbit: cosine of the angle by which its normals run ahead; torus: thickness that they lose
    swell: f32,         // torus: its normals are those of one that is smaller by this factor
    turning: Rotation,
    bound: vec4f,       // bounding sphere throughout the exposure: centre, radius
    slab: vec4f,        // bounding slab through the sphere's centre: normal, half its thickness
    drift: vec2f,       // rolling shutter: rotation across the width, the height [rad]
    unused: vec2f,
}

struct Volumes {
    eye: vec4f,         // w: radius of the sphere around the origin that is marched through
    right: vec4f,       // axes of the view; right and up are as long as half the image at distance 1
    up: vec4f,
    forward: vec4f,
    backdrop: Backdrop,
    strobe: vec2f,      // phase [rad], amount
    grain: u32,         // seed of the noise
    volumes: array<Volume, MOST_VOLUMES>,
}

const MOST_VOLUMES: u32 = 16u;
const TILES_A_ROW: u32 = 1024u;     // of the dispatch: a dimension has 65,535 workgroups at most
const STEPS: u32 = 40u;             // of a ray at most, each a twentieth of the marched sphere's radius
const SHADED: u32 = 30u;            // steps of a ray that are shaded, at most
const SHADOW_STEPS: u32 = 20u;      // at most, each twice as long
const FAINT: f32 = 0.002;           // density that is skipped
const FULL: f32 = 0.95;             // coverage at which a ray ends

// Registers, as far as loops over volumes are unrolled: uniforms are slow within loops.
var<private> volumes: array<Volume, MOST_VOLUMES>;

struct Span {           // the steps from `first` to before `end`
    first: u32,
    end: u32,
}

@compute @workgroup_size(WG_X, WG_Y)
fn main(@builtin(workgroup_id) group: vec3u, @builtin(local_invocation_id) local: vec3u) {
    let tile = group.y * TILES_A_ROW + group.x;
    if tile >= arrayLength(&tiles) { return; }
    let id = tiles[tile] * vec2u(WG_X, WG_Y) + local.xy;
    if any(id >= frame.size) { return; }
    let size = vec2f(frame.size);
    for (var i = 0u; i < ORBITS + TORI; i++) {
        volumes[i] = scene.volumes[i];
        if ROLLING {
            let on = dot(volumes[i].drift, (vec2f(id) + 0.5) / size - 0.5);
            let u = volumes[i].turn.xy;
            let v = volumes[i].turn.zw;
            volumes[i].turn = vec4f(cos(on) * u + sin(on) * v, cos(on) * v - sin(on) * u);
        }
    }
    let x = (vec2f(id) + 0.5) / size * vec2f(2.0, -2.0) + vec2f(-1.0, 1.0);
    let ray = x.x * scene.right.xyz + x.y * scene.up.xyz + scene.forward.xyz;
    let direction = normalize(ray);
    let light = scene.backdrop.light.xyz;
    let eye = scene.eye.xyz;
    let strobe = 1.0 - scene.strobe.y
        * (sin(scene.strobe.x + PI * smoothstep(0.4, 0.6, (f32(id.x) + 0.5) / size.x)) + 1.0);
    let noise = random2(id);

    let drop = scene.backdrop.tint.w - eye.y;
    var color = scene.backdrop.tint.rgb;
    let down = ray.y * drop > 0.0;
    let at = on_ground(ray, drop);
    var shadow = 0.0;
    if SHADOW { shadow = shadow_at(vec3f(at.x, scene.backdrop.tint.w, at.y), light, strobe, noise.y, down); }
    let to_right = on_ground(ray + scene.right.xyz * (2.0 / size.x), drop);
    let to_up = on_ground(ray + scene.up.xyz * (2.0 / size.y), drop);
    let width = max(max(abs(to_right - at), abs(to_up - at)), vec2f(1e-6));
    let ground = ground_color(scene.backdrop, at, width) * (1.0 - 0.7 * shadow);
    color = haze(scene.backdrop, select(color, ground, down), direction.y);

    if CLOUD {
        let seen = march(eye, direction, light, strobe, noise.x);
        color = color * (1.0 - seen.a) + seen.rgb;
    }
    textureStore(output, id, vec4f(linear_from_srgb(color), 1.0));
}

/// (x, z) of where a ray meets the ground, whose height above the eye is `drop`.
fn on_ground(ray: vec3f, drop: f32) -> vec2f {
    let along = drop / select(ray.y, -1e-6, abs(ray.y) < 1e-6);
    return scene.eye.xz + along * ray.xz;
}

/// Radiance of the volumes along a ray, front to back, and in a their coverage.
fn march(origin: vec3f, direction: vec3f, light: vec3f, strobe: f32, noise: f32) -> vec4f {
    let step = scene.eye.w / 20.0;
    let strength = strobe * step / 0.05;
    let start = entry(origin, direction) - step * noise;
    let span = steps(origin + start * direction, step * direction, STEPS, true);
    var sum = vec4f(0.0);
    var shaded = 0u;
    for (var i = span.first; i < span.end; i++) {
        let p = origin + (start + f32(i) * step) * direction;
        let here = density(p);
        let d = min(here.a * strength, 1.0);
        if d > FAINT {
            let n = normal(p);
            let alpha = 0.5 * d * d * (1.0 - sum.a);
            sum += alpha * vec4f(material(here.rgb / here.a, n, light, direction), 1.0);
            shaded += 1u;
            if sum.a > FULL || shaded >= SHADED { break; }
        }
    }
    return sum;
}

/// The share of the light that the volumes take from a point on the ground.
fn shadow_at(at: vec3f, light: vec3f, strobe: f32, noise: f32, there: bool) -> f32 {
    let step = 2.0 * scene.eye.w / 20.0;
    let strength = 0.47 * strobe * step / 0.05;
    let start = entry(at, light) - step * noise;
    let span = steps(at + start * light, step * light, SHADOW_STEPS, there);
    var shadow = 0.0;
    for (var i = span.first; i < span.end; i++) {
        var d = min(density(at + (start + f32(i) * step) * light).a * strength, 1.0);
        d = select(0.0, 0.9 * d * d, d > FAINT);
        shadow += d * (1.0 - shadow);
        if shadow > FULL { break; }
    }
    return shadow;
}

/// Distance at which a ray enters the marched sphere; 0 from within.
fn entry(origin: vec3f, direction: vec3f) -> f32 {
    let b = dot(origin, direction);
    let c = dot(origin, origin) - scene.eye.w * scene.eye.w;
    return max(-b - sqrt(max(b * b - c, 0.0)), 0.0);
}

/// The steps `i` at which start + i * step can be in a volume, by its bounding sphere and slab, within the marched
/// sphere; none if not `there`.
fn steps(start: vec3f, step: vec3f, most: u32, there: bool) -> Span {
    let all = in_sphere(start, step, vec4f(0.0, 0.0, 0.0, scene.eye.w));
    var near = 1e9;
    var far = -1e9;
    for (var i = 0u; i < ORBITS + TORI; i++) {
        let bound = volumes[i].bound;
        let slab = volumes[i].slab;
        let ball = in_sphere(start, step, bound);
        let slope = dot(slab.xyz, step);
        let over = 1.0 / select(slope, 1e-9, abs(slope) < 1e-9);
        let height = dot(slab.xyz, bound.xyz - start);
        let a = (height - slab.w) * over;
        let b = (height + slab.w) * over;
        let first = max(ball.x, min(a, b));
        let last = min(ball.y, max(a, b));
        near = select(near, min(near, first), first <= last);
        far = select(far, max(far, last), first <= last);
    }
    near = clamp(near, max(all.x, 0.0), f32(most));
    far = min(far, all.y);
    let end = u32(clamp(floor(far) + 1.0, 0.0, f32(most)));
    return Span(u32(ceil(near)), select(0u, end, there));
}

/// The range of steps in which a line is within a sphere; empty if it misses it.
fn in_sphere(start: vec3f, step: vec3f, sphere: vec4f) -> vec2f {
    let from_centre = start - sphere.xyz;
    let over = 1.0 / dot(step, step);
    let b = dot(from_centre, step) * over;
    let c = (dot(from_centre, from_centre) - sphere.w * sphere.w) * over;
    let discriminant = b * b - c;
    let half = sqrt(max(discriminant, 0.0));
    return select(vec2f(1e9, -1e9), vec2f(-b - half, -b + half), discriminant > 0.0);
}

/// Density at `p`: occupancies times opacities of all volumes; rgb: the same times their colours.
fn density(p: vec3f) -> vec4f {
    var sum = vec4f(0.0);
    for (var i = 0u; i < ORBITS; i++) {
        let d = orbit_density(i, p);
        sum += d * vec4f(volumes[i].color, 1.0);
    }
    for (var i = ORBITS; i < ORBITS + TORI; i++) {
        let d = torus_density(i, p);
        sum += d * vec4f(volumes[i].color, 1.0);
    }
    return sum;
}

fn orbit_density(i: u32, p: vec3f) -> f32 {
    let q = p - volumes[i].centre;
    let turn = volumes[i].turn;
    let x = turn.x * q.x + turn.y * q.z;
    let y = turn.z * q.x + turn.w * q.z;
    let radius = volumes[i].small;
    let section = radius * radius - q.y * q.y;
    let h = disk_half_angle(sqrt(x * x + y * y), sqrt(max(section, 0.0)), volumes[i].large);
    let d = occupancy(angle(x, y), h, volumes[i].turning);
    return select(0.0, volumes[i].opacity * d, section > 0.0);
}

fn torus_density(i: u32, p: vec3f) -> f32 {
    let q = p - volumes[i].centre;
    let turn = volumes[i].turn;
    let x = turn.x * q.x + turn.y * q.y;
    let y = turn.z * q.x + turn.w * q.y;
    let turning = volumes[i].turning;
    let h = spiric_half_angle(sqrt(x * x + y * y), q.z, volumes[i].small, volumes[i].large);
    let theta = angle(x, y);
    let opposite = theta + select(PI, -PI, theta >= 0.0);
    var d = 0.0;
    if EXACT {
        // A torus has twofold symmetry.
        d = occupancy(2.0 * select(theta, opposite, abs(theta) > 0.5 * PI), 2.0 * h, turning);
    } else {
        d = min(crossing(theta, h, turning.rate) + crossing(opposite, h, turning.rate), 1.0);
        d = select(d, 1.0, h >= 0.5 * PI);
    }
    return volumes[i].opacity * d;
}

/// A unit normal at `p`. Nothing is the normal of motion-blurred density: these are gradients of pseudo distances,
/// blended.
fn normal(p: vec3f) -> vec3f {
    var sum = vec3f(0.0);
    for (var i = 0u; i < ORBITS; i++) {
        var weight = volumes[i].normal_weight;
        if !BLENDED { weight *= orbit_density(i, p); }
        sum += weight * orbit_gradient(i, p);
    }
    for (var i = ORBITS; i < ORBITS + TORI; i++) {
        var weight = volumes[i].normal_weight;
        if !BLENDED { weight *= torus_density(i, p); }
        sum += weight * torus_gradient(i, p);
    }
    return sum * inverseSqrt(max(dot(sum, sum), 1e-20));
}

/// Gradient of the distance to the sphere at mid exposure, after `p` was rotated towards it by the angle of `lead`,
/// but not beyond it.
fn orbit_gradient(i: u32, p: vec3f) -> vec3f {
    let q = p - volumes[i].centre;
    let turn = volumes[i].turn;
    let x = turn.x * q.x + turn.y * q.z;
    let y = turn.z * q.x + turn.w * q.z;
    let side = select(1.0, -1.0, y < 0.0);
    let r = max(sqrt(x * x + y * y), 1e-9);
    let lead = volumes[i].lead;
    let lead_sine = sqrt(1.0 - lead * lead);
    let c = x / r;
    let s = abs(y) / r;
    let ahead = c >= lead;
    let cosine = select(c * lead + s * lead_sine, 1.0, ahead);
    let sine = select(s * lead - c * lead_sine, 0.0, ahead);
    let large = volumes[i].large;
    let out = r - large * cosine;       // along the radius; across it: large * sine
    let round = large * sine;
    let gx = out * c - round * s;
    let gy = (out * s + round * c) * side;
    let far = inverseSqrt(max(out * out + round * round + q.y * q.y, 1e-20));
    return far * vec3f(turn.x * gx + turn.z * gy, q.y, turn.y * gx + turn.w * gy);
}

/// Gradient of the smooth maximum of two distances: to a thinned torus at mid exposure, and to a shell around the
/// sphere that its ring sweeps.
fn torus_gradient(i: u32, p: vec3f) -> vec3f {
    let swell = volumes[i].swell;
    let q = swell * (p - volumes[i].centre);
    let turn = volumes[i].turn;
    let x = turn.x * q.x + turn.y * q.y;
    let y = turn.z * q.x + turn.w * q.y;
    let minor = volumes[i].small;
    let major = volumes[i].large;
    let wide = max(sqrt(x * x + q.z * q.z), 1e-9);
    let out = wide - major;
    let across = max(sqrt(out * out + y * y), 1e-9);
    let far = max(sqrt(dot(q, q)), 1e-9);
    let torus = across - minor;
    let shell = abs(far - major) - 0.3 * minor;
    let a = volumes[i].lead - torus;
    let b = 0.1 - shell;
    let h = 0.5 * max(0.1 - abs(a - b), 0.0) / 0.1;
    let share = select(h, 1.0 - h, a < b);
    let outward = share * out / (across * wide);
    let inward = (1.0 - share) * sign(far - major) / far;
    let gx = x * outward + x * inward;
    let gy = share * y / across + y * inward;
    return swell * vec3f(turn.x * gx + turn.z * gy, turn.y * gx + turn.w * gy, q.z * outward + q.z * inward);
}

/// Two numbers in [0, 1) for a pixel and an image.
fn random2(px: vec2u) -> vec2f {
    return unit_float2(pcg2d(px + vec2u(scene.grain, 0u)));
}
