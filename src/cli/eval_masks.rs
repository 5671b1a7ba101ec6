//! `fmlgs eval --masks`: objects and parts against labelled photos, by one of the protocols.

use std::path::Path;

use image::ColorType;
use serde_json::{Value, json};

use super::asking::{Asker, semantics};
use super::eval::Job;
use super::{CliError, output};
use crate::io::{self, labels::Labels};
use crate::models;
use crate::pipeline::observer::Silent;
use crate::pipeline::semantics::code_map::CodeMap;
use crate::pipeline::semantics::grammar::Kind;
use crate::pipeline::semantics::protocols::{
    AskedScene, Category, LabelledView, Unit, categories, fastlgs_ex, langsplat, masks, means, multi_class,
    part_recall, selection_3d, spin_nerf,
};
use crate::pipeline::semantics::segmenter::{FileMasks, Segmenter};
use crate::pipeline::semantics::view_map::ViewMap;
use crate::render::Renderer;
use crate::scene::{Camera, Identities, IdentityId, NOBODY, SemanticMap};

/// Rows of the table at most; the worst come first.
const ROWS: usize = 12;

/// How objects and parts are compared with labels.
#[derive(Clone, Copy, Debug, PartialEq, Eq, clap::ValueEnum)]
pub enum Protocol {
    /// The pixels of the answer against the region, IoU; objects and parts apart
    Masks,
    /// LERF-OVS as LangSplat counts it: smoothed relevancy cut at 0.4, and localisation
    Langsplat,
    /// FastLGS's evaluator, with its running pooled IoU; for comparison with published numbers only
    FastlgsEx,
    /// Gaussians chosen by text, their silhouette cut at 0.7 (OpenGaussian)
    #[value(name = "3d-selection")]
    Selection3d,
    /// One foreground object at 1008 x 567: IoU and accuracy
    SpinNerf,
    /// Every class: own masks, and the arg-max over all
    #[value(name = "3d-ovs")]
    Ovs3d,
    /// Part queries by looks alone, with the paper's components switched on one after another
    PartRecall,
}

/// What a comparison comes to.
struct Outcome {
    /// Lines for people.
    lines: Vec<String>,
    /// The same for programs.
    json: Value,
    units: Vec<Unit>,
}

pub fn run(
    scene: &Path,
    labels: &Path,
    protocol: Protocol,
    query: Option<&str>,
    job: Job,
    as_json: bool,
) -> Result<(), CliError> {
    let map = semantics(scene, job.state.as_deref(), &job.cloud)?;
    let mut known = FileMasks(Labels::open(labels)?);
    let views = labelled(&job, &map, &mut known)?;
    if views.is_empty() {
        return Err(CliError::failed(format!("{}: no photo to compare with has labels", labels.display())));
    }
    if let Some(folder) = &job.pictures {
        write_pictures(folder, &job, &map, &views)?;
    }
    let list: Vec<LabelledView<'_>> = views.iter().map(Drawn::labelled).collect();
    let mut asker = Asker::new(&map)?;
    let mut failed = None;
    let mut ask = |text: &str| {
        asker.ask(text, Kind::Auto).unwrap_or_else(|e| {
            failed.get_or_insert(e);
            None
        })
    };
    let outcome = match protocol {
        Protocol::PartRecall => recall(&map, &list)?,
        _ => compare(protocol, query, &job, &mut AskedScene { map: &map, ask: &mut ask }, &list)?,
    };
    if let Some(error) = failed {
        return Err(error);
    }
    let name = clap::ValueEnum::to_possible_value(&protocol).map_or_else(String::new, |v| v.get_name().to_owned());
    let trained = views.iter().filter(|v| v.trained_on).count();
    if as_json {
        let mut value = json!({
            "scene": scene, "protocol": name, "views": views.len(), "views_trained_on": trained,
            "units": outcome.units,
        });
        if let (Some(all), Some(own)) = (value.as_object_mut(), outcome.json.as_object()) {
            all.extend(own.clone());
        }
        return output::print_json(&value);
    }
    let mut worst: Vec<&Unit> = outcome.units.iter().collect();
    worst.sort_by(|a, b| a.iou.total_cmp(&b.iou));
    let mut rows = vec![["worst queries", "view", "IoU"].map(str::to_owned).to_vec()];
    rows.extend(worst.iter().take(ROWS).map(|u| vec![u.query.clone(), u.view.clone(), format!("{:.3}", u.iou)]));
    output::print(&format!(
        "{}\nprotocol {name}, {} queries in {} views ({trained} of them trained on)\n{}",
        output::table(&rows),
        outcome.units.len(),
        views.len(),
        outcome.lines.join("\n")
    ))
}

fn compare(
    protocol: Protocol,
    query: Option<&str>,
    job: &Job,
    scene: &mut AskedScene<'_>,
    views: &[LabelledView<'_>],
) -> Result<Outcome, CliError> {
    let mut units: Vec<Unit> = Vec::new();
    let mut lines = Vec::new();
    let mut extra = json!({});
    match protocol {
        Protocol::Masks => {
            views.iter().for_each(|v| units.extend(masks::compare(scene, v)));
            let [objects, parts] = masks::by_level(&units);
            lines.push(format!("mean IoU: objects {objects:.4}, parts {parts:.4}"));
            extra = json!({ "object_miou": objects, "part_miou": parts });
        }
        Protocol::Langsplat => {
            views.iter().for_each(|v| units.extend(langsplat::compare(scene, v)));
            let hits = units.iter().filter(|u| u.hit == Some(true)).count() as f64 / units.len().max(1) as f64;
            lines.push(format!("localisation accuracy {hits:.4}"));
            extra = json!({ "localisation": hits });
        }
        Protocol::FastlgsEx => {
            let mut pool = fastlgs_ex::Pool::default();
            views.iter().for_each(|v| units.extend(fastlgs_ex::compare(scene, v, &mut pool)));
            lines.push("values are running pooled IoUs; not comparable with those of other protocols".into());
        }
        Protocol::Selection3d => {
            for view in views {
                units.extend(selection_3d::compare(scene, view, &job.cloud, &job.settings)?);
            }
            let [low, high] = [0.25, 0.5].map(|least| selection_3d::accuracy(&units, least));
            lines.push(format!("accuracy at 0.25 {low:.4}, at 0.5 {high:.4}"));
            extra = json!({ "accuracy_25": low, "accuracy_50": high });
        }
        Protocol::SpinNerf => {
            let query =
                query.ok_or_else(|| CliError::Usage("--protocol spin-nerf needs --query, the object's name".into()))?;
            let found: Vec<_> = views.iter().filter_map(|v| spin_nerf::compare(scene, v, query)).collect();
            let accuracy = crate::math::stats::mean(&found.iter().map(|f| f.accuracy).collect::<Vec<_>>());
            units.extend(found.into_iter().map(|f| f.unit));
            lines.push(format!("pixel accuracy {accuracy:.4}"));
            extra = json!({ "accuracy": accuracy });
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
            let multi = means(&of_winner).0;
            lines.push(format!("arg-max over {} classes: mean IoU {multi:.4}", classes.len()));
            extra = json!({ "argmax_miou": multi });
        }
        Protocol::PartRecall => {}
    }
    let (micro, by_view) = means(&units);
    lines.push(format!("mean IoU {micro:.4} over queries, {by_view:.4} over views"));
    if let Some(all) = extra.as_object_mut() {
        all.extend([("miou".to_owned(), json!(micro)), ("miou_by_view".to_owned(), json!(by_view))]);
    }
    Ok(Outcome { lines, json: extra, units })
}

/// The paper's ablation.
fn recall(map: &SemanticMap, views: &[LabelledView<'_>]) -> Result<Outcome, CliError> {
    let language = map.language.as_ref().ok_or_else(|| {
        CliError::failed("no encoder has looked at this scene; run 'fmlgs preprocess' on it with --encoder demo")
    })?;
    let mut encoder = models::encoder(&language.encoder)?;
    let mut rows = Vec::new();
    for components in part_recall::Components::ROWS {
        rows.push(part_recall::row(components, map, language, views, |p| encoder.text(p))?);
    }
    let tick = |on: bool| if on { "x" } else { "" }.to_owned();
    let mut table = vec![["ME", "SD", "ML", "recall %", "mean IoU", "ms"].map(str::to_owned).to_vec()];
    for r in &rows {
        let c = r.components;
        table.push(vec![
            tick(c.extraction),
            tick(c.deviation),
            if c.joint { "joint".into() } else { tick(c.localisation) },
            format!("{:.1}", 100.0 * r.recall),
            format!("{:.3}", r.mean_iou),
            format!("{:.2}", 1e3 * r.mean_secs),
        ]);
    }
    // The paper's full method, not ours, is what others can compare with.
    let units = rows.iter().rfind(|r| r.components.localisation).map(|r| r.units.clone()).unwrap_or_default();
    let text =
        format!("recall at IoU {}, encoder '{}'\n{}", part_recall::HIT_IOU, language.encoder, output::table(&table));
    Ok(Outcome { lines: vec![text], json: json!({ "encoder": language.encoder, "rows": rows }), units })
}

/// A labelled photo and what is drawn of its view.
struct Drawn {
    index: usize,
    name: String,
    camera: Camera,
    trained_on: bool,
    exact: ViewMap,
    blended: CodeMap,
    categories: Vec<Category>,
}

impl Drawn {
    fn labelled(&self) -> LabelledView<'_> {
        LabelledView {
            name: &self.name,
            camera: &self.camera,
            exact: &self.exact,
            blended: &self.blended,
            categories: self.categories.clone(),
        }
    }
}

/// The held-out photos with labels; else those that were trained on, as long as no mask of theirs was
/// used.
fn labelled(job: &Job, map: &SemanticMap, labels: &mut FileMasks) -> Result<Vec<Drawn>, CliError> {
    let photos = &job.dataset.photos;
    let held: Vec<usize> = job.views.iter().copied().filter(|&i| labels.covers(&photos[i])).collect();
    let trained_on = held.is_empty();
    let free = |&i: &usize| labels.covers(&photos[i]) && !map.seeds.contains(&photos[i].name);
    let views: Vec<usize> = if trained_on { (0..photos.len()).filter(free).collect() } else { held };
    let mut renderer = Renderer::new();
    let mut drawn = Vec::with_capacity(views.len());
    for index in views {
        let photo = &photos[index];
        let camera = photo.camera.limited_to(job.max_side_px);
        let exact = ViewMap::render(&mut renderer, &job.cloud, &map.of, &map.identities, &camera, &job.settings)?;
        let blended = CodeMap::render(&mut renderer, &job.cloud, &map.codes, map.has_parts(), &camera, &job.settings)?;
        let categories = categories(&labels.segment(photo, job.max_side_px, &mut Silent)?);
        drawn.push(Drawn { index, name: photo.name.clone(), camera, trained_on, exact, blended, categories });
    }
    Ok(drawn)
}

fn write_pictures(folder: &Path, job: &Job, map: &SemanticMap, views: &[Drawn]) -> Result<(), CliError> {
    output::make_folder(folder)?;
    for view in views {
        let pixels = io::photo::load(&job.dataset.photos[view.index], job.max_side_px)?;
        let ids = painted(&pixels.rgb, &view.exact.identity, &map.identities);
        let size = [view.camera.width_px, view.camera.height_px];
        output::write_png(&folder.join(format!("{:03}.png", view.index)), ids.as_flattened(), size, ColorType::Rgb8)?;
    }
    Ok(())
}

/// The photo with every identity's code as a tint.
fn painted(rgb: &[[u8; 3]], of: &[IdentityId], identities: &Identities) -> Vec<[u8; 3]> {
    let tint = |(rgb, id): (&[u8; 3], &IdentityId)| match identities.get(*id) {
        Some(identity) if *id != NOBODY => {
            std::array::from_fn(|c| (0.4 * f32::from(rgb[c]) + 0.6 * 255.0 * identity.code[c]) as u8)
        }
        _ => *rgb,
    };
    rgb.iter().zip(of).map(tint).collect()
}
