// Places that another place hides in the only neighbour: where their motion and the dominant one lead, others lead and fit better.
//#include common/frame.wgsl
//#include flow/dense/differences.wgsl
//#include flow/dense/choice/leading.wgsl
//#include flow/dense/summary.wgsl

@group(1) @binding(2) var leads: texture_2d<f32>;       // output of arrivals.wgsl
@group(1) @binding(3) var<storage, read> arrivals: array<u32>;
@group(1) @binding(4) var small: texture_2d<f32>;       // motion of the small level, of which `summary` is
@group(1) @binding(5) var<storage, read> summary: Summary;
@group(1) @binding(6) var output: texture_storage_2d<rgba32float, write>;   // dominant way to the neighbour [px]; 1 if hidden

const SAME: f32 = 2.0;          // px: places beside each other may lead to one place

@compute @workgroup_size(WG_X, WG_Y)
fn main(@builtin(global_invocation_id) id: vec3u) {
    if any(id.xy >= frame.size) { return; }
    let px = vec2i(id.xy);
    let side = select(0u, 1u, turn.there.y > 0.0);
    let factor = vec2f(frame.size) / vec2f(textureDimensions(small));
    let dominant = factor * dominant_at(summary.most[side], centred(vec2f(px), vec2f(frame.size)));
    let own = textureLoad(leads, px, 0);
    let is_hidden = is_taken(px, own.xy, own.z) && is_taken(px, dominant, cost_of(px, dominant));
    textureStore(output, px, vec4f(dominant, select(0.0, 1.0, is_hidden), 0.0));
}

/// True if a pixel that moves otherwise leads to the same place and costs less.
fn is_taken(px: vec2i, way: vec2f, cost: f32) -> bool {
    let word = arrivals[place_of(px, way)];
    let other = textureLoad(leads, leading(word), 0);
    let apart = abs(way - other.xy);
    return word != 0u && max(apart.x, apart.y) > SAME && cost > other.z;
}
