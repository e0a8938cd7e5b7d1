// States and depth of a picture that was searched at a smaller size: every pixel takes those of the likest pixel near by.
//#include common/frame.wgsl
//#include flow/state.wgsl

@group(1) @binding(0) var display: texture_2d_array<f32>;     // display values of the picture
@group(1) @binding(1) var here: texture_2d_array<f32>;      // features of the small one
@group(1) @binding(2) var states: texture_2d_array<f32>;    // of the small one
@group(1) @binding(3) var depth: texture_2d<f32>;           // the same
@group(1) @binding(4) var output: StatesOut;
@group(1) @binding(5) var depth_out: texture_storage_2d<r32float, write>;

const AROUND: u32 = 9u;             // 3 x 3 small pixels are compared
const FARNESS: f32 = 0.02;          // difference in colour that counts as 1 small pixel of distance

@compute @workgroup_size(WG_X, WG_Y)
fn main(@builtin(global_invocation_id) id: vec3u) {
    if any(id.xy >= frame.size) { return; }
    let color = textureLoad(display, id.xy, 0, 0).rgb;
    let factor = vec2f(frame.size) / vec2f(textureDimensions(here));
    let at = (vec2f(id.xy) + 0.5) / factor - 0.5;
    let last = vec2i(textureDimensions(here)) - 1;
    let middle = min(vec2i(at + 0.5), last);
    var likest = middle;
    var least = 1000.0;
    for (var k = 0u; k < AROUND; k++) {
        let px = clamp(middle + vec2i(vec2u(k % 3u, k / 3u)) - 1, vec2i(0), last);
        let apart = abs(textureLoad(here, px, 0, 0).rgb - color);
        let away = abs(vec2f(px) - at);
        let difference = apart.r + apart.g + apart.b + FARNESS * (away.x + away.y);
        if difference < least {
            least = difference;
            likest = px;
        }
    }
    let state = moved(load_state(states, likest), at - vec2f(likest));
    textureStore(output, id.xy, 0, factor.xyxy * vec4f(state.flow, state.bend));
    textureStore(output, id.xy, 1, state.slope * vec4f(1.0, factor.x / factor.y, factor.y / factor.x, 1.0));
    textureStore(depth_out, id.xy, textureLoad(depth, likest, 0));
}
