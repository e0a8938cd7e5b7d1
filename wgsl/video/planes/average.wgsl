// Stored planes of several pictures (Y, Cb, Cr) -> the planes of their weighted sum in linear light, with nothing
// between. An invocation makes a block of 16 x 2 pixels: whole words of all three planes, from as few loads as there can
// be, because a load of one texel takes lavapipe longer than to make four pixels linear.
//#include common/frame.wgsl
//#include common/loops.wgsl
//#include common/transfer.wgsl
//#include video/planes/code.wgsl

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
// Sixteen bytes to a texel of luma; of chroma the same, or eight samples if READ_X is 2.
@group(1) @binding(3) var lumas: texture_2d_array<u32>;         // stored as rgba32uint
@group(1) @binding(4) var blues: texture_2d_array<u32>;         // stored as rg32uint
@group(1) @binding(5) var reds: texture_2d_array<u32>;          // stored as rg32uint
@group(1) @binding(6) var<storage, read_write> sums: array<mat4x4f>;    // where there are more than eight pictures
@group(1) @binding(7) var<storage, read_write> packed: array<u32>;

override READ_X: u32 = 2u;      // 1 or 2: columns, rows of pixels to one sample of chroma, of the input
override READ_Y: u32 = 2u;
override READ_BITS: u32 = 8u;   // 8 or 16: of a sample in its texel
override WRITE_X: u32 = 2u;     // of the output
override WRITE_Y: u32 = 2u;
override BITS: u32 = 8u;        // 8 or 16: of a sample that is written, in its word
override FIRST: bool = true;    // `sums` is empty
override LAST: bool = true;     // the sum is whole, and is written

/// Light of sixteen pixels of a row.
struct Row {
    a: mat4x3f,
    b: mat4x3f,
    c: mat4x3f,
    d: mat4x3f,
}

/// Sixteen samples of a row as they are stored; the second eight in `b` if READ_BITS is 16.
struct Words {
    a: vec4u,
    b: vec4u,
}

/// One component of sixteen pixels of a row.
struct Samples {
    a: vec4f,
    b: vec4f,
    c: vec4f,
    d: vec4f,
}

var<private> red_row: vec4f;        // of `stored`, as uniforms are slow within loops
var<private> green_row: vec4f;
var<private> blue_row: vec4f;

@compute @workgroup_size(WG_X, WG_Y)
fn main(
    @builtin(local_invocation_index) local: u32,
    @builtin(workgroup_id) group: vec3u,
    @builtin(num_workgroups) groups: vec3u,
) {
    // Blocks in the order of rows, whatever the workgroup's shape, so that none of its rows ends outside.
    let place = (group.y * groups.x + group.x) * WG_X * WG_Y + local;
    let id = vec2u(place % average.blocks, place / average.blocks);
    let turns = turns_of(average.count, id.x);
    // Below the last row stands the last row again.
    let rows = vec2u(2u * id.y, min(2u * id.y + 1u, average.luma.y - 1u));
    red_row = stored.x / signal_unit();
    green_row = stored.y / signal_unit();
    blue_row = stored.z / signal_unit();
    var upper = Row();
    var lower = Row();
    var n = 0u;
    loop {
        let weight = average.parts[n].x;
        let layer = i32(average.parts[n].y);
        let above = vec2u(id.x, rows.x / READ_Y);
        let blue = chroma(blue_at(above, layer));
        let red = chroma(red_at(above, layer));
        let high = sixteen(luma_at(vec2u(id.x, rows.x), layer));
        let low = sixteen(luma_at(vec2u(id.x, rows.y), layer));
        upper = add(upper, weight, high, blue, red);
        if READ_Y == 2u {
            lower = add(lower, weight, low, blue, red);
        } else {
            let below = vec2u(id.x, rows.y);
            lower = add(lower, weight, low, chroma(blue_at(below, layer)), chroma(red_at(below, layer)));
        }
        n++;
        if n >= turns { break; }
    }
    if rows.x > rows.y { return; }      // outside; not before the loop, see wgsl.md
    if !FIRST {
        upper = with_sums(upper, 8u * place);
        lower = with_sums(lower, 8u * place + 4u);
    }
    if !LAST {
        keep(upper, 8u * place);
        keep(lower, 8u * place + 4u);
        return;
    }
    write_quads(2u * id.x, id.y, rows, upper.a, upper.b, lower.a, lower.b);
    write_quads(2u * id.x + 1u, id.y, rows, upper.c, upper.d, lower.c, lower.d);
}

/// Words of luma for the sixteen pixels of block `at`, which has as many samples.
fn luma_at(at: vec2u, layer: i32) -> Words {
    if READ_BITS == 8u { return Words(textureLoad(lumas, at, layer, 0), vec4u()); }
    let left = vec2u(2u * at.x, at.y);
    let right = vec2u(2u * at.x + 1u, at.y);
    return Words(textureLoad(lumas, left, layer, 0), textureLoad(lumas, right, layer, 0));
}

/// The same of Cb, which may have eight samples.
fn blue_at(at: vec2u, layer: i32) -> Words {
    if READ_BITS == 8u || READ_X == 2u { return Words(textureLoad(blues, at, layer, 0), vec4u()); }
    let left = vec2u(2u * at.x, at.y);
    let right = vec2u(2u * at.x + 1u, at.y);
    return Words(textureLoad(blues, left, layer, 0), textureLoad(blues, right, layer, 0));
}

/// The same of Cr.
fn red_at(at: vec2u, layer: i32) -> Words {
    if READ_BITS == 8u || READ_X == 2u { return Words(textureLoad(reds, at, layer, 0), vec4u()); }
    let left = vec2u(2u * at.x, at.y);
    let right = vec2u(2u * at.x + 1u, at.y);
    return Words(textureLoad(reds, left, layer, 0), textureLoad(reds, right, layer, 0));
}

/// Sixteen samples.
fn sixteen(words: Words) -> Samples {
    let a = words.a;
    if READ_BITS == 8u { return Samples(of_bytes(a.x), of_bytes(a.y), of_bytes(a.z), of_bytes(a.w)); }
    return Samples(of_halves(a.xy), of_halves(a.zw), of_halves(words.b.xy), of_halves(words.b.zw));
}

/// Samples of chroma for sixteen pixels.
fn chroma(words: Words) -> Samples {
    if READ_X == 1u { return sixteen(words); }
    var left = of_bytes(words.a.x);
    var right = of_bytes(words.a.y);
    if READ_BITS == 16u {
        left = of_halves(words.a.xy);
        right = of_halves(words.a.zw);
    }
    return Samples(left.xxyy, left.zzww, right.xxyy, right.zzww);
}

fn of_bytes(word: u32) -> vec4f {
    return floats(vec4u(word & 0xffu, (word >> 8u) & 0xffu, (word >> 16u) & 0xffu, word >> 24u));
}

fn of_halves(words: vec2u) -> vec4f {
    return floats(vec4u(words.x & 0xffffu, words.x >> 16u, words.y & 0xffffu, words.y >> 16u));
}

/// Samples, which lavapipe converts ten times as fast as signed numbers.
fn floats(samples: vec4u) -> vec4f {
    return vec4f(vec4i(samples));
}

/// Light of sixteen pixels, added to a sum.
fn add(sum: Row, weight: f32, luma: Samples, blue: Samples, red: Samples) -> Row {
    return Row(
        add_four(sum.a, weight, luma.a, blue.a, red.a), add_four(sum.b, weight, luma.b, blue.b, red.b),
        add_four(sum.c, weight, luma.c, blue.c, red.c), add_four(sum.d, weight, luma.d, blue.d, red.d));
}

fn add_four(sum: mat4x3f, weight: f32, y: vec4f, blue: vec4f, red: vec4f) -> mat4x3f {
    return mat4x3f(
        fma(vec3f(weight), light(y.x, blue.x, red.x), sum[0]), fma(vec3f(weight), light(y.y, blue.y, red.y), sum[1]),
        fma(vec3f(weight), light(y.z, blue.z, red.z), sum[2]), fma(vec3f(weight), light(y.w, blue.w, red.w), sum[3]));
}

fn light(y: f32, cb: f32, cr: f32) -> vec3f {
    let tint = vec3f(
        fma(red_row.y, cb, fma(red_row.z, cr, red_row.w)), fma(green_row.y, cb, fma(green_row.z, cr, green_row.w)),
        fma(blue_row.y, cb, fma(blue_row.z, cr, blue_row.w)));
    return light_of(fma(vec3f(red_row.x), vec3f(y), tint));     // all have the same share of luma
}

/// A sum, and the part kept of the one before.
fn with_sums(row: Row, place: u32) -> Row {
    return Row(
        row.a + colors(sums[place]), row.b + colors(sums[place + 1u]),
        row.c + colors(sums[place + 2u]), row.d + colors(sums[place + 3u]));
}

fn colors(kept: mat4x4f) -> mat4x3f {
    return mat4x3f(kept[0].xyz, kept[1].xyz, kept[2].xyz, kept[3].xyz);
}

fn keep(row: Row, place: u32) {
    sums[place] = padded(row.a);
    sums[place + 1u] = padded(row.b);
    sums[place + 2u] = padded(row.c);
    sums[place + 3u] = padded(row.d);
}

fn padded(sum: mat4x3f) -> mat4x4f {
    return mat4x4f(vec4f(sum[0], 0.0), vec4f(sum[1], 0.0), vec4f(sum[2], 0.0), vec4f(sum[3], 0.0));
}

/// Write half a block, 8 x 2 pixels: four at the upper left (a), at the upper right, below those.
fn write_quads(half: u32, low: u32, rows: vec2u, a: mat4x3f, b: mat4x3f, c: mat4x3f, d: mat4x3f) {
    let upper_left = signals_of(a);
    let upper_right = signals_of(b);
    let lower_left = signals_of(c);
    let lower_right = signals_of(d);
    write_row(average.luma, half, rows.x, mixed(wanted.x, upper_left), mixed(wanted.x, upper_right));
    write_row(average.luma, half, rows.y, mixed(wanted.x, lower_left), mixed(wanted.x, lower_right));
    if WRITE_Y == 2u {
        write_chroma(half, low, upper_left + lower_left, upper_right + lower_right);
    } else {
        write_chroma(half, rows.x, upper_left, upper_right);
        write_chroma(half, rows.y, lower_left, lower_right);
    }
}

/// R, G and B of four pixels.
fn signals_of(light: mat4x3f) -> mat3x4f {
    return transpose(mat4x3f(signal_of(light[0]), signal_of(light[1]), signal_of(light[2]), signal_of(light[3])));
}

/// One component of four pixels, not rounded yet.
fn mixed(row: vec4f, signals: mat3x4f) -> vec4f {
    let by = signal_unit() * row.xyz;
    return fma(vec4f(by.x), signals[0], fma(vec4f(by.y), signals[1], fma(vec4f(by.z), signals[2], vec4f(row.w))));
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
