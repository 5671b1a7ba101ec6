//! Jobs by number and by sort, and which thread runs each.

/// Names one job of one worker.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct JobId(pub(crate) u64);

impl JobId {
    /// First number of jobs on other computers: no worker counts so far.
    pub(crate) const REMOTE: Self = Self(1 << 63);

    /// Returns whether it runs on another computer.
    pub(crate) fn is_remote(self) -> bool {
        self >= Self::REMOTE
    }
}

/// Kind of a job.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum JobKind {
    /// Reads a file or folder.
    Open,
    /// Reads a scene to be seen beside the one on screen.
    Beside,
    /// Reads the trained demo.
    Demo,
    /// Makes the demo's photos and reads them.
    DemoPhotos,
    /// Finds camera poses.
    Poses,
    /// Trains Gaussians.
    Train,
    /// Measures held-out quality.
    Evaluate,
    /// Finds objects and parts.
    Objects,
    /// Takes things out of a scene.
    Remove,
    /// Measures Gaussians, to clean them.
    Clean,
    /// Changes objects and parts, or Gaussians.
    Edit,
    /// Takes in a click or a stroke.
    Select,
    /// Writes a file.
    Export,
    /// Loads a photo's pixels.
    Photo,
    /// Writes a picture.
    Picture,
    /// Draws objects and parts alone.
    Thumbnails,
    /// Lists models.
    Models,
    /// Explores the free space of a scene.
    Explore,
    /// Puts a model in place.
    Model,
    /// Finds the way to an identity.
    Approach,
    /// Draws a video.
    Video,
    /// Measures drawing, knob by knob.
    Measure,
    /// Reads a report.
    Report,
    /// Stores the scene's scale.
    Scale,
    /// Asks a list of phrases.
    Phrases,
    /// Writes all objects and parts.
    ExportAll,
    /// Writes a page to show.
    ExportPage,
    /// Looks into a pixel.
    Inspect,
}

impl JobKind {
    /// Returns whether its outcome becomes the scene on screen: its warnings are about that scene.
    pub(crate) fn makes_scene(self) -> bool {
        matches!(self, Self::Open | Self::Demo | Self::DemoPhotos | Self::Poses | Self::Train | Self::Objects)
    }

    /// Returns whether it can be paused.
    pub(crate) fn can_pause(self) -> bool {
        matches!(
            self,
            Self::Train
                | Self::Objects
                | Self::Remove
                | Self::Clean
                | Self::Model
                | Self::Video
                | Self::Phrases
                | Self::ExportAll
                | Self::ExportPage
        )
    }

    /// Thread that runs it.
    pub(crate) fn lane(self) -> WorkerThread {
        match self {
            Self::Open | Self::Demo | Self::Train | Self::Evaluate | Self::Objects => WorkerThread::Long,
            Self::DemoPhotos
            | Self::Poses
            | Self::Remove
            | Self::Clean
            | Self::Model
            | Self::Video
            | Self::Measure
            | Self::Phrases
            | Self::ExportAll
            | Self::ExportPage => WorkerThread::Long,
            Self::Beside
            | Self::Edit
            | Self::Select
            | Self::Export
            | Self::Photo
            | Self::Picture
            | Self::Thumbnails => WorkerThread::Short,
            Self::Models | Self::Explore | Self::Approach | Self::Scale | Self::Report | Self::Inspect => {
                WorkerThread::Short
            }
        }
    }
}

/// Thread of the worker that runs a job.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum WorkerThread {
    /// Jobs of minutes, one after another.
    Long,
    /// Short jobs, run beside a long one.
    Short,
}
