//! From strokes to motor ticks against time
