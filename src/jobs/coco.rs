//! Masks in the format of COCO: run lengths, column by column.

use serde_json::{Value, json};

use crate::io::labels::rle::Rle;
use crate::scene::{Camera, Mask};

/// Pictures with their masks.
#[derive(Default)]
pub(super) struct Coco {
    images: Vec<Value>,
    annotations: Vec<Value>,
}

impl Coco {
    pub(super) fn view(&mut self, name: &str, camera: &Camera) {
        let id = self.images.len() + 1;
        self.images.push(json!({
            "id": id, "file_name": name, "width": camera.width_px, "height": camera.height_px
        }));
    }

    /// Adds a mask to the newest view, unless it is empty.
    pub(super) fn mask(&mut self, category: usize, mask: &Mask, score: Option<f32>) {
        let Some(b) = mask.bounds() else { return };
        let mut annotation = json!({
            "id": self.annotations.len() + 1,
            "image_id": self.images.len(),
            "category_id": category,
            "segmentation": Rle::of(mask),
            "area": mask.area(),
            "bbox": [b.x.start, b.y.start, b.x.len(), b.y.len()],
            "iscrowd": 0,
        });
        score.into_iter().for_each(|score| annotation["score"] = json!(score));
        self.annotations.push(annotation);
    }

    pub(super) fn document(self, categories: Vec<Value>) -> Value {
        json!({ "images": self.images, "annotations": self.annotations, "categories": categories })
    }
}
