// Transfer functions of videos (ITU-T H.273), both ways. Light of 1 is the white of text and paper; values below 0
// and above 1 go through, so that what is stored comes back as it was.

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

// The same for samples of 8 bits: off by at most 2.2e-5 of a signal of 1, which is a two-hundredth of a sample.
override PRECISE: bool = true;

/// Light of a signal of 0.04 to SRGB_MOST.
fn light_of_bright_byte(x: vec3f) -> vec3f {
    var p = fma(vec3f(-0.004586602), x, vec3f(0.04286516));
    p = fma(p, x, vec3f(-0.1685618));
    p = fma(p, x, vec3f(0.37098163));
    p = fma(p, x, vec3f(-0.53734964));
    p = fma(p, x, vec3f(0.75998694));
    p = fma(p, x, vec3f(0.50155807));
    p = fma(p, x, vec3f(0.034178454));
    return fma(p, x, vec3f(0.0008803853));
}

/// Signal of light of 0.0031 to 6.6.
fn byte_of_bright(x: vec3f) -> vec3f {
    let q = sqrt(sqrt(x));
    var p = fma(vec3f(0.015470728), q, vec3f(-0.1055406));
    p = fma(p, q, vec3f(0.31246793));
    p = fma(p, q, vec3f(-0.5684992));
    p = fma(p, q, vec3f(1.2408011));
    p = fma(p, q, vec3f(0.16720834));
    return fma(p, q, vec3f(-0.061921466));
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
        default: {
            let within = min(x, vec3f(SRGB_MOST));
            var bright = vec3f();
            if PRECISE {
                bright = power_2_4(fma(within, vec3f(1.0 / 1.055), vec3f(0.055 / 1.055)));
            } else {
                bright = light_of_bright_byte(within);
            }
            light = select(bright, x * (1.0 / 12.92), x <= vec3f(0.04045));
        }
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
        default: {
            let within = clamp(x, vec3f(0.0031308), vec3f(6.6));
            var bright = vec3f();
            if PRECISE { bright = srgb_of_bright(within); } else { bright = byte_of_bright(within); }
            signal = select(bright, 12.92 * x, x <= vec3f(0.0031308));
        }
    }
    return select(-signal, signal, light >= vec3f(0.0));
}
