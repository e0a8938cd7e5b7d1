// Angles [rad].

const PI: f32 = 3.14159265;
const TAU: f32 = 6.28318531;    // a whole turn
