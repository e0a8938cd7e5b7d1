// One pass of a separable Gaussian, 1 2 1 over 4, along rows or columns; edge pixels repeat.
//#include common/frame.wgsl

@group(1) @binding(0) var image: texture_2d<f32>;
@group(1) @binding(1) var linear: sampler;
@group(1) @binding(2) var output: Output;

override DOWN: bool = false;        // along columns

@compute @workgroup_size(WG_X, WG_Y)
fn main(@builtin(global_invocation_id) id: vec3u) {
    if any(id.xy >= frame.size) { return; }
    let x = vec2f(id.xy) + 0.5;
    let half = select(vec2f(0.5, 0.0), vec2f(0.0, 0.5), DOWN);  // halfway between two texels both weigh the same
    let texel = 1.0 / vec2f(frame.size);
    let before = textureSampleLevel(image, linear, (x - half) * texel, 0.0);
    let after = textureSampleLevel(image, linear, (x + half) * texel, 0.0);
    textureStore(output, id.xy, 0.5 * before + 0.5 * after);
}
