// The frame and a neighbour, whose light is compared.
//#include methods/gather/shading/changes/side.wgsl

@group(1) @binding(0) var<uniform> side: Side;
@group(1) @binding(1) var light_here: texture_2d<f32>;     // stored as given
@group(1) @binding(2) var light_there: texture_2d<f32>;     // stored as given
@group(1) @binding(3) var depth_here: texture_2d<f32>;     // stored as given
@group(1) @binding(4) var depth_there: texture_2d<f32>;     // stored as given
@group(1) @binding(5) var motion_here: texture_2d<f32>;     // stored as given: to_prev, to_next [px]
