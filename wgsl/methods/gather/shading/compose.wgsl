// What is added to the colours of this frame because its light is that of another time.
//#include common/frame.wgsl
//#include methods/gather/shading/active.wgsl
//#include methods/gather/shading/light.wgsl
//#include methods/gather/shading/pushed.wgsl

struct Node {
    time: f32,          // share of the way to the neighbour
}

@group(1) @binding(0) var<uniform> node: Node;
@group(1) @binding(1) var light_here: texture_2d<f32>;
@group(1) @binding(2) var albedo: texture_2d<f32>;
@group(1) @binding(3) var weight: texture_2d<f32>;
@group(1) @binding(4) var before: texture_2d<f32>;      // changes to the previous frame, to the next one
@group(1) @binding(5) var after: texture_2d<f32>;
@group(1) @binding(6) var values: texture_2d<f32>;
@group(1) @binding(7) var values_there: texture_2d<f32>;
@group(1) @binding(8) var flow: texture_2d<f32>;        // and trust
@group(1) @binding(9) var flow_back: texture_2d<f32>;
@group(1) @binding(10) var explained: texture_2d<f32>;  // what explain.wgsl wrote, blurred
@group(1) @binding(11) var earlier: texture_2d<f32>;    // what is added for other reasons
@group(1) @binding(12) var linear: sampler;
@group(1) @binding(13) var<storage, read_write> from_here: array<u32>;   // see push.wgsl
@group(1) @binding(14) var<storage, read_write> from_there: array<u32>;
@group(1) @binding(15) var<storage, read> found: array<u32>;    // one word, then those of tiles: see gain.wgsl
@group(1) @binding(16) var added: Added;                // [linear, premultiplied by weight]; a: 1

alias Added = texture_storage_2d<rgba16float, write>;

override HAS_ALBEDO: bool = true;   // else it is 1
override WEIGHTED: bool = false;    // multiply by `weight`
override ONTO: bool = false;        // add to `earlier`

const LEAST_LIGHT: f32 = 0.005;     // share of the light that the darkest shadow leaves
const MOST_ADDED: f32 = 60000.0;    // [linear]

/// A smooth step from 0.5 - half to 0.5 + half.
fn step_around(x: f32, half: f32) -> f32 {
    return smoothstep(0.5 - half, 0.5 + half, x);
}

@compute @workgroup_size(WG_X, WG_Y)
fn main(@builtin(global_invocation_id) id: vec3u) {
    if any(id.xy >= frame.size) { return; }
    let px = vec2i(id.xy);
    var change = vec3f(0.0);
    if found[1u + light_tile(id.xy)] == 1u { change = moved(px); }
    store(px, change, 1.0);
}

/// The change of the logarithm of light: no more than a frame showed around.
fn moved(px: vec2i) -> vec3f {
    var change = vec3f(0.0);
    if PULLED { change = pulled(px); } else { change = pushed(px); }
    var low = vec3f(0.0);
    var high = vec3f(0.0);
    for (var k = 0; k < 9; k++) {       // no more than a frame showed
        let near = inside(px + vec2i(k % 3, k / 3) - 1);
        let a = textureLoad(before, near, 0).rgb;
        let b = textureLoad(after, near, 0).rgb;
        low = min(low, min(a, b));
        high = max(high, max(a, b));
    }
    return clamp(change, low, high);
}

/// What a neighbouring frame's own light adds, at the share 1 of the way to it; a: whether the surface is seen there.
@compute @workgroup_size(WG_X, WG_Y)
fn add_neighbour(@builtin(global_invocation_id) id: vec3u) {
    if any(id.xy >= frame.size) { return; }
    let change = textureLoad(before, id.xy, 0);
    store(vec2i(id.xy), change.rgb, change.a);
}

/// Nothing: there is no neighbour on that side.
@compute @workgroup_size(WG_X, WG_Y)
fn add_nothing(@builtin(global_invocation_id) id: vec3u) {
    if any(id.xy >= frame.size) { return; }
    store(vec2i(id.xy), vec3f(0.0), 0.0);
}

fn store(px: vec2i, change: vec3f, seen: f32) {
    var surface = vec3f(1.0);
    if HAS_ALBEDO { surface = valid_light(textureLoad(albedo, px, 0)); }
    var counts = 1.0;
    if WEIGHTED { counts = textureLoad(weight, px, 0).x; }
    let light = valid_light(textureLoad(light_here, px, 0)) + dark();
    var result = counts * surface * light * (exp(change) - 1.0);
    if ONTO { result += textureLoad(earlier, px, 0).rgb; }
    textureStore(added, px, vec4f(clamp(result, vec3f(-MOST_ADDED), vec3f(MOST_ADDED)), seen));
}

/// Darkness as it was pushed here from both frames, and what rests; as a change of the logarithm of light.
fn pushed(px: vec2i) -> vec3f {
    let first = 2u * (u32(px.y) * frame.size.x + u32(px.x));
    let a = unpack_pushed(from_here[first], from_here[first + 1u]);
    let b = unpack_pushed(from_there[first], from_there[first + 1u]);
    for (var k = 0u; k < 2u; k++) {     // empty for the next time
        from_here[first + k] = 0u;
        from_there[first + k] = 0u;
    }
    let own = textureLoad(values, px, 0).rgb;
    let other = textureLoad(values_there, px, 0).rgb;
    let shares = vec2f(1.0 - step_around(node.time, 0.3), step_around(node.time, 0.3));
    let covered = shares * min(vec2f(a.w, b.w), vec2f(1.0));
    let mixed = (shares.x * a.rgb / max(a.w, 1.0) + shares.y * b.rgb / max(b.w, 1.0))
        / max(covered.x + covered.y, 1e-3) * min(max(a.w, b.w), 1.0);
    let late = step_around(node.time, 0.2);
    let rests = (1.0 - late) * (1.0 - textureLoad(flow, px, 0).z) * own
        + late * (1.0 - textureLoad(flow_back, px, 0).z) * other;
    let differs = textureLoad(explained, px, 0);
    let guard = clamp((0.85 - differs.x / max(differs.y, 1e-4)) / 0.25, 0.0, 1.0);
    return guard * (log(max(1.0 - mixed - rests, vec3f(LEAST_LIGHT))) - log(max(1.0 - own, vec3f(LEAST_LIGHT))));
}

/// The light that has come here by then along both flows; as a change of its logarithm.
fn pulled(px: vec2i) -> vec3f {
    let x = vec2f(px) + 0.5;
    let scale = 1.0 / vec2f(frame.size);
    var ahead = textureLoad(flow, px, 0).xyz;
    var back = textureLoad(flow_back, px, 0).xyz;
    for (var k = 0; k < 3; k++) {
        ahead = textureSampleLevel(flow, linear, (x - node.time * ahead.xy) * scale, 0.0).xyz;
        back = textureSampleLevel(flow_back, linear, (x - (1.0 - node.time) * back.xy) * scale, 0.0).xyz;
    }
    let at = (x - node.time * ahead.xy) * scale;
    let at_there = (x - (1.0 - node.time) * back.xy) * scale;
    let late = step_around(node.time, 0.4);
    let shares = vec2f(1.0 - late, late) * vec2f(textureSampleLevel(flow, linear, at, 0.0).z,
                                                 textureSampleLevel(flow_back, linear, at_there, 0.0).z);
    let level = textureLoad(values, px, 0).rgb;
    let come = shares.x * (textureSampleLevel(values, linear, at, 0.0).rgb - level)
        + shares.y * (textureSampleLevel(values_there, linear, at_there, 0.0).rgb - level);
    let total = shares.x + shares.y;
    return come / max(total, 1e-3) * min(total / 0.3, 1.0);
}
