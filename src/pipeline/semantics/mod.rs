//! Objects and their parts: found in photos, carried to every view by the Gaussians, named and queried (the paper's
//! Method).
//!
//! Three rooms, in the order of the data:
//!
//! 1. [`lifting`]: from photos and their masks to a `SemanticMap`, and edits of it.
//! 2. [`query`]: from a typed query to the identities meant, and to their pixels and Gaussians.
//! 3. [`evaluation`]: answers and selections compared with labeled photos.
//!
//! A room uses the rooms before it, never one after it. The modules beside the rooms use no room: [`view_map`] and
//! [`code_map`] render the identities of a known map and their codes into a view, [`thumbnails`] renders each identity
//! alone, [`relevancy`] compares embeddings, of phrases and of parts with their wholes, and [`smoothing`] makes masks
//! of relevancy as LangSplat does, and by a rule that is common to all methods.

pub mod code_map;
pub(crate) mod evaluation;
pub mod lifting;
pub mod query;
pub mod relevancy;
pub(crate) mod smoothing;
pub(crate) mod thumbnails;
pub mod view_map;
