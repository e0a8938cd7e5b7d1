// Linear light -> the bytes of all planes, several samples to a word, with nothing between. An invocation makes a word of
// either plane of chroma, and those of luma and alpha for the same pixels, so that every pixel is read once.
//#include common/frame.wgsl
//#include video/planes/samples.wgsl

struct Planes {
    places: array<vec4u, 4>,    // of a component's plane: words of a row, rows, first word; no rows: there is none
    most: f32,                  // greatest sample
}

@group(1) @binding(2) var<uniform> planes: Planes;
@group(1) @binding(3) var<storage, read_write> packed: array<u32>;

override STEP_X: u32 = 2u;      // columns, rows of pixels to one sample of chroma
override STEP_Y: u32 = 2u;
override BITS: u32 = 8u;        // 8 or 16: of a sample in a word
const MOST_ROWS: u32 = 4u;      // of pixels to one sample of chroma

@compute @workgroup_size(WG_X, WG_Y)
fn main(@builtin(global_invocation_id) id: vec3u) {
    let each = 32u / BITS;
    let last = textureDimensions(light) - 1u;
    let first = id.xy * vec2u(each * STEP_X, STEP_Y);
    var chroma = vec2u(0u);
    var luma = array<u32, MOST_ROWS>();
    var alpha = array<u32, MOST_ROWS>();
    for (var i = 0u; i < each; i++) {
        var sum = vec2f(0.0);
        for (var y = 0u; y < STEP_Y; y++) {
            for (var x = 0u; x < STEP_X; x++) {
                let column = i * STEP_X + x;
                let samples = samples_at(min(first + vec2u(column, y), last));
                sum += samples.yz;
                let shift = BITS * (column % each);
                luma[y] |= rounded(samples.x) << shift;
                if ALPHA { alpha[y] |= rounded(samples.w) << shift; }
                if column % each == each - 1u {
                    let word = vec2u(id.x * STEP_X + column / each, first.y + y);
                    put(0u, word, luma[y]);
                    luma[y] = 0u;
                    if ALPHA {
                        put(3u, word, alpha[y]);
                        alpha[y] = 0u;
                    }
                }
            }
        }
        let mean = sum / f32(STEP_X * STEP_Y);
        chroma |= vec2u(rounded(mean.x), rounded(mean.y)) << vec2u(BITS * i);
    }
    put(1u, id.xy, chroma.x);
    put(2u, id.xy, chroma.y);
}

fn rounded(sample: f32) -> u32 {
    return u32(clamp(floor(sample + 0.5), 0.0, planes.most));
}

/// A word of a plane, unless it is outside.
fn put(component: u32, word: vec2u, bits: u32) {
    let place = planes.places[component];
    if all(word < place.xy) { packed[place.z + word.y * place.x + word.x] = bits; }
}
