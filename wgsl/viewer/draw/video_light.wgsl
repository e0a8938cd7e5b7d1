// Light of a video -> light of a display with the primaries of Rec. 709, where 1 is the white of text and paper.
//#include common/frame.wgsl

@group(1) @binding(0) var<uniform> onto: Onto;
@group(1) @binding(1) var light: texture_2d<f32>;       // premultiplied by alpha
@group(1) @binding(2) var output: Output;

struct Onto {
    red: vec4f,         // rows of the matrix onto Rec. 709
    green: vec4f,
    blue: vec4f,
    luminance: vec4f,   // weights of the video's own primaries
}

override HLG: bool = false;     // the light is that of the scene

// Of a display of 1,000 cd/m2 (ITU-R BT.2100, table 5). There, scene light of 1 is 203 cd/m2, so no factor is left.
const HLG_GAMMA: f32 = 1.2;

@compute @workgroup_size(WG_X, WG_Y)
fn main(@builtin(global_invocation_id) id: vec3u) {
    if any(id.xy >= frame.size) { return; }
    let premultiplied = textureLoad(light, id.xy, 0);
    let alpha = premultiplied.w;
    var color = select(vec3f(0.0), premultiplied.xyz / alpha, alpha > 0.0);
    if HLG { color *= pow(max(dot(onto.luminance.xyz, color), 1e-6), HLG_GAMMA - 1.0); }
    let shown = vec3f(dot(onto.red.xyz, color), dot(onto.green.xyz, color), dot(onto.blue.xyz, color));
    textureStore(output, id.xy, vec4f(shown * alpha, alpha));
}
