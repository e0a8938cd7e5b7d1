// Second differences of the frame's own colours, for cubic interpolation: see resampled() of the resolve.
//#include common/frame.wgsl
//#include common/path.wgsl
//#include methods/gather/worklist.wgsl
//#include methods/gather/surface.wgsl

@group(1) @binding(0) var color: texture_2d<f32>;       // stored as given: premultiplied by alpha and weight
@group(1) @binding(1) var front_surface: texture_2d<u32>;   // stored as rgba32uint: see pack_surface()
@group(1) @binding(2) var second_differences: Differences;  // across, down, in half floats; 0 where not smooth
@group(1) @binding(3) var<storage, read> worklist: WorkList;

const MOST_SLOPE: f32 = 4.0;    // from a texel to the next, as a multiple of the lesser of the two: splines stay over 0 beside a lamp

alias Differences = texture_storage_2d<rgba32uint, write>;

fn color_at(px: vec2i) -> vec4f {
    let at = inside(px);
    return textureLoad(color, at, 0);
}

@compute @workgroup_size(CELL_TILES * TILE, STRIP_HEIGHT)
fn main(@builtin(local_invocation_index) local: u32, @builtin(workgroup_id) group: vec3u) {
    let k = worklist_index(group);
    let px = vec2i(pixel_in_strip(worklist.cells[k], group, local));
    if k >= worklist.count || any(px >= vec2i(frame.size)) { return; }
    let wanted = is_smooth(textureLoad(front_surface, px, 0));
    let here = color_at(px);
    let across = slope(here, color_at(px + vec2i(1, 0))) - slope(color_at(px - vec2i(1, 0)), here);
    let down = slope(here, color_at(px + vec2i(0, 1))) - slope(color_at(px - vec2i(0, 1)), here);
    textureStore(second_differences, px, vec4u(
        pack_halves(across.xy), pack_halves(across.zw), pack_halves(down.xy), pack_halves(down.zw)) * u32(wanted));
}

/// From one texel to the next. It is limited, because splines swing far below 0 beside a lamp; and it is the slopes that are,
/// not what is interpolated, so that what one texel gains the other loses: no light is made.
fn slope(a: vec4f, b: vec4f) -> vec4f {
    let most = MOST_SLOPE * min(abs(a), abs(b));
    return clamp(b - a, -most, most);
}
