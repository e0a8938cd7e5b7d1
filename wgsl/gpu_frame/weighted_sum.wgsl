// The response of an observer's cone cells to the last frames: their weighted sum, eight frames per pass.
//#include common/frame.wgsl
//#include common/finite.wgsl

@group(1) @binding(0) var picture0: texture_2d<f32>;
@group(1) @binding(1) var picture1: texture_2d<f32>;
@group(1) @binding(2) var picture2: texture_2d<f32>;
@group(1) @binding(3) var picture3: texture_2d<f32>;
@group(1) @binding(4) var picture4: texture_2d<f32>;
@group(1) @binding(5) var picture5: texture_2d<f32>;
@group(1) @binding(6) var picture6: texture_2d<f32>;
@group(1) @binding(7) var picture7: texture_2d<f32>;
@group(1) @binding(8) var<uniform> share: Share;
@group(1) @binding(9) var<storage, read_write> sums: array<vec4f>;
@group(1) @binding(10) var output: Output;

// Not a uniform: lavapipe would compile the shader anew at every dispatch, and keep it (wgsl.md).
override FIRST: bool = true;    // `sums` is empty

struct Share {
    weights: array<vec4f, 2>,   // of the eight frames
}

@compute @workgroup_size(WG_X, WG_Y)
fn main(@builtin(global_invocation_id) id: vec3u) {
    if any(id.xy >= frame.size) { return; }
    let at = id.y * frame.size.x + id.x;
    let a = share.weights[0];
    let b = share.weights[1];
    var sum = vec4f(0.0);
    if !FIRST { sum = sums[at]; }
    sum += a.x * finite_or_black(textureLoad(picture0, id.xy, 0)) + a.y * finite_or_black(textureLoad(picture1, id.xy, 0));
    sum += a.z * finite_or_black(textureLoad(picture2, id.xy, 0)) + a.w * finite_or_black(textureLoad(picture3, id.xy, 0));
    sum += b.x * finite_or_black(textureLoad(picture4, id.xy, 0)) + b.y * finite_or_black(textureLoad(picture5, id.xy, 0));
    sum += b.z * finite_or_black(textureLoad(picture6, id.xy, 0)) + b.w * finite_or_black(textureLoad(picture7, id.xy, 0));
    sums[at] = sum;
    textureStore(output, id.xy, sum);
}
