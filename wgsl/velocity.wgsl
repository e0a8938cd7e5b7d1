// Motion of every pixel: from vectors, from depth and matrices (Rosado 2007), or from both.
//#include common/camera.wgsl
//#include common/finite.wgsl
//#include common/frame.wgsl
//#include common/path.wgsl
//#include common/shutter.wgsl

struct Reprojection {       // of one rigid body; homogeneous pixel: see homogeneous()
    prev: mat4x4f,          // clip position in the previous frame
    next: mat4x4f,          // clip position in the next frame
}

struct Velocity {
    view: View,
    bodies: u32,            // rows of `reprojections`
}

@group(1) @binding(0) var<uniform> velocity: Velocity;
@group(1) @binding(1) var to_prev: texture_2d<f32>;     // displacement to the previous frame [px]; with PAIRED in zw to the next
@group(1) @binding(2) var to_next: texture_2d<f32>;     // displacement to the next frame [px]
@group(1) @binding(3) var depth: texture_2d<f32>;       // see depth_kind
@group(1) @binding(4) var object: texture_2d<u32>;      // row of `reprojections`; 0 and unknown ones: the world
@group(1) @binding(5) var scale: texture_2d<f32>;       // multiplies the motion
@group(1) @binding(6) var<storage, read> reprojections: array<Reprojection>;
@group(1) @binding(7) var motion: texture_storage_2d<rgba32float, write>;   // to_prev, to_next [px]

const HUGE: f32 = 1e12;             // longer motion [px] is shortened to this before it is limited

override PREV: bool = false;        // which inputs there are
override NEXT: bool = false;
override PAIRED: bool = false;
override CAMERA: bool = false;
override OBJECTS: bool = false;
override SCALED: bool = false;
override LIMITED: bool = false;     // frame.max_blur
override ADDED: bool = false;       // vectors leave the camera's motion out: add it

@compute @workgroup_size(WG_X, WG_Y)
fn main(@builtin(global_invocation_id) id: vec3u) {
    if any(id.xy >= frame.size) { return; }
    var way = vec4f(0.0);
    var nothing_there = false;
    if CAMERA {
        let z = textureLoad(depth, id.xy, 0).x;
        nothing_there = is_nothing(velocity.view, z);
        way = camera_motion(id.xy, z, nothing_there);
    }
    if PREV || NEXT {
        var given = textureLoad(to_prev, id.xy, 0);
        let ahead = textureLoad(to_next, id.xy, 0).xy;
        if !PAIRED { given = vec4f(given.xy, ahead); }
        if !PREV { given = vec4f(-ahead, ahead); }
        if !NEXT { given = vec4f(given.xy, -given.xy); }
        if !is_finite4(given) { given = vec4f(0.0); }
        if ADDED { way += given; } else if !nothing_there { way = given; }
    }
    if SCALED {
        let factor = textureLoad(scale, id.xy, 0).x;
        way *= select(0.0, factor, is_finite(factor));
    }
    if LIMITED { way = limited(way); }
    textureStore(motion, id.xy, way);
}

/// To where the depth at `px` puts its content in the previous and the next frame [px].
fn camera_motion(px: vec2u, z: f32, nothing_there: bool) -> vec4f {
    var body = 0u;
    if OBJECTS && !nothing_there { body = textureLoad(object, px, 0).x; }
    if body >= velocity.bodies { body = 0u; }
    let view = velocity.view;
    let ndc = ndc_of(view, px);
    if nothing_there && view.depth_kind != PLANAR { return vec4f(0.0); }
    let here = homogeneous(view, ndc, z, nothing_there);
    let prev = reprojections[body].prev * here;
    let next = reprojections[body].next * here;
    let back = to_pixels(view, prev, ndc);
    let ahead = to_pixels(view, next, ndc);
    // A point that is behind the camera in one of the frames goes on as in the other.
    if prev.w <= NEAREST && next.w <= NEAREST { return vec4f(0.0); }
    var way = vec4f(back, ahead);
    if prev.w <= NEAREST { way = vec4f(-ahead, ahead); }
    if next.w <= NEAREST { way = vec4f(back, -back); }
    return select(vec4f(0.0), way, is_finite4(way));
}

/// The motion shortened so that the streak over the exposure is at most frame.max_blur.
fn limited(way: vec4f) -> vec4f {
    let most = max(max(abs(way.x), abs(way.y)), max(abs(way.z), abs(way.w)));
    let safe = way * min(1.0, HUGE / max(most, 1.0));   // its square is finite
    let path = path_of(safe);
    let opening = displacement(path, shutter.span.x);
    let turn = displacement(path, turning(path, shutter.span.x, shutter.span.y));
    let closing = displacement(path, shutter.span.y);
    let streak = max(distance(opening, closing), max(distance(opening, turn), distance(turn, closing)));
    return safe * min(1.0, frame.max_blur / max(streak, 1e-6));
}
