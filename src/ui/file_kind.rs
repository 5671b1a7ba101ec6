//! Kinds of files, each of which is chosen from a folder of its own.

use std::collections::BTreeMap;
use std::path::PathBuf;

use serde::{Deserialize, Serialize};

/// Kind of files; each is chosen from a folder of its own.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
pub enum FileKind {
    Photos,
    Scenes,
    Masks,
    Gaussians,
    Objects,
    Pages,
    Pictures,
    Videos,
    Paths,
    Models,
    Measurements,
    Reports,
    Conversations,
}

/// Folder that each kind of files was last chosen from.
pub type KindFolders = BTreeMap<FileKind, PathBuf>;

impl FileKind {
    /// True if it is opened as a scene: other kinds begin beside it.
    pub(crate) fn is_scene(self) -> bool {
        matches!(self, Self::Photos | Self::Scenes)
    }
}
