//! Comparison of objects and parts with labeled photos, by one of the protocols of the literature.

mod protocol;

use std::path::Path;

use image::ColorType;
use serde::Serialize;
use serde_json::json;

pub(crate) use self::protocol::Protocol;
use super::evaluate::PhotoComparison;
use super::{JobError, export};
use crate::io::{self, labels::Labels};
use crate::math::stats::mean;
use crate::pipeline::observer::Silent;
use crate::pipeline::semantics::code_map::CodeMap;
use crate::pipeline::semantics::evaluation::{
    AskedScene, Category, LabeledPhoto, LabeledView, Unit, categories, fastlgs_ex, langsplat, limits, masks, means,
    multi_class, part_recall, recipes, selection_3d, spin_nerf, strokes,
};
use crate::pipeline::semantics::lifting::segmenter::{FileMasks, Segmenter};
use crate::pipeline::semantics::lifting::splat_tree::hierarchy::Hierarchy;
use crate::pipeline::semantics::query::query_engine::QueryEngine;
use crate::pipeline::semantics::query::recipe::QueryConfig;
use crate::pipeline::semantics::view_map::ViewMap;
use crate::render::Renderer;
use crate::scene::{Camera, Identities, IdentityId, LevelFilter, NO_IDENTITY, Photo, SemanticMap};

/// Scores of the [`Protocol`] of the same name besides the IoU of each query.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[serde(untagged)]
pub(crate) enum ProtocolSummary {
    Masks {
        object_miou: f64,
        part_miou: f64,
    },
    Langsplat {
        /// Share of queries whose most relevant pixel lies in their box.
        localization: f64,
    },
    Limits {
        rows: Vec<limits::LimitRow>,
    },
    FastlgsEx {},
    Selection3d {
        /// Share of queries with an IoU of 0.25 or more.
        accuracy_25: f64,
        /// Share of queries with an IoU of 0.5 or more.
        accuracy_50: f64,
    },
    SpinNerf {
        accuracy: f64,
    },
    Ovs3d {
        /// Mean IoU if every pixel is assigned to its best class.
        argmax_miou: f64,
        #[serde(skip)]
        classes: usize,
    },
    PartRecall {
        encoder: String,
        rows: Vec<part_recall::Row>,
    },
    Recipes {
        /// Queries for absent things: other kinds, other colors, parts that a thing lacks.
        absent: [usize; 3],
        rows: Vec<recipes::RecipeRow>,
    },
    Strokes {
        /// Gaussians of the scene.
        gaussians: usize,
        /// Seconds of looking at its surfaces and merging them, once for all.
        prepare_secs: f64,
        rows: Vec<strokes::StrokeRow>,
    },
}

#[derive(Clone, Debug, PartialEq)]
pub(crate) struct MaskScores {
    pub(crate) views: usize,
    pub(crate) trained_on: usize,
    pub(crate) units: Vec<Unit>,
    pub(crate) summary: ProtocolSummary,
    /// Settings of the recipe that the scene was not prepared for.
    pub(crate) unmet: Vec<String>,
}

impl MaskScores {
    /// Mean IoU over queries, and over views.
    pub(crate) fn miou(&self) -> (f64, f64) {
        means(&self.units)
    }

    /// Returns everything but the single queries, with stable names for scripts.
    pub(crate) fn json(&self, protocol: Protocol, recipe: &QueryConfig) -> serde_json::Value {
        let mut value = json!({
            "protocol": protocol.name(), "views": self.views, "views_trained_on": self.trained_on, "recipe": recipe,
            "unmet": self.unmet,
        });
        if let (Some(all), serde_json::Value::Object(own)) = (value.as_object_mut(), json!(self.summary)) {
            all.extend(own);
            if protocol.has_units() {
                let (miou, miou_by_view) = self.miou();
                all.extend([("miou".to_owned(), json!(miou)), ("miou_by_view".to_owned(), json!(miou_by_view))]);
            }
        }
        value
    }
}

/// Returns labels of these photos that are skipped, unused or joined, a sentence each.
///
/// # Errors
/// If they cannot be read, or a file could belong to two photos.
pub(crate) fn label_notes(labels: &Path, comparison: &PhotoComparison) -> Result<Vec<String>, JobError> {
    Ok(Labels::of_photos(labels, &comparison.dataset.photos)?.notes().to_vec())
}

/// Compares the objects and parts of a scene with `labels`; `query` is the query if labels have no names. Pictures show
/// the identities over the photos.
pub(crate) fn run(
    comparison: &PhotoComparison,
    scene: &Path,
    labels: &Path,
    protocol: Protocol,
    query: Option<&str>,
    recipe: &QueryConfig,
) -> Result<MaskScores, JobError> {
    let opened = || Labels::of_photos(labels, &comparison.dataset.photos).map(FileMasks);
    if protocol == Protocol::Strokes {
        return by_strokes(comparison, opened()?, None);
    }
    let map = io::semantic_map::load(scene, comparison.state.as_deref(), &comparison.cloud)?;
    let map = &map.ok_or_else(|| JobError::NoObjects(scene.into()))?;
    if protocol == Protocol::Corrections {
        return by_strokes(comparison, opened()?, Some(map));
    }
    let mut known = opened()?;
    let views = labeled(comparison, map, &mut known)?;
    if views.is_empty() {
        let text = format!("{}: none of the compared photos has labels", labels.display());
        return Err(JobError::Protocol(text));
    }
    if let Some(folder) = &comparison.pictures {
        pictures(folder, comparison, map, &views)?;
    }
    let list: Vec<LabeledView<'_>> = views.iter().map(DrawnView::labeled).collect();
    let (units, summary) = match protocol {
        Protocol::PartRecall => recall(map, recipe, &list)?,
        Protocol::Recipes => (Vec::new(), compare_recipes(map, recipe, &list)?),
        _ => {
            let mut engine = QueryEngine::new(map.language.as_ref(), recipe.clone())?;
            let mut failed = None;
            let mut ask = |text: &str| {
                engine.ask(map, text, LevelFilter::Auto).unwrap_or_else(|e| {
                    failed.get_or_insert(e);
                    None
                })
            };
            let scores = compare(protocol, query, comparison, &mut AskedScene { map, ask: &mut ask }, &list)?;
            // A failing encoder is an error, not a wrong answer.
            failed.map_or(Ok(scores), Err)?
        }
    };
    let trained_on = views.iter().filter(|v| v.trained_on).count();
    Ok(MaskScores { views: views.len(), trained_on, units, summary, unmet: recipe.unmet(map) })
}

fn compare(
    protocol: Protocol,
    query: Option<&str>,
    comparison: &PhotoComparison,
    scene: &mut AskedScene<'_>,
    views: &[LabeledView<'_>],
) -> Result<(Vec<Unit>, ProtocolSummary), JobError> {
    let mut units: Vec<Unit> = Vec::new();
    let summary = match protocol {
        Protocol::Masks => {
            views.iter().for_each(|v| units.extend(masks::compare(scene, v)));
            let [object_miou, part_miou] = masks::by_level(&units);
            ProtocolSummary::Masks { object_miou, part_miou }
        }
        Protocol::Langsplat => {
            views.iter().for_each(|v| units.extend(langsplat::compare(scene, v)));
            let hits = units.iter().filter(|u| u.hit == Some(true)).count();
            ProtocolSummary::Langsplat { localization: hits as f64 / units.len().max(1) as f64 }
        }
        Protocol::Limits => {
            let rows = limits::rows(scene, views, &comparison.cloud, &comparison.settings)?;
            ProtocolSummary::Limits { rows }
        }
        Protocol::FastlgsEx | Protocol::PartRecall | Protocol::Recipes | Protocol::Strokes | Protocol::Corrections => {
            let mut pool = fastlgs_ex::Pool::default();
            views.iter().for_each(|v| units.extend(fastlgs_ex::compare(scene, v, &mut pool)));
            ProtocolSummary::FastlgsEx {}
        }
        Protocol::Selection3d => {
            for view in views {
                units.extend(selection_3d::compare(scene, view, &comparison.cloud, &comparison.settings)?);
            }
            let [accuracy_25, accuracy_50] = [0.25, 0.5].map(|least| selection_3d::accuracy(&units, least));
            ProtocolSummary::Selection3d { accuracy_25, accuracy_50 }
        }
        Protocol::SpinNerf => {
            let missing = || JobError::Protocol("the protocol spin-nerf needs the object's name (--query)".into());
            let query = query.ok_or_else(missing)?;
            let found: Vec<_> = views.iter().filter_map(|v| spin_nerf::compare(scene, v, query)).collect();
            let accuracy = mean(&found.iter().map(|f| f.accuracy).collect::<Vec<_>>());
            units.extend(found.into_iter().map(|f| f.unit));
            ProtocolSummary::SpinNerf { accuracy }
        }
        Protocol::Ovs3d => {
            let mut classes: Vec<String> = views.iter().flat_map(|v| &v.categories).map(|c| c.name.clone()).collect();
            classes.sort();
            classes.dedup();
            let mut of_winner = Vec::new();
            for view in views {
                let [own, winner] = multi_class::compare(scene, view, &classes);
                units.extend(own);
                of_winner.extend(winner);
            }
            ProtocolSummary::Ovs3d { argmax_miou: means(&of_winner).0, classes: classes.len() }
        }
    };
    Ok((units, summary))
}

/// Selects the labeled things of the held-out photos by strokes, or corrects the `known` ones.
fn by_strokes(
    comparison: &PhotoComparison,
    mut labels: FileMasks,
    known: Option<&SemanticMap>,
) -> Result<MaskScores, JobError> {
    let PhotoComparison { cloud, settings, max_side_px, .. } = comparison;
    let photos = &comparison.dataset.photos;
    let mut views = Vec::new();
    let free = |photo: &&Photo| labels.covers(photo) && !known.is_some_and(|map| map.seeds.contains(&photo.name));
    let held: Vec<_> = comparison.views.iter().map(|&i| &photos[i]).filter(free).collect();
    for photo in held {
        let categories = categories(&labels.segment(photo, *max_side_px, &mut Silent)?);
        let (name, camera) = (photo.name.clone(), photo.camera.limited_to(*max_side_px));
        views.push(LabeledPhoto { name, camera, categories });
    }
    let cameras: Vec<Camera> = photos.iter().map(|p| p.camera.clone()).collect();
    let start = std::time::Instant::now();
    let hierarchy = Hierarchy::new(cloud, &cameras, settings, &mut Silent)?;
    let prepare_secs = start.elapsed().as_secs_f64();
    let rows = strokes::rows(&hierarchy, cloud, settings, &views, known)?;
    if rows.is_empty() {
        let text = "the labels name nothing that is large enough in two of the photos; give those of more photos";
        return Err(JobError::Protocol(text.into()));
    }
    let summary = ProtocolSummary::Strokes { gaussians: cloud.len(), prepare_secs, rows };
    Ok(MaskScores { views: views.len(), trained_on: 0, units: Vec::new(), summary, unmet: Vec::new() })
}

fn recall(
    map: &SemanticMap,
    recipe: &QueryConfig,
    views: &[LabeledView<'_>],
) -> Result<(Vec<Unit>, ProtocolSummary), JobError> {
    let language = map.language.as_ref().ok_or_else(|| {
        let text = "this scene has no embeddings; run 'fmlgs preprocess' on it with --encoder demo";
        JobError::Protocol(text.into())
    })?;
    let mut encoder = crate::models::encoder(&language.encoder)?;
    let mut rows = Vec::new();
    for components in part_recall::Components::ROWS {
        rows.push(part_recall::row((components, recipe), map, language, views, &mut *encoder)?);
    }
    // Others can compare with the paper's full method, not with ours.
    let units = rows.iter().rfind(|r| r.components.localization).map(|r| r.units.clone()).unwrap_or_default();
    Ok((units, ProtocolSummary::PartRecall { encoder: language.encoder.clone(), rows }))
}

fn compare_recipes(
    map: &SemanticMap,
    recipe: &QueryConfig,
    views: &[LabeledView<'_>],
) -> Result<ProtocolSummary, JobError> {
    let absent = recipes::Absent::of(&map.identities);
    let mut engine = QueryEngine::new(map.language.as_ref(), QueryConfig::default())?;
    let mut rows = Vec::new();
    for recipe in recipes::compared(recipe) {
        rows.push(recipes::row(recipe, map, &mut engine, views, &absent)?);
    }
    let counts = [&absent.kinds, &absent.colors, &absent.parts].map(Vec::len);
    Ok(ProtocolSummary::Recipes { absent: counts, rows })
}

/// A labeled photo and the maps drawn of its view.
pub(crate) struct DrawnView {
    index: usize,
    name: String,
    pub(crate) camera: Camera,
    trained_on: bool,
    exact: ViewMap,
    blended: CodeMap,
    categories: Vec<Category>,
}

impl DrawnView {
    pub(crate) fn labeled(&self) -> LabeledView<'_> {
        LabeledView {
            name: &self.name,
            camera: &self.camera,
            exact: &self.exact,
            blended: &self.blended,
            categories: self.categories.clone(),
        }
    }
}

/// Returns the held-out photos with labels; else training photos, except those whose masks were used.
fn labeled(
    comparison: &PhotoComparison,
    map: &SemanticMap,
    labels: &mut FileMasks,
) -> Result<Vec<DrawnView>, JobError> {
    let photos = &comparison.dataset.photos;
    let held: Vec<usize> = comparison.views.iter().copied().filter(|&i| labels.covers(&photos[i])).collect();
    let trained_on = held.is_empty();
    let free = |&i: &usize| labels.covers(&photos[i]) && !map.seeds.contains(&photos[i].name);
    let views: Vec<usize> = if trained_on { (0..photos.len()).filter(free).collect() } else { held };
    draw(comparison, map, labels, &views, trained_on)
}

/// Draws the maps to be compared in these `views` of the photos.
pub(crate) fn draw(
    comparison: &PhotoComparison,
    map: &SemanticMap,
    labels: &mut FileMasks,
    views: &[usize],
    trained_on: bool,
) -> Result<Vec<DrawnView>, JobError> {
    let PhotoComparison { cloud, settings, max_side_px, .. } = comparison;
    let photos = &comparison.dataset.photos;
    let mut renderer = Renderer::new();
    let mut drawn = Vec::with_capacity(views.len());
    for &index in views {
        let photo = &photos[index];
        let camera = photo.camera.limited_to(*max_side_px);
        let exact = ViewMap::render(&mut renderer, cloud, &map.identity_of, &map.identities, &camera, settings)?;
        let blended = CodeMap::render(&mut renderer, cloud, &map.codes, map.has_parts(), &camera, settings)?;
        let categories = categories(&labels.segment(photo, *max_side_px, &mut Silent)?);
        drawn.push(DrawnView { index, name: photo.name.clone(), camera, trained_on, exact, blended, categories });
    }
    Ok(drawn)
}

fn pictures(
    folder: &Path,
    comparison: &PhotoComparison,
    map: &SemanticMap,
    views: &[DrawnView],
) -> Result<(), JobError> {
    export::make_folder(folder)?;
    for view in views {
        let pixels = io::photo::load(&comparison.dataset.photos[view.index], comparison.max_side_px)?;
        let ids = tinted(&pixels.rgb, &view.exact.identity, &map.identities);
        let size = [view.camera.width_px, view.camera.height_px];
        export::png(&folder.join(format!("{:03}.png", view.index)), ids.as_flattened(), size, ColorType::Rgb8)?;
    }
    Ok(())
}

/// Returns the photo with every identity's code as a tint.
fn tinted(rgb: &[[u8; 3]], of: &[IdentityId], identities: &Identities) -> Vec<[u8; 3]> {
    let tint = |(rgb, id): (&[u8; 3], &IdentityId)| match identities.get(*id) {
        Some(identity) if *id != NO_IDENTITY => {
            std::array::from_fn(|c| (0.4 * f32::from(rgb[c]) + 0.6 * 255.0 * identity.code[c]) as u8)
        }
        _ => *rgb,
    };
    rgb.iter().zip(of).map(tint).collect()
}
