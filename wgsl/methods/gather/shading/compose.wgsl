// Addition to the colours of this frame for the light of another time.
//#include common/frame.wgsl
//#include methods/gather/shading/listed.wgsl
//#include methods/gather/shading/light.wgsl
//#include methods/gather/shading/moving.wgsl
//#include methods/gather/shading/pushed.wgsl

struct Node {
    time: f32,          // share of the way to the neighbour
}

@group(1) @binding(0) var<uniform> node: Node;
@group(1) @binding(1) var light_here: texture_2d<f32>;  // stored as given
@group(1) @binding(2) var albedo: texture_2d<f32>;      // stored as given
@group(1) @binding(3) var weight: texture_2d<f32>;      // stored as given
@group(1) @binding(4) var before: texture_2d<f32>;      // stored as rgba16float: changes to the previous frame, to the next one
@group(1) @binding(5) var after: texture_2d<f32>;       // stored as rgba16float
@group(1) @binding(11) var earlier: texture_2d<f32>;    // stored as rgba16float: light added for other reasons
@group(1) @binding(12) var range: texture_2d<u32>;      // stored as rgba32uint, by `find_range`: the least and the greatest change around, and 1 if a neighbour does not show all of it
@group(1) @binding(13) var<storage, read_write> from_here: array<u32>;   // see push.wgsl
@group(1) @binding(14) var<storage, read_write> from_there: array<u32>;
@group(1) @binding(15) var added: Added;                // [linear, premultiplied by weight]; a: how sure it is, 0 to 1
@group(1) @binding(16) var range_out: Range;

alias Added = texture_storage_2d<rgba16float, write>;
alias Range = texture_storage_2d<rgba32uint, write>;

override HAS_ALBEDO: bool = true;   // else it is 1
override WEIGHTED: bool = false;    // multiply by `weight`
override ONTO: bool = false;        // add to `earlier`
override TOLD: bool = true;         // how sure it is

const LEAST_COVERED: f32 = 0.05;    // light from one frame alone counts less than this close to the instant of the other
const MOST_CLOSED: f32 = 4.0;       // factor of partial coverage where flow is not searched, or where light is seen in static colours
const LEAST_LIGHT: f32 = 0.005;     // share of the light that the darkest shadow leaves
const DARKEST: f32 = -3.0;       // change of the logarithm of light where a neighbour does not show it
const MOST_ADDED: f32 = 60000.0;    // [linear]
const COUNTS: f32 = 0.1;            // change of the logarithm of light from which on it has to be followed

/// A smooth step from 0.5 - half to 0.5 + half.
fn step_around(x: f32, half: f32) -> f32 {
    return smoothstep(0.5 - half, 0.5 + half, x);
}

/// The surroundings in a frame.
@compute @workgroup_size(WG_X, WG_Y)
fn find_range(@builtin(local_invocation_index) local: u32, @builtin(workgroup_id) group: vec3u) {
    let id = listed_pixel(group, local);
    if any(id >= frame.size) { return; }
    var low = vec3f(0.0);
    var high = vec3f(0.0);
    var is_hidden = false;      // in a neighbour
    for (var k = 0; k < 9; k++) {
        let near = inside(vec2i(id) + vec2i(k % 3, k / 3) - 1);
        let a = textureLoad(before, near, 0);
        let b = textureLoad(after, near, 0);
        low = min(low, min(a.rgb, b.rgb));
        high = max(high, max(a.rgb, b.rgb));
        is_hidden = is_hidden || (a.a == 0.0 && textureDimensions(before).x > 1u) || (b.a == 0.0 && textureDimensions(after).x > 1u);
    }
    textureStore(range_out, id, vec4u(pack2x16float(low.rg), pack2x16float(vec2f(low.b, high.r)), pack2x16float(high.gb), u32(is_hidden)));
}

/// Nothing yet: light rests where it changes in no frame, and that is sure. It is read in tiles with changes, and in those beside them.
@compute @workgroup_size(WG_X, WG_Y)
fn begin(@builtin(local_invocation_index) local: u32, @builtin(workgroup_id) group: vec3u) {
    let id = listed_pixel(group, local);
    if any(id >= frame.size) { return; }
    var before = vec3f(0.0);
    if ONTO { before = textureLoad(earlier, id, 0).rgb; }
    textureStore(added, id, vec4f(before, as_sure_as(vec2i(id), 1.0)));
}

/// The tiles in which light changes.
@compute @workgroup_size(WG_X, WG_Y)
fn main(@builtin(local_invocation_index) local: u32, @builtin(workgroup_id) group: vec3u) {
    let id = listed_pixel(group, local);
    if any(id >= frame.size) { return; }
    let px = vec2i(id);
    let change = moved(px);
    store(px, change.rgb, as_sure_as(px, change.a));
}

/// The change of the logarithm of light: no more than a frame showed around, where all show it; a: how sure it is, 1 where nothing changes.
fn moved(px: vec2i) -> vec4f {
    var change = vec4f(0.0);
    if PULLED { change = pulled(px); } else { change = pushed(px); }
    let packed = textureLoad(range, px, 0);
    let middle = unpack2x16float(packed.y);
    let low = vec3f(unpack2x16float(packed.x), middle.x);
    let high = vec3f(middle.y, unpack2x16float(packed.z));
    var certain = 1.0;
    if TOLD { certain = sure(px, change.a); }
    var most = clamp(change.rgb, low, high);
    if !PULLED && packed.w == 1u {      // noise is no shadow
        let darkness = textureLoad(values, px, 0).rgb;
        let any_light = clamp(change.rgb, vec3f(DARKEST), -log(max(1.0 - darkness, vec3f(LEAST_LIGHT))));
        most = mix(most, any_light, smoothstep(COUNTS, 3.0 * COUNTS, most_of(any_light)));
    }
    return vec4f(most, certain);
}

/// Confidence of the light, for flow of the trust `trusted`: the share of the change between both frames that the flow
/// explains, either way. 1 where nothing changes.
fn sure(px: vec2i, trusted: f32) -> f32 {
    let x = vec2f(px) + 0.5;
    let ahead = x + textureLoad(flow, px, 0).xy;
    let back = x + textureLoad(flow_back, px, 0).xy;
    let here = levels(textureLoad(values, px, 0));
    let there = levels(textureLoad(values_there, px, 0));
    let differs = most_of(there - here);
    let missed = max(most_of(levels(values_there_at(ahead)) - here),
                     most_of(levels(values_at(back)) - there));
    let explains = 1.0 - min(missed / max(differs, COUNTS), 1.0);
    return 1.0 - min(differs / COUNTS, 1.0) * (1.0 - trusted * explains);
}

/// Values as logarithms of light.
fn levels(value: vec4f) -> vec3f {
    return select(log(max(1.0 - value.rgb, vec3f(LEAST_LIGHT))), value.rgb, vec3<bool>(PULLED));
}

fn most_of(change: vec3f) -> f32 {
    return max(abs(change.r), max(abs(change.g), abs(change.b)));
}

/// Of several kinds of light, the least sure one.
fn as_sure_as(px: vec2i, sure: f32) -> f32 {
    if !ONTO { return sure; }
    return min(sure, textureLoad(earlier, px, 0).a);
}

/// Addition for a neighbouring frame's own light, at the share 1 of the way to it; a: 1 if the surface is seen there.
@compute @workgroup_size(WG_X, WG_Y)
fn add_neighbour(@builtin(local_invocation_index) local: u32, @builtin(workgroup_id) group: vec3u) {
    let id = listed_pixel(group, local);
    if any(id >= frame.size) { return; }
    let change = textureLoad(before, id, 0);
    store(vec2i(id), change.rgb, change.a);
}

/// At a time on whose side there is no neighbour, light rests. It is not known where it changes on the other side.
@compute @workgroup_size(WG_X, WG_Y)
fn rest(@builtin(local_invocation_index) local: u32, @builtin(workgroup_id) group: vec3u) {
    let id = listed_pixel(group, local);
    if any(id >= frame.size) { return; }
    let px = vec2i(id);
    let change = max(most_of(textureLoad(before, px, 0).rgb), most_of(textureLoad(after, px, 0).rgb));
    store(px, vec3f(0.0), as_sure_as(px, 1.0 - min(change / COUNTS, 1.0)));
}

/// Nothing: there is no neighbour on that side.
@compute @workgroup_size(WG_X, WG_Y)
fn add_nothing(@builtin(local_invocation_index) local: u32, @builtin(workgroup_id) group: vec3u) {
    let id = listed_pixel(group, local);
    if any(id >= frame.size) { return; }
    store(vec2i(id), vec3f(0.0), 0.0);
}

fn store(px: vec2i, change: vec3f, a: f32) {
    if RESTING {    // a share of the colour
        textureStore(added, px, vec4f(exp(change) - 1.0, a));
        return;
    }
    var surface = vec3f(1.0);
    if HAS_ALBEDO { surface = valid_light(textureLoad(albedo, px, 0)); }
    var counts = 1.0;
    if WEIGHTED { counts = textureLoad(weight, px, 0).x; }
    let light = valid_light(textureLoad(light_here, px, 0)) + dark();
    var result = counts * surface * light * (exp(change) - 1.0);
    if ONTO { result += textureLoad(earlier, px, 0).rgb; }
    textureStore(added, px, vec4f(clamp(result, vec3f(-MOST_ADDED), vec3f(MOST_ADDED)), a));
}

/// Darkness as it was pushed here from both frames, and static darkness; as a change of the logarithm of light. a: the share of
/// both frames' darkness here whose flow is trusted.
fn pushed(px: vec2i) -> vec4f {
    let first = 2u * (u32(px.y) * frame.size.x + u32(px.x));
    let explains = textureLoad(flow, px, 0).w;
    let most = select(1.0, MOST_CLOSED, RESTING || explains < 0.0);
    let a = closed(unpack_pushed(from_here[first], from_here[first + 1u]), most);
    let b = closed(unpack_pushed(from_there[first], from_there[first + 1u]), most);
    for (var k = 0u; k < 2u; k++) {     // empty for the next time
        from_here[first + k] = 0u;
        from_there[first + k] = 0u;
    }
    let value = textureLoad(values, px, 0);
    let value_there = textureLoad(values_there, px, 0);
    let own = value.rgb;
    let other = value_there.rgb;
    let trusts = vec2f(textureLoad(flow, px, 0).z, textureLoad(flow_back, px, 0).z);
    let shares = vec2f(1.0 - step_around(node.time, 0.3), step_around(node.time, 0.3));
    let covered = shares * min(vec2f(a.w, b.w), vec2f(1.0));
    let mixed = (shares.x * a.rgb / max(a.w, 1.0) + shares.y * b.rgb / max(b.w, 1.0))
        / max(covered.x + covered.y, LEAST_COVERED) * min(max(a.w, b.w), 1.0);
    let late = step_around(node.time, 0.2);
    let rests = (1.0 - late) * (1.0 - trusts.x) * own + late * (1.0 - trusts.y) * other;
    let change = log(max(1.0 - mixed - rests, vec3f(LEAST_LIGHT))) - log(max(1.0 - own, vec3f(LEAST_LIGHT)));
    let trusted = dot(trusts, vec2f(value.a, value_there.a)) / max(value.a + value_there.a, 1e-3);
    return abs(explains) * vec4f(change, trusted);
}

/// Darkness that covers a part of a pixel spread over up to `most` times this part: flow that is not searched parts from place to
/// place, and would leave gaps.
fn closed(pushed: vec4f, most: f32) -> vec4f {
    return pushed * clamp(1.0 / max(pushed.w, 0.01), 1.0, most);
}

/// The light that has come here by then along both flows; as a change of its logarithm. a: how far it is trusted.
fn pulled(px: vec2i) -> vec4f {
    let x = vec2f(px) + 0.5;
    var ahead = textureLoad(flow, px, 0).xyz;
    var back = textureLoad(flow_back, px, 0).xyz;
    for (var k = 0; k < 3; k++) {
        ahead = flow_at(x - node.time * ahead.xy).xyz;
        back = flow_back_at(x - (1.0 - node.time) * back.xy).xyz;
    }
    let at = x - node.time * ahead.xy;
    let at_there = x - (1.0 - node.time) * back.xy;
    let late = step_around(node.time, 0.4);
    let shares = vec2f(1.0 - late, late) * vec2f(flow_at(at).z, flow_back_at(at_there).z);
    let level = textureLoad(values, px, 0).rgb;
    let come = shares.x * (values_at(at).rgb - level) + shares.y * (values_there_at(at_there).rgb - level);
    let total = shares.x + shares.y;
    let trusted = min(total / 0.3, 1.0);
    return vec4f(come / max(total, 1e-3) * trusted, trusted);
}
