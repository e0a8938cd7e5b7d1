// Where the patches of a level are: every pixel is in four of them.

const PATCH: i32 = 8;           // [px]
const STRIDE: i32 = 4;          // from one patch to the next [px]; the first begins outside of the picture

fn patches_of(size: vec2u) -> vec2i {
    return (vec2i(size) + STRIDE - 1) / STRIDE + 1;
}

/// Where the way of a patch to a neighbour is kept: those to the next picture below all those to the previous one.
fn patch_place(number: vec2i, side: u32, size: vec2u) -> vec2i {
    return number + vec2i(0, i32(side) * patches_of(size).y);
}
