// Pictures of moving light, each level half as large as the one before: with their gradients, and for reading between pixels.
//#include common/frame.wgsl
//#include methods/gather/shading/light.wgsl
//#include methods/gather/shading/listed.wgsl
//#include methods/gather/shading/resting.wgsl

@group(1) @binding(0) var source: texture_2d<f32>;      // stored as rgba16float: values, or the finer level
@group(1) @binding(1) var level: Level;                 // brightness, of shadows less 1; its change a pixel across, down
@group(1) @binding(2) var squares: Level;               // brightness of 2 x 2 pixels from each one on: its own, right, below, both

alias Level = texture_storage_2d<rgba16float, write>;

const FINE: u32 = 4u;           // level up to which a pixel and those beside it are in one tile and those beside it
const CONTRAST: f32 = 0.2;      // of a logarithm of light

@compute @workgroup_size(WG_X, WG_Y)
fn begin(@builtin(local_invocation_index) local: u32, @builtin(workgroup_id) group: vec3u) {
    let id = listed_pixel(group, local);
    if any(id >= frame.size) { return; }
    let px = vec2i(id);
    let own = brightness(px);
    let right = brightness(px + vec2i(1, 0));
    let below = brightness(px + vec2i(0, 1));
    let across = right - brightness(px - vec2i(1, 0));
    let down = below - brightness(px - vec2i(0, 1));
    textureStore(level, px, vec4f(own, 0.5 * across, 0.5 * down, 0.0));
    textureStore(squares, px, vec4f(own, right, below, brightness(px + 1)));
}

@compute @workgroup_size(WG_X, WG_Y)
fn halve(@builtin(global_invocation_id) id: vec3u) {
    let px = vec2i(id.xy);
    let size = (textureDimensions(source) + 1u) / 2u;
    if any(id.xy >= size) { return; }
    if !PULLED && level_of(size) <= FINE && is_black_around(in_frame(id.xy, size)) {
        textureStore(level, px, vec4f(0.0));
        textureStore(squares, px, vec4f(0.0));
        return;
    }
    let own = quarter(px);
    let right = quarter(px + vec2i(1, 0));
    let below = quarter(px + vec2i(0, 1));
    let across = right - quarter(px - vec2i(1, 0));
    let down = below - quarter(px - vec2i(0, 1));
    textureStore(level, px, vec4f(own, 0.5 * across, 0.5 * down, 0.0));
    textureStore(squares, px, vec4f(own, right, below, quarter(px + 1)));
}

fn brightness(px: vec2i) -> f32 {
    let near = clamp(px, vec2i(0), vec2i(textureDimensions(source)) - 1);
    let value = textureLoad(source, near, 0);
    return select(exp(-value.a) - 1.0, CONTRAST * dot(value.rgb, LUMINANCE), PULLED);
}

/// The mean of 2 x 2 pixels of the finer level.
fn quarter(px: vec2i) -> f32 {
    let last = vec2i(textureDimensions(source)) - 1;
    let a = clamp(2 * px, vec2i(0), last);
    let b = min(a + 1, last);
    let right = vec2i(b.x, a.y);
    let below = vec2i(a.x, b.y);
    return 0.25 * (textureLoad(source, a, 0).x + textureLoad(source, right, 0).x
        + textureLoad(source, below, 0).x + textureLoad(source, b, 0).x);
}
