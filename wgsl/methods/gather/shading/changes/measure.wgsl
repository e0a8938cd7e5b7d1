// Difference of the light on every surface in a neighbouring frame: log(light there) - log(light here), where the same
// surface is seen there.
//#include common/depth.wgsl
//#include common/frame.wgsl
//#include methods/gather/shading/light.wgsl
//#include methods/gather/shading/changes/both.wgsl
//#include methods/gather/shading/listed.wgsl

@group(1) @binding(6) var motion_there: texture_2d<f32>;      // stored as given
@group(1) @binding(7) var plain_here: texture_2d<u32>;      // stored as r32uint, by plain.wgsl
@group(1) @binding(8) var plain_there: texture_2d<u32>;     // stored as r32uint
@group(1) @binding(9) var ratio: Ratio;     // of light, as a logarithm; a: 1 where the surface is seen there

alias Ratio = texture_storage_2d<rgba16float, write>;

const LEADS_BACK: f32 = 1.0;    // a vector that leads farther away from where it came from [px] is of something else

@compute @workgroup_size(WG_X, WG_Y)
fn main(@builtin(local_invocation_index) local: u32, @builtin(workgroup_id) group: vec3u) {
    let id = listed_pixel(group, local);
    if any(id >= frame.size) { return; }
    let px = vec2i(id);
    let both = textureLoad(motion_here, px, 0);
    let way = select(both.xy, both.zw, side.next == 1u);
    let at = vec2f(px) + 0.5 + way;
    let is_there = all(at >= vec2f(0.0)) && all(at < vec2f(frame.size));
    let landing = inside(vec2i(floor(at)));
    let back = way + way_back(at);
    let z = valid_depth(textureLoad(depth_here, px, 0).x);
    let z_there = valid_depth(textureLoad(depth_there, landing, 0).x);
    let as_deep = is_as_deep_there(z, z_there);
    let seen = is_there && as_deep && dot(back, back) < LEADS_BACK * LEADS_BACK
        && are_plain(px, landing) && (!RESTING || (rests(both) && rests(textureLoad(motion_there, landing, 0))));
    let here = valid_light(textureLoad(light_here, px, 0));
    let there = cubic(at);
    let change = log(there + dark()) - log(here + dark());
    textureStore(ratio, px, select(vec4f(0.0), vec4f(change, 1.0), seen));
}

/// True if the pixels and those around them show one surface.
fn are_plain(px: vec2i, px_there: vec2i) -> bool {
    var all_plain = 1u;
    for (var k = 0; k < 9; k++) {
        let by = vec2i(k % 3, k / 3) - 1;
        let near = inside(px + by);
        let near_there = inside(px_there + by);
        all_plain &= textureLoad(plain_here, near, 0).x & textureLoad(plain_there, near_there, 0).x;
    }
    return all_plain == 1u;
}

/// The neighbour's motion to this frame, between its pixels [px].
fn way_back(at: vec2f) -> vec2f {
    let corner = floor(at - 0.5);
    let share = at - 0.5 - corner;
    var sum = vec2f(0.0);
    for (var k = 0; k < 4; k++) {
        let step = vec2f(f32(k & 1), f32(k >> 1u));
        let px = inside(vec2i(corner + step));
        let both = textureLoad(motion_there, px, 0);
        let shares = mix(1.0 - share, share, step);
        sum += shares.x * shares.y * select(both.zw, both.xy, side.next == 1u);
    }
    return sum;
}

/// The neighbour's light between its pixels, by Catmull and Rom.
fn cubic(at: vec2f) -> vec3f {
    let corner = floor(at - 0.5);
    let u = at - 0.5 - corner;
    let across = catmull_rom(u.x);
    let down = catmull_rom(u.y);
    var sum = vec3f(0.0);
    for (var k = 0; k < 16; k++) {
        let px = inside(vec2i(corner) + vec2i(k % 4, k / 4) - 1);
        sum += across[k % 4] * down[k / 4] * valid_light(textureLoad(light_there, px, 0));
    }
    return max(sum, vec3f(0.0));
}

fn catmull_rom(u: f32) -> vec4f {
    return vec4f(((-0.5 * u + 1.0) * u - 0.5) * u, (1.5 * u - 2.5) * u * u + 1.0,
                 ((-1.5 * u + 2.0) * u + 0.5) * u, (0.5 * u - 0.5) * u * u);
}
