//! Gaussians as a tree of things that belong together: masks and clicks on some Gaussians label the others that go
//! with them, without any network.
//!
//! The [`surface`] of a scene (neighboring Gaussians, and the borders between them) is merged into a tree once, the
//! most alike first, as regions of a photo are. Votes of pixels become [`labels`] of leaves, from which those of all
//! others follow. Clicks and strokes are [`marks`]: a [`selection`] grows from each over connected Gaussians, but not
//! over those marked as outside. So an answer takes no rendering and little time, however many corrections come. They
//! leave to [`others`] what no mark touches.
//!
//! Labels minimize a cost over the tree: votes of masks weigh more than photo edges (`tracker/complete.rs`). A click
//! or stroke renders only the Gaussians near it.

mod band;
mod cheapest;
pub(crate) mod hierarchy;
mod labels;
mod leaves;
pub(crate) mod marks;
pub(crate) mod others;
mod seen;
pub(crate) mod selection;
pub(crate) mod stored;
pub(crate) mod surface;
