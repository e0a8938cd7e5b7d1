// An order in depth: surfaces that move otherwise than most of the picture are nearer.
//#include common/frame.wgsl
//#include flow/dense/summary.wgsl
//#include flow/dense/turn.wgsl

@group(1) @binding(1) var motion: texture_2d<f32>;      // to_prev, to_next [px]
@group(1) @binding(2) var small: texture_2d<f32>;       // motion of the small level, of which `summary` is
@group(1) @binding(3) var<storage, read> summary: Summary;
@group(1) @binding(4) var output: texture_storage_2d<r32float, write>;

const NEARNESS: f32 = 0.005;    // how fast depth falls with the distance [1/px]
const RADIUS: i32 = 2;          // of the median [px]
const SIDE: i32 = 5;
const COUNT: i32 = 25;
const RANK: i32 = 12;           // of the median

@compute @workgroup_size(WG_X, WG_Y)
fn main(@builtin(global_invocation_id) id: vec3u) {
    if any(id.xy >= frame.size) { return; }
    var values: array<vec2f, COUNT>;
    for (var k = 0; k < COUNT; k++) {
        values[k] = distances(inside(vec2i(id.xy) + vec2i(k % SIDE, k / SIDE) - RADIUS));
    }
    // The greatest of those that no more than RANK values are below.
    var found = vec2f(0.0);
    for (var k = 0; k < COUNT; k++) {
        var below = vec2i(0);
        for (var i = 0; i < COUNT; i++) { below += vec2i(values[i] < values[k]); }
        found = max(found, select(vec2f(0.0), values[k], below <= vec2i(RANK)));
    }
    textureStore(output, id.xy, vec4f(1.0 / (1.0 + NEARNESS * max(found.x, found.y))));
}

/// By how much the motion to each neighbour differs from that of most; 0 where it lacks.
fn distances(px: vec2i) -> vec2f {
    let own = textureLoad(motion, px, 0);
    let place = centred(vec2f(px), vec2f(frame.size));
    let factor = vec2f(frame.size) / vec2f(textureDimensions(small));
    return turn.there * vec2f(distance(own.xy, factor * dominant_at(summary.most[0], place)), distance(own.zw, factor * dominant_at(summary.most[1], place)));
}
