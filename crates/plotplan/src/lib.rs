//! The compiler from pen-plotter drawings to motor motion
