// Light that moves over the surfaces, in this frame and in a neighbour, and its flow both ways; read between pixels.
//#include methods/gather/shading/light.wgsl

@group(1) @binding(6) var values: texture_2d<f32>;      // stored as rgba16float, by values.wgsl
@group(1) @binding(7) var values_there: texture_2d<f32>;    // stored as rgba16float
@group(1) @binding(8) var flow: texture_2d<f32>;        // stored as rgba16float: to the other frame [px]; trust; see `settle` of extrapolate.wgsl
@group(1) @binding(9) var flow_back: texture_2d<f32>;   // stored as rgba16float

const PRESENT: f32 = 0.1;       // value from which on there is something to move

fn values_at(at: vec2f) -> vec4f {
    let s = square_around(at);
    return mixed(s, textureLoad(values, s.pair.xy, 0), textureLoad(values, s.pair.zy, 0),
                 textureLoad(values, s.pair.xw, 0), textureLoad(values, s.pair.zw, 0));
}

fn values_there_at(at: vec2f) -> vec4f {
    let s = square_around(at);
    return mixed(s, textureLoad(values_there, s.pair.xy, 0), textureLoad(values_there, s.pair.zy, 0),
                 textureLoad(values_there, s.pair.xw, 0), textureLoad(values_there, s.pair.zw, 0));
}

fn flow_at(at: vec2f) -> vec4f {
    let s = square_around(at);
    return mixed(s, textureLoad(flow, s.pair.xy, 0), textureLoad(flow, s.pair.zy, 0),
                 textureLoad(flow, s.pair.xw, 0), textureLoad(flow, s.pair.zw, 0));
}

fn flow_back_at(at: vec2f) -> vec4f {
    let s = square_around(at);
    return mixed(s, textureLoad(flow_back, s.pair.xy, 0), textureLoad(flow_back, s.pair.zy, 0),
                 textureLoad(flow_back, s.pair.xw, 0), textureLoad(flow_back, s.pair.zw, 0));
}
