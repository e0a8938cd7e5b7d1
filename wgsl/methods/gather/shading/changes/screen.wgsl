// Tiles in which light may differ from a neighbouring frame, by the nearest pixel there alone: all others are left out.
//#include common/depth.wgsl
//#include common/frame.wgsl
//#include methods/gather/shading/active.wgsl
//#include methods/gather/shading/changes/differs.wgsl
//#include methods/gather/shading/light.wgsl
//#include methods/gather/shading/changes/both.wgsl

@group(1) @binding(6) var<storage, read_write> found: FoundTiles;

@compute @workgroup_size(WG_X, WG_Y)
fn main(@builtin(global_invocation_id) id: vec3u) {
    if any(id.xy >= frame.size) { return; }
    let px = id.xy;
    let both = textureLoad(motion_here, px, 0);
    let at = vec2f(id.xy) + 0.5 + select(both.xy, both.zw, side.next == 1u);
    let landing = inside(vec2i(floor(at)));
    let z = valid_depth(textureLoad(depth_here, px, 0).x);
    let z_there = valid_depth(textureLoad(depth_there, landing, 0).x);
    let here = valid_light(textureLoad(light_here, px, 0));
    let there = valid_light(textureLoad(light_there, landing, 0));
    let is_there = all(at >= vec2f(0.0)) && all(at < vec2f(frame.size));
    if differs(here, there) && is_there && is_as_deep_there(z, z_there) { atomicOr(&found.tiles[light_tile(id.xy)], MAY_CHANGE); }
}
