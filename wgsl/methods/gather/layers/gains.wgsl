// The gain of a pixel whose light is made that of another frame, in one word, from relight.wgsl.

const MOST_DARKER: f32 = -2.0794415;    // logarithm of an eighth
const MOST_BRIGHTER: f32 = 1.3862944;   // of four
const GAIN_STEPS: f32 = 1023.0;         // between them, of each colour: 0.3 %
const GAIN_BITS: u32 = 10u;
const HAS_GAIN: u32 = 0x80000000u;      // 0: a gain of 1

const WANTS_GAIN: u32 = 1u;             // of a pixel whose gain is not found yet

/// The nearest to the logarithms of the gains of red, green and blue; 0 where all are 0.
fn pack_gain(gain: vec3f) -> u32 {
    let share = (gain - MOST_DARKER) / (MOST_BRIGHTER - MOST_DARKER);
    let steps = vec3u(round(clamp(share, vec3f(0.0), vec3f(1.0)) * GAIN_STEPS));
    let word = HAS_GAIN | steps.x | (steps.y << GAIN_BITS) | (steps.z << (2u * GAIN_BITS));
    return select(word, 0u, all(gain == vec3f(0.0)));
}

/// The colour, which may be premultiplied, with a gain as pack_gain() gave it.
fn relit_color(color: vec4f, gain: u32) -> vec4f {
    let steps = vec3u(gain, gain >> GAIN_BITS, gain >> (2u * GAIN_BITS)) & vec3u(u32(GAIN_STEPS));
    let factor = exp(mix(vec3f(MOST_DARKER), vec3f(MOST_BRIGHTER), vec3f(steps) / GAIN_STEPS));
    return vec4f(color.rgb * select(vec3f(1.0), factor, gain != 0u), color.a);
}
