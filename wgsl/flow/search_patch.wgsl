// A patch that is compared at whole displacements only.
//#include flow/match.wgsl

const SEARCH_SIDE: i32 = 4;         // samples along a patch,
const SEARCH_PATCH: i32 = 16;       // and in it
const SEARCH_STRIDE: i32 = 2;       // from one to the next [px]

var<private> own0: array<vec4f, SEARCH_PATCH>;
var<private> own1: array<vec4f, SEARCH_PATCH>;  // xyz; w: the sample's weight

fn search_offset(k: i32) -> vec2i {
    return SEARCH_STRIDE * vec2i(k % SEARCH_SIDE, k / SEARCH_SIDE) - (SEARCH_SIDE - 1);
}

fn load_search_patch(px: vec2i) {
    let color = textureLoad(here, px, 0, 0).rgb;
    var total = 0.0;
    for (var k = 0; k < SEARCH_PATCH; k++) {
        let at = px + search_offset(k);
        own0[k] = textureLoad(here, at, 0, 0);
        let is_inside = all(at >= vec2i(0)) && all(at < vec2i(frame.size));
        let weight = select(0.0, likeness(own0[k].rgb, color), is_inside);
        own1[k] = vec4f(textureLoad(here, at, 1, 0).xyz, weight);
        total += weight;
    }
    for (var k = 0; k < SEARCH_PATCH; k++) { own1[k].w /= total; }
}

/// Mean difference from another frame; a value above `most` may be too small, but is above `most`.
fn whole_cost(other: texture_2d_array<f32>, at: vec2i, most: f32) -> f32 {
    let last = vec2i(frame.size) - 1;
    let is_outside = any(at < vec2i(0)) || any(at > last);
    let limit = select(most, -1.0, is_outside);
    var sum = 0.0;
    if sum <= limit { sum = search_row(other, at, 0, sum); }
    if sum <= limit { sum = search_row(other, at, 1, sum); }
    if sum <= limit { sum = search_row(other, at, 2, sum); }
    if sum <= limit { sum = search_row(other, at, 3, sum); }
    return select(sum, OUTSIDE, is_outside);
}

/// The sum with the samples of a row, whose number is a constant: see match.wgsl on arrays.
fn search_row(other: texture_2d_array<f32>, at: vec2i, row: i32, before: f32) -> f32 {
    let last = vec2i(frame.size) - 1;
    var sum = before;
    for (var column = 0; column < SEARCH_SIDE; column++) {
        let k = SEARCH_SIDE * row + column;
        let px = clamp(at + search_offset(k), vec2i(0), last);
        let found0 = textureLoad(other, px, 0, 0);
        let found1 = textureLoad(other, px, 1, 0).xyz;
        let d = shaded_difference(own0[k], own1[k].xyz, found0, found1, view.most_shade);
        sum += own1[k].w * min(d, MOST_DIFFERENCE);
    }
    return sum;
}
