//! The whole way from a folder of photos or a video to poses, for window and command line.

use std::path::PathBuf;

use super::maker::MakerPlaces;
use super::{FoundPoses, MakerKind, environment, find, makers, source, usual_out};
use crate::io::unposed::Unposed;
use crate::jobs::{Folders, JobError};
use crate::pipeline::observer::{Observer, Severity};
use crate::scene::text;

/// Photos or a video that poses are wanted of, and how.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct PoseRequest {
    /// The photos, or the video.
    pub(crate) photos: Unposed,
    /// Maker; the best one that is here by default.
    pub(crate) maker: Option<MakerKind>,
    /// Folder for the result; one in the program's own folder by default.
    pub(crate) out: Option<PathBuf>,
    /// Number of photos from a video.
    pub(crate) frames: Option<usize>,
    /// True if the user agreed to [`environment::TERMS`], where no other maker is here.
    pub(crate) install: bool,
}

/// Photos without poses, and the makers that could find them: a question to the user.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct PoseQuestion {
    pub(crate) photos: Unposed,
    /// Makers that are here, the best first, with their names.
    pub(crate) makers: Vec<(MakerKind, String)>,
    /// Folder into which pycolmap can be installed; `None` without a Python.
    pub(crate) installs_into: Option<PathBuf>,
}

impl PoseQuestion {
    /// Looks for makers.
    pub(crate) fn of(photos: Unposed, folders: &Folders) -> Self {
        let places = MakerPlaces::usual(folders);
        let makers = makers::installed(&places).iter().map(|maker| (maker.kind(), maker.name())).collect();
        let has_python = ["python3", "python"].iter().any(|name| places.program(name).is_some());
        Self { photos, makers, installs_into: has_python.then_some(places.own_python) }
    }
}

/// Finds poses.
///
/// # Errors
/// As [`find`], and if no maker is here.
pub(crate) fn find_in(
    request: &PoseRequest,
    places: &MakerPlaces,
    folders: &Folders,
    observer: &mut dyn Observer,
) -> Result<FoundPoses, JobError> {
    let maker = match makers::choose(request.maker, places) {
        Err(JobError::NoPoseMaker(None | Some(MakerKind::Pycolmap))) if request.install => {
            environment::install(places, observer)?;
            makers::choose(Some(MakerKind::Pycolmap), places)?
        }
        maker => maker?,
    };
    // The folder belongs to what was opened, whichever photos it gave.
    let out = request.out.clone().unwrap_or_else(|| usual_out(&request.photos, folders));
    let photos = match &request.photos.video {
        Some(video) => source::photos_of(video, request.frames, observer)?,
        None => request.photos.clone(),
    };
    find(&photos, &*maker, &out, observer)
}

/// [`find_in`] the places of this process.
pub(crate) fn find_here(
    request: &PoseRequest,
    folders: &Folders,
    observer: &mut dyn Observer,
) -> Result<FoundPoses, JobError> {
    find_in(request, &MakerPlaces::usual(folders), folders, observer)
}

impl FoundPoses {
    /// Sentence on all photos.
    pub(crate) fn summary(&self) -> String {
        let off = self.error_px.map_or_else(String::new, |e| format!(", {e:.2} px off"));
        let (registered, photos, points) = (self.registered, self.photos, self.points);
        format!("{registered} of {photos} photos have a pose, by {}; {points} points{off}", self.maker)
    }

    /// Sentences on single photos.
    pub(crate) fn remarks(&self) -> Vec<String> {
        let missing = self.missing.iter().map(|r| format!("{}: no pose; it {}", text::line(&r.photo), r.why));
        let doubtful =
            self.doubtful.iter().map(|r| format!("{}: its pose may be wrong; it {}", text::line(&r.photo), r.why));
        missing.chain(doubtful).collect()
    }

    /// Puts both into the log.
    pub(crate) fn tell(&self, observer: &mut dyn Observer) {
        observer.note(Severity::Info, self.summary());
        self.remarks().into_iter().for_each(|remark| observer.note(Severity::Warning, remark));
    }
}

/// Name for titles of what was opened: of a folder `images` the one above.
pub(crate) fn name_of(photos: &Unposed) -> String {
    match &photos.video {
        Some(video) => source::stem(video),
        None => crate::io::files::data_set_name(&photos.folder),
    }
}
