// The index of each pixel's body from the pick buffer of pygfx, whose lowest 20 bits are the object's id.
//#include common/frame.wgsl

@group(1) @binding(0) var pick: texture_2d<u32>;        // 16 bits in each channel
@group(1) @binding(1) var<storage, read> bodies: array<u32>;    // by id: the index of the body, 0 for the world
@group(1) @binding(2) var object: texture_storage_2d<r32uint, write>;

const IDS: u32 = 1048576u;      // 2 to the power of 20

@compute @workgroup_size(WG_X, WG_Y)
fn main(@builtin(global_invocation_id) at: vec3u) {
    if any(at.xy >= frame.size) {
        return;
    }
    let picked = textureLoad(pick, at.xy, 0);
    let id = (picked.x | (picked.y << 16u)) % IDS;
    textureStore(object, at.xy, vec4u(bodies[id], 0u, 0u, 0u));
}
