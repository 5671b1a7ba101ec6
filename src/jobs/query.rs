//! Queries of a scene: the answer, its pixels in a view, and the relevancy of all others.

use std::path::Path;
use std::time::Instant;

use image::ColorType;

use super::{JobError, Scene, export};
use crate::math::colormap::Colormap;
use crate::pipeline::removal::invented_flags;
use crate::pipeline::semantics::code_map::CodeMap;
use crate::pipeline::semantics::evaluation::langsplat;
use crate::pipeline::semantics::lifting::votes::UNKNOWN;
use crate::pipeline::semantics::query::answer::{Basis, QueryAnswer};
use crate::pipeline::semantics::query::language::QueryPlace;
use crate::pipeline::semantics::query::localize::Answer;
use crate::pipeline::semantics::query::matching::{self, MatchMode};
pub(crate) use crate::pipeline::semantics::query::query_engine::{QueryEngine, answer_encoded, ask_with};
use crate::pipeline::semantics::query::reading::QueryReading;
use crate::pipeline::semantics::query::recipe::QueryConfig;
use crate::pipeline::semantics::query::timing::ms_since;
use crate::pipeline::semantics::smoothing::{BY_COMMON_RULE, by_common_rule};
use crate::pipeline::semantics::view_map::ViewMap;
use crate::render::{DrawError, Features, RenderError, RenderSettings, Renderer};
use crate::scene::{Camera, GaussianCloud, IdentityId, LevelFilter, Mask, NO_IDENTITY, SemanticMap};

/// Identities of a view's pixels, drawn once for all queries.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct ViewMaps {
    /// Identity of largest weight per pixel.
    pub identities: ViewMap,
    /// Blended codes, if they were requested.
    pub(crate) codes: Option<CodeMap>,
    /// Pixels dominated by unknown Gaussians: no mask or photo tells about them. All else treats them as unlabeled.
    pub(crate) unknown: Mask,
    /// Pixels dominated by Gaussians that were invented to close a surface; empty if there are none.
    pub(crate) invented: Mask,
}

/// Stands for unknown Gaussians while a view is drawn. No identity has this number, so they count together with
/// unlabeled ones, and masks are the same with them or without.
const UNSEEN: IdentityId = UNKNOWN - 1;

impl ViewMaps {
    /// Draws them; codes if `wanted`, those of parts too if `parts`.
    pub(crate) fn draw(
        renderer: &mut Renderer,
        (cloud, settings): (&GaussianCloud, &RenderSettings),
        map: &SemanticMap,
        camera: &Camera,
        wanted: bool,
        parts: bool,
    ) -> Result<Self, DrawError> {
        let seen = |(i, id): (usize, &IdentityId)| if map.is_unknown(i) { UNSEEN } else { *id };
        let of: Vec<IdentityId> = map.identity_of.iter().enumerate().map(seen).collect();
        let mut identities = ViewMap::render(renderer, cloud, &of, &map.identities, camera, settings)?;
        let drawn = &identities.identity;
        let unknown = Mask::from_fn(identities.width_px, identities.height_px, |i| drawn[i] == UNSEEN);
        unknown.pixels().for_each(|i| identities.identity[i] = NO_IDENTITY);
        let codes = match wanted {
            true => Some(CodeMap::render(renderer, cloud, &map.codes, parts, camera, settings)?),
            false => None,
        };
        let invented = invented(renderer, (cloud, settings), camera)?;
        Ok(Self { identities, codes, unknown, invented })
    }

    /// Share of the view dominated by invented Gaussians.
    pub(crate) fn invented_share(&self) -> f64 {
        self.invented.area() as f64 / self.identities.identity.len().max(1) as f64
    }

    /// Share of the view dominated by unknown Gaussians.
    pub(crate) fn unknown_share(&self) -> f64 {
        self.unknown.area() as f64 / self.identities.identity.len().max(1) as f64
    }

    /// Returns the pixels of an identity; a match differs by at most `tolerance` per channel.
    pub(crate) fn mask(&self, map: &SemanticMap, id: IdentityId, mode: MatchMode, tolerance: f32) -> Mask {
        matching::pixels((&self.identities, self.codes.as_ref()), &map.identities, id, mode, tolerance)
    }

    /// Returns the pixels of an answer, of at most `top` identities.
    pub(crate) fn of_answer(&self, map: &SemanticMap, answered: &QueryAnswer, top: usize) -> Mask {
        answered.mask(&self.identities, self.codes.as_ref(), &map.identities, top)
    }
}

/// Returns the pixels dominated by invented Gaussians.
fn invented(
    renderer: &mut Renderer,
    (cloud, settings): (&GaussianCloud, &RenderSettings),
    camera: &Camera,
) -> Result<Mask, RenderError> {
    let Some(flags) = invented_flags(cloud) else { return Ok(Mask::empty(0, 0)) };
    let features = Features { channels: 1, values: flags };
    let bare = RenderSettings { sh_degree: 0, depth: false, ..settings.clone() };
    let frame = renderer.render(cloud, features, camera, &bare)?;
    Ok(Mask::from_fn(frame.width_px, frame.height_px, |i| frame.features[0][i] >= 0.5))
}

/// Draws the identities of a view's pixels.
pub(crate) fn identities_in_view(
    drawn: (&GaussianCloud, &RenderSettings),
    map: &SemanticMap,
    camera: &Camera,
) -> Result<ViewMap, JobError> {
    Ok(ViewMaps::draw(&mut Renderer::new(), drawn, map, camera, false, false)?.identities)
}

/// A query of a scene in a view.
#[derive(Clone, Debug)]
pub(crate) struct QueryRequest<'a> {
    pub(crate) text: &'a str,
    pub(crate) level: LevelFilter,
    pub(crate) camera: &'a Camera,
    pub(crate) recipe: &'a QueryConfig,
    /// Most answers whose pixels go into the mask.
    pub(crate) top: usize,
}

#[derive(Clone, Debug)]
pub(crate) struct QueryResult {
    /// The answer, and the time it took.
    pub(crate) answered: QueryAnswer,
    /// The parsed query.
    pub(crate) reading: QueryReading,
    pub(crate) mask: Mask,
    /// Canonical phrases that the encoder could not read and that were left out.
    pub(crate) unread: Vec<String>,
    /// Words that the answer does not use.
    pub(crate) ignored_words: Vec<String>,
    /// Words that would have been needed for an answer.
    pub(crate) unexplained_words: Vec<String>,
    /// Milliseconds from the text to the mask, with the view drawn before.
    pub(crate) query_ms: f64,
    pub(crate) maps: ViewMaps,
}

/// Own rule of this program in words.
pub(crate) const BY_IDENTITY: &str = "pixels of the object or part that is the answer";

/// A mask by a rule.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct RuledMask {
    pub(crate) mask: Mask,
    /// Name of the level that it was taken from.
    pub(crate) level: &'static str,
    /// The rule in words.
    pub(crate) rule: &'static str,
}

impl QueryResult {
    /// Returns the mask by the rule that is the same for all methods.
    pub(crate) fn common_mask(&self, map: &SemanticMap) -> RuledMask {
        let (seen, rule) = (&self.maps.identities, BY_COMMON_RULE);
        let levels = langsplat::levels(&self.answered, seen, &map.identities);
        match by_common_rule(&levels, seen.width_px, seen.height_px) {
            Some(found) => RuledMask { mask: found.mask, level: ["object", "part"][found.level.min(1)], rule },
            None => RuledMask { mask: Mask::empty(seen.width_px, seen.height_px), level: "object", rule },
        }
    }
}

pub(crate) fn run(scene: &Scene, map: &SemanticMap, request: &QueryRequest<'_>) -> Result<QueryResult, JobError> {
    let drawn = (&*scene.cloud, &scene.settings);
    let blend = request.recipe.masks == MatchMode::Codes;
    let maps = ViewMaps::draw(&mut Renderer::new(), drawn, map, request.camera, blend, map.has_parts())?;
    let mut engine = QueryEngine::new(map.language.as_ref(), request.recipe.clone())?;
    engine.place = seen_from(scene, Some(request.camera));
    let start = Instant::now();
    let reading = engine.read(&map.identities, request.text).ok_or(JobError::EmptyQuery)?;
    let mut answered = engine.answer(map, &reading, request.level)?;
    let matching_since = Instant::now();
    let mask = maps.of_answer(map, &answered, request.top);
    answered.stages.mask = ms_since(matching_since);
    let query_ms = ms_since(start);
    let (ignored_words, unexplained_words) = engine.left_out(&map.identities, &reading, &answered);
    let unread = engine.unread();
    Ok(QueryResult { answered, reading, mask, unread, ignored_words, unexplained_words, query_ms, maps })
}

/// Place of a camera in a scene, for questions; that of the first photo without one.
pub(crate) fn seen_from(scene: &Scene, camera: Option<&Camera>) -> QueryPlace {
    let views = scene.views();
    let up = Camera::up_of(views.iter()).unwrap_or_else(|| scene.home().up);
    let at = |camera: &Camera| QueryPlace::new(camera, up, scene.meters_per_unit);
    camera.or(views.first()).map(at).unwrap_or_default()
}

/// Returns the identities of the answer: all that are meant together, else at most `top`.
pub(crate) fn identities(
    map: &SemanticMap,
    place: &QueryPlace,
    text: &str,
    level: LevelFilter,
    top: usize,
) -> Result<Vec<IdentityId>, JobError> {
    Ok(answered(map, place, text, level, &QueryConfig::default())?.chosen(top))
}

/// Returns the same for edits: by names alone.
///
/// # Errors
/// If nothing is found, or only by embedding, or if several fit where one is meant.
pub(crate) fn named(
    map: &SemanticMap,
    place: &QueryPlace,
    text: &str,
    level: LevelFilter,
    top: usize,
) -> Result<Vec<IdentityId>, JobError> {
    let answered = answered(map, place, text, level, &QueryConfig::default())?;
    let names = |ids: &[IdentityId]| ids.iter().take(8).map(|id| map.identities.full_name(*id)).collect::<Vec<_>>();
    match (answered.basis, answered.chosen(top)) {
        (Basis::Embedding, ids) => {
            let name = names(&ids).into_iter().next().unwrap_or_default();
            Err(JobError::OnlyLooks { text: text.to_owned(), name })
        }
        (Basis::Names, ids) if matches!(answered.answer, Answer::Ambiguous(_)) && top < ids.len() => {
            Err(JobError::SeveralFit { text: text.to_owned(), names: names(&ids).join("', '") })
        }
        (Basis::Names, ids) => Ok(ids),
    }
}

/// Returns the one identity that a text names.
///
/// # Errors
/// If nothing is found, or only by embedding, or if several fit.
pub(crate) fn one_named(
    map: &SemanticMap,
    place: &QueryPlace,
    text: &str,
    level: LevelFilter,
) -> Result<IdentityId, JobError> {
    match named(map, place, text, level, 1)?.as_slice() {
        [id] => Ok(*id),
        [] => Err(JobError::NoMatch(text.to_owned())),
        several => {
            let names: Vec<String> = several.iter().map(|id| map.identities.full_name(*id)).collect();
            Err(JobError::SeveralFit { text: text.to_owned(), names: names.join("', '") })
        }
    }
}

/// Returns the answer to a query.
///
/// # Errors
/// If nothing is found, or the encoder fails.
pub(crate) fn answered(
    map: &SemanticMap,
    place: &QueryPlace,
    text: &str,
    level: LevelFilter,
    recipe: &QueryConfig,
) -> Result<QueryAnswer, JobError> {
    let mut engine = QueryEngine::new(map.language.as_ref(), recipe.clone())?;
    engine.place = place.clone();
    let answered = engine.ask(map, text, level)?;
    answered.filter(|a| !a.chosen(1).is_empty()).ok_or_else(|| JobError::NoMatch(text.to_owned()))
}

/// Endings of files that [`write_mask`] and [`write_heat`] write.
pub(crate) const MAP_ENDINGS: [&str; 2] = [".png", ".npy"];

fn is_array(path: &Path) -> bool {
    path.extension().is_some_and(|e| e.eq_ignore_ascii_case("npy"))
}

/// Writes the mask: white on black, or as an array of booleans.
pub(crate) fn write_mask(path: &Path, mask: &Mask) -> Result<(), JobError> {
    let size = [mask.width_px() as u32, mask.height_px() as u32];
    let inside = (0..mask.width_px() * mask.height_px()).map(|i| mask.contains(i));
    export::make_parent(path)?;
    if is_array(path) {
        return Ok(export::npy(path, &inside.collect::<Vec<bool>>(), size)?);
    }
    let pixels: Vec<u8> = inside.map(|inside| if inside { 255 } else { 0 }).collect();
    Ok(export::png(path, &pixels, size, ColorType::L8)?)
}

/// Writes the relevancy of every pixel: over the gray picture, or as an array of numbers.
pub(crate) fn write_heat(
    path: &Path,
    (cloud, settings): (&GaussianCloud, &RenderSettings),
    camera: &Camera,
    relevancy: &[f32],
) -> Result<(), JobError> {
    let size = [camera.width_px, camera.height_px];
    export::make_parent(path)?;
    if is_array(path) {
        return Ok(export::npy(path, relevancy, size)?);
    }
    let frame = Renderer::new().render(cloud, Features::NONE, camera, settings)?;
    let mixed = frame.to_rgb8().into_iter().zip(relevancy).map(|(rgb, &relevancy)| {
        let heat = Colormap::Turbo.color(relevancy);
        let gray = (u32::from(rgb[0]) + u32::from(rgb[1]) + u32::from(rgb[2])) / 3;
        std::array::from_fn::<u8, 3, _>(|c| ((u32::from(heat[c]) * 6 + gray * 4) / 10) as u8)
    });
    let pixels: Vec<[u8; 3]> = mixed.collect();
    Ok(export::png(path, pixels.as_flattened(), size, ColorType::Rgb8)?)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::Identities;
    use glam::DVec3;

    #[test]
    fn what_nothing_is_known_of_is_nobodys_and_told_apart() {
        // A row of four: one of an object, one unlabeled by masks, one unknown, and a guess at the object.
        let at = |x: f32| [x, 0.0, 0.0];
        let cloud = GaussianCloud::isotropic(vec![at(-0.9), at(-0.3), at(0.3), at(0.9)], -2.0, 6.0);
        let camera =
            Camera::look_at(DVec3::new(0.0, 0.0, -4.0), DVec3::ZERO, DVec3::NEG_Y, 0.6, 96, 48).expect("valid");
        let draw = |margin: [f32; 4]| {
            let map = SemanticMap::from_identities(
                Identities::objects(1),
                vec![1, NO_IDENTITY, NO_IDENTITY, 1],
                margin.into(),
                vec![],
            );
            let settings = RenderSettings::default();
            ViewMaps::draw(&mut Renderer::new(), (&cloud, &settings), &map, &camera, false, false).expect("drawn")
        };
        let maps = draw([1.0, 0.5, 0.0, 0.0]);
        let px = |x: f64| camera.project(DVec3::new(x, 0.0, 0.0)).map(|p| 24 * 96 + p.x as usize).expect("in front");
        let at = [-0.9, -0.3, 0.3, 0.9].map(|x| (maps.identities.identity[px(x)], maps.unknown.contains(px(x))));
        assert_eq!(at, [(1, false), (NO_IDENTITY, false), (NO_IDENTITY, true), (1, false)]);
        assert!((0.002..0.05).contains(&maps.unknown_share()), "{}", maps.unknown_share());
        // The control: if none is unknown, no pixel is, and every pixel has the same identity as before.
        let known = draw([1.0; 4]);
        assert!(known.unknown.is_empty() && known.identities == maps.identities && known.unknown_share() == 0.0);
    }
}
