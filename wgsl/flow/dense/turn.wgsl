// Which layers of the pyramid hold a picture and its neighbours. Every layer of a level holds one picture: display
// values without colour, in levels of 0 to 255.

struct Turn {
    here: u32,
    prev: u32,          // `here` where it lacks
    next: u32,          // the same
    unused: u32,
    there: vec2f,       // 1: there is a previous, a next picture; 0: it lacks
}

// Of pixels of the small level:
const TRIED: f32 = 1.0;         // ways of blocks were tried there
const OTHERWISE: f32 = 2.0;     // a way was taken that is another motion than the one before

@group(1) @binding(0) var<uniform> turn: Turn;

/// The layer of a neighbour: 0 the previous, 1 the next.
fn layer_of(side: u32) -> u32 {
    return select(turn.prev, turn.next, side == 1u);
}

/// Motion to_prev, to_next of which a side that lacks goes on as on the other.
fn both_ways(motion: vec4f) -> vec4f {
    return vec4f(select(-motion.zw, motion.xy, turn.there.x > 0.0), select(-motion.xy, motion.zw, turn.there.y > 0.0));
}
