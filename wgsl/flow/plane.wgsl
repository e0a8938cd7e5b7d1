// A plane through the states around a pixel.
//#include common/frame.wgsl
//#include flow/features.wgsl
//#include flow/state.wgsl

const PLANE_RADIUS: i32 = 8;        // of the pixels to which a plane is fitted [px]
const PLANE_SIDE: u32 = 9u;         // such pixels along a side
const PLANE_INERTIA: f32 = 1.0;     // how much a fitted plane tends to be level [px^2]

struct Plane {
    flow: vec2f,
    slope: vec4f,
    bend: vec2f,        // the mean one
}

/// The plane through the flows near by that are of like pixels and like the state.
fn fitted_plane(here: texture_2d_array<f32>, states: texture_2d_array<f32>, px: vec2i, state: State) -> Plane {
    let color = textureLoad(here, px, 0, 0).rgb;
    var total = 0.0;
    var sum_at = vec2f(0.0);
    var sum_flow = vec2f(0.0);
    var sum_bend = vec2f(0.0);
    var square = vec3f(0.0);    // xx, xy, yy
    var product = vec4f(0.0);   // xu, yu, xv, yv
    for (var k = 0u; k < PLANE_SIDE * PLANE_SIDE; k++) {
        let by = 2 * vec2i(vec2u(k % PLANE_SIDE, k / PLANE_SIDE)) - PLANE_RADIUS;
        let at = px + by;
        let is_there = all(at >= vec2i(0)) && all(at < vec2i(frame.size));
        let flow_bend = textureLoad(states, at, 0, 0);
        let flow = flow_bend.xy;
        let x = vec2f(by);
        let apart = dot(abs(flow - moved(state, x).flow), vec2f(1.0));
        let like = likeness(textureLoad(here, at, 0, 0).rgb, color) / (1.0 + apart * apart);
        let weight = select(0.0, like, is_there);
        total += weight;
        sum_at += weight * x;
        sum_flow += weight * flow;
        sum_bend += weight * flow_bend.zw;
        square += weight * vec3f(x.x * x.x, x.x * x.y, x.y * x.y);
        product += weight * vec4f(x * flow.x, x * flow.y);
    }
    let mean_at = sum_at / total;
    let xx = square.x - mean_at.x * sum_at.x + PLANE_INERTIA * total;
    let xy = square.y - mean_at.x * sum_at.y;
    let yy = square.z - mean_at.y * sum_at.y + PLANE_INERTIA * total;
    let u = product.xy - mean_at * sum_flow.x;
    let v = product.zw - mean_at * sum_flow.y;
    let slope = vec4f(u.x * yy - u.y * xy, u.y * xx - u.x * xy, v.x * yy - v.y * xy, v.y * xx - v.x * xy)
        / (xx * yy - xy * xy);
    return Plane(sum_flow / total - sloped(slope, mean_at), slope, sum_bend / total);
}
