// Holdout: pixels that stay sharp and out of their neighbours' blur. Pixels that are not finite stay out of it too.
//#include common/finite.wgsl
//#include common/frame.wgsl

@group(1) @binding(0) var color: texture_2d<f32>;       // the frame, linear, premultiplied
@group(1) @binding(1) var holdout: texture_2d<f32>;     // 1: stays sharp
@group(1) @binding(2) var blurred: texture_2d<f32>;     // the method's result
@group(1) @binding(3) var weight: Weight;
@group(1) @binding(4) var output: Output;

alias Weight = texture_storage_2d<r32float, write>;

override HOLDOUT: bool = false;     // there is a mask, `holdout`

/// Share of a pixel that is held out; a mask that is not finite holds nothing out.
fn holdout_amount(px: vec2u) -> f32 {
    if !HOLDOUT { return 0.0; }
    let amount = textureLoad(holdout, px, 0).x;
    return select(0.0, clamp(amount, 0.0, 1.0), is_finite(amount));
}

/// Before the method: the weight of every pixel, and its colour times that weight, which the method blurs.
@compute @workgroup_size(WG_X, WG_Y)
fn before(@builtin(global_invocation_id) id: vec3u) {
    if any(id.xy >= frame.size) { return; }
    let own = textureLoad(color, id.xy, 0);
    let counts = select(0.0, 1.0 - holdout_amount(id.xy), is_color(own));
    textureStore(weight, id.xy, vec4f(counts));
    textureStore(output, id.xy, select(vec4f(0.0), own * counts, counts > 0.0));
}

/// After the method: holdouts come back.
@compute @workgroup_size(WG_X, WG_Y)
fn after(@builtin(global_invocation_id) id: vec3u) {
    if any(id.xy >= frame.size) { return; }
    let own = textureLoad(color, id.xy, 0);
    let amount = select(0.0, holdout_amount(id.xy), is_color(own));
    let result = textureLoad(blurred, id.xy, 0);
    textureStore(output, id.xy, select(result, mix(result, own, amount), amount > 0.0));
}
