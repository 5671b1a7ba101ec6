//! Choice of the models that find objects if photos have no masks: the abilities, costs and downloads of each.

use std::collections::VecDeque;

use egui::{CollapsingHeader, RichText, ScrollArea, Ui};

use super::ctx::Ctx;
use super::theme;
use crate::jobs::find_objects::forecast::{self, InferenceEstimate};
use crate::jobs::find_objects::{FindSettings, NO_ENCODER};
use crate::jobs::models::{ModelEntry, ModelList, ModelRole, ModelState};
use crate::math::format::{megabytes, things};
use crate::pipeline::semantics::lifting::build_map::{MaskPropagation, REGIONS};
use crate::scene::Preparation;
use crate::ui::actions::{Action, Pane};

/// Choices made so far.
#[derive(Default)]
pub(crate) struct FindDialog {
    open: bool,
    /// Segmenter chosen by the user; `None` for the best installed.
    segmenter: Option<String>,
    encoder: Option<String>,
    /// True if the fast engine is not to be downloaded.
    without_engine: bool,
    /// Preparation in the recipe on screen, as last seen.
    recipe: Preparation,
}

/// Models that the user chose for the search.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct Means {
    pub(crate) segmenter: String,
    pub(crate) encoder: String,
    /// Models to download first.
    pub(crate) missing: VecDeque<String>,
}

impl FindDialog {
    /// Opens the dialog with the models of the last search.
    pub(crate) fn open(&mut self, last: &FindSettings) {
        self.open = true;
        self.segmenter = last.segmenter.clone().or(self.segmenter.take());
        self.encoder = last.encoder.clone().or(self.encoder.take());
    }

    pub(crate) fn is_open(&self) -> bool {
        self.open
    }

    /// Updates the settings of the next search when the preparation in the recipe on screen changes.
    pub(crate) fn follow_recipe(&mut self, recipe: Preparation, finding: &mut FindSettings) {
        if std::mem::replace(&mut self.recipe, recipe) == recipe {
            return;
        }
        finding.preparation = recipe;
        finding.carry = match (recipe.prompt, finding.carry) {
            (None, _) => MaskPropagation::Gaussians,
            (Some(_), MaskPropagation::Gaussians) => MaskPropagation::Sam2,
            (Some(_), chosen) => chosen,
        };
    }

    /// Draws the dialog if it is open; returns the decision, once there is one.
    pub(crate) fn show(&mut self, ctx: &egui::Context, max_seeds: usize, cx: &mut Ctx<'_>) -> Option<Means> {
        if !self.open {
            return None;
        }
        let state = cx.state;
        let response = theme::dialog("find objects").show(ctx, |ui| {
            let room = ctx.content_rect().size();
            ui.set_width((room.x - 80.0).min(600.0));
            ui.heading("Find objects and parts");
            ui.add_space(4.0);
            let text = "These photos have no masks. The segmenter decides which objects are found, the text encoder \
                        which words find them.";
            ui.label(RichText::new(text).color(theme::weak()));
            let masks = ui.button("Masks from files\u{2026}").on_hover_text(Action::ChooseMasks.tooltip());
            if masks.clicked() {
                cx.ask(Action::ChooseMasks);
                self.open = false;
            }
            let Some(known) = &state.models else {
                ui.add_space(8.0);
                ui.weak("Looking for models\u{2026}");
                return self.buttons(ui, None, cx);
            };
            let photos = state.scene.as_ref().and_then(|s| s.dataset.as_ref()).map_or(0, |d| d.photos.len());
            let means = self.means(known);
            // A dialog gets little height before the size of its content is known.
            let list_pt = (room.y - 230.0).max(120.0);
            ScrollArea::vertical().max_height(list_pt).min_scrolled_height(list_pt).show(ui, |ui| {
                self.choices(ui, known, &means);
                self.engine(ui, known, &means);
            });
            ui.add_space(6.0);
            summary(ui, known, &means, photos.min(max_seeds), self.is_fast(known));
            self.buttons(ui, Some(means), cx)
        });
        if response.should_close() {
            self.open = false;
        }
        response.inner.inspect(|_| self.open = false)
    }

    /// The chosen models, completed by the best installed ones.
    pub(crate) fn means(&self, known: &ModelList) -> Means {
        let best = |role: ModelRole| known.best(role).map(|e| e.id.clone());
        // A model of an earlier use may be in no list any more.
        let is_offered = |id: &String| [REGIONS, NO_ENCODER].contains(&id.as_str()) || known.get(id).is_some();
        let chosen = |id: &Option<String>, role| id.clone().filter(is_offered).or_else(|| best(role));
        let segmenter = chosen(&self.segmenter, ModelRole::Segmenter).unwrap_or_else(|| REGIONS.into());
        let encoder = chosen(&self.encoder, ModelRole::Encoder).unwrap_or_else(|| NO_ENCODER.into());
        let is_missing = |id: &&String| known.get(id).is_some_and(|(_, s)| !s.is_usable());
        let networks = [&segmenter, &encoder];
        let needs_engine = networks.iter().any(|id| known.get(id).is_some_and(|(e, _)| !e.built_in));
        let engine = missing_engine(known).filter(|_| needs_engine && !self.without_engine).map(|e| &e.id);
        let missing = engine.into_iter().chain(networks.into_iter().filter(is_missing)).cloned().collect();
        Means { segmenter, encoder, missing }
    }

    /// True if the fast engine will run the networks.
    fn is_fast(&self, known: &ModelList) -> bool {
        known.is_fast || !known.is_settled && !self.without_engine && missing_engine(known).is_some()
    }

    fn choices(&mut self, ui: &mut Ui, known: &ModelList, means: &Means) {
        ui.add_space(6.0);
        ui.label(RichText::new("Segmenter").strong());
        let text = "Rough: an object of two colors is split, neighbors of one color are merged.";
        if choice(ui, means.segmenter == REGIONS, "Uniform color regions (built in)", text, "") {
            self.segmenter = Some(REGIONS.into());
        }
        if let Some(id) = networks(ui, known, self.is_fast(known), ModelRole::Segmenter, &means.segmenter) {
            self.segmenter = Some(id);
        }
        ui.add_space(8.0);
        ui.label(RichText::new("Text encoder").strong());
        let text = "Objects have numbers instead of names. Those that you name (double-click one in Objects) are found \
                    by name.";
        if choice(ui, means.encoder == NO_ENCODER, "Only names that you give", text, "") {
            self.encoder = Some(NO_ENCODER.into());
        }
        if let Some(id) = networks(ui, known, self.is_fast(known), ModelRole::Encoder, &means.encoder) {
            self.encoder = Some(id);
        }
    }

    /// Offers the fast engine if it is missing.
    fn engine(&mut self, ui: &mut Ui, known: &ModelList, means: &Means) {
        let Some(entry) = missing_engine(known) else { return };
        ui.add_space(8.0);
        ui.label(RichText::new("Inference engine").strong());
        let (mut is_wanted, is_needed) =
            (means.missing.contains(&entry.id), self.without_engine || !means.missing.is_empty());
        if ui.add_enabled(is_needed, egui::Checkbox::new(&mut is_wanted, &entry.title)).changed() {
            self.without_engine = !is_wanted;
        }
        ui.indent("engine", |ui| {
            ui.label(RichText::new(&entry.adds).small().color(theme::weak()));
            ui.label(RichText::new(download(known, entry)).small().color(theme::text()));
            if known.is_settled {
                let text = "Used from the next start of the program: another engine is in use already.";
                ui.label(RichText::new(text).small().color(theme::warning()));
            }
        });
    }

    fn buttons(&mut self, ui: &mut Ui, means: Option<Means>, cx: &mut Ctx<'_>) -> Option<Means> {
        ui.add_space(10.0);
        ui.horizontal(|ui| {
            let text = match &means {
                Some(means) if !means.missing.is_empty() => "Download, then find",
                _ => "Find objects",
            };
            let goes = ui.add_enabled(means.is_some(), theme::primary_button(text)).clicked();
            let cancels = ui.button("Cancel").clicked();
            let files = ui.button("I have the files\u{2026}").on_hover_text("Add downloaded files in the Models pane.");
            if files.clicked() {
                cx.ask(Action::ShowPane(Pane::Models));
            }
            self.open &= !cancels && !files.clicked();
            means.filter(|_| goes)
        })
        .inner
    }
}

/// Networks for one role: installed, recommended or chosen ones, the others folded. Returns the one that was clicked.
fn networks(ui: &mut Ui, known: &ModelList, is_fast: bool, role: ModelRole, chosen: &str) -> Option<String> {
    let (first, others): (Vec<_>, Vec<_>) =
        known.of(role).partition(|(e, s)| s.is_usable() || e.recommended || e.id == chosen);
    let mut clicked = None;
    let mut list = |ui: &mut Ui, all: Vec<(&ModelEntry, &ModelState)>| {
        for (entry, model) in all {
            if offered(ui, chosen == entry.id, entry, model, known, is_fast) {
                clicked = Some(entry.id.clone());
            }
        }
    };
    list(ui, first);
    if !others.is_empty() {
        let title = things(others.len(), "other network");
        CollapsingHeader::new(title).id_salt(("networks", role)).show(ui, |ui| list(ui, others));
    }
    clicked
}

/// A model of the list as a choice; returns true if it was clicked.
fn offered(
    ui: &mut Ui,
    chosen: bool,
    entry: &ModelEntry,
    model: &ModelState,
    known: &ModelList,
    is_fast: bool,
) -> bool {
    let to_load = (!model.is_usable()).then(|| download(known, entry));
    let what = if entry.role == ModelRole::Encoder { "a picture of an object" } else { "a photo" };
    let look = InferenceEstimate::of(&entry.id, known, is_fast).map(|look| look.text(what));
    ui.add_enabled_ui(model.is_usable() || entry.is_hosted(), |ui| {
        let costs: Vec<String> = [to_load, look].into_iter().flatten().collect();
        choice(ui, chosen, &entry.title, &entry.adds, &costs.join("  \u{b7}  "))
    })
    .inner
}

/// Download size and license of a model.
fn download(known: &ModelList, entry: &ModelEntry) -> String {
    match known.to_load(entry) {
        _ if !entry.is_hosted() => format!("not hosted anywhere; {}, {}", megabytes(entry.megabytes()), entry.license),
        [all, 0] => format!("download of {}, {}", megabytes(all), entry.license),
        [left, arrived] => {
            let [left, arrived] = [left, arrived].map(megabytes);
            format!("download of {left} more, {arrived} are here already, {}", entry.license)
        }
    }
}

/// The fast engine, if it is hosted but not installed.
fn missing_engine(known: &ModelList) -> Option<&ModelEntry> {
    let fast = known.of(ModelRole::Engine).find(|(e, s)| !known.is_fast && !s.is_usable() && e.is_hosted());
    fast.map(|(entry, _)| entry)
}

/// A radio button with its explanation below; returns true if it was clicked.
fn choice(ui: &mut Ui, chosen: bool, title: &str, means: &str, costs: &str) -> bool {
    let clicked = theme::outlined(ui, |ui| ui.radio(chosen, title).clicked());
    ui.indent(title, |ui| {
        ui.label(RichText::new(means).small().color(theme::weak()));
        if !costs.is_empty() {
            ui.label(RichText::new(costs).small().color(theme::text()));
        }
    });
    clicked
}

/// Summary of the next steps: sizes, times, and the effect of the encoder on queries.
fn summary(ui: &mut Ui, known: &ModelList, means: &Means, most_photos: usize, is_fast: bool) {
    let missing = means.missing.iter().filter_map(|id| known.get(id));
    let to_load: u64 = missing.map(|(e, _)| known.to_load(e)[0]).sum();
    let mut parts = Vec::new();
    if to_load > 0 {
        parts.push(format!("Download {}.", megabytes(to_load)));
    }
    parts.extend(
        InferenceEstimate::of(&means.segmenter, known, is_fast).map(|look| forecast::sentence(look, most_photos)),
    );
    ui.label(parts.join(" "));
    let warning = match means.encoder.as_str() {
        NO_ENCODER => Some("Objects will be unnamed: name them to query by text."),
        id if known.get(id).is_some_and(|(e, _)| e.built_in) => {
            Some("The built-in encoder was trained on synthetic scenes: on real photos, words find almost nothing.")
        }
        _ => None,
    };
    if let Some(warning) = warning {
        ui.label(RichText::new(warning).color(theme::warning()));
    }
}
