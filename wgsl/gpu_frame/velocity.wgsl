// Motion of every pixel: from vectors, from depth and camera matrices (Rosado 2007), or from both.
//#include common/camera.wgsl
//#include common/finite.wgsl
//#include common/frame.wgsl
//#include common/path.wgsl
//#include common/shutter.wgsl

struct Reprojection {       // of one rigid body; both matrices multiply homogeneous()
    prev: mat4x4f,          // to the clip position in the previous frame
    next: mat4x4f,          // to the clip position in the next frame
}

struct Velocity {
    viewport: Viewport,
    bodies: u32,            // rows of `reprojections`
    top: u32,               // first row of the image that is written; the dispatch has as many as are [px]
}

@group(1) @binding(0) var<uniform> velocity: Velocity;
@group(1) @binding(1) var to_prev: texture_2d<f32>;     // displacement to the previous frame [px]; with PAIRED in zw to the next
@group(1) @binding(2) var to_next: texture_2d<f32>;     // displacement to the next frame [px]
@group(1) @binding(3) var depth: texture_2d<f32>;       // see Viewport.depth_kind
@group(1) @binding(4) var object: texture_2d<u32>;      // index of the body; 0 and unknown ones: the world
@group(1) @binding(5) var scale: texture_2d<f32>;       // multiplies the motion
@group(1) @binding(6) var<storage, read> reprojections: array<Reprojection>;
@group(1) @binding(7) var motion: texture_storage_2d<rgba32float, write>;   // to_prev, to_next [px]
@group(1) @binding(8) var<storage, read> indices: array<u32>;   // of the bodies in `reprojections`, ascending; 0 first

const MAX_COMPONENT: f32 = 1e12;    // longer motion [px] is shortened to this before it is limited: its square is finite

override PREV: bool = false;        // which inputs there are
override NEXT: bool = false;
override PAIRED: bool = false;      // both vectors are in to_prev
override CAMERA: bool = false;
override OBJECTS: bool = false;
override SCALED: bool = false;
override LIMITED: bool = false;     // to frame.max_blur
override ADDED: bool = false;       // vectors are of the objects alone: the camera's motion is added

@compute @workgroup_size(WG_X, WG_Y)
fn main(@builtin(global_invocation_id) id: vec3u) {
    let px = vec2u(id.x, velocity.top + id.y);
    if any(px >= frame.size) { return; }
    var result = vec4f(0.0);
    var nothing_there = false;
    if CAMERA {
        let z = textureLoad(depth, px, 0).x;
        nothing_there = is_nothing(velocity.viewport, z);
        result = camera_motion(px, z, nothing_there);
    }
    if PREV || NEXT {
        var vectors = textureLoad(to_prev, px, 0);
        let ahead = textureLoad(to_next, px, 0).xy;
        if !PAIRED { vectors = vec4f(vectors.xy, ahead); }
        if !PREV { vectors = vec4f(-ahead, ahead); }
        if !NEXT { vectors = vec4f(vectors.xy, -vectors.xy); }
        if !is_finite4(vectors) { vectors = vec4f(0.0); }
        if ADDED { result += vectors; } else if !nothing_there { result = vectors; }
    }
    if SCALED {
        let factor = textureLoad(scale, px, 0).x;
        result *= select(0.0, factor, is_finite(factor));
    }
    if LIMITED { result = limited(result); }
    textureStore(motion, px, result);
}

/// Displacements to where the matrices put the point at `px` in the previous and the next frame [px].
fn camera_motion(px: vec2u, z: f32, nothing_there: bool) -> vec4f {
    var body = 0u;
    if OBJECTS && !nothing_there { body = row_of(textureLoad(object, px, 0).x); }
    let viewport = velocity.viewport;
    let ndc = ndc_of(viewport, px);
    if nothing_there && viewport.depth_kind != PLANAR { return vec4f(0.0); }
    let here = homogeneous(viewport, ndc, z, nothing_there);
    let prev = reprojections[body].prev * here;
    let next = reprojections[body].next * here;
    let back = to_pixels(viewport, prev, ndc);
    let ahead = to_pixels(viewport, next, ndc);
    // A point that is behind the camera in one of the frames continues as in the other.
    if prev.w <= MIN_W && next.w <= MIN_W { return vec4f(0.0); }
    var result = vec4f(back, ahead);
    if prev.w <= MIN_W { result = vec4f(-ahead, ahead); }
    if next.w <= MIN_W { result = vec4f(back, -back); }
    return select(vec4f(0.0), result, is_finite4(result));
}

/// The row of the body with this index; 0 for the world, and where no body has it.
fn row_of(index: u32) -> u32 {
    var low = 0u;
    var high = velocity.bodies;
    loop {
        let middle = (low + high) / 2u;
        let above = indices[middle] <= index;
        low = select(low, middle, above);
        high = select(middle, high, above);
        if high - low <= 1u { break; }
    }
    return select(0u, low, indices[low] == index);
}

/// The motion scaled so that its blur over the exposure is at most frame.max_blur long.
fn limited(motion: vec4f) -> vec4f {
    let largest = max(max(abs(motion.x), abs(motion.y)), max(abs(motion.z), abs(motion.w)));
    let safe = motion * min(1.0, MAX_COMPONENT / max(largest, 1.0));
    let trajectory = trajectory_from(safe);
    let opening = displacement(trajectory, shutter.span.x);
    let turn = displacement(trajectory, slowest_time(trajectory, shutter.span.x, shutter.span.y));
    let closing = displacement(trajectory, shutter.span.y);
    let blur_length = max(distance(opening, closing), max(distance(opening, turn), distance(turn, closing)));
    return safe * min(1.0, frame.max_blur / max(blur_length, 1e-6));
}
