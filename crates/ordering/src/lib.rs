//! The order of strokes: merge, remove duplicates, reorder, reverse, by a cost that is handed in
