//! Photos with poses: layouts, names, splits, poses.
