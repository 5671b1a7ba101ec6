//! Objects and their parts: found in photos, carried to every view by the Gaussians, named, asked
//! for (the paper's Method).
//!
//! In the order of the data: [`segmenter`] finds masks, [`tracker`] makes them identities over all
//! views, [`votes`] gives every Gaussian its identity, [`codes`] every identity its point in code
//! space, [`view_map`] draws identities into a view; [`grammar`] takes a query apart, and [`localise`]
//! answers it from one view's map.

pub mod codes;
mod extend;
pub mod find;
pub mod grammar;
mod link;
pub mod localise;
pub mod names;
pub mod score;
pub mod segmenter;
pub mod tracker;
pub mod view_map;
pub mod votes;
