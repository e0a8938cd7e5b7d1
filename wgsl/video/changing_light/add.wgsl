// The changes of light, of small pixels, added to a picture.
//#include common/frame.wgsl

override STEP: u32 = 4u;

@group(1) @binding(0) var picture: texture_2d<f32>;                 // linear, premultiplied alpha
@group(1) @binding(1) var<storage, read> changes: array<vec4f>;     // as change.wgsl leaves them
@group(1) @binding(2) var output: Output;

@compute @workgroup_size(WG_X, WG_Y)
fn main(@builtin(global_invocation_id) id: vec3u) {
    if any(id.xy >= frame.size) { return; }
    let size = (frame.size + STEP - 1u) / STEP;
    let last = size - 1u;
    let at = clamp((vec2f(id.xy) + 0.5) / f32(STEP) - 0.5, vec2f(0.0), vec2f(last));
    let a = vec2u(at);
    let b = min(a + 1u, last);
    let t = fract(at);
    let top = mix(changes[a.y * size.x + a.x].xyz, changes[a.y * size.x + b.x].xyz, t.x);
    let low = mix(changes[b.y * size.x + a.x].xyz, changes[b.y * size.x + b.x].xyz, t.x);
    let own = textureLoad(picture, id.xy, 0);
    let changed = own.rgb + own.a * mix(top, low, t.y);
    textureStore(output, id.xy, vec4f(max(changed, min(own.rgb, vec3f(0.0))), own.a));
}
