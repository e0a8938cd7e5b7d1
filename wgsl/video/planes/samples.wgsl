// Linear light, premultiplied by alpha -> the samples that are stored, not rounded yet.
//#include common/finite.wgsl
//#include common/highlights.wgsl
//#include common/transfer.wgsl
//#include video/changing_light/changed.wgsl
//#include video/planes/code.wgsl

@group(1) @binding(0) var<uniform> code: Code;
@group(1) @binding(1) var light: texture_2d<f32>;       // stored as given

/// Three components and alpha of a pixel.
fn samples_at(px: vec2u) -> vec4f {
    let premultiplied = changed(finite_or_black(textureLoad(light, px, 0)), px);
    var color = premultiplied.xyz;
    if ALPHA { color = select(vec3f(0.0), color / premultiplied.w, premultiplied.w > 0.0); }
    let signal = vec4f(signal_of(compressed(color)), 1.0);
    return vec4f(dot(code.x, signal), dot(code.y, signal), dot(code.z, signal), code.alpha * premultiplied.w);
}
