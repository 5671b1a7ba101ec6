//! Objects and their parts: found in photos, carried to every view by the Gaussians, named and queried (the paper's
//! Method).
//!
//! In the order of the data: [`segmenter`] finds masks ([`regions`] without any model), and [`filters`] sort them into
//! objects and parts. [`tracker`] makes them identities over all views. [`votes`] gives every Gaussian its identity,
//! [`codes`] every identity its point in code space. [`view_map`] renders identities into a view.
//!
//! For a query: [`parse`] takes it apart, and [`reading`] mends its slips and reads noun compounds. [`names`] and
//! [`by_embedding`] score identities by name and by embedding. [`grounds`] say which words an answer rests on, and
//! [`localize`] picks the identities of the answer. [`answer`] puts it together, with the time of each of the
//! [`timing`] stages.

pub(crate) mod add_photo;
pub mod answer;
mod associate;
pub(crate) mod build_map;
pub mod by_embedding;
pub(crate) mod by_similarity;
pub(crate) mod carry;
pub mod code_map;
pub mod codes;
pub(crate) mod colors;
pub mod edit;
pub(crate) mod embed;
pub(crate) mod error;
pub(crate) mod filters;
mod floaters;
pub(crate) mod grounds;
#[cfg(test)]
mod heart;
pub(crate) mod keep;
pub mod kept_frames;
pub(crate) mod kept_masks;
mod kept_track;
pub mod localize;
pub mod matching;
pub(crate) mod names;
mod nearest;
pub(crate) mod network_segmenter;
pub mod parse;
mod prompt_points;
pub(crate) mod propagate;
pub(crate) mod protocols;
pub(crate) mod query_engine;
pub(crate) mod reading;
pub mod recipe;
pub mod regions;
pub mod relevancy;
pub(crate) mod removed;
pub(crate) mod sam2_tracker;
pub mod segmenter;
pub(crate) mod splat_tree;
pub(crate) mod thumbnails;
pub(crate) mod timing;
pub(crate) mod tracker;
pub(crate) mod train_codes;
pub mod view_map;
pub(crate) mod votes;
pub(crate) mod words;
