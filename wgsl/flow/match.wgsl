// How badly a state explains a pixel: its patch against the two other frames, each of which may hide it.
//#include common/frame.wgsl
//#include flow/features.wgsl
//#include flow/state.wgsl

struct View {
    far_factor: f32,    // displacement to the far frame over that to the near one: -1 around a frame, 2 at an end
    far_price: f32,     // for being hidden in the near frame, where the far one is twice as far off
    stride: f32,        // of the patch [px]
    unused: f32,
}

@group(1) @binding(0) var<uniform> view: View;
@group(1) @binding(1) var here: texture_2d_array<f32>;      // features of this frame
@group(1) @binding(2) var near: texture_2d_array<f32>;      // of the near one
@group(1) @binding(3) var far: texture_2d_array<f32>;       // of the far one

override VIEWS: u32 = 2u;           // which frames are compared with this one:
const ONE: u32 = 1u;                // one beside it
const AROUND: u32 = 2u;             // those before and after it
const BESIDE: u32 = 3u;             // the two nearest on one side

const SIDE: u32 = 5u;           // samples along a patch
const PATCH: u32 = 25u;         // samples in a patch
const SPREAD_ORDER: u32 = 7u;   // samples are taken this far apart, so that the first few cover the patch
const MOST_DIFFERENCE: f32 = 0.6;   // of a sample: what differs more is something else
const OUTSIDE: f32 = 2.0;       // cost of leaving the picture: more than any other
const HIDDEN_PRICE: f32 = 0.03; // for being hidden in one of the frames
const SLOPE_PRICE: f32 = 0.02;  // per unit of slope
const BEND_PRICE: f32 = 0.002;  // per px of bend

struct Patch {
    x: vec2f,                   // its centre, in pixels whose centres are whole numbers
    features0: array<vec4f, PATCH>,
    features1: array<vec4f, PATCH>,     // xyz; w: the sample's weight, all of them sum up to 1
}

var<private> patch_here: Patch;

/// Place of a sample from the centre of its patch [px].
fn sample_offset(k: u32) -> vec2f {
    let i = (k * SPREAD_ORDER + PATCH / 2u) % PATCH;
    return view.stride * (vec2f(f32(i % SIDE), f32(i / SIDE)) - f32(SIDE / 2u));
}

fn load_patch(px: vec2i) {
    let centre = textureLoad(here, px, 0, 0).rgb;
    patch_here.x = vec2f(px);
    var total = 0.0;
    for (var k = 0u; k < PATCH; k++) {
        let at = px + vec2i(sample_offset(k));
        let features0 = textureLoad(here, at, 0, 0);
        let is_inside = all(at >= vec2i(0)) && all(at < vec2i(frame.size));
        let weight = select(0.0, likeness(features0.rgb, centre), is_inside);
        patch_here.features0[k] = features0;
        patch_here.features1[k] = vec4f(textureLoad(here, at, 1, 0).xyz, weight);
        total += weight;
    }
    for (var k = 0u; k < PATCH; k++) { patch_here.features1[k].w /= total; }
}

/// Mean difference of the patch from another frame, moved by `flow`; OUTSIDE if it is more than `most`.
fn side_cost(other: texture_2d_array<f32>, flow: vec2f, slope: vec4f, most: f32) -> f32 {
    let centre = patch_here.x + flow;
    let last = vec2f(frame.size) - 1.0;
    let is_inside = all(centre >= vec2f(0.0)) && all(centre <= last);
    let limit = select(-1.0, most, is_inside);
    var sum = 0.0;
    for (var k = 0u; k < PATCH && sum <= limit; k++) {
        let offset = sample_offset(k);
        let at = clamp(centre + offset + sloped(slope, offset), vec2f(0.0), last);
        let a = vec2i(at);
        let b = min(a + 1, vec2i(last));
        let part = at - vec2f(a);
        let ba = vec2i(b.x, a.y);
        let ab = vec2i(a.x, b.y);
        let found0 = mix(mix(textureLoad(other, a, 0, 0), textureLoad(other, ba, 0, 0), part.x),
                         mix(textureLoad(other, ab, 0, 0), textureLoad(other, b, 0, 0), part.x), part.y);
        let found1 = mix(mix(textureLoad(other, a, 1, 0), textureLoad(other, ba, 1, 0), part.x),
                         mix(textureLoad(other, ab, 1, 0), textureLoad(other, b, 1, 0), part.x), part.y);
        let own1 = patch_here.features1[k];
        let d = difference(patch_here.features0[k], own1.xyz, found0, found1.xyz);
        sum += own1.w * min(d, MOST_DIFFERENCE);
    }
    return select(OUTSIDE, sum, sum <= limit);
}

/// What a state costs in itself.
fn price(state: State) -> f32 {
    return SLOPE_PRICE * dot(abs(state.slope), vec4f(1.0)) + BEND_PRICE * (abs(state.bend.x) + abs(state.bend.y));
}

/// Cost of matching, without price(); anything above `most` may be wrong, but is above `most`.
fn match_cost(state: State, most: f32) -> f32 {
    let n = side_cost(near, state.flow, state.slope, select(2.0 * most, most, VIEWS == ONE));
    if VIEWS == ONE { return n; }
    // The far side is looked at as long as it can still change the result.
    let useful = min(most, n + HIDDEN_PRICE);
    let limit = max(2.0 * useful - n, useful - HIDDEN_PRICE - view.far_price);
    let f = side_cost(far, view.far_factor * state.flow + state.bend, view.far_factor * state.slope, limit);
    return min(0.5 * (n + f), min(n, f + view.far_price) + HIDDEN_PRICE);
}
