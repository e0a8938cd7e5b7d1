// Occupancy: the share of the exposure during which a rotating body is at a place (Cusa 2022, "Motion Blur All
// the Way Down"). Angles are those of the place, relative to the body at mid exposure, in its direction of rotation.
//#include common/angle.wgsl

// Curves of the shutter.
const BOX: u32 = 0u;
const COSINE: u32 = 1u;
const TABLE: u32 = 2u;
const SHARES: u32 = 4096u;      // steps of the shutter's integral, and of the periodic sums

override CURVE: u32 = COSINE;
override EXACT: bool = true;    // count all revolutions; else each crossing of the place once
override MANY: bool = true;     // some body turns more than CLOSED_FROM times within the exposure

@group(1) @binding(0) var<storage, read> tables: array<f32>;    // the shutter's integral, then the periodic sum of each body

const CLOSED_FROM: f32 = 1.5;   // turns within the exposure from which on the closed form holds

struct Rotation {   // of a body within the exposure
    rate: f32,      // shares of the exposure per radian
    turns: f32,     // revolutions within the exposure
    half: f32,      // fractional part of half the turns
    sum: u32,       // index of its table in `tables`
}

/// Integral of the shutter's curve from its middle to `x` [shares of the exposure]; -0.5 to 0.5.
fn integral(x: f32) -> f32 {
    let v = clamp(x, -0.5, 0.5);
    if CURVE == BOX { return v; }
    if CURVE == COSINE {
        // v + sin(2 pi v) / (2 pi), fitted with odd powers; off by 1e-7 at most.
        let s = v * v;
        return v * (1.9999996 + s * (-6.5796916 + s * (12.986436
                    + s * (-12.188102 + s * (6.5580421 + s * -1.9530318)))));
    }
    return table(0u, v + 0.5) - 0.5;
}

/// The table that begins at `first`, interpolated at `share` of its length.
fn table(first: u32, share: f32) -> f32 {
    let x = share * f32(SHARES);
    let i = min(u32(x), SHARES - 1u);
    let a = tables[first + i];
    return mix(a, tables[first + i + 1u], x - f32(i));
}

/// Share of the exposure during which |theta - angle of the body| < h, counting one crossing.
fn crossing(theta: f32, h: f32, rate: f32) -> f32 {
    return integral((theta + h) * rate) - integral((theta - h) * rate);
}

/// The same for theta in -pi..pi and h in 0..pi, counting every revolution.
fn occupancy(theta: f32, h: f32, t: Rotation) -> f32 {
    if !EXACT { return crossing(theta, h, t.rate); }
    let few = crossing(theta - TAU, h, t.rate) + crossing(theta, h, t.rate) + crossing(theta + TAU, h, t.rate);
    if !MANY { return few; }
    let many = h / PI + periodic_residual(theta + h, t) - periodic_residual(theta - h, t);
    return select(few, many, t.turns > CLOSED_FROM);
}

/// The periodic sum of the shutter's integrals at an edge of the body, less its mean and its trend.
fn periodic_residual(edge: f32, t: Rotation) -> f32 {
    if CURVE == TABLE { return table(t.sum, fract(edge / TAU)); }
    let f = fract(t.half + edge / TAU);
    let k = fract(t.half - edge / TAU);
    let u = f - k;
    let v = 1.0 - f - k;
    let box = u * v / (2.0 * t.turns);
    if CURVE == BOX { return box; }
    let a = PI / t.turns;
    return box - sin(u * a) * sin(v * a) / (TAU * sin(a));
}

/// arccos of q, given p = 1 - q, which callers know without cancellation (Abramowitz and Stegun 4.4.46).
fn arccos_from(p: f32) -> f32 {
    let x = 1.0 - p;
    return sqrt(max(p, 0.0)) * (1.5707963050 + x * (-0.2145988016 + x * (0.0889789874 + x * (-0.0501743046
           + x * (0.0308918810 + x * (-0.0170881256 + x * (0.0066700901 + x * -0.0012624911)))))));
}

/// Half the angle [rad] that a disk of radius `a`, `orbit` from the origin, covers on the circle of radius r; 0 to pi.
fn disk_half_angle(r: f32, a: f32, orbit: f32) -> f32 {
    let over = 1.0 / max(2.0 * r * orbit, 1e-12);
    let apart = r - orbit;
    let p = clamp((a - apart) * (a + apart) * over, 0.0, 2.0);      // 1 - cosine
    let q = clamp((r + orbit - a) * (r + orbit + a) * over, 0.0, 2.0);    // 1 + cosine
    let small = arccos_from(min(p, q));
    return select(small, PI - small, p > q);
}

/// The same of a torus's section at z = c, a spiric, for each of its two parts; 0 to pi / 2.
fn spiric_half_angle(r: f32, c: f32, minor: f32, major: f32) -> f32 {
    let far = sqrt(r * r + c * c);
    let apart = far - major;
    let over = 1.0 / max(4.0 * major * major * r * r, 1e-24);
    let p2 = (minor - apart) * (minor + apart) * (far + major - minor) * (far + major + minor) * over;  // 1 - cosine^2
    let q = sqrt(max(1.0 - p2, 0.0));
    return select(arccos_from(clamp(p2, 0.0, 1.0) / (1.0 + q)), 0.5 * PI, p2 >= 1.0);
}

/// atan2(y, x), off by 1e-6 at most, and 0 at the origin.
fn angle(x: f32, y: f32) -> f32 {
    let u = abs(x);
    let v = abs(y);
    let z = min(u, v) / max(max(u, v), 1e-30);
    let s = z * z;
    var a = z * (0.99999611 + s * (-0.33317368 + s * (0.19807815 + s * (-0.1323334 + s * (0.07962364 + s * (-0.03360419 + s * 0.00681178))))));
    a = select(a, 0.5 * PI - a, v > u);
    a = select(a, PI - a, x < 0.0);
    return select(a, -a, y < 0.0);
}
