// Frame blending (the accumulation buffer of Haeberli and Akeley 1990): the mean of whole images at sub-frame times.
//#include common/frame.wgsl

@group(1) @binding(0) var color: texture_2d<f32>;                   // one more image
@group(1) @binding(1) var<storage, read_write> sums: array<vec4f>;  // of the images so far
@group(1) @binding(2) var<uniform> progress: Progress;
@group(1) @binding(3) var output: Output;

struct Progress {
    done: u32,          // images in `sums`; 0 starts anew
}

@compute @workgroup_size(WG_X, WG_Y)
fn main(@builtin(global_invocation_id) id: vec3u) {
    if any(id.xy >= frame.size) { return; }
    let at = id.y * frame.size.x + id.x;
    var sum = textureLoad(color, id.xy, 0);
    if progress.done > 0u { sum += sums[at]; }
    sums[at] = sum;
    textureStore(output, id.xy, sum / f32(progress.done + 1u));
}
