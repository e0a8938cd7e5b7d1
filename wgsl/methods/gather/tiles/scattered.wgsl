// Scattered motions: for the frame and its neighbours, every slice of the exposure and every block of pixels a word that tells the
// nearest pixel that is in the block by then: its depth, and its place counted from the block's first pixel. 0: none; greater: nearer.
//#include common/frame.wgsl
//#include common/shutter.wgsl
//#include methods/gather/worklist.wgsl

const SLICES: u32 = 16u;            // of the exposure, at most: fewer if there are fewer samples, or no memory for more
const LEAST_SCATTERED: f32 = 1.0;   // motion of less per frame interval [px] needs no start of its own
const PLACE_BITS: u32 = 9u;         // of x and y each, as far as motions are followed
const HALF_PLACE: i32 = 256;        // [px]
const LOST_BITS: u32 = 17u;         // of a depth, which is known to 1/64 of itself
const DEPTH_NOISE: u32 = 256u;      // last places by which depths that are equal may differ

/// The slices in a buffer of so many words, for so many frames.
fn slice_count(words: u32, frames: u32) -> u32 {
    let blocks = tiles_of(frame.size) * (TILE / BLOCK);
    return words / (blocks.x * blocks.y * frames);
}

/// The middle of a slice [frame intervals].
fn slice_time(i: u32, slices: u32) -> f32 {
    let window = exposure_window(0.0);
    return mix(window.x, window.y, (f32(i) + 0.5) / f32(slices));
}

/// The slice in which the time `t` is; at a boundary the later one, so that rounding does not decide.
fn slice_at(t: f32, slices: u32) -> u32 {
    let window = exposure_window(0.0);
    let share = (t - window.x) / max(window.y - window.x, 1e-9);
    return min(u32(max(share, 0.0) * f32(slices) + 0.001), slices - 1u);
}

/// The place of a block's word in the buffer: of frame `f`, in a slice of so many.
fn scattered_index(f: u32, slice: u32, slices: u32, block: vec2u) -> u32 {
    let blocks = tiles_of(frame.size) * (TILE / BLOCK);
    return ((f * slices + slice) * blocks.y + block.y) * blocks.x + block.x;
}

/// The depth as far as it is known; depths that are equal but for rounding are the same.
fn known_depth(depth: f32) -> u32 {
    return (bitcast<u32>(depth) + DEPTH_NOISE) >> LOST_BITS;
}

/// The word of a pixel of that depth; 0 if it is too far from the block.
fn pack_scattered(px: vec2u, block: vec2u, depth: f32) -> u32 {
    let off = vec2i(px) - vec2i(block * BLOCK) + HALF_PLACE;
    let is_near = all(off >= vec2i(0)) && all(off < vec2i(2 * HALF_PLACE));
    let place = u32(off.x) | (u32(off.y) << PLACE_BITS);
    return select(0u, ~((known_depth(depth) << (2u * PLACE_BITS)) | place), is_near);
}

/// The pixel in a word that is not 0.
fn scattered_pixel(word: u32, block: vec2u) -> vec2i {
    let mask = (1u << PLACE_BITS) - 1u;
    return vec2i(vec2u(~word, ~word >> PLACE_BITS) & vec2u(mask)) - HALF_PLACE + vec2i(block * BLOCK);
}

/// Its depth, or a little less.
fn scattered_depth(word: u32) -> f32 {
    return bitcast<f32>((~word >> (2u * PLACE_BITS)) << LOST_BITS);
}
