// Motion of every pixel of a level: the mean of the patches that cover it or are beside these,
// weighted by how near each is, and how well it matches there.
//#include common/frame.wgsl
//#include flow/dense/sampling.wgsl
//#include flow/dense/grid.wgsl

@group(1) @binding(2) var patches: texture_2d<f32>;     // stored as rgba32float
@group(1) @binding(3) var output: texture_storage_2d<rgba32float, write>;   // to_prev, to_next [px]

const SIDE: i32 = 4;            // patches a side whose ways count
const FALLOFF: f32 = 0.03125;   // of the weight with the squared distance from a patch's middle [1 / px^2]
const LEAST_APART: f32 = 1.0;   // difference [levels of 255] below which all count alike

@compute @workgroup_size(WG_X, WG_Y)
fn main(@builtin(global_invocation_id) id: vec3u) {
    if any(id.xy >= frame.size) { return; }
    let px = vec2i(id.xy);
    textureStore(output, px, both_ways(vec4f(mean_way(px, 0u), mean_way(px, 1u))));
}

fn mean_way(px: vec2i, side: u32) -> vec2f {
    let own = grey(px, turn.here);
    let layer = layer_of(side);
    var sum = vec2f(0.0);
    var total = 0.0;
    for (var k = 0; k < SIDE * SIDE; k++) {
        let number = clamp(px / STRIDE + vec2i(k % SIDE, k / SIDE) - 1, vec2i(0), patches_of(frame.size) - 1);
        let at = patch_place(number, side, frame.size);
        let way = textureLoad(patches, at, 0).xy;
        let off = vec2f(number * STRIDE - px) - 0.5;
        let apart = max(abs(grey_between(vec2f(px) + way, layer) - own), LEAST_APART);
        let weight = exp(-FALLOFF * dot(off, off)) / apart;
        sum += weight * way;
        total += weight;
    }
    return sum / total;
}
