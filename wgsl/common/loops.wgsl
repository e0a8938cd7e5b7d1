// Loops whose number of turns the CPU chooses.

/// `turns`, but not told by uniforms alone: lavapipe would compile the shader anew at every dispatch, and keep it;
/// see wgsl.md. `other` is any number that no uniform tells and that is never ~0.
fn turns_of(turns: u32, other: u32) -> u32 {
    return select(turns, 0u, other == 0xffffffffu);
}
