// How well a square of pixels matches both neighbours along a motion.
//#include flow/dense/sampling.wgsl

struct Differences {    // means, in levels of 255
    better: f32,        // to the neighbour that fits better
    worse: f32,         // to the other one; 0 where it lacks
    mean: f32,          // to the mean of both; NOWHERE where one lacks
}

const MOST_APART: f32 = 40.0;   // levels of difference of a pixel that count
const NOWHERE: f32 = 1000000.0; // more than any difference

/// Of the square up to `radius` px around a pixel; `motion`: to_prev, to_next [px].
fn differences(px: vec2i, motion: vec4f, radius: i32) -> Differences {
    let side = 2 * radius + 1;
    var sum = vec3f(0.0);
    for (var k = 0; k < side * side; k++) {
        let at = px + vec2i(k % side, k / side) - radius;
        let own = grey(at, turn.here);
        let prev = grey_between(vec2f(at) + motion.xy, turn.prev);
        let next = grey_between(vec2f(at) + motion.zw, turn.next);
        sum += min(abs(vec3f(prev, next, 0.5 * (prev + next)) - own), vec3f(MOST_APART));
    }
    let each = sum / f32(side * side);
    let both = of_both(each.xy);
    return Differences(both.better, both.worse, select(NOWHERE, each.z, all(turn.there > vec2f(0.0))));
}

struct Both {
    better: f32,        // the least
    worse: f32,         // the greatest; 0 where one lacks
}

/// Of measures of the previous and of the next picture.
fn of_both(each: vec2f) -> Both {
    let there = select(vec2f(NOWHERE), each, turn.there > vec2f(0.0));
    let counted = each * turn.there;
    return Both(min(there.x, there.y), select(0.0, max(counted.x, counted.y), all(turn.there > vec2f(0.0))));
}
