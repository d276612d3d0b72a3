//! How lines get to a machine, whatever its firmware: one at a time, in a window of numbers, in a window of bytes, or
//! without any acknowledgement. What the firmware's lines and answers mean is passed in.

pub mod character_counting;
pub mod open_loop;
pub mod sliding_window;
pub mod stop_and_wait;
