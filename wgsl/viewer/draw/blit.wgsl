// Copies the composed image to the window, texel by texel.

@group(0) @binding(0) var picture: texture_2d<f32>;

@vertex
fn corner(@builtin(vertex_index) i: u32) -> @builtin(position) vec4f {
    return vec4f(vec2f(vec2u(i << 1u, i) & vec2u(2u)) * 2.0 - 1.0, 0.0, 1.0);
}

@fragment
fn texel(@builtin(position) at: vec4f) -> @location(0) vec4f {
    return textureLoad(picture, vec2u(at.xy), 0);
}
