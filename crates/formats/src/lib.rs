//! One file a format: plans in and out, pictures
