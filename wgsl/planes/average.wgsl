// Stored planes of several pictures (Y, Cb, Cr) -> the planes of their weighted sum in linear light, with nothing
// between. An invocation makes a block of 8 x 2 pixels: whole words of all three planes.
//#include common/frame.wgsl
//#include common/loops.wgsl
//#include common/transfer.wgsl
//#include planes/code.wgsl

struct Average {
    parts: array<vec4f, 8>,     // weight of a picture, and the layer that holds its planes
    count: u32,                 // of pictures: 1 to 8
    most: i32,                  // greatest sample
    blocks: u32,                // of a row
    luma: vec4u,                // words of a row, rows, and the first word of the plane
    blue: vec4u,
    red: vec4u,
}

@group(1) @binding(0) var<uniform> stored: Code;
@group(1) @binding(1) var<uniform> wanted: Code;
@group(1) @binding(2) var<uniform> average: Average;
@group(1) @binding(3) var lumas: texture_2d_array<u32>;         // four samples to a texel
@group(1) @binding(4) var blues: texture_2d_array<u32>;
@group(1) @binding(5) var reds: texture_2d_array<u32>;
@group(1) @binding(6) var<storage, read_write> sums: array<mat4x4f>;    // where there are more than eight pictures
@group(1) @binding(7) var<storage, read_write> packed: array<u32>;

override READ_X: u32 = 2u;      // 1 or 2: columns, rows of pixels to one sample of chroma, of what is read
override READ_Y: u32 = 2u;
override WRITE_X: u32 = 2u;     // of what is written
override WRITE_Y: u32 = 2u;
override BITS: u32 = 8u;        // 8 or 16: of a sample that is written, in its word
override FIRST: bool = true;    // `sums` is empty
override LAST: bool = true;     // the sum is whole, and is written

@compute @workgroup_size(WG_X, WG_Y)
fn main(@builtin(global_invocation_id) id: vec3u) {
    let turns = turns_of(average.count, id.x);
    // Below the last row stands the last row again.
    let rows = vec2u(2u * id.y, min(2u * id.y + 1u, average.luma.y - 1u));
    let coarse = vec2u(rows.x / READ_Y, select(rows.y, rows.x / 2u, READ_Y == 2u));
    let left = 2u * id.x;
    var a = mat4x3f();          // the four pixels at the upper left
    var b = mat4x3f();
    var c = mat4x3f();          // at the lower left
    var d = mat4x3f();
    var n = 0u;
    loop {
        let weight = average.parts[n].x;
        let layer = i32(average.parts[n].y);
        let upper = chroma(id.x, coarse.x, layer);
        let lower = chroma(id.x, coarse.y, layer);
        a = add(a, weight, textureLoad(lumas, vec2u(left, rows.x), layer, 0), upper.blue_left, upper.red_left);
        b = add(b, weight, textureLoad(lumas, vec2u(left + 1u, rows.x), layer, 0), upper.blue_right, upper.red_right);
        c = add(c, weight, textureLoad(lumas, vec2u(left, rows.y), layer, 0), lower.blue_left, lower.red_left);
        d = add(d, weight, textureLoad(lumas, vec2u(left + 1u, rows.y), layer, 0), lower.blue_right, lower.red_right);
        n++;
        if n >= turns { break; }
    }
    if rows.x > rows.y || id.x >= average.blocks { return; }    // outside; not before the loop, see lavapipe.md
    let place = 4u * (id.y * average.blocks + id.x);
    if !FIRST {
        a += colors(sums[place]);
        b += colors(sums[place + 1u]);
        c += colors(sums[place + 2u]);
        d += colors(sums[place + 3u]);
    }
    if !LAST {
        sums[place] = padded(a);
        sums[place + 1u] = padded(b);
        sums[place + 2u] = padded(c);
        sums[place + 3u] = padded(d);
        return;
    }
    let upper_left = signals_of(a);
    let upper_right = signals_of(b);
    let lower_left = signals_of(c);
    let lower_right = signals_of(d);
    write_row(average.luma, id.x, rows.x, mixed(wanted.x, upper_left), mixed(wanted.x, upper_right));
    write_row(average.luma, id.x, rows.y, mixed(wanted.x, lower_left), mixed(wanted.x, lower_right));
    if WRITE_Y == 2u {
        write_chroma(id.x, id.y, upper_left + lower_left, upper_right + lower_right);
    } else {
        write_chroma(id.x, rows.x, upper_left, upper_right);
        write_chroma(id.x, rows.y, lower_left, lower_right);
    }
}

/// Samples of chroma for eight pixels of a row.
struct Chroma {
    blue_left: vec4f,
    blue_right: vec4f,
    red_left: vec4f,
    red_right: vec4f,
}

fn chroma(block: u32, row: u32, layer: i32) -> Chroma {
    if READ_X == 2u {
        let at = vec2u(block, row);
        let blue = floats(textureLoad(blues, at, layer, 0));
        let red = floats(textureLoad(reds, at, layer, 0));
        return Chroma(blue.xxyy, blue.zzww, red.xxyy, red.zzww);
    }
    let at = vec2u(2u * block, row);
    let next = at + vec2u(1u, 0u);
    return Chroma(
        floats(textureLoad(blues, at, layer, 0)), floats(textureLoad(blues, next, layer, 0)),
        floats(textureLoad(reds, at, layer, 0)), floats(textureLoad(reds, next, layer, 0)));
}

/// Light of four pixels, added to a sum.
fn add(sum: mat4x3f, weight: f32, luma: vec4u, blue: vec4f, red: vec4f) -> mat4x3f {
    let y = floats(luma);
    return mat4x3f(
        fma(vec3f(weight), light(y.x, blue.x, red.x), sum[0]), fma(vec3f(weight), light(y.y, blue.y, red.y), sum[1]),
        fma(vec3f(weight), light(y.z, blue.z, red.z), sum[2]), fma(vec3f(weight), light(y.w, blue.w, red.w), sum[3]));
}

fn light(y: f32, cb: f32, cr: f32) -> vec3f {
    let tint = vec3f(
        fma(stored.x.y, cb, fma(stored.x.z, cr, stored.x.w)), fma(stored.y.y, cb, fma(stored.y.z, cr, stored.y.w)),
        fma(stored.z.y, cb, fma(stored.z.z, cr, stored.z.w)));
    return light_of(fma(vec3f(stored.x.x, stored.y.x, stored.z.x), vec3f(y), tint));
}

/// Samples, which lavapipe converts ten times as fast as signed numbers.
fn floats(texel: vec4u) -> vec4f {
    return vec4f(vec4i(texel));
}

fn colors(kept: mat4x4f) -> mat4x3f {
    return mat4x3f(kept[0].xyz, kept[1].xyz, kept[2].xyz, kept[3].xyz);
}

fn padded(sum: mat4x3f) -> mat4x4f {
    return mat4x4f(vec4f(sum[0], 0.0), vec4f(sum[1], 0.0), vec4f(sum[2], 0.0), vec4f(sum[3], 0.0));
}

/// R, G and B of four pixels.
fn signals_of(light: mat4x3f) -> mat3x4f {
    return transpose(mat4x3f(signal_of(light[0]), signal_of(light[1]), signal_of(light[2]), signal_of(light[3])));
}

/// One component of four pixels, not rounded yet.
fn mixed(row: vec4f, signals: mat3x4f) -> vec4f {
    return fma(vec4f(row.x), signals[0], fma(vec4f(row.y), signals[1], fma(vec4f(row.z), signals[2], vec4f(row.w))));
}

/// Write Cb and Cr of eight pixels, from sums of their signals over WRITE_Y rows.
fn write_chroma(block: u32, row: u32, left: mat3x4f, right: mat3x4f) {
    let part = 1.0 / f32(WRITE_X * WRITE_Y);
    if WRITE_X == 2u {
        let mean = part * mat3x4f(
            paired(left[0], right[0]), paired(left[1], right[1]), paired(left[2], right[2]));
        write_half(average.blue, block, row, mixed(wanted.y, mean));
        write_half(average.red, block, row, mixed(wanted.z, mean));
    } else {
        write_row(average.blue, block, row, mixed(wanted.y, part * left), mixed(wanted.y, part * right));
        write_row(average.red, block, row, mixed(wanted.z, part * left), mixed(wanted.z, part * right));
    }
}

/// Sums of neighbours.
fn paired(left: vec4f, right: vec4f) -> vec4f {
    return vec4f(left.xz, right.xz) + vec4f(left.yw, right.yw);
}

/// Write eight samples of a row.
fn write_row(plane: vec4u, block: u32, row: u32, left: vec4f, right: vec4f) {
    write_half(plane, 2u * block, row, left);
    write_half(plane, 2u * block + 1u, row, right);
}

/// Write four samples of a row, rounded, unless they are outside the plane.
fn write_half(plane: vec4u, half: u32, row: u32, samples: vec4f) {
    let s = vec4u(clamp(vec4i(samples + 0.5), vec4i(0), vec4i(average.most)));
    let words = BITS / 8u;
    let column = half * words;
    let first = plane.z + row * plane.x + column;
    let fits = row < plane.y && column < plane.x;
    if BITS == 8u {
        if fits { packed[first] = s.x | (s.y << 8u) | (s.z << 16u) | (s.w << 24u); }
        return;
    }
    if fits { packed[first] = s.x | (s.y << 16u); }
    if fits && column + 1u < plane.x { packed[first + 1u] = s.z | (s.w << 16u); }
}
