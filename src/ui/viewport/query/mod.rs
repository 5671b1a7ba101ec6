//! Queries asked of the scene: the box to type them into, their answers, and what they draw over
//! the frame.
//!
//! What the view's pixels belong to is drawn once, when the eye rests; every query then only
//! reads it, while it is still being typed.

mod bar;
mod card;
mod details;
mod embeddings;
mod overlay;
mod panel;
mod settings;
mod times;
mod truth;

use std::collections::BTreeMap;
use std::time::Instant;

use egui::{Color32, Rect, TextureHandle, TextureOptions, Ui, Vec2, vec2};

use self::embeddings::Embeddings;
pub(crate) use self::settings::OverlaySettings;
use crate::jobs::query::{ViewMaps, answer_encoded};
use crate::navigate::Pose;
use crate::pipeline::semantics::answer::QueryAnswer;
use crate::pipeline::semantics::matching::MatchMode;
use crate::pipeline::semantics::names;
use crate::pipeline::semantics::reading::QueryReading;
use crate::pipeline::semantics::timing::{StagesMs, ms_since};
use crate::scene::{IdentityId, Mask, ScenePlan, SemanticMap};
use crate::ui::color_by::ColorBy;
use crate::worker::Versioned;

/// Colors of queries, in turn.
const COLORS: [[u8; 3]; 6] =
    [[255, 179, 0], [0, 200, 215], [233, 84, 150], [128, 215, 70], [160, 130, 255], [255, 120, 70]];
/// Queries that are kept on screen.
const MOST: usize = COLORS.len();

/// A query with its answer.
#[derive(Clone, Debug, PartialEq)]
pub struct Asked {
    /// As it was typed.
    pub(crate) text: String,
    /// What it comes to.
    pub answered: QueryAnswer,
    /// Whether the text encoder has yet to read it: names alone have answered so far.
    pub pending: bool,
    /// A hit that was chosen among the others; else the best are shown.
    chosen: Option<IdentityId>,
    /// How it was read.
    reading: QueryReading,
    /// Words that neither names nor the encoder know.
    unknown: Vec<String>,
    /// Words that the answer does not rest on.
    ignored: Vec<String>,
}

impl Asked {
    /// The identities that are shown.
    pub(crate) fn shown(&self, settings: &OverlaySettings) -> Vec<IdentityId> {
        self.chosen.map_or_else(|| self.answered.chosen(settings.top), |id| vec![id])
    }
}

/// What the overlay was painted for.
#[derive(Clone, PartialEq)]
struct Painted {
    maps: u64,
    semantics: u64,
    shown: Vec<Vec<IdentityId>>,
    newest: Option<String>,
    settings: OverlaySettings,
}

/// The queries on screen.
#[derive(Default)]
pub struct Queries {
    typed: String,
    /// Set while the box is to take the keyboard.
    focus: bool,
    /// Whether anything was asked in this scene, or begun to be.
    wanted: bool,
    /// Place in the history while going through it.
    recalled: Option<usize>,
    settings: OverlaySettings,
    live: Option<Asked>,
    kept: Vec<Asked>,
    /// What was asked, oldest first.
    history: Vec<String>,
    maps: Option<Versioned<ViewMaps>>,
    /// The same while the eye moves, at the resolution of the frame.
    moving: Option<Versioned<ViewMaps>>,
    /// Generation of the objects and parts that were asked.
    answered_for: u64,
    /// Embeddings of the texts on screen.
    embeddings: Embeddings,
    /// Why there are none, once that was reported.
    reported: Option<String>,
    /// Relevancy of the pixels, for the histogram.
    heat: Vec<f32>,
    texture: Option<TextureHandle>,
    painted: Option<Painted>,
    /// What answers are compared with, where the eye is, and what that came to.
    truth: Option<truth::ViewTruth>,
    eye: Option<Pose>,
    comparison: Option<truth::TruthComparison>,
    /// Of the target that is shown.
    facts: Option<card::Facts>,
    /// Pixels of identities in the present view, counted as they are listed.
    areas: Areas,
    /// What finding the pixels and drawing them took, of all queries on screen.
    paint_ms: StagesMs,
}

/// Pixels of identities in a view, for one way of matching.
#[derive(Default)]
struct Areas {
    /// View, objects and match that they were counted for.
    of: (u64, u64, MatchMode, u32),
    known: BTreeMap<IdentityId, (usize, Option<Vec2>)>,
}

impl Queries {
    /// All queries, the one being typed last.
    pub fn all(&self) -> impl Iterator<Item = &Asked> {
        self.kept.iter().chain(&self.live)
    }

    /// The query that is answered on screen.
    fn newest(&self) -> Option<&Asked> {
        self.live.as_ref().or(self.kept.last())
    }

    /// Shows this hit of the newest query alone, or the best again.
    fn choose(&mut self, chosen: Option<IdentityId>) {
        if let (Some(id), Some(newest)) = (chosen, self.live.as_mut().or(self.kept.last_mut())) {
            newest.chosen = (newest.chosen != Some(id)).then_some(id);
        }
    }

    /// The identities that are found on screen.
    pub fn found(&self) -> Vec<IdentityId> {
        self.all().flat_map(|asked| asked.shown(&self.settings)).collect()
    }

    /// The same with the colors of their queries.
    pub(super) fn found_colors(&self) -> Vec<(IdentityId, Color32)> {
        let colors = COLORS.map(|[r, g, b]| Color32::from_rgb(r, g, b));
        let colored =
            |(k, q): (usize, &Asked)| q.shown(&self.settings).into_iter().map(move |id| (id, colors[k % COLORS.len()]));
        self.all().enumerate().flat_map(colored).collect()
    }

    /// What the present view's pixels belong to, once that is drawn.
    pub fn maps(&self) -> Option<&Versioned<ViewMaps>> {
        self.maps.as_ref()
    }

    /// Whether anything was asked in this scene, or begun to be: what queries need is needed now.
    pub(crate) fn wanted(&self) -> bool {
        self.wanted
    }

    /// Whether blended codes of the view are wanted.
    pub(crate) fn wants_codes(&self) -> bool {
        self.settings.mode == MatchMode::Blend || self.settings.color_by == ColorBy::Difference
    }

    /// Puts the cursor into the box.
    pub(crate) fn start_typing(&mut self) {
        (self.focus, self.wanted) = (true, true);
    }

    /// Answers anew where objects and parts, or embeddings, have changed.
    pub(crate) fn keep_up(&mut self, ctx: &egui::Context, semantics: &Versioned<SemanticMap>, plan: &ScenePlan) {
        let encoder = semantics.language.as_ref().map(|l| l.encoder.as_str());
        let now = semantics.generation();
        // One that is of no more use goes at once, one that is new waits for a query.
        let texts = self.all().map(|q| q.reading.phrase.clone()).collect();
        let encoded =
            (encoder.is_none() || plan.encoder.now(self.wanted)) && self.embeddings.keep_up(ctx, encoder, texts);
        if encoded || self.answered_for != now {
            self.answered_for = now;
            self.ask_again(semantics);
        }
    }

    /// Asks as if it had been typed.
    pub(crate) fn ask(&mut self, text: &str, semantics: &SemanticMap) {
        self.typed = text.to_owned();
        self.wanted = true;
        self.live = self.asked(text, semantics);
    }

    /// Shows the answers to these queries, and no others.
    pub(crate) fn mark(&mut self, texts: &[String], semantics: &SemanticMap) {
        self.typed.clear();
        self.wanted = true;
        self.kept = texts.iter().filter_map(|text| self.asked(text, semantics)).collect();
        self.live = None;
        if let Some(last) = self.kept.pop() {
            self.typed.clone_from(&last.text);
            self.live = Some(last);
        }
    }

    /// Answers all queries anew: identities have changed.
    pub(crate) fn ask_again(&mut self, semantics: &SemanticMap) {
        let texts: Vec<String> = self.kept.iter().map(|q| q.text.clone()).collect();
        self.kept = texts.iter().filter_map(|text| self.asked(text, semantics)).collect();
        self.live = self.live.take().and_then(|q| self.asked(&q.text, semantics));
    }

    /// Forgets queries and answers: another scene.
    pub(crate) fn clear(&mut self) {
        let history = std::mem::take(&mut self.history);
        let embeddings = std::mem::take(&mut self.embeddings);
        *self = Self { settings: self.settings, history, embeddings, ..Self::default() };
    }

    /// Why only names are understood, once for each reason.
    pub(crate) fn newly_failed(&mut self) -> Option<String> {
        let why = self.embeddings.problem()?.to_owned();
        (self.reported.replace(why.clone()).as_ref() != Some(&why)).then_some(why)
    }

    /// Takes over what the present view's pixels belong to, exactly or as the eye moves.
    pub(crate) fn set_maps(&mut self, maps: Versioned<ViewMaps>, exact: bool) {
        (self.maps, self.moving) = if exact { (Some(maps), None) } else { (None, Some(maps)) };
    }

    /// What the pixels belong to is not known any more. What was drawn stays on screen until it is, if only the
    /// eye has moved.
    pub(crate) fn forget_maps(&mut self, only_moved: bool) {
        let before = self.maps.take().or(self.moving.take());
        self.moving = before.filter(|_| only_moved);
    }

    /// What is on screen of it: exact, or of the newest frame of a moving view.
    pub fn shown_maps(&self) -> Option<&Versioned<ViewMaps>> {
        self.maps.as_ref().or(self.moving.as_ref())
    }

    /// Colors the view by this; by nothing but masks if it is colored so.
    pub(crate) fn tint(&mut self, by: ColorBy) {
        self.settings.color_by = if self.settings.color_by == by { ColorBy::Masks } else { by };
        self.wanted = true;
    }

    /// How answers are drawn.
    pub(super) fn settings(&mut self) -> &mut OverlaySettings {
        &mut self.settings
    }

    /// Whether anything is drawn over the frame that depends on what its pixels belong to.
    pub(super) fn tints(&self) -> bool {
        self.painted.is_some()
    }

    fn asked(&self, text: &str, semantics: &SemanticMap) -> Option<Asked> {
        let text = text.trim();
        let reading = QueryReading::new(&semantics.identities, text, self.settings.kind)?;
        let phrase = &reading.phrase;
        let encoded = self.embeddings.of(phrase);
        let mut answered = answer_encoded(semantics, phrase, self.settings.kind, self.embeddings.phrases(phrase));
        answered.stages.encode = encoded.map_or(0.0, |t| t.encode_ms);
        let to_encoder = encoded.map(|t| t.unknown.as_slice());
        let unknown = names::unknown_to_all(&semantics.identities, &phrase.text, to_encoder);
        let ignored = answered.ignored_words(&semantics.identities, phrase, &unknown);
        let pending = semantics.language.is_some() && self.embeddings.is_pending(phrase);
        Some(Asked { text: text.to_owned(), answered, pending, chosen: None, reading, unknown, ignored })
    }

    /// The target's pixels in the present view.
    fn mask_of(&self, maps: &ViewMaps, semantics: &SemanticMap, target: IdentityId) -> Mask {
        maps.mask(semantics, target, self.settings.mode, self.settings.tolerance)
    }

    /// Pixels of an identity in the present view, if that is drawn.
    fn area_of(&mut self, semantics: &Versioned<SemanticMap>, id: IdentityId) -> Option<usize> {
        Some(self.measured(semantics, id)?.0)
    }

    /// Shares of the present view's width and height that an identity spans, if that is drawn; `Some(None)` if it
    /// has no pixel there.
    pub(super) fn span_of(&mut self, semantics: &Versioned<SemanticMap>, id: IdentityId) -> Option<Option<Vec2>> {
        Some(self.measured(semantics, id)?.1)
    }

    /// Both, found once for a view.
    fn measured(&mut self, semantics: &Versioned<SemanticMap>, id: IdentityId) -> Option<(usize, Option<Vec2>)> {
        let maps = self.maps.clone()?;
        let OverlaySettings { mode, tolerance, .. } = self.settings;
        let of = (maps.generation(), semantics.generation(), mode, tolerance.to_bits());
        if self.areas.of != of {
            self.areas = Areas { of, known: BTreeMap::new() };
        }
        if let Some(known) = self.areas.known.get(&id) {
            return Some(*known);
        }
        let mask = self.mask_of(&maps, semantics, id);
        let of = vec2(mask.width_px() as f32, mask.height_px() as f32);
        let span = mask.bounds().map(|b| vec2(b.x.len() as f32, b.y.len() as f32) / of);
        self.areas.known.insert(id, (mask.area(), span));
        Some((mask.area(), span))
    }

    /// Masks and tints over the frame in `rect`.
    pub(crate) fn paint(&mut self, ui: &Ui, rect: Rect, semantics: &Versioned<SemanticMap>) {
        let Some(maps) = self.shown_maps().cloned() else { return };
        let shown: Vec<Vec<IdentityId>> = self.all().map(|q| q.shown(&self.settings)).collect();
        let newest = self.all().last().map(|q| q.text.clone());
        let nothing =
            shown.iter().all(Vec::is_empty) && matches!(self.settings.color_by, ColorBy::Masks | ColorBy::Heat);
        if nothing && (newest.is_none() || self.settings.color_by == ColorBy::Masks) && self.settings.threshold <= 0.0 {
            (self.painted, self.paint_ms) = (None, StagesMs::default());
            return;
        }
        let painted = Painted {
            maps: maps.generation(),
            semantics: semantics.generation(),
            shown,
            newest,
            settings: self.settings,
        };
        if self.painted.as_ref() != Some(&painted) {
            let start = Instant::now();
            let image = self.image(&maps, &painted.shown, semantics);
            match &mut self.texture {
                Some(texture) => texture.set(image, TextureOptions::LINEAR),
                None => self.texture = Some(ui.ctx().load_texture("masks", image, TextureOptions::LINEAR)),
            }
            self.paint_ms.draw = ms_since(start) - self.paint_ms.mask;
            self.painted = Some(painted);
        }
        if let Some(texture) = &self.texture {
            let uv = Rect::from_min_max(egui::pos2(0.0, 0.0), egui::pos2(1.0, 1.0));
            ui.painter().image(texture.id(), rect, uv, Color32::WHITE);
        }
    }

    fn image(&mut self, maps: &ViewMaps, shown: &[Vec<IdentityId>], semantics: &SemanticMap) -> egui::ColorImage {
        let union = |ids: &Vec<IdentityId>| {
            let mut mask = Mask::empty(maps.identities.width_px, maps.identities.height_px);
            ids.iter().for_each(|id| mask.add(&self.mask_of(maps, semantics, *id)));
            mask
        };
        let start = Instant::now();
        let masks: Vec<([u8; 3], Mask)> =
            shown.iter().enumerate().map(|(k, ids)| (COLORS[k % COLORS.len()], union(ids))).collect();
        let masks = self.compared(masks);
        self.paint_ms.mask = ms_since(start);
        let newest = self.all().last();
        let relevancy = newest.map_or_else(Vec::new, |q| q.answered.relevancy.clone());
        let features = match (&semantics.language, self.settings.color_by) {
            (Some(language), ColorBy::Features) => {
                let of = |f: &crate::scene::ViewFeatures| f.deviated.first().cloned();
                let vectors: Vec<Option<Vec<f32>>> =
                    std::iter::once(None).chain(language.by_identity.iter().map(of)).collect();
                overlay::main_directions(&vectors.iter().map(Option::as_deref).collect::<Vec<_>>())
            }
            _ => Vec::new(),
        };
        self.heat = newest.map_or_else(Vec::new, |q| q.answered.heat(&maps.identities));
        let layers = overlay::Layers {
            map: &maps.identities,
            codes: maps.codes.as_ref(),
            identities: &semantics.identities,
            masks: &masks,
            relevancy: &relevancy,
            features: &features,
            settings: self.settings,
        };
        layers.paint()
    }
}

#[cfg(test)]
mod tests;
