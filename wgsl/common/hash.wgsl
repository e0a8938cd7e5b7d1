// Hashes of integers, and uniform numbers in [0, 1) from their bits: same input, same bits.

/// PCG2D (Jarzynski and Olano, "Hash Functions for GPU Rendering", 2020).
fn pcg2d(key: vec2u) -> vec2u {
    var v = key * 1664525u + 1013904223u;
    v.x += v.y * 1664525u;
    v.y += v.x * 1664525u;
    v ^= v >> vec2u(16u);
    v.x += v.y * 1664525u;
    v.y += v.x * 1664525u;
    v ^= v >> vec2u(16u);
    return v;
}

/// PCG3D (the same paper).
fn pcg3d(key: vec3u) -> vec3u {
    var v = key * 1664525u + 1013904223u;
    v.x += v.y * v.z;
    v.y += v.z * v.x;
    v.z += v.x * v.y;
    v ^= v >> vec3u(16u);
    v.x += v.y * v.z;
    v.y += v.z * v.x;
    v.z += v.x * v.y;
    return v;
}

/// One multiplicative round for the points of a lattice: enough to give each brick a tone of its own.
fn lattice_hash(point: vec2i) -> u32 {
    let h = (u32(point.x) * 0x9E3779B1u) ^ (u32(point.y) * 0x85EBCA77u);
    return (h ^ (h >> 15u)) * 0x2C1B3C6Du;
}

// The upper 24 bits are as many as an f32 in [0, 1) can hold exactly.

fn unit_float(bits: u32) -> f32 {
    return f32(bits >> 8u) / 16777216.0;
}

fn unit_float2(bits: vec2u) -> vec2f {
    return vec2f(bits >> vec2u(8u)) / 16777216.0;
}

fn unit_float3(bits: vec3u) -> vec3f {
    return vec3f(bits >> vec3u(8u)) / 16777216.0;
}
