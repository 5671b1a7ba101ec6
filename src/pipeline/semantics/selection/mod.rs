//! What somebody points at: Gaussians that belong together with those under clicks and strokes, without any network.
//!
//! The [`surface`] of a scene (what lies side by side, and how clearly something ends between) is merged into a tree
//! once, the most alike first, as regions of a photo are. Marks are places in it: a selection grows from each mark as
//! far as things hang together, and not over what is marked as being no part of it. So an answer takes no drawing and
//! little time, however many corrections come.

pub(crate) mod hierarchy;
pub(crate) mod marks;
pub(crate) mod surface;
