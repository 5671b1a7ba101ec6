//! `limits`: the IoU that true labels of all compared photos would reach with the same Gaussians, and what the scene's
//! own answers lose, by cause.
//!
//! Every wrong pixel lowers an IoU by the same share, one over the area of the union, so the causes add up to the loss.

use std::collections::BTreeMap;

use strum::VariantArray;

use super::{AskedScene, Category, LabeledView};
use crate::math::stats::mean;
use crate::pipeline::semantics::lifting::votes::{Assignment, LEAST_VOTES, UNKNOWN, Votes};
use crate::pipeline::semantics::view_map::ViewMap;
use crate::render::{DrawError, RenderSettings, Renderer};
use crate::scene::identity::whole_names::BETWEEN;
use crate::scene::{Camera, GaussianCloud, Identities, IdentityId, Level, LevelFilter, Mask, NO_IDENTITY, SemanticMap};

/// Sizes of the drawn mask, as divisors of the label's.
pub(crate) const SIZES: [u32; 3] = [1, 2, 4];
/// Distance from a label's border up to which nobody can say who is right, px.
const RIM_PX: usize = 2;
/// Area from which a label counts as large, px.
const LARGE_PX: usize = 100;

/// Cause of a wrong pixel.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, VariantArray, strum::IntoStaticStr, serde::Serialize)]
#[serde(rename_all = "kebab-case")]
pub(crate) enum Cause {
    /// No labeled photo shows it, so that nothing has its name.
    #[strum(serialize = "unseen")]
    Unseen,
    /// True labels are wrong here too, at most [`RIM_PX`] from the label's border.
    #[strum(serialize = "rim")]
    Rim,
    /// True labels are wrong here too: one Gaussian covers several things.
    #[strum(serialize = "straddling")]
    Straddling,
    /// The Gaussian has no label.
    #[strum(serialize = "unknown")]
    Unknown,
    /// The Gaussian has its label from its neighbors.
    #[strum(serialize = "inherited")]
    Inherited,
    /// Photos gave the Gaussian the wrong label.
    #[strum(serialize = "voted")]
    Voted,
    /// The labels are right, and the answer is not.
    #[strum(serialize = "answer")]
    Answer,
}

/// Means over the labels of one kind.
#[derive(Clone, Debug, PartialEq, serde::Serialize)]
pub(crate) struct LimitRow {
    /// Kind of the labels, in words.
    pub(crate) labels: &'static str,
    pub(crate) count: usize,
    /// IoU of the scene's own answers.
    pub(crate) iou: f64,
    /// IoU of true labels, by [`SIZES`].
    pub(crate) limits: [f64; SIZES.len()],
    /// What the answers lose, by [`Cause`].
    pub(crate) lost: [f64; Cause::VARIANTS.len()],
}

/// Scores of one label.
#[derive(Clone, Debug, PartialEq)]
struct LimitUnit {
    level: Level,
    area: usize,
    iou: f64,
    limits: [f64; SIZES.len()],
    lost: [f64; Cause::VARIANTS.len()],
}

/// Compares the answers and true labels with the labels of the views.
pub(crate) fn rows(
    scene: &mut AskedScene<'_>,
    views: &[LabeledView<'_>],
    cloud: &GaussianCloud,
    settings: &RenderSettings,
) -> Result<Vec<LimitRow>, DrawError> {
    let mut renderer = Renderer::new();
    let mut truth = TrueLabels::vote(&mut renderer, views, cloud, settings)?;
    truth.identities.blur_px2 = scene.map.identities.blur_px2;
    let (kinds, kind_of) = evidence(scene.map);
    let mut units = Vec::new();
    for view in views {
        let limits = truth.masks(&mut renderer, view.camera, cloud, settings)?;
        let kind = ViewMap::render(&mut renderer, cloud, &kind_of, &kinds, view.camera, settings)?;
        for category in &view.categories {
            let answer = (scene.ask)(&category.name);
            let mask = answer.map(|a| a.mask(view.exact, Some(view.blended), &scene.map.identities, 1));
            let mask = mask.unwrap_or_else(|| Mask::empty(view.exact.width_px, view.exact.height_px));
            let id = truth.by_name[&category.name];
            let limits: Vec<Mask> = limits.iter().map(|map| truth.mask(map, id, &category.mask)).collect();
            let known = known(scene.map, view.exact, &category.name);
            let lost = lost(category, &mask, &limits[0], known.as_ref(), &kind.identity);
            let limits = std::array::from_fn(|k| limits[k].iou(&category.mask));
            let (level, area, iou) = (category.level, category.mask.area(), mask.iou(&category.mask));
            units.push(LimitUnit { level, area, iou, limits, lost });
        }
    }
    Ok(summarize(&units))
}

/// Pixels of the identities called so; `None` if there are no such identities.
fn known(map: &SemanticMap, exact: &ViewMap, name: &str) -> Option<Mask> {
    let named = map.identities.called(name, LevelFilter::Auto);
    let masks = named.into_iter().map(|id| exact.mask(&map.identities, id));
    masks.reduce(|mut all, mask| {
        all.add(&mask);
        all
    })
}

/// What each Gaussian's label rests on, as identities in the order of [`Cause`].
fn evidence(map: &SemanticMap) -> (Identities, Vec<IdentityId>) {
    let of = (0..map.identity_of.len()).map(|i| {
        let cause = match map.identity_of[i] {
            _ if map.is_unknown(i) => Cause::Unknown,
            _ if map.margin[i] == 0.0 => Cause::Inherited,
            _ => Cause::Voted,
        };
        cause as IdentityId + 1
    });
    (Identities::objects(Cause::VARIANTS.len()), of.collect())
}

/// What an answer loses, by cause.
fn lost(
    category: &Category,
    answer: &Mask,
    limit: &Mask,
    known: Option<&Mask>,
    evidence: &[IdentityId],
) -> [f64; Cause::VARIANTS.len()] {
    let truth = &category.mask;
    let mut counts = [0_usize; Cause::VARIANTS.len()];
    for i in (0..evidence.len()).filter(|&i| answer.contains(i) != truth.contains(i)) {
        let Some(known) = known else {
            counts[Cause::Unseen as usize] += 1;
            continue;
        };
        let cause = match Cause::VARIANTS.get((evidence[i] as usize).wrapping_sub(1)) {
            _ if limit.contains(i) != truth.contains(i) && at_rim(truth, i) => Cause::Rim,
            _ if limit.contains(i) != truth.contains(i) => Cause::Straddling,
            _ if known.contains(i) == truth.contains(i) => Cause::Answer,
            Some(cause) => *cause,
            None => Cause::Unknown,
        };
        counts[cause as usize] += 1;
    }
    let union = answer.area() + truth.area() - answer.overlap(truth);
    counts.map(|n| n as f64 / union.max(1) as f64)
}

/// Returns whether the border of a mask is near a pixel.
fn at_rim(mask: &Mask, i: usize) -> bool {
    let (w, h) = (mask.width_px(), mask.height_px());
    let (x, y, inside) = (i % w, i / w, mask.contains(i));
    let near = |at: usize, size: usize| at.saturating_sub(RIM_PX)..(at + RIM_PX + 1).min(size);
    near(y, h).any(|y| near(x, w).any(|x| mask.contains(y * w + x) != inside))
}

/// Labels of Gaussians by the true labels of all views.
struct TrueLabels {
    identities: Identities,
    by_name: BTreeMap<String, IdentityId>,
    of: Vec<IdentityId>,
}

impl TrueLabels {
    fn vote(
        renderer: &mut Renderer,
        views: &[LabeledView<'_>],
        cloud: &GaussianCloud,
        settings: &RenderSettings,
    ) -> Result<Self, DrawError> {
        let mut names: Vec<&String> = views.iter().flat_map(|v| &v.categories).map(|c| &c.name).collect();
        // Wholes come before their pieces.
        names.sort_by_key(|name| (name.matches(BETWEEN).count(), *name));
        names.dedup();
        let (mut identities, mut by_name) = (Identities::default(), BTreeMap::new());
        for name in names {
            let whole = name.split_once(BETWEEN).and_then(|(_, whole)| by_name.get(whole)).copied();
            let level = if whole.is_some() { Level::Part } else { Level::Object };
            by_name.insert(name.clone(), identities.add(level, whole.unwrap_or(NO_IDENTITY), vec![name.clone()]));
        }
        let mut votes = Votes::new(cloud.len());
        for view in views {
            votes.see(renderer, cloud, view.camera, settings)?;
        }
        for view in views {
            let mut labels = vec![NO_IDENTITY; view.exact.identity.len()];
            let mut inside_out: Vec<(IdentityId, &Mask)> =
                view.categories.iter().map(|c| (by_name[&c.name], &c.mask)).collect();
            inside_out.sort_by_key(|c| c.0);
            inside_out.iter().for_each(|(id, mask)| mask.pixels().for_each(|i| labels[i] = *id));
            votes.add_view(renderer, cloud, view.camera, settings, &labels)?;
        }
        let decided = votes.decide(&identities, LEAST_VOTES);
        let unlabeled = |a: Assignment| if a.identity == UNKNOWN { NO_IDENTITY } else { a.identity };
        Ok(Self { identities, by_name, of: decided.into_iter().map(unlabeled).collect() })
    }

    /// Draws them in all [`SIZES`].
    fn masks(
        &self,
        renderer: &mut Renderer,
        camera: &Camera,
        cloud: &GaussianCloud,
        settings: &RenderSettings,
    ) -> Result<Vec<ViewMap>, DrawError> {
        let side = camera.width_px.max(camera.height_px);
        let draw = |divisor: &u32| {
            let camera = camera.limited_to((side / divisor).max(1));
            ViewMap::render(renderer, cloud, &self.of, &self.identities, &camera, settings)
        };
        SIZES.iter().map(draw).collect()
    }

    /// Pixels of an identity, in the size of `like`.
    fn mask(&self, map: &ViewMap, id: IdentityId, like: &Mask) -> Mask {
        map.mask(&self.identities, id).resized(like.width_px(), like.height_px())
    }
}

/// Means by kind of label; kinds without any are left out.
fn summarize(units: &[LimitUnit]) -> Vec<LimitRow> {
    type IsOf = fn(&LimitUnit) -> bool;
    let kinds: [(&str, IsOf); 4] = [
        ("objects", |u| u.level == Level::Object),
        ("parts", |u| u.level == Level::Part),
        ("large parts", |u| u.level == Level::Part && u.area >= LARGE_PX),
        ("small parts", |u| u.level == Level::Part && u.area < LARGE_PX),
    ];
    let row = |(labels, is): (&'static str, IsOf)| {
        let of: Vec<&LimitUnit> = units.iter().filter(|u| is(u)).collect();
        let mean = |value: &dyn Fn(&LimitUnit) -> f64| mean(&of.iter().map(|u| value(u)).collect::<Vec<_>>());
        (!of.is_empty()).then(|| LimitRow {
            labels,
            count: of.len(),
            iou: mean(&|u| u.iou),
            limits: std::array::from_fn(|k| mean(&|u| u.limits[k])),
            lost: std::array::from_fn(|k| mean(&|u| u.lost[k])),
        })
    };
    kinds.into_iter().filter_map(row).collect()
}

#[cfg(test)]
mod tests {
    use glam::DVec3;

    use super::*;
    use crate::pipeline::semantics::code_map::CodeMap;
    use crate::pipeline::semantics::evaluation::AskedScene;
    use crate::pipeline::semantics::query::language::QueryPlace;
    use crate::pipeline::semantics::query::query_engine::ask_by_name;
    use crate::pipeline::semantics::query::recipe::QueryConfig;

    const SIZE: (usize, usize) = (180, 120);

    /// Two opaque plates side by side before the camera, and a view of them.
    fn plates() -> (GaussianCloud, Camera) {
        let cloud = GaussianCloud::isotropic(vec![[-0.5, 0.0, 0.0], [0.5, 0.0, 0.0]], -1.4, 6.0);
        let eye = DVec3::new(0.0, 0.0, -4.0);
        let camera = Camera::look_at(eye, DVec3::ZERO, DVec3::NEG_Y, 0.5, SIZE.0 as u32, SIZE.1 as u32);
        (cloud, camera.expect("valid"))
    }

    /// Asks a scene in which the Gaussians have these labels ("mug", 1) with these margins, by a label of the pixels
    /// that `is_mug` says.
    fn row(of: [IdentityId; 2], margin: [f32; 2], is_mug: impl Fn(usize, f32) -> bool + Sync) -> LimitRow {
        row_of("mug", of, margin, is_mug)
    }

    /// The same, asked for another thing in place of the mug.
    fn row_of(
        asked: &str,
        of: [IdentityId; 2],
        margin: [f32; 2],
        is_asked: impl Fn(usize, f32) -> bool + Sync,
    ) -> LimitRow {
        let (cloud, camera) = plates();
        let mut identities = Identities::default();
        for (name, code) in [("mug", [0.1, 0.5, 0.5]), ("pan", [0.9, 0.5, 0.5])] {
            let id = identities.add(Level::Object, NO_IDENTITY, vec![name.into()]);
            identities.get_mut(id).expect("there").code = code;
        }
        let map = SemanticMap::from_identities(identities, of.to_vec(), margin.to_vec(), vec![]);
        let (mut renderer, settings) = (Renderer::new(), RenderSettings::default());
        let exact = ViewMap::render(&mut renderer, &cloud, &of, &map.identities, &camera, &settings).expect("drawn");
        let left = camera.project(DVec3::new(-0.5, 0.0, 0.0)).expect("in front").x < SIZE.0 as f64 / 2.0;
        let column = |x: usize| if left { x } else { SIZE.0 - 1 - x };
        let mask = Mask::from_fn(SIZE.0, SIZE.1, |i| is_asked(column(i % SIZE.0), exact.alpha[i]));
        let category =
            Category { name: asked.into(), level: Level::Object, boxes: mask.bounds().into_iter().collect(), mask };
        let blended = CodeMap::default();
        let view =
            LabeledView { name: "a", camera: &camera, exact: &exact, blended: &blended, categories: vec![category] };
        let place = QueryPlace::default();
        let mut ask =
            |text: &str| ask_by_name(&map.identities, text, (LevelFilter::Auto, &place), &QueryConfig::default());
        let rows = rows(&mut AskedScene { map: &map, ask: &mut ask }, &[view], &cloud, &settings).expect("drawn");
        assert_eq!((rows.len(), rows[0].labels, rows[0].count), (1, "objects", 1));
        rows.into_iter().next().expect("a row")
    }

    fn only(cause: Cause, row: &LimitRow) {
        let total: f64 = row.lost.iter().sum();
        assert!((total + row.iou - 1.0).abs() < 1e-9, "causes add up: {row:?}");
        assert!(row.lost[cause as usize] > 0.8 * total && total > 0.3, "{cause:?}: {row:?}");
    }

    #[test]
    fn each_cause_is_told_apart() {
        let is_left = |x: usize, alpha: f32| alpha > 0.5 && x < SIZE.0 / 2;
        let right = row([1, 2], [1.0; 2], is_left);
        assert!(right.iou > 0.9 && right.limits[0] > 0.9, "the control: {right:?}");
        only(Cause::Unknown, &row([NO_IDENTITY, 2], [0.0; 2], is_left));
        only(Cause::Inherited, &row([2, 2], [0.0; 2], is_left));
        only(Cause::Voted, &row([2, 2], [0.7; 2], is_left));
        only(Cause::Unseen, &row_of("jug", [1, 2], [0.7; 2], is_left));
        // The label reaches over the faint rim of a plate, which is one Gaussian.
        let wide = row([1, 2], [1.0; 2], |x, alpha| alpha > 0.05 && x < SIZE.0 / 2);
        only(Cause::Straddling, &wide);
        assert!(wide.limits[0] < 0.7, "{wide:?}");
    }

    #[test]
    fn smaller_masks_are_coarser() {
        let row = row([1, 2], [1.0; 2], |x, alpha| alpha > 0.5 && x < SIZE.0 / 2);
        assert!(row.limits[0] >= row.limits[1] && row.limits[1] > row.limits[2], "{row:?}");
    }
}
