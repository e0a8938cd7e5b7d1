// Light that may differ: changes of less than LEAST (gain.wgsl) do not count.
//#include methods/gather/shading/light.wgsl

const DIFFERS: f32 = 0.075;     // share of a channel

fn differs(here: vec3f, there: vec3f) -> bool {
    return any(abs(there - here) > DIFFERS * (here + dark()));
}
