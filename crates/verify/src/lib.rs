//! Replays a tick table and certifies it, sharing no code with the planner
