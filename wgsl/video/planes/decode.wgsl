// Stored planes of a picture (Y, Cb, Cr; R, G, B; grey) -> linear light, premultiplied by alpha.
//#include common/frame.wgsl
//#include common/highlights.wgsl
//#include common/transfer.wgsl
//#include video/planes/code.wgsl

@group(1) @binding(0) var<uniform> code: Code;
@group(1) @binding(1) var plane0: texture_2d<u32>;
@group(1) @binding(2) var plane1: texture_2d<u32>;
@group(1) @binding(3) var plane2: texture_2d<u32>;
@group(1) @binding(4) var plane3: texture_2d<u32>;      // alpha
@group(1) @binding(5) var output: Output;

override GREY: bool = false;        // there is only plane0

@compute @workgroup_size(WG_X, WG_Y)
fn main(@builtin(global_invocation_id) id: vec3u) {
    if any(id.xy >= frame.size) { return; }
    var samples = vec3f(f32(textureLoad(plane0, id.xy, 0).x));
    if !GREY {
        // A sample of chroma stands for all its pixels, so that it comes back as it was.
        let at = id.xy / code.step;
        samples.y = f32(textureLoad(plane1, at, 0).x);
        samples.z = f32(textureLoad(plane2, at, 0).x);
    }
    let known = vec4f(samples, 1.0);
    let light = expanded(light_of(vec3f(dot(code.x, known), dot(code.y, known), dot(code.z, known))));
    var alpha = 1.0;
    if ALPHA { alpha = code.alpha * f32(textureLoad(plane3, id.xy, 0).x); }
    textureStore(output, id.xy, vec4f(light * alpha, alpha));
}
