// Motion of a small level at a pixel of a larger one: that of the likest of the nine small pixels around it.
//#include flow/dense/sampling.wgsl

@group(1) @binding(2) var small: texture_2d_array<f32>;     // stored as r32float; the small level

const NEAR: i32 = 3;            // small pixels a side that are compared
const AWAY: f32 = 1.5;          // levels of 255 that a small pixel of distance counts

/// The small pixel whose motion a pixel of the larger level takes.
fn likest(px: vec2i, many: vec2f) -> vec2i {
    let few = vec2f(textureDimensions(small));
    let at = (vec2f(px) + 0.5) * few / many - 0.5;
    let middle = vec2i(round(at));
    let own = grey(px, turn.here);
    var found = middle;
    var least = 1000000.0;
    for (var k = 0; k < NEAR * NEAR; k++) {
        // The middle one first, then the others: of those that are as like, the first is taken.
        let n = (k + NEAR * NEAR / 2) % (NEAR * NEAR);
        let near = middle + vec2i(n % NEAR, n / NEAR) - 1;
        let inner = clamp(near, vec2i(0), vec2i(few) - 1);
        let apart = abs(textureLoad(small, inner, turn.here, 0).x - own) + AWAY * distance(vec2f(near), at);
        found = select(found, inner, apart < least);
        least = min(least, apart);
    }
    return found;
}
