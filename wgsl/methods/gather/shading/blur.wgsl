// A Gaussian, along one axis a pass.
//#include common/frame.wgsl
//#include methods/gather/shading/listed.wgsl
//#include methods/gather/shading/light.wgsl

@group(1) @binding(0) var source: texture_2d<f32>;        // stored as rgba32float
@group(1) @binding(1) var output: Blurred;

alias Blurred = texture_storage_2d<rgba32float, write>;

override SIGMA: f32 = 5.0;      // [px]

@compute @workgroup_size(WG_X, WG_Y)
fn across(@builtin(local_invocation_index) local: u32, @builtin(workgroup_id) group: vec3u) {
    let id = listed_pixel(group, local);
    if any(id >= frame.size) { return; }
    textureStore(output, id, mean(vec2i(id), vec2i(1, 0)));
}

@compute @workgroup_size(WG_X, WG_Y)
fn down(@builtin(local_invocation_index) local: u32, @builtin(workgroup_id) group: vec3u) {
    let id = listed_pixel(group, local);
    if any(id >= frame.size) { return; }
    textureStore(output, id, mean(vec2i(id), vec2i(0, 1)));
}

fn mean(px: vec2i, axis: vec2i) -> vec4f {
    let radius = i32(ceil(3.0 * SIGMA));
    // From one weight to the next: exp(-(k + 1)^2 / s) = exp(-k^2 / s) exp(-(2 k + 1) / s).
    let second = exp(-1.0 / (SIGMA * SIGMA));
    var ratio = exp(-0.5 / (SIGMA * SIGMA));
    var weight = 1.0;
    var sum = textureLoad(source, px, 0);
    var total = 1.0;
    for (var k = 1; k <= radius; k++) {
        weight *= ratio;
        ratio *= second;
        let ahead = inside(px + k * axis);
        let behind = inside(px - k * axis);
        sum += weight * (textureLoad(source, ahead, 0) + textureLoad(source, behind, 0));
        total += 2.0 * weight;
    }
    return sum / total;
}
