// Functions that measure.wgsl and smooth.wgsl share.

const RADIUS: i32 = 2;  // of the rows and columns in which motion is measured [px]
