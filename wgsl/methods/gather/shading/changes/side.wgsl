// The side of the frame on which a neighbour is.

struct Side {
    next: u32,          // 1: the neighbour is the next frame; 0: the previous one
}
