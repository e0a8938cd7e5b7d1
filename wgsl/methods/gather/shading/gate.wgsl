// Workgroups of all later passes: none if light changes nowhere.
//#include common/frame.wgsl

const GATES: u32 = 32u;

struct Sizes {
    counts: array<vec4u, GATES>,    // invocations across and down of the passes; 0, 0
}

@group(1) @binding(0) var<uniform> sizes: Sizes;
@group(1) @binding(1) var<storage, read> found: array<u32>;
@group(1) @binding(2) var<storage, read_write> gates: array<u32>;   // three words a pass

@compute @workgroup_size(1)
fn main() {
    for (var k = 0u; k < GATES; k++) {
        let size = sizes.counts[k].xy;
        gates[3u * k] = select(0u, (size.x + WG_X - 1u) / WG_X, found[0] == 1u);
        gates[3u * k + 1u] = (size.y + WG_Y - 1u) / WG_Y;
        gates[3u * k + 2u] = 1u;
    }
}
