// A part of a picture that may be swept by itself: as many pixels of one colour of the chessboard as a workgroup has.

const TILE: u32 = 8u;   // px of a colour along a side: rows hold twice as many pixels
