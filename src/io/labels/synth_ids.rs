//! Id maps written by `fmlgs synth`.

use std::collections::HashSet;
use std::path::{Path, PathBuf};

use serde::Deserialize;

use super::belongs::LabelAddress;
use super::pictures::png_stem;
use super::{Region, Sheet, entries, read_ids};
use crate::io::{IoError, files};
use crate::scene::{Level, Mask, text};

pub(crate) const LIST_FILE: &str = "identities.json";

#[derive(Deserialize)]
struct File {
    identities: Vec<ListedIdentity>,
}

#[derive(Clone, Debug, Deserialize)]
pub(crate) struct ListedIdentity {
    /// Value in the id maps.
    pub(crate) id: u16,
    #[serde(deserialize_with = "text::read_name")]
    pub(crate) name: String,
    pub(crate) level: Level,
    /// For a part, the id of the object or part that contains it.
    #[serde(default)]
    pub(crate) parent: Option<u16>,
}

/// A folder with id maps.
pub struct SynthIds {
    root: PathBuf,
    list: Vec<ListedIdentity>,
    /// Names of the pictures in the folder of objects, without ending.
    pictures: Vec<String>,
}

/// Folder with the pictures of a level.
pub(crate) fn folder(level: Level) -> &'static str {
    if level == Level::Object { "object_ids" } else { "part_ids" }
}

impl SynthIds {
    /// Reads the list in the folder `root`.
    pub fn open(root: &Path) -> Result<Self, IoError> {
        let file: File = files::read_json(&root.join(LIST_FILE))?;
        let names = entries(&root.join(folder(Level::Object)));
        let pictures = names.iter().filter_map(|name| png_stem(name).map(str::to_owned)).collect();
        Ok(Self { root: root.into(), list: file.identities, pictures })
    }

    /// Addresses of the pictures of objects.
    pub(super) fn addresses(&self) -> Vec<LabelAddress> {
        let address = |name: &String| LabelAddress::of_file(self.path(Level::Object, name), "", "");
        self.pictures.iter().map(address).collect()
    }

    fn path(&self, level: Level, name: &str) -> PathBuf {
        self.root.join(folder(level)).join(format!("{name}.png"))
    }

    /// Returns the ids of a listed identity and of its parts: a picture shows the innermost one of a level.
    fn with_pieces(&self, listed: &ListedIdentity) -> HashSet<u16> {
        let mut ids = HashSet::from([listed.id]);
        // Repeated until no part is added: the list may be in any order.
        while let Some(piece) = self.list.iter().find(|l| {
            l.level == listed.level && !ids.contains(&l.id) && l.parent.is_some_and(|parent| ids.contains(&parent))
        }) {
            ids.insert(piece.id);
        }
        ids
    }

    /// Reads the regions of the picture at `index`, also those without a pixel: objects, then parts, in the list's
    /// order.
    pub(super) fn regions(&self, index: usize, sheet: Sheet<'_>) -> Result<Vec<Region>, IoError> {
        let Some(name) = self.pictures.get(index) else { return Ok(Vec::new()) };
        let mut regions = Vec::with_capacity(self.list.len());
        let mut ids_of = Vec::new();
        for level in [Level::Object, Level::Part] {
            let path = self.path(level, name);
            let (width, height, ids) = read_ids(&path, sheet, self.list.len())?;
            // Regions that show each id, so that all are filled in one pass.
            let mut shown_by = vec![Vec::new(); usize::from(u16::MAX) + 1];
            for listed in self.list.iter().filter(|l| l.level == level) {
                let parent = listed.parent.and_then(|p| ids_of.iter().position(|id| *id == p));
                self.with_pieces(listed).into_iter().for_each(|id| shown_by[usize::from(id)].push(regions.len()));
                let mask = Mask::empty(width, height);
                regions.push(Region { name: listed.name.clone(), level: Some(level), parent, mask });
                ids_of.push(listed.id);
            }
            for (i, id) in ids.into_iter().enumerate() {
                shown_by[usize::from(id)].iter().for_each(|region| regions[*region].mask.insert(i));
            }
        }
        Ok(regions)
    }
}
