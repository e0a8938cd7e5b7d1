// Places of one surface, by their tangent planes.
//#include common/frame.wgsl
//#include methods/gather/shading/light.wgsl

@group(1) @binding(10) var planes: texture_2d<f32>;     // stored as rgba32float, by `find_planes`: the inverse of depth; its change a pixel across, down

const OFF_PLANE: f32 = 0.02;    // by which one surface may leave its tangent plane [share of the depth],
const BEND: f32 = 0.5;          // and this much more over the picture's width: a turn of about 45 degrees

/// True if each of the pixels is about on the other's tangent plane, along which the inverse of depth is linear. False where
/// light rests.
fn is_one_surface(a: vec2i, b: vec2i) -> bool {
    let way = vec2f(b - a);
    let most = 1.0 + OFF_PLANE + BEND * length(way) / f32(frame.size.x);
    let at = textureLoad(planes, a, 0).xyz;
    let landing = inside(b);
    let at_there = textureLoad(planes, landing, 0).xyz;
    let there = at.x + dot(way, at.yz);
    let here = at_there.x - dot(way, at_there.yz);
    return is_as_deep(there, at_there.x, most) && is_as_deep(here, at.x, most);
}

fn is_as_deep(a: f32, b: f32, most: f32) -> bool {
    return max(a, b) < most * min(a, b);
}
