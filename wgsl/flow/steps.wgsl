// Steps of inverse search: by how much a patch has to be moved so that it matches the other frames better.
//#include flow/match.wgsl

const STEPS: u32 = 3u;              // see stepped()
const FLAT: f32 = 0.00001;          // squared gradient [1/px^2] that says nothing of the place
const LONGEST_STEP: f32 = 2.0;      // [px]

struct Slide {          // sums of Gauss and Newton's method over the differences to a frame
    square: vec3f,      // of the gradient: xx, xy, yy
    product: vec2f,     // of gradient and difference
    error: f32,
}

fn slid(slide: Slide, gradient: vec2f, weight: f32, own: vec4f, found: vec4f, apart: f32) -> Slide {
    let w = select(0.0, weight, apart < MOST_DIFFERENCE);
    let d = dot(found.rgb - own.rgb, LUMA);
    return Slide(slide.square + w * vec3f(gradient.x * gradient.x, gradient.x * gradient.y, gradient.y * gradient.y),
                 slide.product + w * d * gradient, slide.error + weight * min(apart, MOST_DIFFERENCE));
}

/// By how much the patch has to be moved so that the differences vanish [px]; 0 if that is too far to be true.
fn step_of(square: vec3f, product: vec2f) -> vec2f {
    let xx = square.x + FLAT;
    let yy = square.z + FLAT;
    let step = vec2f(square.y * product.y - yy * product.x, square.y * product.x - xx * product.y)
        / (xx * yy - square.y * square.y);
    return select(vec2f(0.0), step, max(abs(step.x), abs(step.y)) < LONGEST_STEP);
}

struct Steps {
    near: vec2f,        // to match the near frame better, [px]
    far: vec2f,
    both: vec2f,        // to match both, with the same bend
    better: vec2f,      // that of the side that matches better
    cost: f32,          // of the match as it is
}

/// Steps of inverse search (Baker and Matthews, "Lucas-Kanade 20 Years On", 2004): with this frame's gradients.
fn inverse_steps(state: State) -> Steps {
    let way = way_to_far(state);
    let to_near = target_of(state.flow, state.slope, OUTSIDE);
    let to_far = target_of(way.flow, way.slope, OUTSIDE);
    var n = Slide();
    var f = Slide();
    for (var row = 0u; row < SIDE; row++) {
        for (var column = first_column(row); column < SIDE; column += 2u) {
            let offset = vec2f(column_offset(column), row_offset(row));
            let k = sample_index(row, column);
            let gradient = 0.5 * (vec2f(patch0[k].w, patch1[k].x) - 0.5);
            let weight = patch1[k].w;
            let at_near = sample_place(to_near, offset);
            let near0 = textureSampleLevel(near, linear, at_near, 0, 0.0);
            let near1 = textureSampleLevel(near, linear, at_near, 1, 0.0);
            n = slid(n, gradient, weight, patch0[k], near0, difference(patch0[k], patch1[k].xyz, near0, near1.xyz));
            let at_far = sample_place(to_far, offset);
            let far0 = textureSampleLevel(far, linear, at_far, 0, 0.0);
            let far1 = textureSampleLevel(far, linear, at_far, 1, 0.0);
            f = slid(f, gradient, weight, patch0[k], far0, difference(patch0[k], patch1[k].xyz, far0, far1.xyz));
        }
    }
    let by = view.far_factor;
    let near_step = step_of(n.square, n.product);
    let far_step = step_of(f.square, f.product);
    let both = step_of(n.square + by * by * f.square, n.product + by * f.product);
    let near_cost = select(n.error, OUTSIDE, to_near.limit < 0.0);
    let far_cost = select(f.error, OUTSIDE, to_far.limit < 0.0);
    let cost = select(cost_of(near_cost, far_cost), near_cost, VIEWS == ONE);
    return Steps(near_step, far_step, both, select(far_step / by, near_step, n.error <= f.error), cost);
}

/// Variation `k` by such a step.
fn stepped(state: State, steps: Steps, k: u32) -> State {
    var result = state;
    if k == 0u { result.flow += select(steps.both, steps.near, VIEWS == ONE); }
    if k == 1u { result.flow += steps.better; }
    if k == 2u {
        result.flow += steps.near;
        result.bend += steps.far - view.far_factor * steps.near;
    }
    return result;
}
