//! Splats of other programs: axes, numbers, properties.
