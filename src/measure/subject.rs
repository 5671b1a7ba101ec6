//! Subject of `fmlgs report`: the studies that a scene allows, each opened at its turn.

use std::path::PathBuf;
use std::sync::Arc;

use strum::VariantArray;

use super::studies::views::{held_out, spread};
use super::studies::{StudyInput, depth, features, path, query, render, train};
use super::sweep::failed;
use super::{StageName, Study, StudyError};
use crate::io::labels::Labels;
use crate::models;
use crate::pipeline::depth as true_depth;
use crate::pipeline::observer::{Interrupted, Observer, Silent};
use crate::pipeline::semantics::evaluation::categories;
use crate::pipeline::semantics::lifting::segmenter::{FileMasks, FoundMask, Segmenter};
use crate::pipeline::semantics::lifting::tracker::{TrackOptions, Tracked, labels_of, track};
use crate::pipeline::semantics::lifting::train_codes::CodeView;
use crate::pipeline::semantics::query::recipe::QueryConfig;
use crate::pipeline::train::TrainConfig;
use crate::render::RenderSettings;
use crate::scene::{Camera, Dataset, GaussianCloud, Identities, Identity, IdentityId, NO_IDENTITY, Photo, SemanticMap};

#[derive(Clone, Debug)]
pub struct StudyOptions {
    pub(crate) masks: Option<PathBuf>,
    pub(crate) steps: Vec<u64>,
    pub(crate) train_steps: u64,
    pub(crate) max_side_px: u32,
    /// Most views that are compared.
    pub(crate) views: usize,
    pub(crate) repeats: u32,
    /// Recipe that the variants of queries differ from.
    pub(crate) recipe: QueryConfig,
}

#[derive(Clone, Debug)]
pub struct Subject {
    pub(crate) name: String,
    pub(crate) cloud: Arc<GaussianCloud>,
    pub(crate) settings: RenderSettings,
    /// Cameras of its photos, and whether training did not see them.
    pub(crate) cameras: Vec<(Camera, bool)>,
    pub(crate) holdout_every: usize,
    pub(crate) dataset: Option<Arc<Dataset>>,
    pub(crate) map: Option<Arc<SemanticMap>>,
    pub(crate) options: StudyOptions,
}

impl Default for StudyOptions {
    fn default() -> Self {
        Self {
            masks: None,
            steps: vec![300, 1_000],
            train_steps: 1_000,
            max_side_px: 256,
            views: 4,
            repeats: 3,
            recipe: QueryConfig::default(),
        }
    }
}

impl Subject {
    /// The stages that are wanted, and for each that is not possible why.
    pub(crate) fn stages(&self, wanted: &[StageName]) -> Result<(Vec<StageName>, Vec<String>), StudyError> {
        let (mut stages, mut missing) = (Vec::new(), Vec::new());
        for &name in StageName::VARIANTS {
            let asked = wanted.contains(&name);
            match self.lacks(name) {
                None if asked || wanted.is_empty() => stages.push(name),
                Some(what) if asked => {
                    return Err(failed(format!("{}: the stage '{}' needs {what}", self.name, name.name())));
                }
                Some(what) if wanted.is_empty() => {
                    missing.push(format!("Stage '{}' left out: it needs {what}", name.name()))
                }
                _ => {}
            }
        }
        Ok((stages, missing))
    }

    /// Input that a stage needs and the scene lacks.
    fn lacks(&self, name: StageName) -> Option<&'static str> {
        let photos = self.dataset.is_none().then_some("the scene's photos");
        let labels = self.options.masks.is_none().then_some("labels of the photos: --masks");
        match name {
            StageName::Render => self.cameras.is_empty().then_some("cameras"),
            StageName::Train => photos,
            StageName::Features => photos.or(labels),
            StageName::Query => photos.or(labels).or(self
                .language()
                .is_none()
                .then_some("embeddings of its objects: run 'fmlgs preprocess' on it with --encoder demo")),
            StageName::Path => self.cameras.is_empty().then_some("cameras"),
            StageName::Depth => match &self.dataset {
                Some(d) => {
                    (!d.root.join(true_depth::FOLDER).is_dir()).then_some("true depths, which synthetic photos have")
                }
                None => photos,
            },
        }
    }

    /// Study of a stage; `None` if the observer asks to stop while it is prepared.
    pub(crate) fn study(&self, name: StageName, observer: &mut dyn Observer) -> Result<Option<Study<'_>>, StudyError> {
        match name {
            StageName::Render => self.drawing(observer),
            StageName::Train => self.training().map(Some),
            StageName::Features => self.features(observer),
            StageName::Query => self.asking(observer),
            StageName::Path => {
                let cameras: Vec<Camera> = self.cameras.iter().map(|c| c.0.clone()).collect();
                let input = self.input(&[("cameras", cameras.len().to_string())]);
                Ok(Some(path::study(&self.cloud, &cameras, self.options.repeats, input)))
            }
            StageName::Depth => self.depth(observer),
        }
    }

    /// Objects and parts, if an encoder has embedded them.
    fn language(&self) -> Option<(&SemanticMap, &str)> {
        self.map.as_deref().and_then(|m| Some((m, m.language.as_ref()?.encoder.as_str())))
    }

    fn input(&self, more: &[(&str, String)]) -> StudyInput {
        let mut input = StudyInput::from([
            ("scene".to_owned(), self.name.clone()),
            ("Gaussians".to_owned(), self.cloud.len().to_string()),
            ("longer side".to_owned(), format!("{} px", self.options.max_side_px)),
        ]);
        input.extend(more.iter().map(|(k, v)| ((*k).to_owned(), v.clone())));
        input
    }

    fn dataset(&self) -> Result<&Dataset, StudyError> {
        self.dataset.as_deref().ok_or_else(|| failed("photos are needed"))
    }

    fn labels(&self) -> Result<FileMasks, StudyError> {
        let masks = self.options.masks.as_ref().ok_or_else(|| failed("labels are needed"))?;
        Ok(FileMasks(Labels::of_photos(masks, &self.dataset()?.photos).map_err(failed)?))
    }

    fn few_labels(&self, what: &str) -> StudyError {
        let masks = self.options.masks.clone().unwrap_or_default();
        failed(format!("{}: {what}", masks.display()))
    }

    fn drawing(&self, observer: &mut dyn Observer) -> Result<Option<Study<'_>>, StudyError> {
        let (side, count) = (self.options.max_side_px, self.options.views);
        let loaded = match &self.dataset {
            Some(dataset) => held_out(dataset, self.holdout_every, side, count, observer).map_err(failed)?,
            None => Some(Vec::new()),
        };
        let Some(mut views) = loaded else { return Ok(None) };
        if views.is_empty() {
            // Spread over those that training did not see, or over all.
            let held: Vec<&Camera> = self.cameras.iter().filter(|c| c.1).map(|c| &c.0).collect();
            let from = if held.is_empty() { self.cameras.iter().map(|c| &c.0).collect() } else { held };
            views = spread(&from, count).into_iter().map(|c| (c.limited_to(side), None)).collect();
        }
        let input = self.input(&[("views", views.len().to_string())]);
        let (cloud, repeats) = (Arc::clone(&self.cloud), self.options.repeats);
        render::study(cloud, &self.settings, views, repeats, input, observer).map_err(failed)
    }

    fn training(&self) -> Result<Study<'_>, StudyError> {
        let dataset = self.dataset()?;
        let base = TrainConfig {
            steps: self.options.train_steps,
            max_side_px: self.options.max_side_px,
            holdout_every: self.holdout_every,
            ..TrainConfig::default()
        };
        let held = dataset.split(base.holdout_every).1.len();
        let input = self.input(&[
            ("photos", format!("{} + {held} held out", dataset.photos.len() - held)),
            ("steps of the default", base.steps.to_string()),
        ]);
        train::study(dataset, base, self.options.repeats, input)
    }

    fn asking(&self, observer: &dyn Observer) -> Result<Option<Study<'_>>, StudyError> {
        let (dataset, mut labels) = (self.dataset()?, self.labels()?);
        let (map, encoder) = self.language().ok_or_else(|| failed("objects are needed"))?;
        let encoder = models::encoder(encoder).map_err(failed)?;
        let [seen, held_out] = self.labeled(dataset, &labels);
        // Labels of few photos are rarely of held-out ones.
        let (asked, which) = if held_out.is_empty() { (seen, "trained on") } else { (held_out, "held out") };
        let side = self.options.max_side_px;
        let mut views = Vec::new();
        for i in spread(&asked, self.options.views) {
            if observer.proceed().is_err() {
                return Ok(None);
            }
            let photo = &dataset.photos[i];
            let categories = categories(&labels.segment(photo, side, &mut Silent).map_err(failed)?);
            let camera = photo.camera.limited_to(side);
            views.push(query::LabeledScene { name: photo.name.clone(), camera, categories });
        }
        if views.is_empty() {
            return Err(self.few_labels("there are no labels of this scene's photos"));
        }
        let input = self.input(&[("photos", which.into())]);
        let how = (self.options.repeats, &self.options.recipe);
        query::study((&self.cloud, &self.settings), map, encoder, views, how, input).map(Some)
    }

    /// Indices of the labeled photos that training saw, and of those that it did not see.
    fn labeled(&self, dataset: &Dataset, labels: &FileMasks) -> [Vec<usize>; 2] {
        let (seen, held_out) = dataset.split(self.holdout_every);
        [seen, held_out].map(|of| of.into_iter().filter(|&i| labels.covers(&dataset.photos[i])).collect())
    }

    fn depth(&self, observer: &dyn Observer) -> Result<Option<Study<'_>>, StudyError> {
        let dataset = self.dataset()?;
        let held = dataset.split(self.holdout_every).1;
        let mut views = Vec::new();
        for i in spread(&held, self.options.views) {
            if observer.proceed().is_err() {
                return Ok(None);
            }
            let photo = &dataset.photos[i];
            let camera = photo.camera.limited_to(self.options.max_side_px);
            views.push((camera, true_depth::of_photo(&dataset.root, photo).map_err(failed)?));
        }
        let input = self.input(&[("views", views.len().to_string())]);
        Ok(Some(depth::study(&self.cloud, &self.settings, views, self.options.repeats, input)))
    }

    fn features(&self, observer: &dyn Observer) -> Result<Option<Study<'_>>, StudyError> {
        let (dataset, mut segmenter) = (self.dataset()?, self.labels()?);
        let [mut training, mut held_out] = self.labeled(dataset, &segmenter);
        // Few labels may all be of photos that the Gaussians were trained on; the lifting does without some.
        if held_out.is_empty() {
            held_out = training.iter().copied().step_by(TrainConfig::default().holdout_every).collect();
            training.retain(|i| !held_out.contains(i));
        }
        let mut identities = Identities::default();
        let mut views = |indices: &[usize]| -> Result<Option<Vec<CodeView>>, StudyError> {
            let mut all = Vec::with_capacity(indices.len());
            for &i in indices {
                if observer.proceed().is_err() {
                    return Ok(None);
                }
                all.push(view(&dataset.photos[i], &mut segmenter, &mut identities, self.options.max_side_px)?);
            }
            Ok(Some(all))
        };
        let both = (views(&training)?, views(&spread(&held_out, self.options.views))?);
        let (Some(seen), Some(compared)) = both else { return Ok(None) };
        let views = [seen, compared];
        if views.iter().any(Vec::is_empty) {
            return Err(self.few_labels("masks of two photos of the scene are needed at least"));
        }
        let input = self.input(&[
            ("views", format!("{} + {} held out", views[0].len(), views[1].len())),
            ("identities", identities.len().to_string()),
        ]);
        let drawn = (&*self.cloud, &self.settings);
        let photos: Vec<Photo> = training.iter().map(|&i| dataset.photos[i].clone()).collect();
        let all = identities.clone();
        let tracking: features::Tracking<'_> = Box::new(move |options, observer| {
            let mut labels = self.labels()?;
            let options = TrackOptions { max_side_px: self.options.max_side_px, ..options.clone() };
            match track(drawn.0, &photos, drawn.1, &mut labels, None, &options, observer) {
                Err(e) if Interrupted::is_cause_of(&e) => Ok(None),
                tracked => Ok(Some(renumbered(&tracked.map_err(failed)?, &all))),
            }
        });
        let views = (tracking, views);
        let study = features::study(drawn, identities, views, &self.options.steps, self.options.repeats, input);
        study.map(Some).map_err(failed)
    }
}

/// Identity of each Gaussian, by the numbers that identities of the same names have in `all`.
fn renumbered(tracked: &Tracked, all: &Identities) -> Vec<IdentityId> {
    let mut number = vec![NO_IDENTITY; tracked.identities.len() + 1];
    for (id, identity) in tracked.identities.iter() {
        let parent = number[identity.parent as usize];
        let same = |i: &Identity| i.level == identity.level && i.parent == parent && i.names == identity.names;
        number[id as usize] = all.iter().find(|(_, i)| same(i)).map_or(NO_IDENTITY, |(id, _)| id);
    }
    let of = tracked.assignments.iter().map(|a| number.get(a.identity as usize).copied());
    of.map(|id| id.unwrap_or(NO_IDENTITY)).collect()
}

/// The labels of a photo that has some, its regions matched with known identities by their names.
fn view(
    photo: &Photo,
    segmenter: &mut FileMasks,
    identities: &mut Identities,
    max_side_px: u32,
) -> Result<CodeView, StudyError> {
    let found: Vec<FoundMask> = segmenter.segment(photo, max_side_px, &mut Silent).map_err(failed)?;
    let mut ids: Vec<IdentityId> = Vec::with_capacity(found.len());
    for mask in &found {
        let parent = mask.parent.map_or(NO_IDENTITY, |p| ids[p]);
        let names: Vec<String> = mask.name.iter().cloned().collect();
        let known = identities.iter().find(|(_, i)| i.level == mask.level && i.parent == parent && i.names == names);
        let known = known.map(|(id, _)| id);
        ids.push(known.unwrap_or_else(|| identities.add(mask.level, parent, names)));
    }
    let camera = photo.camera.limited_to(max_side_px);
    let labels = labels_of(&found, &ids, camera.width_px as usize * camera.height_px as usize);
    Ok(CodeView { camera, labels })
}
