//! Questions asked of the scene: the box to type them into, their answers, and the masks and heat
//! map over the picture.
//!
//! Identities of the view's pixels are drawn once, when the eye rests; every question then only
//! reads them, while it is still being typed.

use std::sync::Arc;

use egui::{Align2, Area, Color32, ColorImage, Id, Order, Rect, RichText, TextEdit, TextureHandle, TextureOptions, Ui};

use super::super::theme;
use crate::math::colormap::turbo;
use crate::pipeline::semantics::grammar::{Kind, Phrase};
use crate::pipeline::semantics::localise::{Answer, ByName, localise};
use crate::pipeline::semantics::names;
use crate::pipeline::semantics::view_map::ViewMap;
use crate::scene::{Identities, IdentityId, NOBODY, SemanticMap};

/// Colours of questions, in turn.
const COLORS: [[u8; 3]; 6] =
    [[255, 179, 0], [0, 200, 215], [233, 84, 150], [128, 215, 70], [160, 130, 255], [255, 120, 70]];
/// Questions that are kept on screen.
const MOST: usize = COLORS.len();

/// A question with its answer.
#[derive(Clone, Debug, PartialEq)]
pub struct Asked {
    /// As it was typed.
    pub text: String,
    /// What it comes to; `None` for nothing to ask.
    pub answer: Option<Answer>,
    /// The identity that is shown: the best, or the one that was chosen among the others.
    pub shown: Option<IdentityId>,
}

/// What the overlay was painted for.
#[derive(Clone, PartialEq)]
struct Painted {
    map: usize,
    shown: Vec<Option<IdentityId>>,
    heat: bool,
}

/// The questions on screen.
#[derive(Default)]
pub struct Questions {
    typed: String,
    /// Set while the box is to take the keyboard.
    focus: bool,
    live: Option<Asked>,
    kept: Vec<Asked>,
    heat: bool,
    map: Option<Arc<ViewMap>>,
    texture: Option<TextureHandle>,
    painted: Option<Painted>,
}

impl Questions {
    /// All questions, the one being typed last.
    pub fn all(&self) -> impl Iterator<Item = &Asked> {
        self.kept.iter().chain(&self.live)
    }

    /// Identities of the present view's pixels, once they are drawn.
    pub fn map(&self) -> Option<&Arc<ViewMap>> {
        self.map.as_ref()
    }

    /// Puts the cursor into the box.
    pub fn start_typing(&mut self) {
        self.focus = true;
    }

    /// Asks as if it had been typed.
    pub fn ask(&mut self, text: &str, semantics: &SemanticMap) {
        self.typed = text.to_owned();
        self.live = asked(text, &semantics.identities);
    }

    /// Forgets questions and answers: another scene.
    pub fn clear(&mut self) {
        *self = Self { heat: self.heat, ..Self::default() };
    }

    /// Takes over what the present view's pixels belong to; `None` while it is not known.
    pub fn set_map(&mut self, map: Option<Arc<ViewMap>>) {
        self.map = map;
    }

    /// Masks and heat over the picture in `rect`.
    pub fn paint(&mut self, ui: &Ui, rect: Rect, semantics: &SemanticMap) {
        let Some(map) = self.map.clone() else { return };
        let shown: Vec<Option<IdentityId>> = self.all().map(|q| q.shown).collect();
        if shown.iter().all(Option::is_none) && !self.heat {
            return;
        }
        let painted = Painted { map: Arc::as_ptr(&map) as usize, shown, heat: self.heat };
        if self.painted.as_ref() != Some(&painted) {
            let image = self.image(&map, &painted.shown, &semantics.identities);
            match &mut self.texture {
                Some(texture) => texture.set(image, TextureOptions::LINEAR),
                None => self.texture = Some(ui.ctx().load_texture("masks", image, TextureOptions::LINEAR)),
            }
            self.painted = Some(painted);
        }
        if let Some(texture) = &self.texture {
            let uv = Rect::from_min_max(egui::pos2(0.0, 0.0), egui::pos2(1.0, 1.0));
            ui.painter().image(texture.id(), rect, uv, Color32::WHITE);
        }
    }

    fn image(&self, map: &ViewMap, shown: &[Option<IdentityId>], identities: &Identities) -> ColorImage {
        // Which question each identity answers, by number.
        let mut owner: Vec<Option<usize>> = vec![None; identities.len() + 1];
        for (k, id) in shown.iter().enumerate().filter_map(|(k, id)| Some((k, (*id)?))) {
            for (o, inside) in owner.iter_mut().zip(identities.within(id)) {
                *o = if inside { Some(k) } else { *o };
            }
        }
        let heat = self.heat.then(|| self.relevancy(identities));
        let (w, h) = (map.width_px, map.height_px);
        let at = |i: usize| owner.get(map.identity[i] as usize).copied().flatten();
        let pixel = |i: usize| {
            let (x, y) = (i % w, i / w);
            let mine = at(i);
            let edge = mine.is_some()
                && ((x > 0 && at(i - 1) != mine)
                    || (x + 1 < w && at(i + 1) != mine)
                    || (y > 0 && at(i - w) != mine)
                    || (y + 1 < h && at(i + w) != mine));
            match (mine, &heat) {
                (Some(k), _) if edge => {
                    let [r, g, b] = COLORS[k % COLORS.len()];
                    Color32::from_rgb(r, g, b)
                }
                (_, Some(heat)) => {
                    let [r, g, b] = turbo(heat.get(map.identity[i] as usize).copied().unwrap_or(0.0));
                    Color32::from_rgba_unmultiplied(r, g, b, 150)
                }
                (Some(k), None) => {
                    let [r, g, b] = COLORS[k % COLORS.len()];
                    Color32::from_rgba_unmultiplied(r, g, b, 90)
                }
                (None, None) => Color32::TRANSPARENT,
            }
        };
        ColorImage::new([w, h], (0..w * h).map(pixel).collect())
    }

    /// Score of every identity for the newest question, by number; a piece counts at least as much
    /// as its whole.
    fn relevancy(&self, identities: &Identities) -> Vec<f32> {
        let mut all = vec![0.0; identities.len() + 1];
        let Some(newest) = self.all().last() else { return all };
        let target = Phrase::parse(&newest.text).map(|p| p.target).unwrap_or_default();
        let by_name = names::scores(identities, &target);
        for (id, identity) in identities.iter() {
            let hit = newest.answer.iter().flat_map(Answer::hits).find(|h| h.identity == id);
            // What shares the words but not the whole is related, not meant.
            let own = hit.map_or(0.5 * by_name[id as usize - 1], |h| h.score);
            all[id as usize] = f32::max(own, all[identity.parent as usize]);
        }
        all
    }

    /// The box, the answers, and the questions that are kept.
    pub fn show(&mut self, ui: &Ui, rect: Rect, semantics: &SemanticMap) {
        let at = Align2::CENTER_TOP.pos_in_rect(&rect.shrink(12.0)) + egui::vec2(0.0, 46.0);
        let area = Area::new(Id::unique("question")).order(Order::Middle).pivot(Align2::CENTER_TOP).fixed_pos(at);
        area.constrain_to(rect).show(ui.ctx(), |ui| {
            theme::overlay().show(ui, |ui| {
                ui.set_width(400.0_f32.min(rect.width() - 40.0));
                self.show_box(ui, semantics);
                self.show_answer(ui, semantics);
                self.show_kept(ui);
            });
        });
        self.show_name_under_cursor(ui, rect, &semantics.identities);
    }

    fn show_box(&mut self, ui: &mut Ui, semantics: &SemanticMap) {
        ui.horizontal(|ui| {
            let width = ui.available_width() - 62.0;
            let edit = TextEdit::singleline(&mut self.typed)
                .hint_text("Find an object, or \"the button of the red controller\"   ( / )")
                .char_limit(2_000)
                .desired_width(width);
            let response = ui.add(edit);
            if std::mem::take(&mut self.focus) {
                response.request_focus();
            }
            if response.changed() {
                self.live = asked(&self.typed, &semantics.identities);
            }
            if response.lost_focus() && ui.input(|i| i.key_pressed(egui::Key::Enter)) {
                self.keep();
                response.request_focus();
            }
            ui.toggle_value(&mut self.heat, "Heat")
                .on_hover_text("Colour every pixel by how well it fits the newest question, blue to red");
        });
    }

    /// Keeps the question being typed on screen, and makes room for the next.
    fn keep(&mut self) {
        let Some(live) = self.live.take() else { return };
        self.kept.retain(|q| q.text != live.text);
        if self.kept.len() == MOST {
            self.kept.remove(0);
        }
        self.kept.push(live);
        self.typed.clear();
    }

    fn show_answer(&mut self, ui: &mut Ui, semantics: &SemanticMap) {
        let identities = &semantics.identities;
        let pixels = |map: &Option<Arc<ViewMap>>, id: IdentityId| map.as_ref().map(|m| m.mask(identities, id).area());
        let newest = self.live.as_mut().or(self.kept.last_mut());
        let Some(newest) = newest else { return };
        let Some(answer) = &newest.answer else { return };
        let verdict = match answer {
            Answer::Found(_) => None,
            Answer::Ambiguous(_) => Some((theme::WARNING, "Several fit equally well:".to_owned())),
            Answer::NotFound(_) => {
                let unknown = names::unknown_words(identities, &newest.text);
                let why = if unknown.is_empty() {
                    "Nothing here fits all of it.".to_owned()
                } else {
                    format!("Nothing here is called \"{}\".", unknown.join("\", \""))
                };
                Some((theme::WARNING, why))
            }
        };
        if let Some((color, text)) = verdict {
            ui.colored_label(color, text);
        }
        let mut chosen = newest.shown;
        for hit in answer.hits().iter().filter(|h| h.score > 0.0).take(4) {
            ui.horizontal(|ui| {
                let name = full_name(identities, hit.identity);
                if ui.selectable_label(chosen == Some(hit.identity), RichText::new(name).strong()).clicked() {
                    chosen = Some(hit.identity);
                }
                let seen = match pixels(&self.map, hit.identity) {
                    Some(0) => "  not in this view".to_owned(),
                    Some(n) => format!("  {n} px"),
                    None => String::new(),
                };
                ui.weak(format!("{:.2}{seen}", hit.score)).on_hover_text("Score from 0 to 1, and size in this view");
            });
        }
        newest.shown = chosen;
        if answer.hits().iter().all(|h| h.score <= 0.0) {
            let known = names::completions(identities, "", 6).join(", ");
            ui.weak(format!("Known here, for example: {known}"));
        }
    }

    fn show_kept(&mut self, ui: &mut Ui) {
        if self.kept.is_empty() {
            return;
        }
        let mut gone = None;
        ui.horizontal_wrapped(|ui| {
            for (k, question) in self.kept.iter().enumerate() {
                let [r, g, b] = COLORS[k % COLORS.len()];
                let text =
                    RichText::new(format!("{}  \u{00d7}", question.text)).small().color(Color32::from_rgb(r, g, b));
                let chip = ui.button(text).on_hover_text("Take this question off the screen");
                if chip.clicked() {
                    gone = Some(k);
                }
            }
        });
        if let Some(k) = gone {
            self.kept.remove(k);
        }
    }

    fn show_name_under_cursor(&self, ui: &Ui, rect: Rect, identities: &Identities) {
        let Some(map) = &self.map else { return };
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
            theme::overlay().show(ui, |ui| ui.label(full_name(identities, id)));
        });
    }
}

/// The name of an identity with those of its wholes: "button a of the red controller".
pub fn full_name(identities: &Identities, id: IdentityId) -> String {
    identities.line(id).map(|i| identities.name(i)).collect::<Vec<_>>().join(" of the ")
}

fn asked(text: &str, identities: &Identities) -> Option<Asked> {
    let phrase = Phrase::parse(text)?;
    let answer = localise(identities, &phrase, Kind::Auto, &mut ByName(identities));
    let shown = match &answer {
        Answer::Found(hits) | Answer::Ambiguous(hits) => hits.first().map(|h| h.identity),
        Answer::NotFound(_) => None,
    };
    Some(Asked { text: text.trim().to_owned(), answer: Some(answer), shown })
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
    fn a_question_is_kept_in_its_colour_and_masks_follow() {
        let (semantics, mut questions) = (semantics(), Questions::default());
        questions.ask("the lamp's shade", &semantics);
        questions.keep();
        questions.ask("lamp", &semantics);
        assert_eq!(questions.all().map(|q| q.shown).collect::<Vec<_>>(), [Some(2), Some(1)]);
        let map = ViewMap {
            width_px: 6,
            height_px: 3,
            identity: [[0, 0, 2, 2, 2, 1]; 3].concat(),
            share: vec![1.0; 18],
            alpha: vec![1.0; 18],
        };
        let image = questions.image(&map, &[Some(2), None], &semantics.identities);
        assert_eq!(image.pixels[6], Color32::TRANSPARENT);
        assert_eq!(image.pixels[8], Color32::from_rgb(255, 179, 0), "the outline");
        assert_eq!(image.pixels[9], Color32::from_rgba_unmultiplied(255, 179, 0, 90), "the fill");
        questions.ask("giraffe", &semantics);
        assert_eq!(questions.live.as_ref().and_then(|q| q.shown), None);
        questions.ask("  ", &semantics);
        assert!(questions.live.is_none());
    }

    #[test]
    fn heat_is_highest_where_the_answer_is() {
        let (semantics, mut questions) = (semantics(), Questions::default());
        questions.ask("shade of the lamp", &semantics);
        let heat = questions.relevancy(&semantics.identities);
        assert!(heat[2] > heat[1] && heat[1] >= heat[0], "{heat:?}");
    }
}
