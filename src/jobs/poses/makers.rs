//! Makers of camera poses that are here.

#[cfg(feature = "sfm")]
use super::built_in::BuiltIn;
use super::colmap::Colmap;
use super::maker::{MakerKind, MakerPlaces, PoseMaker};
use super::pycolmap::Pycolmap;
use crate::jobs::JobError;

/// Makers that are here, the best first. Python is started to ask for its package.
pub(crate) fn installed(places: &MakerPlaces) -> Vec<Box<dyn PoseMaker>> {
    let mut all: Vec<Box<dyn PoseMaker>> = Vec::new();
    if let Some(colmap) = Colmap::at(places) {
        all.push(Box::new(colmap));
    }
    if let Some(pycolmap) = Pycolmap::at(places) {
        all.push(Box::new(pycolmap));
    }
    #[cfg(feature = "sfm")]
    all.push(Box::new(BuiltIn));
    all
}

/// The wanted maker, or the best one that is here.
///
/// # Errors
/// If it is not here; the error says how to get it.
pub(crate) fn choose(wanted: Option<MakerKind>, places: &MakerPlaces) -> Result<Box<dyn PoseMaker>, JobError> {
    let found = installed(places).into_iter().find(|maker| wanted.is_none_or(|kind| kind == maker.kind()));
    found.ok_or(JobError::NoPoseMaker(wanted))
}
