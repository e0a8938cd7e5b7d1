// Transfer functions of videos (ITU-T H.273), both ways. Light of 1 is the white of text and paper; values below 0
// and above 1 go through, so that stored values come back unchanged.

const CURVE_SRGB: u32 = 13u;    // also of BT.709, BT.601 and BT.2020: pictures are graded on displays about like it
const CURVE_GAMMA22: u32 = 4u;
const CURVE_GAMMA28: u32 = 5u;
const CURVE_LINEAR: u32 = 8u;
const CURVE_PQ: u32 = 16u;      // SMPTE ST 2084
const CURVE_HLG: u32 = 18u;     // ITU-R BT.2100: light of the scene

override CURVE: u32 = CURVE_SRGB;

// BT.2100, tables 4 and 5.
const PQ_M1: f32 = 0.1593017578125;
const PQ_M2: f32 = 78.84375;
const PQ_C1: f32 = 0.8359375;
const PQ_C2: f32 = 18.8515625;
const PQ_C3: f32 = 18.6875;
const HLG_A: f32 = 0.17883277;
const HLG_B: f32 = 0.28466892;
const HLG_C: f32 = 0.55991073;
// White of text and paper (ITU-R BT.2408): 203 of PQ's 10,000 cd/m2, and 75 % of HLG's signal.
const PQ_WHITE: f32 = 0.0203;
const HLG_WHITE: f32 = 0.26496256;

// The powers of sRGB as polynomials, as lavapipe takes ten times as long for a power: of square roots, in which they
// are smooth. Off by at most 4e-7 up to a signal of 1, and 2e-6 up to SRGB_MOST, beyond all that YCbCr can hold.
const SRGB_MOST: f32 = 2.26;

/// t^2.4 of t = 0.09 to 2.2.
fn power_2_4(t: vec3f) -> vec3f {
    let s = sqrt(t);
    var p = fma(vec3f(0.0050850119), s, vec3f(-0.056260407));
    p = fma(p, s, vec3f(0.84298944));
    p = fma(p, s, vec3f(0.2813772));
    p = fma(p, s, vec3f(-0.09608822));
    p = fma(p, s, vec3f(0.027230183));
    p = fma(p, s, vec3f(-0.0046870974));
    return fma(p, s, vec3f(0.0003538517));
}

/// 1.055 x^(1 / 2.4) - 0.055 of x = 0.0031 to 6.6.
fn srgb_of_bright(x: vec3f) -> vec3f {
    let q = sqrt(sqrt(x));
    var p = fma(vec3f(-0.009865669), q, vec3f(0.091328755));
    p = fma(p, q, vec3f(-0.37246656));
    p = fma(p, q, vec3f(0.8847937));
    p = fma(p, q, vec3f(-1.3702497));
    p = fma(p, q, vec3f(1.4873199));
    p = fma(p, q, vec3f(-1.2569497));
    p = fma(p, q, vec3f(1.4833983));
    p = fma(p, q, vec3f(0.12101359));
    return fma(p, q, vec3f(-0.05832279));
}

// The same for samples of 8 bits: an average is off by at most 6e-5 of a signal up to 1.1, a sixtieth of a sample, and by
// 0.0018 up to SRGB_MOST. Signals are counted in units of SHORT_UNIT there, so that near black they equal their light.
override PRECISE: bool = true;
const SHORT_UNIT: f32 = 12.92;

/// Light of a signal of 0.0031 to SRGB_MOST / SHORT_UNIT.
fn light_of_bright_byte(x: vec3f) -> vec3f {
    var p = fma(vec3f(-94042.156), x, vec3f(44726.004));
    p = fma(p, x, vec3f(-9052.7227));
    p = fma(p, x, vec3f(1436.6296));
    p = fma(p, x, vec3f(87.014854));
    p = fma(p, x, vec3f(0.41965029));
    return fma(p, x, vec3f(0.00092551421));
}

/// Signal of light of 0.0031 to 6.6.
fn byte_of_bright(x: vec3f) -> vec3f {
    let q = sqrt(sqrt(x));
    var p = fma(vec3f(0.0016581981), q, vec3f(-0.010486971));
    p = fma(p, q, vec3f(0.028738217));
    p = fma(p, q, vec3f(-0.048434056));
    p = fma(p, q, vec3f(0.098274566));
    p = fma(p, q, vec3f(0.012390314));
    return fma(p, q, vec3f(-0.0047409497));
}

/// Signals that light_of() takes and signal_of() gives are counted in this.
fn signal_unit() -> f32 {
    return select(SHORT_UNIT, 1.0, PRECISE || CURVE != CURVE_SRGB);
}

/// Light of a signal on the curve of sRGB, whose line near black goes on below.
fn light_of_srgb(signal: vec3f) -> vec3f {
    if !PRECISE { return select(light_of_bright_byte(signal), signal, signal <= vec3f(0.0031308)); }
    let within = clamp(signal, vec3f(0.04045), vec3f(SRGB_MOST));
    let bright = power_2_4(fma(within, vec3f(1.0 / 1.055), vec3f(0.055 / 1.055)));
    return select(bright, signal * (1.0 / 12.92), signal <= vec3f(0.04045));
}

/// Signal of light on the same.
fn srgb_of_light(light: vec3f) -> vec3f {
    let within = max(light, vec3f(0.0031308));
    if !PRECISE { return select(byte_of_bright(within), light, light <= vec3f(0.0031308)); }
    return select(srgb_of_bright(min(within, vec3f(6.6))), 12.92 * light, light <= vec3f(0.0031308));
}

/// Light of a signal.
fn light_of(signal: vec3f) -> vec3f {
    let x = abs(signal);
    var light = x;
    switch CURVE {
        case CURVE_GAMMA22: { light = pow(x, vec3f(2.2)); }
        case CURVE_GAMMA28: { light = pow(x, vec3f(2.8)); }
        case CURVE_LINEAR: {}
        case CURVE_PQ: {
            let root = pow(min(x, vec3f(1.0)), vec3f(1.0 / PQ_M2));
            light = pow(max(root - PQ_C1, vec3f(0.0)) / (PQ_C2 - PQ_C3 * root), vec3f(1.0 / PQ_M1)) / PQ_WHITE;
        }
        case CURVE_HLG: {
            let high = (exp((x - HLG_C) / HLG_A) + HLG_B) / 12.0;
            light = select(high, x * x / 3.0, x <= vec3f(0.5)) / HLG_WHITE;
        }
        default: { return light_of_srgb(signal); }
    }
    return select(-light, light, signal >= vec3f(0.0));
}

/// Signal of light.
fn signal_of(light: vec3f) -> vec3f {
    let x = abs(light);
    var signal = x;
    switch CURVE {
        case CURVE_GAMMA22: { signal = pow(x, vec3f(1.0 / 2.2)); }
        case CURVE_GAMMA28: { signal = pow(x, vec3f(1.0 / 2.8)); }
        case CURVE_LINEAR: {}
        case CURVE_PQ: {
            let power = pow(x * PQ_WHITE, vec3f(PQ_M1));
            signal = pow((PQ_C1 + PQ_C2 * power) / (1.0 + PQ_C3 * power), vec3f(PQ_M2));
        }
        case CURVE_HLG: {
            let y = x * HLG_WHITE;
            let high = HLG_A * log(max(12.0 * y - HLG_B, vec3f(1e-6))) + HLG_C;
            signal = select(high, sqrt(3.0 * y), y <= vec3f(1.0 / 12.0));
        }
        default: { return srgb_of_light(light); }
    }
    return select(-signal, signal, light >= vec3f(0.0));
}
