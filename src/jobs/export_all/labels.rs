//! Masks of photos as label files, in the formats that [`Labels`](crate::io::labels::Labels) reads.

use std::collections::HashMap;
use std::path::Path;

use image::ColorType;
use serde_json::{Value, json};

use super::MaskFormat;
use super::folder::ExportFolder;
use crate::io::labels::{Region, isat, synth_ids};
use crate::io::{IoError, atomic};
use crate::jobs::coco::Coco;
use crate::jobs::{JobError, export};
use crate::pipeline::semantics::view_map::ViewMap;
use crate::scene::identity::whole_names::BETWEEN;
use crate::scene::{Camera, Identities, Identity, IdentityId, Level, NO_IDENTITY};

pub(super) use crate::io::labels::stem;

/// Writes the label files of a scene's photos.
pub(super) struct LabelWriter<'a> {
    all: &'a Identities,
    masks: &'a [MaskFormat],
    /// Unique names in a file of polygons, by number less one.
    categories: Vec<String>,
    coco: Coco,
}

impl<'a> LabelWriter<'a> {
    /// # Errors
    /// If a scene has more identities than a 16-bit picture has numbers.
    pub(super) fn new(all: &'a Identities, masks: &'a [MaskFormat]) -> Result<Self, JobError> {
        if masks.contains(&MaskFormat::Ids) && all.len() > usize::from(u16::MAX) {
            let text =
                format!("{} objects and parts exceed the numbers of a 16-bit picture: leave out 'ids'", all.len());
            return Err(JobError::Output(text));
        }
        Ok(Self { all, masks, categories: categories(all), coco: Coco::default() })
    }

    /// Writes the masks of a photo.
    pub(super) fn view(
        &mut self,
        name: &str,
        camera: &Camera,
        view: &ViewMap,
        folder: &mut ExportFolder,
    ) -> Result<(), JobError> {
        let stem = stem(name);
        if self.masks.contains(&MaskFormat::Ids) {
            self.pictures(&stem, view, folder)?;
        }
        if !self.masks.iter().any(|format| matches!(format, MaskFormat::Isat | MaskFormat::Coco)) {
            return Ok(());
        }
        self.coco.view(name, camera);
        let mut place = vec![None; self.all.len() + 1];
        let mut regions: Vec<Region> = Vec::new();
        for (id, identity) in self.all.iter() {
            let mask = view.mask(self.all, id);
            if mask.is_empty() {
                continue;
            }
            self.coco.mask(id as usize, &mask, None);
            place[id as usize] = Some(regions.len());
            let parent = place[identity.parent as usize];
            let name = self.categories[id as usize - 1].clone();
            regions.push(Region { name, level: Some(identity.level), parent, mask });
        }
        if self.masks.contains(&MaskFormat::Isat) {
            let document = isat::document(name, [view.width_px, view.height_px], &regions);
            folder.write(&format!("isat/{stem}.json"), |path| compact(path, &document))?;
        }
        Ok(())
    }

    /// Writes pictures of the numbers of objects, and of the innermost parts.
    fn pictures(&self, stem: &str, view: &ViewMap, folder: &mut ExportFolder) -> Result<(), JobError> {
        let numbers: Vec<[u16; 2]> = (0..=self.all.len() as IdentityId).map(|id| self.numbers(id)).collect();
        for (level, of) in [Level::Object, Level::Part].into_iter().zip(0..) {
            let number = |id: &IdentityId| numbers.get(*id as usize).map_or(0, |n| n[of]);
            let pixels: Vec<u8> = view.identity.iter().map(number).flat_map(u16::to_ne_bytes).collect();
            let size = [view.width_px as u32, view.height_px as u32];
            let place = format!("ids/{}/{stem}.png", synth_ids::folder(level));
            folder.write(&place, |path| export::png(path, &pixels, size, ColorType::L16))?;
        }
        Ok(())
    }

    /// Returns the object and the part that a pixel of an identity shows.
    fn numbers(&self, id: IdentityId) -> [u16; 2] {
        let is = |id: IdentityId, level: Level| self.all.get(id).is_some_and(|i| i.level == level);
        let number = |id: IdentityId, level: Level| if is(id, level) { id as u16 } else { NO_IDENTITY as u16 };
        [number(self.all.object_of(id), Level::Object), number(id, Level::Part)]
    }

    /// Writes the files that cover all photos.
    pub(super) fn finish(self, folder: &mut ExportFolder) -> Result<(), JobError> {
        let ids = || self.all.iter().map(|(id, i)| (id, i, self.all.full_name(id)));
        if self.masks.contains(&MaskFormat::Ids) {
            let parent = |id: IdentityId| Some(id).filter(|id| *id != NO_IDENTITY);
            let list: Vec<Value> = ids()
                .map(|(id, i, full)| {
                    json!({ "id": id, "name": self.all.name(id), "full_name": full, "level": i.level, "parent": parent(i.parent) })
                })
                .collect();
            let list = json!({ "identities": list });
            folder.write(&format!("ids/{}", synth_ids::LIST_FILE), |path| export::json(path, &list))?;
        }
        if self.masks.contains(&MaskFormat::Coco) {
            let category = |(id, i, full): (IdentityId, &Identity, String)| {
                let parent = Some(i.parent).filter(|id| *id != NO_IDENTITY);
                json!({ "id": id, "name": full, "supercategory": i.level, "parent": parent })
            };
            let categories = ids().map(category).collect();
            let document = self.coco.document(categories);
            folder.write("coco.json", |path| compact(path, &document))?;
        }
        Ok(())
    }
}

/// Writes JSON without line breaks: lists have thousands of numbers.
fn compact(path: &Path, value: &Value) -> Result<(), IoError> {
    atomic::write(path, |w| Ok(serde_json::to_writer(w, value)?))
}

/// Returns labels if they are unique, else labels with those of their wholes.
fn categories(all: &Identities) -> Vec<String> {
    let mut found: Vec<String> = Vec::with_capacity(all.len());
    let labels: Vec<String> = all.iter().map(|(id, _)| all.label(id)).collect();
    let mut counts = HashMap::new();
    labels.iter().for_each(|label| *counts.entry(label.as_str()).or_insert(0) += 1);
    for ((_, identity), label) in all.iter().zip(&labels) {
        let whole = (identity.parent as usize).checked_sub(1).map(|i| found[i].as_str());
        let name = match whole.filter(|_| counts[label.as_str()] > 1) {
            Some(whole) => [label.as_str(), whole].join(BETWEEN),
            None => label.clone(),
        };
        found.push(name);
    }
    found
}
