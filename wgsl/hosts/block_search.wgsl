// Motion from one picture to another by blocks that match, from coarse to fine: for the page, whose pictures have none.
//#include common/frame.wgsl

@group(1) @binding(0) var first: texture_2d<f32>;   // display values of one level
@group(1) @binding(1) var second: texture_2d<f32>;
@group(1) @binding(2) var found: texture_2d<f32>;   // displacements [px of its own level] and their cost
@group(1) @binding(3) var other: texture_2d<f32>;   // those to the frame before, for `spread`
@group(1) @binding(4) var output: Output;

override REACH: i32 = 0;            // of a full search on the coarsest level [px]; 0: refine what was found
const PATCH: i32 = 2;               // pixels to either side that are compared
const LENGTH_PRICE: f32 = 0.002;    // per px: of displacements that match much alike, the shortest

/// Half the size: the mean of four pixels.
@compute @workgroup_size(WG_X, WG_Y)
fn shrink(@builtin(global_invocation_id) id: vec3u) {
    if any(id.xy >= frame.size) { return; }
    let last = vec2i(textureDimensions(first)) - 1;
    var sum = vec4f(0.0);
    for (var i = 0; i < 4; i++) {
        sum += textureLoad(first, min(2 * vec2i(id.xy) + vec2i(i % 2, i / 2), last), 0);
    }
    textureStore(output, id.xy, 0.25 * sum);
}

fn at(px: vec2i) -> vec3f {
    return textureLoad(second, inside(px), 0).rgb;
}

fn between(px: vec2f) -> vec3f {
    let low = floor(px);
    let share = px - low;
    let p = vec2i(low);
    return mix(mix(at(p), at(p + vec2i(1, 0)), share.x), mix(at(p + vec2i(0, 1)), at(p + vec2i(1, 1)), share.x), share.y);
}

/// Mean difference of a patch and the same one moved, and the price of the way.
fn cost(px: vec2i, by: vec2f) -> f32 {
    var sum = 0.0;
    for (var y = -PATCH; y <= PATCH; y++) {
        for (var x = -PATCH; x <= PATCH; x++) {
            let p = inside(px + vec2i(x, y));
            let apart = abs(textureLoad(first, p, 0).rgb - between(vec2f(p) + by));
            sum += apart.x + apart.y + apart.z;
        }
    }
    let side = f32(2 * PATCH + 1);
    return sum / (3.0 * side * side) + LENGTH_PRICE * length(by);
}

fn cheaper(best: vec3f, px: vec2i, by: vec2f) -> vec3f {
    let price = cost(px, by);
    return select(best, vec3f(by, price), price < best.z);
}

/// The best displacement of a pixel: of all within reach, or of the coarser level's around it, refined.
@compute @workgroup_size(WG_X, WG_Y)
fn search(@builtin(global_invocation_id) id: vec3u) {
    if any(id.xy >= frame.size) { return; }
    let px = vec2i(id.xy);
    var best = vec3f(0.0, 0.0, cost(px, vec2f(0.0)));
    if REACH > 0 {
        for (var y = -REACH; y <= REACH; y++) {
            for (var x = -REACH; x <= REACH; x++) { best = cheaper(best, px, vec2f(f32(x), f32(y))); }
        }
    } else {
        let last = vec2i(textureDimensions(found)) - 1;
        for (var i = 0; i < 9; i++) {
            let near = clamp(px / 2 + vec2i(i % 3, i / 3) - 1, vec2i(0), last);
            best = cheaper(best, px, 2.0 * textureLoad(found, near, 0).xy);
        }
    }
    for (var step = 1.0; step >= 0.25; step *= 0.5) {
        let middle = best.xy;
        for (var i = 0; i < 9; i++) {
            best = cheaper(best, px, middle + step * vec2f(f32(i % 3) - 1.0, f32(i / 3) - 1.0));
        }
    }
    textureStore(output, id.xy, vec4f(best, 0.0));
}

/// Of the displacements around a pixel the one that differs least from the others.
@compute @workgroup_size(WG_X, WG_Y)
fn smooth_out(@builtin(global_invocation_id) id: vec3u) {
    if any(id.xy >= frame.size) { return; }
    let last = vec2i(frame.size) - 1;
    var best = vec4f(0.0);
    var least = 1e9;
    for (var i = 0; i < 9; i++) {
        let one = textureLoad(found, clamp(vec2i(id.xy) + vec2i(i % 3, i / 3) - 1, vec2i(0), last), 0);
        var apart = 0.0;
        for (var k = 0; k < 9; k++) {
            let near = clamp(vec2i(id.xy) + vec2i(k % 3, k / 3) - 1, vec2i(0), last);
            apart += distance(one.xy, textureLoad(found, near, 0).xy);
        }
        if apart < least {
            least = apart;
            best = one;
        }
    }
    textureStore(output, id.xy, best);
}

fn grown(field: texture_2d<f32>, px: vec2u) -> vec2f {
    let size = vec2f(textureDimensions(field));
    let scale = vec2f(frame.size) / size;
    let at = clamp((vec2f(px) + 0.5) / scale - 0.5, vec2f(0.0), size - 1.0);
    let low = vec2i(at);
    let high = min(low + 1, vec2i(size) - 1);
    let share = at - vec2f(low);
    let upper = mix(textureLoad(field, low, 0).xy, textureLoad(field, vec2i(high.x, low.y), 0).xy, share.x);
    let lower = mix(textureLoad(field, vec2i(low.x, high.y), 0).xy, textureLoad(field, high, 0).xy, share.x);
    return scale * mix(upper, lower, share.y);
}

/// The motion of every pixel as methods read it: to the frame before, and to the next.
@compute @workgroup_size(WG_X, WG_Y)
fn spread(@builtin(global_invocation_id) id: vec3u) {
    if any(id.xy >= frame.size) { return; }
    textureStore(output, id.xy, vec4f(grown(other, id.xy), grown(found, id.xy)));
}

/// The same where there is no frame before: the motion goes on straight.
@compute @workgroup_size(WG_X, WG_Y)
fn spread_straight(@builtin(global_invocation_id) id: vec3u) {
    if any(id.xy >= frame.size) { return; }
    let next = grown(found, id.xy);
    textureStore(output, id.xy, vec4f(-next, next));
}
