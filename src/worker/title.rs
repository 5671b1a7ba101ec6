//! Titles of commands, for display.

use std::path::PathBuf;

use super::protocol::Command;

impl Command {
    /// Title of the job, such as "Opening fox".
    pub(crate) fn title(&self) -> String {
        let name =
            |p: &PathBuf| p.file_name().map_or_else(|| p.display().to_string(), |n| n.to_string_lossy().into_owned());
        match self {
            Self::Open { path } => format!("Opening {}", name(path)),
            Self::OpenBeside { path } => format!("Opening {} beside", name(path)),
            Self::Demo => "Opening the demo".into(),
            Self::DemoPhotos => "Rendering the demo scene".into(),
            Self::FindPoses(photos) => format!("Finding camera poses of {}", name(&photos.folder)),
            Self::Train { dataset, .. } => format!("Training {}", dataset.name),
            Self::Evaluate { dataset, .. } => format!("Evaluating {}", dataset.name),
            Self::FindObjects(request) if request.known.is_some() => {
                format!("Segmenting {}", request.with.seed.as_deref().unwrap_or("a photo"))
            }
            Self::FindObjects(request) => format!("Finding objects in {}", request.dataset.name),
            Self::Remove(_) => "Removing".into(),
            Self::EditObjects { .. } => "Editing objects".into(),
            Self::Rearrange(_) => "Editing Gaussians".into(),
            Self::MeasureSplats(_) => "Measuring Gaussians".into(),
            Self::Select(_) => "Selecting".into(),
            Self::SetScale { .. } => "Saving the scale".into(),
            Self::Export { path, .. } | Self::Picture { path, .. } => format!("Writing {}", name(path)),
            Self::Photo { photo, .. } => format!("Loading {}", photo.name),
            Self::KeepPicture { of, .. } => format!("Saving the thumbnail of {}", name(of)),
            Self::RecentPictures(_) => "Loading thumbnails of recent scenes".into(),
            Self::RecentRuns(_) => "Listing trainings of recent photos".into(),
            Self::Thumbnails { .. } => "Rendering thumbnails".into(),
            Self::ListModels => "Listing models".into(),
            Self::Explore { .. } => "Building the navigation graph".into(),
            Self::InstallModel { id, .. } => format!("Installing the model {id}"),
            Self::Approach(request) => {
                format!("Planning the flight to {}", request.map.identities.full_name(request.id))
            }
            Self::Inspect(_) => "Looking into a pixel".into(),
            Self::Video(request) => format!("Rendering {}", name(&request.out)),
            Self::Measure(_) => "Benchmarking rendering".into(),
            Self::Phrases(_) => "Running the phrase list".into(),
            Self::ExportAll(request) => format!("Writing {}", name(&request.folder)),
            Self::ExportPage(request) => format!("Writing {}", name(&request.out)),
            Self::ReadReport { path, .. } => format!("Opening the report {}", name(path)),
        }
    }
}
