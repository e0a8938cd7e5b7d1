// Meaning of the stored samples of a picture.

struct Code {
    x: vec4f,           // rows of a matrix and an offset: signals from samples to decode, samples from signals to encode
    y: vec4f,
    z: vec4f,
    alpha: f32,         // opacity of a sample, or the sample of full opacity
    step: vec2u,        // columns, rows of pixels to one sample of chroma
}

override ALPHA: bool = false;       // there is a plane of it: straight, not multiplied into the colour
