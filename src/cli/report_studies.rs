//! What `fmlgs report` sweeps: the studies that a scene allows, each opened when its turn comes.

use std::path::{Path, PathBuf};

use super::CliError;
use super::opened::{self, DrawableScene};
use crate::io::{self, labels::Labels};
use crate::models;
use crate::pipeline::depth;
use crate::pipeline::observer::Silent;
use crate::pipeline::semantics::protocols::categories;
use crate::pipeline::semantics::segmenter::{FileMasks, FoundMask, Segmenter};
use crate::pipeline::semantics::tracker::labels_of;
use crate::pipeline::semantics::train_codes::CodeView;
use crate::pipeline::train::TrainConfig;
use crate::report::studies::Input;
use crate::report::studies::depth::DepthStudy;
use crate::report::studies::features::FeatureStudy;
use crate::report::studies::path::PathStudy;
use crate::report::studies::query::{Asked, QueryStudy};
use crate::report::studies::render::RenderStudy;
use crate::report::studies::train::TrainStudy;
use crate::report::studies::views::{held_out, spread};
use crate::report::{End, StageName, Study};
use crate::scene::{Camera, Dataset, Identities, IdentityId, NOBODY, Photo, SemanticMap};

/// What is asked for.
pub struct Options {
    /// Labels of the photos.
    pub masks: Option<PathBuf>,
    /// Optimiser steps of codes.
    pub steps: Vec<u64>,
    /// Optimiser steps of trainings.
    pub train_steps: u64,
    /// Longer side of compared pictures, px.
    pub max_side_px: u32,
    /// Most views that are compared.
    pub views: usize,
    /// Repeats.
    pub repeats: u32,
}

/// A scene and what came with it.
pub struct Subject {
    scene: DrawableScene,
    path: PathBuf,
    dataset: Option<Dataset>,
    /// Objects and parts, if an encoder has looked at them.
    language: Option<SemanticMap>,
    options: Options,
}

type Sweep<'a> = &'a mut dyn FnMut(&mut dyn Study) -> Result<End, CliError>;

impl Subject {
    /// Opens a trained scene and its photos, if they are there.
    pub fn open(path: &Path, options: Options) -> Result<Self, CliError> {
        let scene = opened::drawable(path)?;
        let dataset = scene.dataset_path.as_ref().filter(|p| p.exists()).map(|p| opened::dataset(p)).transpose()?;
        let map =
            if path.is_dir() { io::semantic_map::load(path, scene.state.as_deref(), &scene.cloud)? } else { None };
        let language = map.filter(|m| m.language.is_some());
        Ok(Self { scene, language, path: path.to_owned(), dataset, options })
    }

    /// The stages that are wanted, and for each that is not possible why.
    ///
    /// # Errors
    /// If one was asked for that is not possible.
    pub fn stages(&self, wanted: &[StageName]) -> Result<(Vec<StageName>, Vec<String>), CliError> {
        let (mut stages, mut missing) = (Vec::new(), Vec::new());
        for name in StageName::ALL {
            let asked = wanted.contains(&name);
            match self.lacks(name) {
                None if asked || wanted.is_empty() => stages.push(name),
                Some(what) if asked => {
                    return Err(CliError::failed(format!(
                        "{}: the stage '{}' needs {what}",
                        self.path.display(),
                        name.name()
                    )));
                }
                Some(what) if wanted.is_empty() => {
                    missing.push(format!("Stage '{}' left out: it needs {what}", name.name()))
                }
                _ => {}
            }
        }
        Ok((stages, missing))
    }

    /// What a stage needs that is not here.
    fn lacks(&self, name: StageName) -> Option<&'static str> {
        let photos = self.dataset.is_none().then_some("the scene's photos");
        let labels = self.options.masks.is_none().then_some("labels of the photos: --masks");
        match name {
            StageName::Render => self.scene.cameras.is_empty().then_some("cameras"),
            StageName::Train => photos,
            StageName::Features => photos.or(labels),
            StageName::Query => {
                photos.or(labels).or(self.language.is_none().then_some(
                    "objects that an encoder has looked at: run 'fmlgs preprocess' on it with --encoder demo",
                ))
            }
            StageName::Path => self.scene.cameras.is_empty().then_some("cameras"),
            StageName::Depth => match &self.dataset {
                Some(d) => (!d.root.join(depth::FOLDER).is_dir()).then_some("true depths, which synthetic photos have"),
                None => photos,
            },
        }
    }

    /// Hands the study of a stage to `sweep`.
    pub fn with_study(&self, name: StageName, sweep: Sweep<'_>) -> Result<End, CliError> {
        match name {
            StageName::Render => sweep(&mut self.drawing()?),
            StageName::Train => self.training(sweep),
            StageName::Features => self.features(sweep),
            StageName::Query => self.asking(sweep),
            StageName::Path => {
                let cameras: Vec<Camera> = self.scene.cameras.iter().map(|c| c.camera.clone()).collect();
                let input = self.input(&[("cameras", cameras.len().to_string())]);
                sweep(&mut PathStudy::new(&self.scene.cloud, &cameras, self.options.repeats, input))
            }
            StageName::Depth => self.depth(sweep),
        }
    }

    /// What is swept on, in words.
    fn input(&self, more: &[(&str, String)]) -> Input {
        let mut input = Input::from([
            ("scene".to_owned(), self.path.display().to_string()),
            ("Gaussians".to_owned(), self.scene.cloud.len().to_string()),
            ("longer side".to_owned(), format!("{} px", self.options.max_side_px)),
        ]);
        input.extend(more.iter().map(|(k, v)| ((*k).to_owned(), v.clone())));
        input
    }

    /// Views to compare, spread over those that training did not see, or over all.
    fn cameras(&self) -> Vec<Camera> {
        let all = &self.scene.cameras;
        let held: Vec<&Camera> = all.iter().filter(|c| c.held_out).map(|c| &c.camera).collect();
        let from = if held.is_empty() { all.iter().map(|c| &c.camera).collect() } else { held };
        spread(&from, self.options.views).into_iter().map(|c| c.limited_to(self.options.max_side_px)).collect()
    }

    fn drawing(&self) -> Result<RenderStudy, CliError> {
        let (every, side, count) = (self.scene.config.holdout_every, self.options.max_side_px, self.options.views);
        let mut views = match &self.dataset {
            Some(dataset) => held_out(dataset, every, side, count, &mut Silent)?.unwrap_or_default(),
            None => Vec::new(),
        };
        if views.is_empty() {
            views = self.cameras().into_iter().map(|c| (c, None)).collect();
        }
        let input = self.input(&[("views", views.len().to_string())]);
        let (cloud, settings) = ((*self.scene.cloud).clone(), &self.scene.settings);
        Ok(RenderStudy::new(cloud, settings, views, self.options.repeats, input)?)
    }

    fn training(&self, sweep: Sweep<'_>) -> Result<End, CliError> {
        let Some(dataset) = &self.dataset else { return Err(CliError::failed("photos are needed")) };
        let base = TrainConfig {
            steps: self.options.train_steps,
            max_side_px: self.options.max_side_px,
            holdout_every: self.scene.config.holdout_every,
            ..TrainConfig::default()
        };
        let held = dataset.split(base.holdout_every).1.len();
        let input = self.input(&[
            ("photos", format!("{} + {held} held out", dataset.photos.len() - held)),
            ("steps of the default", base.steps.to_string()),
        ]);
        sweep(&mut TrainStudy::new(dataset, base, self.options.repeats, input)?)
    }

    fn asking(&self, sweep: Sweep<'_>) -> Result<End, CliError> {
        let (Some(dataset), Some(masks), Some(map)) = (&self.dataset, &self.options.masks, &self.language) else {
            return Err(CliError::failed("photos, labels and objects are needed"));
        };
        let encoder = models::encoder(&map.language.as_ref().map(|l| l.encoder.clone()).unwrap_or_default())?;
        let mut labels = FileMasks(Labels::open(masks)?);
        let [seen, held_out] = self.labelled(dataset, &labels);
        // Labels of few photos are rarely of held-out ones.
        let (asked, which) = if held_out.is_empty() { (seen, "trained on") } else { (held_out, "held out") };
        let mut views = Vec::new();
        for i in spread(&asked, self.options.views) {
            let photo = &dataset.photos[i];
            let categories = categories(&labels.segment(photo, self.options.max_side_px, &mut Silent)?);
            let camera = photo.camera.limited_to(self.options.max_side_px);
            views.push(Asked { name: photo.name.clone(), camera, categories });
        }
        if views.is_empty() {
            return Err(CliError::failed(format!("{}: there are no labels of this scene's photos", masks.display())));
        }
        let drawn = (&*self.scene.cloud, &self.scene.settings);
        let input = self.input(&[("photos", which.into())]);
        let study = QueryStudy::new(drawn, map, encoder, views, self.options.repeats, input);
        sweep(&mut study.map_err(|e| CliError::failed(e.to_string()))?)
    }

    /// Indices of the labelled photos that training saw, and of those that it did not see.
    fn labelled(&self, dataset: &Dataset, labels: &FileMasks) -> [Vec<usize>; 2] {
        let (seen, held_out) = dataset.split(self.scene.config.holdout_every);
        [seen, held_out].map(|of| of.into_iter().filter(|&i| labels.covers(&dataset.photos[i])).collect())
    }

    fn depth(&self, sweep: Sweep<'_>) -> Result<End, CliError> {
        let Some(dataset) = &self.dataset else { return Err(CliError::failed("photos are needed")) };
        let held = dataset.split(self.scene.config.holdout_every).1;
        let mut views = Vec::new();
        for i in spread(&held, self.options.views) {
            let photo = &dataset.photos[i];
            let camera = photo.camera.limited_to(self.options.max_side_px);
            views.push((camera, depth::of_photo(&dataset.root, photo)?));
        }
        let input = self.input(&[("views", views.len().to_string())]);
        let (cloud, settings) = (&self.scene.cloud, &self.scene.settings);
        sweep(&mut DepthStudy::new(cloud, settings, views, self.options.repeats, input))
    }

    fn features(&self, sweep: Sweep<'_>) -> Result<End, CliError> {
        let (Some(dataset), Some(masks)) = (&self.dataset, &self.options.masks) else {
            return Err(CliError::failed("photos and labels are needed"));
        };
        let mut segmenter = FileMasks(Labels::open(masks)?);
        let [mut training, mut held_out] = self.labelled(dataset, &segmenter);
        // Few labels may all be of photos that the Gaussians were trained on; the lifting does without some.
        if held_out.is_empty() {
            held_out = training.iter().copied().step_by(TrainConfig::default().holdout_every).collect();
            training.retain(|i| !held_out.contains(i));
        }
        let mut identities = Identities::default();
        let mut views = |indices: &[usize]| -> Result<Vec<CodeView>, CliError> {
            let photos = indices.iter().map(|&i| &dataset.photos[i]);
            let each = photos.map(|p| view(p, &mut segmenter, &mut identities, self.options.max_side_px));
            each.collect()
        };
        let (training, held_out) = (views(&training)?, views(&spread(&held_out, self.options.views))?);
        if training.is_empty() || held_out.is_empty() {
            let path = masks.display();
            return Err(CliError::failed(format!("{path}: masks of two photos of the scene are needed at least")));
        }
        let input = self.input(&[
            ("views", format!("{} + {} held out", training.len(), held_out.len())),
            ("identities", identities.len().to_string()),
        ]);
        let drawn = (&*self.scene.cloud, &self.scene.settings);
        let (steps, repeats) = (&self.options.steps, self.options.repeats);
        sweep(&mut FeatureStudy::new(drawn, identities, [&training, &held_out], steps, repeats, input)?)
    }
}

/// The labels of a photo that has some, its regions matched with known identities by their names.
fn view(
    photo: &Photo,
    segmenter: &mut FileMasks,
    identities: &mut Identities,
    max_side_px: u32,
) -> Result<CodeView, CliError> {
    let found: Vec<FoundMask> = segmenter.segment(photo, max_side_px, &mut Silent)?;
    let mut ids: Vec<IdentityId> = Vec::with_capacity(found.len());
    for mask in &found {
        let parent = mask.parent.map_or(NOBODY, |p| ids[p]);
        let names: Vec<String> = mask.name.iter().cloned().collect();
        let known = identities.iter().find(|(_, i)| i.level == mask.level && i.parent == parent && i.names == names);
        let known = known.map(|(id, _)| id);
        ids.push(known.unwrap_or_else(|| identities.add(mask.level, parent, names)));
    }
    let camera = photo.camera.limited_to(max_side_px);
    let labels = labels_of(&found, &ids, camera.width_px as usize * camera.height_px as usize);
    Ok(CodeView { camera, labels })
}
