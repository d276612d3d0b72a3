//! Machines: geometry, coupling, motors, limits, reach
