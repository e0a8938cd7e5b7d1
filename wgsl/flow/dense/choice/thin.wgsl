// The motion of a larger picture in a pixel of this level: the mean of some pixels, evenly spaced.
//#include common/frame.wgsl

const MEANS: i32 = 3;           // pixels a side of which it is the mean

/// `motion`: of the larger picture [px of it]; result: [px of this level].
fn thin(motion: texture_2d<f32>, px: vec2i) -> vec4f {
    let factor = vec2f(textureDimensions(motion)) / vec2f(frame.size);
    var sum = vec4f(0.0);
    for (var k = 0; k < MEANS * MEANS; k++) {
        let part = (vec2f(vec2i(k % MEANS, k / MEANS)) + 0.5) / f32(MEANS);
        sum += textureLoad(motion, vec2i((vec2f(px) + part) * factor), 0);
    }
    return sum / f32(MEANS * MEANS) / factor.xyxy;
}
