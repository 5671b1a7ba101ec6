//! Gaussians as a tree of what belongs together: what masks and clicks say of some is said of those that go with them,
//! without any network.
//!
//! The [`surface`] of a scene (what lies side by side, and how clearly something ends between) is merged into a tree
//! once, the most alike first, as regions of a photo are. Votes of pixels are [`labels`] of leaves, from which those of
//! all others follow. Clicks and strokes are [`marks`]: a selection grows from each as far as things hang together, and
//! not over what is marked as being no part of it. So an answer takes no drawing and little time, however many
//! corrections come.

pub(crate) mod hierarchy;
mod labels;
pub(crate) mod marks;
mod surface;
