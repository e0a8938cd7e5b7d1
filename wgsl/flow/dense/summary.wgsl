// Results of passes over the small level: how often each value occurs, the motion of most of the picture, and which blocks
// are searched.

struct Most {           // affine motion to a neighbour [px], of places as centred() gives them: columns
    x: vec3f,
    y: vec3f,
    same: vec3f,        // the motion in the middle
    median: vec4f,      // of the motion [px], in its first two parts
}

struct Summary {
    most: array<Most, 2>,       // to the previous picture, to the next one
    noise: array<f32, 2>,       // change that is taken for noise [levels of 255]; both are the same
}

/// A pixel's place from the middle of a picture, in halves of its longer side; and 1.
fn centred(px: vec2f, size: vec2f) -> vec3f {
    return vec3f((px + 0.5 - 0.5 * size) / (0.5 * max(size.x, size.y)), 1.0);
}

/// The motion of most of the picture [px of the small level] at a place that centred() gives.
fn dominant_at(most: Most, place: vec3f) -> vec2f {
    return (most.x * place.x + most.y * place.y + most.same * place.z).xy;
}

// Tables of counts, one after the other:
const BINS: u32 = 512u;             // of a table
const CHANGES: u32 = 0u;            // tables: of changes,
const PREV_X: u32 = 1u;             // of the four parts of the motion, of which 0 is in the middle
const TABLES: u32 = 5u;
const BINS_PER_LEVEL: f32 = 4.0;    // of 255, of changes
const BINS_PER_PIXEL: f32 = 4.0;    // of motion

/// The place of a value in a table; values beyond its ends count there.
fn bin(table: u32, value: f32) -> u32 {
    return table * BINS + u32(clamp(value, 0.0, f32(BINS) - 1.0));
}

struct List {
    blocks: array<u32, MOST_BLOCKS>,    // number of each in the grid, in no order
}

const MOST_BLOCKS: u32 = 1600u; // a small picture of 160 x 160 px has so many
const BLOCK: i32 = 8;           // [px]
const SPACING: i32 = 4;         // from one block to the next [px]

fn corner_of(cell: vec2i) -> vec2i {
    return cell * SPACING + (SPACING - BLOCK) / 2;
}
