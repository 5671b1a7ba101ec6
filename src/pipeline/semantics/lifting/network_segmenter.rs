//! Masks of everything in a photo, found by a network (SAM, SAM 2) and sorted into objects and parts by the paper's
//! filters.

use std::path::PathBuf;

use super::error::FindError;
use super::filters::{self, FilterOptions};
use super::mask_cache::MaskCache;
use super::segmenter::{FoundMask, Segmenter, with_parts};
use crate::io;
use crate::models::catalog::{self, ModelRole};
use crate::models::sam::automatic::{AutomaticMask, AutomaticOptions, everything};
use crate::models::sam::{PromptedMasks, Sam};
use crate::models::sam2::Sam2;
use crate::models::{ModelError, manifest};
use crate::pipeline::observer::{Interrupted, Observer, Ticker};
use crate::scene::{Mask, MaskGrid, Photo, PhotoPixels};

pub(crate) struct NetworkMasks {
    pub(crate) network: Box<dyn PromptedMasks>,
    pub(crate) options: AutomaticOptions,
    /// Filters that sort the masks into objects and parts.
    pub(crate) filters: FilterOptions,
    /// True if each object's own tile is segmented for its parts, as in the paper: finer, for one more network run
    /// per object.
    pub(crate) tiles: bool,
    /// Points along a side of the grid on a tile.
    tile_points: usize,
}

/// Overlap from which the less certain of two masks is left out (LangSplat's).
const MASK_NMS: f64 = 0.8;
/// Predicted IoU times stability from which a mask is taken (LangSplat's).
const LEAST_SCORE: f32 = 0.7;
/// Points along a side of the grid on a tile, for small networks.
const TILE_POINTS_OF_SMALL: usize = 16;
/// Side of an object's box from which its tile is segmented, px.
const LEAST_TILE_PX: usize = 32;

impl NetworkMasks {
    /// Opens the network of this name: a model of the catalog, or the path of a model's description.
    pub(crate) fn open(name: &str, grid: MaskGrid) -> Result<Self, ModelError> {
        let path = catalog::find(name, ModelRole::Segmenter)?;
        let mut options = AutomaticOptions { adaptive: grid == MaskGrid::Adaptive, ..AutomaticOptions::default() };
        let mut tile_points = options.points_per_side;
        let network: Box<dyn PromptedMasks> = match manifest::kind(&path)?.as_str() {
            "sam" => {
                let sam = Sam::open(&path)?;
                if sam.is_small() {
                    // The setting of its authors; a photo takes less than a minute.
                    options.crop_layers = 0;
                    tile_points = TILE_POINTS_OF_SMALL;
                }
                Box::new(sam)
            }
            "sam2" => {
                // Its small regions are those of low-resolution masks, 16 times as coarse.
                options.least_region_px /= 16;
                Box::new(Sam2::open(&path)?)
            }
            other => return Err(ModelError::Metadata { path, problem: format!("a '{other}' model finds no masks") }),
        };
        Ok(Self { network, options, filters: FilterOptions::default(), tiles: true, tile_points })
    }

    /// The same, with its masks kept in `folder`.
    pub(crate) fn open_cached(name: &str, grid: MaskGrid, folder: PathBuf) -> Result<MaskCache, FindError> {
        let path = catalog::find(name, ModelRole::Segmenter)?;
        let open = Self::open(name, grid)?;
        // The description holds the checksums of the graphs.
        let description = std::fs::read(&path).map_err(|e| ModelError::Metadata { path, problem: e.to_string() })?;
        let asked = format!("{:?} {:?} {} {}", open.options, open.filters, open.tiles, open.tile_points);
        Ok(MaskCache::new(Box::new(open), folder, &[&description, asked.as_bytes()]))
    }

    /// Finds masks in a picture and reports progress as a share of all runs.
    fn look(
        &mut self,
        picture: &PhotoPixels,
        options: &AutomaticOptions,
        watch: &mut Watch<'_>,
    ) -> Result<Vec<Mask>, FindError> {
        let mut end = Ok(());
        let found = everything(&mut *self.network, picture, options, &mut |share| {
            end = watch.tick(share);
            end.is_ok()
        })?;
        end?;
        watch.done += 1.0;
        Ok(distinct(found))
    }

    /// Finds masks inside an object's tile, in px of the whole picture.
    fn look_closer(
        &mut self,
        picture: &PhotoPixels,
        object: &Mask,
        watch: &mut Watch<'_>,
    ) -> Result<Vec<Mask>, FindError> {
        let Some(at) = object.bounds().filter(|b| b.x.len().min(b.y.len()) >= LEAST_TILE_PX) else {
            return Ok(Vec::new());
        };
        let width = picture.width_px as usize;
        let pixel = |i: usize| if object.contains(i) { picture.rgb[i] } else { [0; 3] };
        let rgb = at.y.clone().flat_map(|y| at.x.clone().map(move |x| y * width + x)).map(pixel).collect();
        let tile =
            PhotoPixels { width_px: at.x.len() as u32, height_px: at.y.len() as u32, rgb, coverage: None, alpha: None };
        let options = AutomaticOptions { crop_layers: 0, points_per_side: self.tile_points, ..self.options };
        let masks = self.look(&tile, &options, watch)?;
        let place = |mask: Mask| {
            let mut placed = Mask::empty(width, picture.height_px as usize);
            let w = at.x.len();
            mask.pixels().for_each(|i| placed.insert((at.y.start + i / w) * width + at.x.start + i % w));
            placed
        };
        Ok(masks.into_iter().map(place).collect())
    }
}

/// Reports progress and passes on cancellation.
struct Watch<'a> {
    observer: &'a mut dyn Observer,
    ticker: Ticker,
    /// Runs that are done, and all of them.
    done: f64,
    all: f64,
}

impl Watch<'_> {
    /// Reports this share of a run, and returns an error on cancellation.
    fn tick(&mut self, share: f64) -> Result<(), Interrupted> {
        // In hundredths of a run.
        let [done, all] = [self.done + share, self.all].map(|looks| (100.0 * looks) as u64);
        self.ticker.total = all;
        self.ticker.tick(done as usize, self.observer)
    }
}

/// Returns masks that are certain enough, without near copies of more certain ones. Unlike in LangSplat, masks inside
/// others stay: they become parts.
fn distinct(mut found: Vec<AutomaticMask>) -> Vec<Mask> {
    let score = |f: &AutomaticMask| f.predicted_iou * f.stability;
    found.retain(|f| score(f) >= LEAST_SCORE);
    found.sort_by(|a, b| score(b).total_cmp(&score(a)));
    let mut kept: Vec<Mask> = Vec::new();
    for mask in found.into_iter().map(|f| f.mask) {
        if kept.iter().all(|k| k.iou(&mask) <= MASK_NMS) {
            kept.push(mask);
        }
    }
    kept
}

impl Segmenter for NetworkMasks {
    fn name(&self) -> &str {
        self.network.name()
    }

    fn covers(&self, _: &Photo) -> bool {
        true
    }

    fn segment(
        &mut self,
        photo: &Photo,
        max_side_px: u32,
        observer: &mut dyn Observer,
    ) -> Result<Vec<FoundMask>, FindError> {
        let picture = io::photo::load(photo, max_side_px)?;
        let ticker = Ticker::new(format!("Finding masks in {}", photo.name), 0);
        let mut watch = Watch { observer, ticker, done: 0.0, all: 1.0 };
        let options = self.options;
        let mut masks = self.look(&picture, &options, &mut watch)?;
        let objects = filters::objects(&masks, &self.filters);
        if self.tiles {
            watch.all += objects.len() as f64;
            for object in &objects {
                masks.extend(self.look_closer(&picture, &object.mask, &mut watch)?);
            }
        }
        Ok(with_parts(objects, |object| filters::parts(&object.mask, &masks, &self.filters)))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::Level;

    #[test]
    fn what_lies_inside_something_is_its_part() {
        let mask = |from: usize, to: usize| Mask::from_fn(100, 1, |i| (from..to).contains(&i));
        let (options, masks) = (FilterOptions::default(), [mask(10, 20), mask(0, 50), mask(60, 90), mask(61, 90)]);
        let found = with_parts(filters::objects(&masks, &options), |o| filters::parts(&o.mask, &masks, &options));
        let list: Vec<_> = found.iter().map(|f| (f.level, f.parent, f.mask.area())).collect();
        // A mask of nearly all of an object is that object.
        assert_eq!(list, [(Level::Object, None, 50), (Level::Object, None, 30), (Level::Part, Some(0), 10)]);
    }

    #[test]
    fn of_masks_that_repeat_each_other_the_surest_stays() {
        let something = |from: usize, to: usize, predicted_iou: f32| AutomaticMask {
            mask: Mask::from_fn(100, 1, |i| (from..to).contains(&i)),
            bounds: [0.0; 4],
            predicted_iou,
            stability: 1.0,
            point: [0.0; 2],
            crop: [0; 4],
        };
        let found = [something(0, 50, 0.8), something(0, 52, 0.9), something(0, 30, 0.95), something(60, 90, 0.6)];
        let kept: Vec<usize> = distinct(found.to_vec()).iter().map(Mask::area).collect();
        assert_eq!(kept, [30, 52], "one repeats, one is not sure; one inside another stays");
    }
}
