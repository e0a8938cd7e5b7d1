// One plane of samples -> its bytes, rounded; several to a word.
//#include common/frame.wgsl

struct Plane {
    size: vec2u,        // width, height [samples]
    step: vec2u,        // columns, rows of pixels to one sample
    words: u32,         // of a row
    first: u32,         // word of the plane
    most: f32,          // greatest sample
}

@group(1) @binding(0) var<uniform> plane: Plane;
@group(1) @binding(1) var samples: texture_2d<f32>;
@group(1) @binding(2) var<storage, read_write> packed: array<u32>;

override COMPONENT: u32 = 0u;       // of the samples
override BITS: u32 = 8u;            // 8 or 16: of a sample in the words

@compute @workgroup_size(WG_X, WG_Y)
fn main(@builtin(global_invocation_id) id: vec3u) {
    if any(id.xy >= vec2u(plane.words, plane.size.y)) { return; }
    let each = 32u / BITS;
    var word = 0u;
    for (var i = 0u; i < each; i++) {
        let at = min(vec2u(id.x * each + i, id.y), plane.size - 1u);
        word |= u32(clamp(floor(mean(at) + 0.5), 0.0, plane.most)) << (BITS * i);
    }
    packed[plane.first + id.y * plane.words + id.x] = word;
}

/// Mean over the pixels that a sample stands for.
fn mean(at: vec2u) -> f32 {
    let last = textureDimensions(samples) - 1u;
    var sum = 0.0;
    for (var y = 0u; y < plane.step.y; y++) {
        for (var x = 0u; x < plane.step.x; x++) {
            sum += textureLoad(samples, min(at * plane.step + vec2u(x, y), last), 0)[COMPONENT];
        }
    }
    return sum / f32(plane.step.x * plane.step.y);
}
