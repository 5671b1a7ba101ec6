//! Masks and tints of a view's queries, repainted over its frame after every change.

use std::sync::Arc;
use std::time::Instant;

use egui::{Color32, ColorImage, Rect, TextureHandle, TextureOptions, Ui};

use super::truth::{TruthComparison, compared};
use super::{Asked, OverlaySettings, overlay};
use crate::jobs::phrases::colors::PhraseColors;
use crate::jobs::query::ViewMaps;
use crate::pipeline::semantics::query::matching::MatchMode;
use crate::pipeline::semantics::query::recipe::QueryConfig;
use crate::pipeline::semantics::query::timing::{StagesMs, ms_since};
use crate::scene::{IdentityId, Mask, SemanticMap};
use crate::ui::color_by::ColorBy;
use crate::worker::Versioned;

/// Most things with an outline each.
const MOST_OUTLINES: usize = 24;

/// State that the overlay was painted for.
#[derive(Clone, PartialEq)]
struct Painted {
    maps: u64,
    semantics: u64,
    /// Found identities, with the colors of the queries.
    shown: Vec<([u8; 3], Vec<IdentityId>)>,
    newest: Option<String>,
    settings: OverlaySettings,
    /// Identities that stay bright, beside the found ones, while the rest is dimmed.
    lit: Option<Vec<IdentityId>>,
}

/// Content of an overlay.
pub(super) struct PaintedQueries<'a> {
    /// The queries, the one in the field last.
    pub(super) asked: Vec<&'a Asked>,
    pub(super) settings: &'a OverlaySettings,
    pub(super) colors: &'a PhraseColors,
    pub(super) maps: &'a Versioned<ViewMaps>,
    pub(super) semantics: &'a Versioned<SemanticMap>,
    /// True mask of the view, to compare the newest query with.
    pub(super) truth: Option<Arc<Mask>>,
    /// Identities that stay bright, beside the found ones, while the rest is dimmed.
    pub(super) lit: Option<Vec<IdentityId>>,
}

/// Overlay of a view's queries.
#[derive(Default)]
pub(super) struct QueryOverlay {
    texture: Option<TextureHandle>,
    painted: Option<Painted>,
    /// Comparison with the true mask.
    pub(super) comparison: Option<TruthComparison>,
    /// Relevancy of the pixels, for the histogram.
    pub(super) heat: Vec<f32>,
    /// Times of localization and drawing, of all queries on screen.
    pub(super) paint_ms: StagesMs,
}

impl QueryOverlay {
    /// True if an overlay from identity maps is drawn over the frame.
    pub(super) fn is_painted(&self) -> bool {
        self.painted.is_some()
    }

    /// Forces a new overlay and comparison.
    pub(super) fn forget(&mut self) {
        (self.painted, self.comparison) = (None, None);
    }

    /// Paints masks and tints over the frame in `rect`.
    pub(super) fn paint(&mut self, ui: &Ui, rect: Rect, queries: &PaintedQueries<'_>) {
        let PaintedQueries { asked, settings, colors, maps, semantics, lit, .. } = queries;
        let shown: Vec<_> = asked.iter().map(|q| (colors.of(&q.text), q.shown(settings))).collect();
        let newest = asked.last().map(|q| q.text.clone());
        let nothing = shown.iter().all(|s| s.1.is_empty())
            && lit.as_ref().is_none_or(Vec::is_empty)
            && matches!(settings.color_by, ColorBy::Masks | ColorBy::Heat);
        if nothing && (newest.is_none() || settings.color_by == ColorBy::Masks) && settings.threshold <= 0.0 {
            self.forget();
            self.paint_ms = StagesMs::default();
            return;
        }
        let (settings, lit) = ((*settings).clone(), lit.clone());
        let (maps, semantics) = (maps.generation(), semantics.generation());
        let painted = Painted { maps, semantics, shown, newest, settings, lit };
        if self.painted.as_ref() != Some(&painted) {
            let start = Instant::now();
            let image = self.image(&painted, queries);
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

    fn image(&mut self, painted: &Painted, queries: &PaintedQueries<'_>) -> ColorImage {
        let PaintedQueries { asked, settings, maps, semantics, truth, .. } = queries;
        let QueryConfig { masks: mode, tolerance, .. } = settings.recipe;
        let union = |ids: &[IdentityId]| {
            let mut mask = Mask::empty(maps.identities.width_px, maps.identities.height_px);
            ids.iter().for_each(|id| mask.add(&maps.mask(semantics, *id, mode, tolerance)));
            mask
        };
        let start = Instant::now();
        let mask = |(q, (color, ids)): (&&Asked, &([u8; 3], Vec<IdentityId>))| match q.chosen {
            None if mode == MatchMode::Relevancy => (*color, maps.of_answer(semantics, &q.answered, 1)),
            _ => (*color, union(ids)),
        };
        // Things that were found together have an outline each.
        let each = |(q, (color, ids)): (&&Asked, &([u8; 3], Vec<IdentityId>))| {
            let is_apart = truth.is_none() && mode != MatchMode::Relevancy && (2..=MOST_OUTLINES).contains(&ids.len());
            if is_apart {
                ids.iter().map(|id| (*color, union(&[*id]))).collect()
            } else {
                vec![mask((q, &(*color, ids.clone())))]
            }
        };
        let masks: Vec<([u8; 3], Mask)> = asked.iter().zip(&painted.shown).flat_map(each).collect();
        let lit = painted.lit.as_deref().map(|others| {
            let mut lit = union(others);
            masks.iter().for_each(|(_, mask)| lit.add(mask));
            lit
        });
        let (comparison, masks) = compared(truth.as_deref(), masks);
        // Without a true mask of this view, an earlier comparison stays until all is painted anew.
        self.comparison = comparison.or(self.comparison.take());
        self.paint_ms.mask = ms_since(start);
        let newest = asked.last();
        let relevancy = newest.map_or_else(Vec::new, |q| q.answered.shown_relevancy(&maps.identities));
        let features = match (&semantics.language, settings.color_by) {
            (Some(language), ColorBy::Features) => {
                let of = |f: &crate::scene::ViewFeatures| f.deviated.first().cloned();
                let vectors: Vec<Option<Vec<f32>>> =
                    std::iter::once(None).chain(language.by_identity.iter().map(of)).collect();
                overlay::main_directions(&vectors.iter().map(Option::as_deref).collect::<Vec<_>>())
            }
            _ => Vec::new(),
        };
        self.heat = newest.map_or_else(Vec::new, |q| q.answered.heat(&maps.identities));
        let tells_unknown = settings.color_by.tells_unknown();
        let layers = overlay::Layers {
            map: &maps.identities,
            codes: maps.codes.as_ref(),
            unknown: tells_unknown.then_some(&maps.unknown),
            invented: (tells_unknown && !maps.invented.is_empty()).then_some(&maps.invented),
            identities: &semantics.identities,
            masks: &masks,
            // Without found identities there is nothing to dim.
            lit: lit.as_ref().filter(|lit| !lit.is_empty()),
            relevancy: &relevancy,
            features: &features,
            settings: (*settings).clone(),
        };
        layers.paint()
    }
}
