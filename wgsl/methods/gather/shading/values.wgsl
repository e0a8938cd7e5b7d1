// Values that move over the surfaces of this frame, in one of the three frames. Shadows: the darkness, the missing part
// of the light; reflections: the logarithm of the light. a: the weight.
//#include common/frame.wgsl
//#include methods/gather/shading/light.wgsl
//#include methods/gather/shading/listed.wgsl

@group(1) @binding(0) var light_here: texture_2d<f32>;  // stored as given
@group(1) @binding(1) var before: texture_2d<f32>;      // stored as rgba16float: changes to the previous frame, to the next one
@group(1) @binding(2) var after: texture_2d<f32>;       // stored as rgba16float
@group(1) @binding(3) var closed: texture_2d<f32>;      // output of closing.wgsl
@group(1) @binding(4) var own: texture_2d<f32>;         // changes to the frame that is asked for; black: this one
@group(1) @binding(5) var values: Values;

alias Values = texture_storage_2d<rgba16float, write>;

@compute @workgroup_size(WG_X, WG_Y)
fn main(@builtin(local_invocation_index) local: u32, @builtin(workgroup_id) group: vec3u) {
    let id = listed_pixel(group, local);
    if any(id >= frame.size) { return; }
    let px = vec2i(id);
    let level = log(valid_light(textureLoad(light_here, px, 0)) + dark());
    let a = textureLoad(before, px, 0).rgb;
    let b = textureLoad(after, px, 0).rgb;
    let change = textureLoad(own, px % vec2i(textureDimensions(own)), 0).rgb;
    let most = max(vec3f(0.0), max(a, b));
    if PULLED {
        let median = a + b - most - min(vec3f(0.0), min(a, b));
        let apart = abs(median - change);
        textureStore(values, px, vec4f(level + change, max(apart.r, max(apart.g, apart.b))));
        return;
    }
    var brightest = most;
    if !RESTING {   // there, brighter pixels around are another texture
        brightest = max(most, textureLoad(closed, px, 0).rgb - level);
    }
    let darkness = 1.0 - exp(change - brightest);
    textureStore(values, px, vec4f(darkness, max(dot(darkness, LUMINANCE), 0.0)));
}
