// Workgroups of the search: with moving light, or without it where no light changes.
//#include methods/gather/worklist.wgsl

@group(1) @binding(0) var<storage, read> found: array<u32>;     // 1 if light changes anywhere
@group(1) @binding(1) var<storage, read> worklist: WorkList;
@group(1) @binding(2) var<storage, read_write> groups: array<u32>;  // three words with light, three without

@compute @workgroup_size(1)
fn main() {
    let moves = found[0] == 1u;
    groups[0] = select(0u, worklist.groups.x, moves);
    groups[3] = select(worklist.groups.x, 0u, moves);
    for (var k = 0u; k < 2u; k++) {
        groups[3u * k + 1u] = worklist.groups.y;
        groups[3u * k + 2u] = worklist.groups.z;
    }
}
