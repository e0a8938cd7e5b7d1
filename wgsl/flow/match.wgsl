// Cost of a state for a pixel: its patch against the two other frames, each of which may hide it.
//#include common/frame.wgsl
//#include flow/features.wgsl
//#include flow/state.wgsl

struct View {
    far_factor: f32,    // displacement to the far frame over that to the near one: -1 around a frame, 2 at an end
    far_price: f32,     // for being hidden in the near frame, where the far one is twice as far off
    stride: f32,        // of the patch [px]
    most_shade: f32,    // difference in grey up to which the light may have changed
}

@group(1) @binding(0) var<uniform> view: View;
@group(1) @binding(1) var here: texture_2d_array<f32>;      // features of this frame
@group(1) @binding(2) var near: texture_2d_array<f32>;      // of the near one
@group(1) @binding(3) var far: texture_2d_array<f32>;       // of the far one
@group(1) @binding(4) var linear: sampler;

override VIEWS: u32 = 2u;           // which frames are compared with this one:
const ONE: u32 = 1u;                // one beside it
const AROUND: u32 = 2u;             // those before and after it
const BESIDE: u32 = 3u;             // the two nearest on one side

const SIDE: u32 = 5u;           // places along a patch; every second one is a sample, as on a chessboard
const SAMPLES: u32 = 13u;       // in a patch
const ROW_ORDER: u32 = 2u;      // rows are taken this far apart
const MOST_DIFFERENCE: f32 = 0.6;   // of a sample: one that differs more is something else
const BESIDE_CENTRE: f32 = 0.0009765625;    // [px]; hardware filters in steps of 1/256
const OUTSIDE: f32 = 2.0;       // cost of leaving the picture: more than any other
const HIDDEN_PRICE: f32 = 0.03; // for being hidden in one of the frames
const SLOPE_PRICE: f32 = 0.02;  // per unit of slope
const BEND_PRICE: f32 = 0.002;  // per px of bend,
const MOST_BEND_PRICE: f32 = 0.01;  // which costs no more: less than being hidden

var<private> centre: vec2f;             // of the patch, in pixels whose centres are whole numbers
var<private> centre_color: vec3f;       // its display colour
// Of every sample, loaded once. Indices are constants wherever loops are unrolled: an array in registers.
var<private> patch0: array<vec4f, SAMPLES>;   // features
var<private> patch1: array<vec4f, SAMPLES>;   // xyz: features; w: weight, all of them sum up to 1

/// Row `k` of a patch from its centre [px]: the middle one first, then the others, far from one another.
fn row_offset(k: u32) -> f32 {
    return view.stride * (f32((k * ROW_ORDER + SIDE / 2u) % SIDE) - f32(SIDE / 2u));
}

/// Where the samples of a row begin.
fn first_column(row: u32) -> u32 {
    return (row * ROW_ORDER + SIDE / 2u) % SIDE % 2u;
}

fn column_offset(k: u32) -> f32 {
    return view.stride * (f32(k) - f32(SIDE / 2u));
}

/// The number of a sample in its array.
fn sample_index(row: u32, column: u32) -> u32 {
    return (row * ROW_ORDER + SIDE / 2u) % SIDE * SIDE / 2u + (column + 1u) / 2u;
}

/// Weight of a sample; 0 outside the picture.
fn sample_weight(px: vec2i, color: vec3f) -> f32 {
    let is_inside = all(px >= vec2i(0)) && all(px < vec2i(frame.size));
    return select(0.0, likeness(color, centre_color), is_inside);
}

fn load_patch(px: vec2i) {
    centre = vec2f(px);
    centre_color = textureLoad(here, px, 0, 0).rgb;
    var total = 0.0;
    for (var row = 0u; row < SIDE; row++) {
        for (var column = first_column(row); column < SIDE; column += 2u) {
            let at = px + vec2i(vec2f(column_offset(column), row_offset(row)));
            let k = sample_index(row, column);
            patch0[k] = textureLoad(here, at, 0, 0);
            patch1[k] = vec4f(textureLoad(here, at, 1, 0).xyz, sample_weight(at, patch0[k].rgb));
            total += patch1[k].w;
        }
    }
    let inverse = 1.0 / total;
    for (var k = 0u; k < SAMPLES; k++) { patch1[k].w *= inverse; }
}

struct Target {         // of a patch in another frame
    at: vec2f,          // its centre
    slope: vec4f,       // how its samples are drawn apart
    limit: f32,         // cost above which it is not looked at further
}

fn target_of(flow: vec2f, slope: vec4f, most: f32) -> Target {
    let at = centre + flow;
    let is_inside = all(at >= vec2f(0.0)) && all(at <= vec2f(frame.size) - 1.0);
    return Target(at, slope, select(-1.0, most, is_inside));
}

/// Where a sample is in the other frame, as the sampler takes it. Beside a pixel's centre by so little that no
/// neighbour has a weight, so that a whole displacement gives the pixel itself wherever the rounding goes.
fn sample_place(to: Target, offset: vec2f) -> vec2f {
    return (to.at + offset + sloped(to.slope, offset) + 0.5 + BESIDE_CENTRE) / vec2f(frame.size);
}

/// Addition of sample `k` to the cost if this is found in the other frame.
fn sample_cost(k: u32, found0: vec4f, found1: vec4f) -> f32 {
    let d = shaded_difference(patch0[k], patch1[k].xyz, found0, found1.xyz, view.most_shade);
    return patch1[k].w * min(d, MOST_DIFFERENCE);
}

/// Mean difference of the patch from the near frame; OUTSIDE if it is more than the limit.
fn near_cost(to: Target) -> f32 {
    var sum = 0.0;
    if sum <= to.limit { sum = near_row(to, 0u, sum); }
    if sum <= to.limit { sum = near_row(to, 1u, sum); }
    if sum <= to.limit { sum = near_row(to, 2u, sum); }
    if sum <= to.limit { sum = near_row(to, 3u, sum); }
    if sum <= to.limit { sum = near_row(to, 4u, sum); }
    return select(OUTSIDE, sum, sum <= to.limit);
}

fn near_row(to: Target, row: u32, before: f32) -> f32 {
    var sum = before;
    for (var column = first_column(row); column < SIDE; column += 2u) {
        let at = sample_place(to, vec2f(column_offset(column), row_offset(row)));
        sum += sample_cost(sample_index(row, column), textureSampleLevel(near, linear, at, 0, 0.0),
                           textureSampleLevel(near, linear, at, 1, 0.0));
    }
    return sum;
}

/// The same of the far frame, in functions of its own: a texture that is sampled by its name in the text is bound with a
/// filter (kernels.py), an argument is not.
fn far_cost(to: Target) -> f32 {
    var sum = 0.0;
    if sum <= to.limit { sum = far_row(to, 0u, sum); }
    if sum <= to.limit { sum = far_row(to, 1u, sum); }
    if sum <= to.limit { sum = far_row(to, 2u, sum); }
    if sum <= to.limit { sum = far_row(to, 3u, sum); }
    if sum <= to.limit { sum = far_row(to, 4u, sum); }
    return select(OUTSIDE, sum, sum <= to.limit);
}

fn far_row(to: Target, row: u32, before: f32) -> f32 {
    var sum = before;
    for (var column = first_column(row); column < SIDE; column += 2u) {
        let at = sample_place(to, vec2f(column_offset(column), row_offset(row)));
        sum += sample_cost(sample_index(row, column), textureSampleLevel(far, linear, at, 0, 0.0),
                           textureSampleLevel(far, linear, at, 1, 0.0));
    }
    return sum;
}

/// Cost of a state in itself.
fn price(state: State) -> f32 {
    let bend_price = min(BEND_PRICE * (abs(state.bend.x) + abs(state.bend.y)), MOST_BEND_PRICE);
    return SLOPE_PRICE * dot(abs(state.slope), vec4f(1.0)) + bend_price;
}

/// A state as it leads to the far frame.
fn way_to_far(state: State) -> State {
    return State(view.far_factor * state.flow + state.bend, vec2f(0.0), view.far_factor * state.slope);
}

/// Cost of matching, without price(); anything above `most` may be wrong, but is above `most`.
fn match_cost(state: State, most: f32) -> f32 {
    let n = near_cost(target_of(state.flow, state.slope, select(2.0 * most, most, VIEWS == ONE)));
    if VIEWS == ONE { return n; }
    // The far side is looked at as long as it can still change the result.
    let useful = min(most, n + HIDDEN_PRICE);
    let limit = max(2.0 * useful - n, useful - HIDDEN_PRICE - view.far_price);
    let way = way_to_far(state);
    let f = far_cost(target_of(way.flow, way.slope, limit));
    return cost_of(n, f);
}

/// Cost of matching the near frame by `n` and the far one by `f`.
fn cost_of(n: f32, f: f32) -> f32 {
    return min(0.5 * (n + f), min(n, f + view.far_price) + HIDDEN_PRICE);
}
