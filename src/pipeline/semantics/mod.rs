//! Objects and their parts: found in photos, carried to every view by the Gaussians, named, asked
//! for (the paper's Method).
//!
//! In the order of the data: [`segmenter`] finds masks ([`regions`] without any model; [`filters`]
//! tell objects from parts), [`tracker`] makes them identities over all views, [`votes`] gives every Gaussian its
//! identity, [`codes`] every identity its point in code space, [`view_map`] draws identities into a view; [`parse`] takes a query apart, [`names`] and
//! [`by_embedding`] score identities for it by name and by embedding, [`localize`] picks those that are
//! meant, and [`answer`] puts it together, with the time of each of the [`timing`] stages.

pub mod answer;
mod associate;
pub mod build_map;
pub mod by_embedding;
pub mod carry;
pub mod code_map;
pub mod codes;
pub mod edit;
pub mod embed;
pub mod filters;
#[cfg(test)]
mod heart;
pub mod localize;
pub mod matching;
pub mod names;
pub mod network_segmenter;
pub mod parse;
pub mod propagate;
pub mod protocols;
pub mod query_engine;
pub mod regions;
pub mod relevancy;
pub mod sam2_tracker;
pub mod segmenter;
pub mod thumbnails;
pub mod timing;
pub mod tracker;
pub mod train_codes;
pub mod view_map;
pub mod votes;
