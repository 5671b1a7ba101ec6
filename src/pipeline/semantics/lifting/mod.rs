//! Lifting: from photos and their masks to a `SemanticMap`, which has an identity for every Gaussian, and a code and an
//! embedding for every identity.
//!
//! In the order of the data, which [`build_map`] runs:
//!
//! 1. [`segmenter`] finds the masks of a photo: in files, by a network ([`network_segmenter`]), or as [`regions`] of
//!    even color. [`filters`] sort masks into objects and parts.
//! 2. [`tracker`] makes masks identities over all views: by the Gaussians, or by [`sam2_tracker`] from photo to photo.
//! 3. [`votes`], of each view by [`view_votes`], give every Gaussian its identity; [`splat_tree`] labels Gaussians without votes by the things that they
//!    belong to, [`mirror`] by the other side of these.
//! 4. [`codes`] give every identity its point in code space; [`train_codes`] trains the codes of Gaussians instead, as
//!    in the paper.
//! 5. [`embed`] gives every identity its embedding; [`mask_vectors`] takes it from vectors that came with the masks.
//!
//! Views of the photos are drawn by [`renderers`], several at once; [`kept_views`] serve those that are weighed again.
//!
//! A known map changes by [`edit`], [`add_photo`] and the masks of close-ups ([`closer`]). [`keep`] holds edited objects in a new search, and [`carry`]
//! takes the map to other Gaussians of the scene.

pub(crate) mod add_photo;
mod associate;
pub(crate) mod build_map;
pub(crate) mod carry;
pub(crate) mod closer;
pub mod codes;
pub mod edit;
pub(crate) mod embed;
pub(crate) mod error;
pub(crate) mod filters;
mod floaters;
pub mod frame_cache;
pub(crate) mod keep;
mod kept_views;
pub(crate) mod mask_cache;
mod mask_vectors;
mod mirror;
mod nearest;
pub(crate) mod network_segmenter;
mod prompt_points;
pub(crate) mod propagate;
pub mod regions;
pub(crate) mod removed;
mod renderers;
pub(crate) mod sam2_tracker;
pub mod segmenter;
pub(crate) mod splat_tree;
mod track_cache;
pub(crate) mod tracker;
pub(crate) mod train_codes;
mod view_votes;
pub(crate) mod votes;
