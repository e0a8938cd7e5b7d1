// How colours bend between pixels, for finer interpolation than linear: see resampled() of gather.wgsl.
//#include common/frame.wgsl
//#include common/path.wgsl
//#include blur/gather_listed.wgsl
//#include blur/gather_tile.wgsl

@group(1) @binding(0) var color: texture_2d<f32>;       // premultiplied by alpha and weight
@group(1) @binding(1) var near: texture_2d<u32>;        // see packed()
@group(1) @binding(2) var bends: Bends;                 // second differences, across, down; 0 where not calm
@group(1) @binding(3) var<storage, read> listed: Listed;    // the cells to work on

alias Bends = texture_storage_2d<rgba32uint, write>;

fn color_at(px: vec2i) -> vec4f {
    return textureLoad(color, clamp(px, vec2i(0), vec2i(frame.size) - 1), 0);
}

@compute @workgroup_size(CELL * TILE, STRIP)
fn main(@builtin(local_invocation_index) local: u32, @builtin(workgroup_id) group: vec3u) {
    let k = place_of(group);
    let px = vec2i(pixel_in(listed.cells[k], group, local));
    if k >= listed.count || any(px >= vec2i(frame.size)) { return; }
    let calm = is_calm(textureLoad(near, px, 0));
    let twice = 2.0 * color_at(px);
    let across = select(vec4f(0.0), color_at(px - vec2i(1, 0)) - twice + color_at(px + vec2i(1, 0)), calm);
    let down = select(vec4f(0.0), color_at(px - vec2i(0, 1)) - twice + color_at(px + vec2i(0, 1)), calm);
    textureStore(bends, px, vec4u(
        pack2x16float(across.xy), pack2x16float(across.zw), pack2x16float(down.xy), pack2x16float(down.zw)));
}
