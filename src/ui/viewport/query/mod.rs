//! Questions asked of the scene: the box to type them into, their answers, and what they draw over
//! the picture.
//!
//! What the view's pixels belong to is drawn once, when the eye rests; every question then only
//! reads it, while it is still being typed.

mod bar;
mod card;
mod look;
mod overlay;
mod speech;
mod times;

use std::collections::BTreeMap;
use std::sync::Arc;
use std::time::Instant;

use egui::{Align2, Area, Color32, Id, Order, Rect, TextureHandle, TextureOptions, Ui};

pub use self::look::{Look, Tint};
use self::speech::Speech;
use super::super::theme;
use crate::pipeline::semantics::answer::Answered;
use crate::pipeline::semantics::matching::MatchMode;
use crate::pipeline::semantics::stages::{StagesMs, ms_since};
use crate::scene::{GaussianCloud, Identities, IdentityId, Mask, NOBODY, ScenePlan, SemanticMap};
use crate::worker::{Action, ViewMaps};

/// Colours of questions, in turn.
const COLORS: [[u8; 3]; 6] =
    [[255, 179, 0], [0, 200, 215], [233, 84, 150], [128, 215, 70], [160, 130, 255], [255, 120, 70]];
/// Questions that are kept on screen.
const MOST: usize = COLORS.len();
/// Views narrower than this have no room for the question beside the view's own buttons, points.
const BESIDE: f32 = 700.0;
/// How far it is below them then: both rows of them.
const BELOW: f32 = 92.0;

/// A question with its answer.
#[derive(Clone, Debug, PartialEq)]
pub struct Asked {
    /// As it was typed.
    pub text: String,
    /// What it comes to.
    pub answered: Answered,
    /// A hit that was chosen among the others; else the best are shown.
    chosen: Option<IdentityId>,
    /// Words that neither names nor the encoder know.
    unknown: Vec<String>,
}

impl Asked {
    /// The identities that are shown.
    pub fn shown(&self, look: &Look) -> Vec<IdentityId> {
        self.chosen.map_or_else(|| self.answered.chosen(look.top), |id| vec![id])
    }
}

/// What the overlay was painted for.
#[derive(Clone, PartialEq)]
struct Painted {
    map: usize,
    semantics: usize,
    shown: Vec<Vec<IdentityId>>,
    newest: Option<String>,
    look: Look,
}

/// The questions on screen.
#[derive(Default)]
pub struct Questions {
    typed: String,
    /// Set while the box is to take the keyboard.
    focus: bool,
    /// Whether anything was asked in this scene, or begun to be.
    wanted: bool,
    /// Place in the history while going through it.
    recalled: Option<usize>,
    /// Whether the settings are open.
    open: bool,
    look: Look,
    live: Option<Asked>,
    kept: Vec<Asked>,
    /// What was asked, oldest first.
    history: Vec<String>,
    maps: Option<Arc<ViewMaps>>,
    /// The objects and parts that were asked, by address.
    answered_for: usize,
    /// What compares phrases with looks, once it is loaded.
    speech: Speech,
    /// Relevancy of the pixels, for the histogram.
    heat: Vec<f32>,
    texture: Option<TextureHandle>,
    painted: Option<Painted>,
    /// Of the target that is shown.
    facts: Option<card::Facts>,
    /// Pixels of identities in the present view, counted as they are listed.
    areas: Areas,
    /// What finding the pixels and drawing them took, of all questions on screen.
    paint_ms: StagesMs,
}

/// Pixels of identities in a view, for one way of matching.
#[derive(Default)]
struct Areas {
    /// View, objects and match that they were counted for.
    of: (usize, usize, MatchMode, u32),
    known: BTreeMap<IdentityId, usize>,
}

impl Questions {
    /// All questions, the one being typed last.
    pub fn all(&self) -> impl Iterator<Item = &Asked> {
        self.kept.iter().chain(&self.live)
    }

    /// The identities that are found on screen.
    pub fn found(&self) -> Vec<IdentityId> {
        self.all().flat_map(|asked| asked.shown(&self.look)).collect()
    }

    /// What the present view's pixels belong to, once that is drawn.
    pub fn maps(&self) -> Option<&Arc<ViewMaps>> {
        self.maps.as_ref()
    }

    /// Whether anything was asked in this scene, or begun to be: what questions need is needed now.
    pub fn wanted(&self) -> bool {
        self.wanted
    }

    /// Whether blended codes of the view are wanted.
    pub fn wants_codes(&self) -> bool {
        self.look.mode == MatchMode::Blend || self.look.tint == Tint::Difference
    }

    /// Puts the cursor into the box.
    pub fn start_typing(&mut self) {
        (self.focus, self.wanted) = (true, true);
    }

    /// Answers anew where objects and parts, or what understands phrases, have changed.
    pub fn keep_up(&mut self, ctx: &egui::Context, semantics: &Arc<SemanticMap>, plan: &ScenePlan) {
        let encoder = semantics.language.as_ref().map(|l| l.encoder.as_str());
        let now = Arc::as_ptr(semantics) as usize;
        // One that is of no more use goes at once, one that is new waits for a question.
        let speaks = (encoder.is_none() || plan.encoder.now(self.wanted)) && self.speech.keep_up(ctx, encoder);
        if speaks || self.answered_for != now {
            self.answered_for = now;
            self.ask_again(semantics);
        }
    }

    /// Asks as if it had been typed.
    pub fn ask(&mut self, text: &str, semantics: &SemanticMap) {
        self.typed = text.to_owned();
        self.wanted = true;
        self.live = self.asked(text, semantics);
    }

    /// Shows the answers to these questions, and no others.
    pub fn mark(&mut self, texts: &[String], semantics: &SemanticMap) {
        self.typed.clear();
        self.wanted = true;
        self.kept = texts.iter().filter_map(|text| self.asked(text, semantics)).collect();
        self.live = None;
        if let Some(last) = self.kept.pop() {
            self.typed.clone_from(&last.text);
            self.live = Some(last);
        }
    }

    /// Answers all questions anew: identities have changed.
    pub fn ask_again(&mut self, semantics: &SemanticMap) {
        let texts: Vec<String> = self.kept.iter().map(|q| q.text.clone()).collect();
        self.kept = texts.iter().filter_map(|text| self.asked(text, semantics)).collect();
        self.live = self.live.take().and_then(|q| self.asked(&q.text, semantics));
    }

    /// Forgets questions and answers: another scene.
    pub fn clear(&mut self) {
        let history = std::mem::take(&mut self.history);
        let speech = std::mem::take(&mut self.speech);
        *self = Self { look: self.look, open: self.open, history, speech, ..Self::default() };
    }

    /// Takes over what the present view's pixels belong to; `None` while it is not known.
    pub fn set_maps(&mut self, maps: Option<Arc<ViewMaps>>) {
        self.maps = maps;
        // What was painted and counted for the view before may have had the same address.
        (self.painted, self.areas) = (None, Areas::default());
    }

    fn asked(&mut self, text: &str, semantics: &SemanticMap) -> Option<Asked> {
        let (answered, unknown) = self.speech.ask(semantics, text, self.look.kind)?;
        Some(Asked { text: text.trim().to_owned(), answered, chosen: None, unknown })
    }

    /// Keeps the question being typed on screen, and makes room for the next.
    fn keep(&mut self) {
        let Some(live) = self.live.take() else { return };
        self.kept.retain(|q| q.text != live.text);
        if self.kept.len() == MOST {
            self.kept.remove(0);
        }
        self.history.retain(|t| *t != live.text);
        self.history.push(live.text.clone());
        self.recalled = None;
        self.kept.push(live);
        self.typed.clear();
    }

    /// The target's pixels in the present view.
    fn mask_of(&self, maps: &ViewMaps, semantics: &SemanticMap, target: IdentityId) -> Mask {
        maps.mask(semantics, target, self.look.mode, self.look.tolerance)
    }

    /// Pixels of an identity in the present view, if that is drawn; counted once for a view.
    fn area_of(&mut self, semantics: &SemanticMap, id: IdentityId) -> Option<usize> {
        let maps = self.maps.clone()?;
        let Look { mode, tolerance, .. } = self.look;
        let of = (Arc::as_ptr(&maps) as usize, std::ptr::from_ref(semantics) as usize, mode, tolerance.to_bits());
        if self.areas.of != of {
            self.areas = Areas { of, known: BTreeMap::new() };
        }
        if let Some(area) = self.areas.known.get(&id) {
            return Some(*area);
        }
        let area = self.mask_of(&maps, semantics, id).area();
        self.areas.known.insert(id, area);
        Some(area)
    }

    /// Masks and tints over the picture in `rect`.
    pub fn paint(&mut self, ui: &Ui, rect: Rect, semantics: &Arc<SemanticMap>) {
        let Some(maps) = self.maps.clone() else { return };
        let shown: Vec<Vec<IdentityId>> = self.all().map(|q| q.shown(&self.look)).collect();
        let newest = self.all().last().map(|q| q.text.clone());
        let nothing = shown.iter().all(Vec::is_empty) && matches!(self.look.tint, Tint::Masks | Tint::Heat);
        if nothing && (newest.is_none() || self.look.tint == Tint::Masks) && self.look.threshold <= 0.0 {
            (self.painted, self.paint_ms) = (None, StagesMs::default());
            return;
        }
        let painted = Painted {
            map: Arc::as_ptr(&maps) as usize,
            semantics: Arc::as_ptr(semantics) as usize,
            shown,
            newest,
            look: self.look,
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
        self.paint_ms.mask = ms_since(start);
        let newest = self.all().last();
        let relevancy = newest.map_or_else(Vec::new, |q| q.answered.relevancy.clone());
        let features = match (&semantics.language, self.look.tint) {
            (Some(language), Tint::Features) => {
                let of = |f: &crate::scene::ViewFeatures| f.deviated.first().cloned();
                let vectors: Vec<Option<Vec<f32>>> = std::iter::once(None).chain(language.of.iter().map(of)).collect();
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
            look: self.look,
        };
        layers.paint()
    }

    /// The box, the answers, and the questions that are kept.
    pub fn show(
        &mut self,
        ui: &Ui,
        rect: Rect,
        semantics: &SemanticMap,
        cloud: &GaussianCloud,
        actions: &mut Vec<Action>,
    ) {
        // In the corner: what is looked for is mostly in the middle.
        let mut at = Align2::RIGHT_TOP.pos_in_rect(&rect.shrink(12.0));
        if rect.width() < BESIDE {
            at.y += BELOW;
        }
        let area = Area::new(Id::unique("question")).order(Order::Middle).pivot(Align2::RIGHT_TOP).fixed_pos(at);
        area.constrain_to(rect).show(ui.ctx(), |ui| {
            theme::overlay().show(ui, |ui| {
                // Beside the view's own buttons, as long as there is room.
                ui.set_width((rect.width() - 410.0).clamp(300.0, 380.0).min(rect.width() - 40.0));
                self.show_bar(ui, semantics);
                if self.open {
                    let heat = (!self.heat.is_empty()).then_some(self.heat.as_slice());
                    if look::show(ui, &mut self.look, heat) {
                        self.ask_again(semantics);
                    }
                }
                self.show_answer(ui, semantics, cloud, actions);
                self.show_kept(ui);
            });
        });
        self.show_name_under_cursor(ui, rect, &semantics.identities);
    }

    fn show_name_under_cursor(&self, ui: &Ui, rect: Rect, identities: &Identities) {
        let Some(maps) = &self.maps else { return };
        let map = &maps.identities;
        let Some(pos) = ui.input(|i| i.pointer.hover_pos()).filter(|p| rect.contains(*p)) else { return };
        let x = ((pos.x - rect.left()) / rect.width() * map.width_px as f32) as usize;
        let y = ((pos.y - rect.top()) / rect.height() * map.height_px as f32) as usize;
        let id = map.identity.get(y * map.width_px + x.min(map.width_px - 1)).copied().unwrap_or(NOBODY);
        if identities.get(id).is_none() {
            return;
        }
        let at = Align2::CENTER_BOTTOM.pos_in_rect(&rect.shrink(12.0));
        let area =
            Area::new(Id::unique("under cursor")).order(Order::Middle).pivot(Align2::CENTER_BOTTOM).fixed_pos(at);
        area.interactable(false).show(ui.ctx(), |ui| {
            theme::overlay().show(ui, |ui| ui.label(identities.full_name(id)));
        });
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::Level;

    fn semantics() -> SemanticMap {
        let mut identities = Identities::default();
        let lamp = identities.add(Level::Object, NOBODY, vec!["lamp".into()]);
        identities.add(Level::Part, lamp, vec!["shade".into()]);
        SemanticMap { identities, ..SemanticMap::default() }
    }

    #[test]
    fn a_question_is_kept_and_answers_follow_the_names() {
        let (mut semantics, mut questions) = (semantics(), Questions::default());
        questions.ask("the lamp's shade", &semantics);
        questions.keep();
        questions.ask("lamp", &semantics);
        let shown = |q: &Questions| q.all().map(|a| a.shown(&q.look)).collect::<Vec<_>>();
        assert_eq!(shown(&questions), [vec![2], vec![1]]);
        questions.ask("giraffe", &semantics);
        assert!(shown(&questions)[1].is_empty());
        semantics.identities.get_mut(2).expect("there").names = vec!["giraffe".into()];
        questions.ask_again(&semantics);
        assert_eq!(shown(&questions), [Vec::new(), vec![2]]);
        questions.ask("  ", &semantics);
        assert!(questions.live.is_none());
    }

    #[test]
    fn history_is_kept_once_each() {
        let (semantics, mut questions) = (semantics(), Questions::default());
        for text in ["lamp", "shade", "lamp"] {
            questions.ask(text, &semantics);
            questions.keep();
        }
        assert_eq!(questions.history, ["shade", "lamp"]);
        questions.clear();
        assert_eq!((questions.history.len(), questions.kept.len()), (2, 0));
    }
}
