// What counts as "no depth": one value that every pass reads, writes and compares.
//#include common/finite.wgsl

// Depth of a pixel in which nothing was hit. A power of two: its last bits are 0, so that flags may be packed
// there, and scaling by it loses no bits. Files hold other values (Blender writes 1e10, others infinity).
const NO_DEPTH: f32 = 8589934592.0;

const SURFACE_DEPTH_RATIO: f32 = 1.05;  // of the depths of two samples from which on they are of different surfaces

/// The depth of a pixel as it was given, which may be anything: from 0 to NO_DEPTH, and NO_DEPTH where none is valid.
fn valid_depth(z: f32) -> f32 {
    return select(NO_DEPTH, min(z, NO_DEPTH), is_finite(z) && z > 0.0);
}
