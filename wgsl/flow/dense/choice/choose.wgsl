// Motion of the picture: of blocks, raised, where that was chosen, else of dense inverse search; the dominant one where the only
// neighbour hides a place.
//#include common/frame.wgsl
//#include flow/dense/raising.wgsl

@group(1) @binding(3) var state: texture_2d<f32>;           // of that: to_prev, to_next [px]
@group(1) @binding(4) var chosen: texture_2d<f32>;          // of that: 1 where its motion is taken
@group(1) @binding(5) var motion: texture_2d<f32>;          // by dense inverse search
@group(1) @binding(6) var hidden: texture_2d<f32>;          // output of hidden.wgsl, where a neighbour lacks
@group(1) @binding(7) var output: texture_storage_2d<rgba32float, write>;

override ALONE: bool = false;   // there is one neighbour

const RADIUS: i32 = 2;          // of the square [px of the middle level] of which most must be hidden

@compute @workgroup_size(WG_X, WG_Y)
fn main(@builtin(global_invocation_id) id: vec3u) {
    if any(id.xy >= frame.size) { return; }
    let px = vec2i(id.xy);
    let factor = vec2f(frame.size) / vec2f(textureDimensions(state));
    let found = factor.xyxy * textureLoad(state, likest(px, vec2f(frame.size)), 0);
    let is_chosen = textureLoad(chosen, vec2i((vec2f(px) + 0.5) / factor), 0).x > 0.0;
    var taken = select(textureLoad(motion, px, 0), found, is_chosen);
    if ALONE {
        let at = vec2i((vec2f(px) + 0.5) / factor);
        let way = factor * textureLoad(hidden, at, 0).xy;
        let dominant = select(vec4f(way, -way), vec4f(-way, way), turn.there.y > 0.0);
        taken = select(taken, dominant, is_hidden(at));
    }
    textureStore(output, px, taken);
}

/// True if more than half of the places around are hidden.
fn is_hidden(at: vec2i) -> bool {
    let side = 2 * RADIUS + 1;
    let last = vec2i(textureDimensions(hidden)) - 1;
    var sum = 0.0;
    for (var k = 0; k < side * side; k++) {
        let near = at + vec2i(k % side, k / side) - RADIUS;
        sum += textureLoad(hidden, clamp(near, vec2i(0), last), 0).z;
    }
    return 2.0 * sum > f32(side * side);
}
