// Pixels around one: those outside are the nearest ones inside.
//#include common/frame.wgsl

const RADIUS: i32 = 2;  // of the rows and columns in which motion is measured [px]

fn inside(px: vec2i) -> vec2i {
    return clamp(px, vec2i(0), vec2i(frame.size) - 1);
}
