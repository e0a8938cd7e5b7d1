// Tiles into which a body carries its shadow: light changes there, even if neither neighbour shows the place.
//#include common/frame.wgsl
//#include methods/gather/shading/active.wgsl
//#include methods/gather/shading/listed.wgsl

struct Carry {
    last: f32,          // share of the way to the neighbour that the exposure takes
}

@group(1) @binding(0) var<uniform> carry: Carry;
@group(1) @binding(1) var values: texture_2d<f32>;      // stored as rgba16float
@group(1) @binding(2) var flow: texture_2d<f32>;        // stored as rgba16float, by `settle` of extrapolate.wgsl
@group(1) @binding(3) var<storage, read_write> found: FoundTiles;
@group(1) @binding(4) var<storage, read_write> changing: TileList;

const DARK: f32 = 0.3;          // value from which on a pixel is in a shadow
const MOVES: f32 = 0.5;         // least motion that counts [px]
const PLACES: u32 = 4u;         // of the way at which tiles are told

/// One of 2 x 2 pixels.
@compute @workgroup_size(WG_X, WG_Y)
fn main(@builtin(local_invocation_index) local: u32, @builtin(workgroup_id) group: vec3u) {
    let px = 2u * listed_half(group, local);
    if any(px >= frame.size) { return; }
    let known = textureLoad(flow, px, 0);
    let way = carry.last * known.xy;
    let is_carried = known.w < 0.0 && textureLoad(values, px, 0).a > DARK && length(way) > MOVES;
    for (var k = 0u; k < select(0u, PLACES, is_carried); k++) {
        let at = vec2f(px) + 0.5 + f32(k) / f32(PLACES - 1u) * way;
        if all(at >= vec2f(0.0)) && all(at < vec2f(frame.size)) { tell(light_tile(vec2u(at))); }
    }
}

/// Of a tile near changes, once.
fn tell(tile: u32) {
    if (atomicLoad(&found.tiles[tile]) & NEAR) == 0u { return; }
    if (atomicOr(&found.tiles[tile], CHANGES) & CHANGES) == 0u { changing.tiles[atomicAdd(&changing.count, 1u)] = tile; }
}
