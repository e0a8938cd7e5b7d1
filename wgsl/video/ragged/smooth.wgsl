// Motion where it goes there and back along rows and along columns: the mean of that around. All else stays as it is.
//#include common/frame.wgsl
//#include video/ragged/around.wgsl

@group(1) @binding(0) var motion: texture_2d<f32>;      // to_prev, to_next [px]
@group(1) @binding(1) var depth: texture_2d<f32>;
@group(1) @binding(2) var measured: texture_2d<f32>;    // output of measure.wgsl
@group(1) @binding(3) var motion_out: Output;
@group(1) @binding(4) var depth_out: texture_storage_2d<r32float, write>;

const MOST: f32 = 60.0;     // there and back, in 5 rows and in 5 columns of 5 px [px]: 3 px a step
const REACH: i32 = 4;       // of the mean, to each side [px]

@compute @workgroup_size(WG_X, WG_Y)
fn main(@builtin(global_invocation_id) id: vec3u) {
    if any(id.xy >= frame.size) { return; }
    let px = vec2i(id.xy);
    var along = vec2f(0.0);
    for (var k = -RADIUS; k <= RADIUS; k++) {
        along.x += textureLoad(measured, inside(px + vec2i(0, k)), 0).x;
        along.y += textureLoad(measured, inside(px + vec2i(k, 0)), 0).y;
    }
    if min(along.x, along.y) <= MOST {
        textureStore(motion_out, id.xy, textureLoad(motion, id.xy, 0));
        textureStore(depth_out, id.xy, textureLoad(depth, id.xy, 0));
        return;
    }
    var way = vec4f(0.0);
    var far = 0.0;
    for (var y = -REACH; y <= REACH; y++) {
        for (var x = -REACH; x <= REACH; x++) {
            let at = inside(px + vec2i(x, y));
            way += textureLoad(motion, at, 0);
            far += textureLoad(depth, at, 0).x;
        }
    }
    let count = f32((2 * REACH + 1) * (2 * REACH + 1));
    textureStore(motion_out, id.xy, way / count);
    textureStore(depth_out, id.xy, vec4f(far / count));
}
