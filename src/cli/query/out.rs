//! Files of `--out`: relevancy, the mask by the own rule and the mask by the common one.

use std::path::PathBuf;

use super::QueryArgs;
use crate::cli::CliError;
use crate::jobs::{Scene, export, query};
use crate::scene::{Camera, Mask};

/// Names of the files, without ending.
const FILES: [&str; 3] = ["relevancy", "mask-own-rule", "mask-common-rule"];

/// Places of the files.
pub(super) struct OutFiles {
    folder: PathBuf,
    files: [PathBuf; 3],
}

impl OutFiles {
    /// Returns the places that the arguments ask for, if they ask for any; refuses files that cannot be written.
    pub(super) fn of(args: &QueryArgs, scene: &Scene) -> Result<Option<Self>, CliError> {
        let Some(folder) = &args.out else { return Ok(None) };
        export::check_folder(folder, &scene.reads())?;
        let ending = if args.arrays { "npy" } else { "png" };
        let files = FILES.map(|name| folder.join(format!("{name}.{ending}")));
        files.iter().try_for_each(|file| export::check(file, &query::MAP_ENDINGS, &scene.reads()))?;
        Ok(Some(Self { folder: folder.clone(), files }))
    }

    /// Writes the files; that of a mask which there is not is left out.
    pub(super) fn write(
        &self,
        scene: &Scene,
        camera: &Camera,
        relevancy: &[f32],
        masks: [Option<&Mask>; 2],
    ) -> Result<(), CliError> {
        let [heat, own, common] = &self.files;
        export::make_folder(&self.folder)?;
        query::write_heat(heat, (&scene.cloud, &scene.settings), camera, relevancy)?;
        for (file, mask) in [own, common].into_iter().zip(masks) {
            mask.map_or(Ok(()), |mask| query::write_mask(file, mask))?;
        }
        Ok(())
    }
}
