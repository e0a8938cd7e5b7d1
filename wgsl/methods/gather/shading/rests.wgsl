// Surfaces that rest: nothing but light changes their colours.

override RESTING: bool = false;     // light is the picture itself, on static surfaces alone: see light_inputs.py

const RESTS: f32 = 0.05;        // motion below which a surface rests: its texture stays where it is [px]
const DARK: f32 = 0.02;         // light that is dark [linear]: changes are those of the logarithm of light and this

/// True if a surface of this motion to both neighbours [px] rests.
fn rests(both: vec4f) -> bool {
    return all(abs(both) < vec4f(RESTS));
}
