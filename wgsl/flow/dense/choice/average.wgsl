// Costs, averaged over a square: first along x, then along y, where the cheaper motion is chosen.
//#include common/frame.wgsl

@group(1) @binding(0) var costs: texture_2d<f32>;       // of dense inverse search, of blocks; 1 near other motion
@group(1) @binding(1) var output: texture_storage_2d<rgba32float, write>;

const RADIUS: i32 = 8;      // [px]

@compute @workgroup_size(WG_X, WG_Y)
fn along_x(@builtin(global_invocation_id) id: vec3u) {
    if any(id.xy >= frame.size) { return; }
    textureStore(output, id.xy, sum(vec2i(id.xy), vec2i(1, 0)));
}

/// 1 where the motion of blocks is taken, else 0.
@compute @workgroup_size(WG_X, WG_Y)
fn choose(@builtin(global_invocation_id) id: vec3u) {
    if any(id.xy >= frame.size) { return; }
    let both = sum(vec2i(id.xy), vec2i(0, 1));
    textureStore(output, id.xy, vec4f(select(0.0, 1.0, both.y < both.x && both.z > 0.0)));
}

fn sum(px: vec2i, along: vec2i) -> vec4f {
    var found = vec2f(0.0);
    for (var k = -RADIUS; k <= RADIUS; k++) { found += textureLoad(costs, inside(px + k * along), 0).xy; }
    return vec4f(found, textureLoad(costs, px, 0).z, 0.0);
}
