//! Masks and tints of a view's queries, repainted over its frame after every change.

use std::time::Instant;

use egui::{Color32, Rect, TextureOptions, Ui};

use super::{Asked, OverlaySettings, Queries, overlay};
use crate::jobs::query::ViewMaps;
use crate::pipeline::semantics::matching::MatchMode;
use crate::pipeline::semantics::timing::{StagesMs, ms_since};
use crate::scene::{IdentityId, Mask, SemanticMap};
use crate::ui::color_by::ColorBy;
use crate::worker::Versioned;

/// State that the overlay was painted for.
#[derive(Clone, PartialEq)]
pub(super) struct Painted {
    maps: u64,
    semantics: u64,
    /// Found identities, with the colors of the queries.
    shown: Vec<([u8; 3], Vec<IdentityId>)>,
    newest: Option<String>,
    settings: OverlaySettings,
    /// Identities that stay bright, beside the found ones, while the rest is dimmed.
    lit: Option<Vec<IdentityId>>,
}

impl Queries {
    /// Paints masks and tints over the frame in `rect`. With `lit`, all else is dimmed except the found ones.
    pub(crate) fn paint(
        &mut self,
        ui: &Ui,
        rect: Rect,
        semantics: &Versioned<SemanticMap>,
        lit: Option<Vec<IdentityId>>,
    ) {
        let Some(maps) = self.shown_maps().cloned() else { return };
        let settings = self.side.settings.clone();
        let shown: Vec<_> = self.all().map(|q| (self.colors.of(&q.text), q.shown(&settings))).collect();
        let newest = self.all().last().map(|q| q.text.clone());
        let nothing = shown.iter().all(|s| s.1.is_empty())
            && lit.as_ref().is_none_or(Vec::is_empty)
            && matches!(settings.color_by, ColorBy::Masks | ColorBy::Heat);
        if nothing && (newest.is_none() || settings.color_by == ColorBy::Masks) && settings.threshold <= 0.0 {
            (self.side.painted, self.side.comparison, self.side.paint_ms) = (None, None, StagesMs::default());
            return;
        }
        let painted =
            Painted { maps: maps.generation(), semantics: semantics.generation(), shown, newest, settings, lit };
        if self.side.painted.as_ref() != Some(&painted) {
            let start = Instant::now();
            let image = self.image(&maps, &painted, semantics);
            match &mut self.side.texture {
                Some(texture) => texture.set(image, TextureOptions::LINEAR),
                None => self.side.texture = Some(ui.ctx().load_texture("masks", image, TextureOptions::LINEAR)),
            }
            self.side.paint_ms.draw = ms_since(start) - self.side.paint_ms.mask;
            self.side.painted = Some(painted);
        }
        if let Some(texture) = &self.side.texture {
            let uv = Rect::from_min_max(egui::pos2(0.0, 0.0), egui::pos2(1.0, 1.0));
            ui.painter().image(texture.id(), rect, uv, Color32::WHITE);
        }
    }

    fn image(&mut self, maps: &ViewMaps, painted: &Painted, semantics: &SemanticMap) -> egui::ColorImage {
        let union = |ids: &[IdentityId]| {
            let mut mask = Mask::empty(maps.identities.width_px, maps.identities.height_px);
            ids.iter().for_each(|id| mask.add(&self.mask_of(maps, semantics, *id)));
            mask
        };
        let start = Instant::now();
        let by_relevancy = self.side.settings.recipe.masks == MatchMode::Relevancy;
        let mask = |(q, (color, ids)): (&Asked, &([u8; 3], Vec<IdentityId>))| match q.chosen {
            None if by_relevancy => (*color, maps.of_answer(semantics, &q.answered, 1)),
            _ => (*color, union(ids)),
        };
        let masks: Vec<([u8; 3], Mask)> = self.all().zip(&painted.shown).map(mask).collect();
        let lit = painted.lit.as_deref().map(|others| {
            let mut lit = union(others);
            masks.iter().for_each(|(_, mask)| lit.add(mask));
            lit
        });
        let masks = self.compared(masks);
        self.side.paint_ms.mask = ms_since(start);
        let newest = self.all().last();
        let relevancy = newest.map_or_else(Vec::new, |q| q.answered.shown_relevancy(&maps.identities));
        let features = match (&semantics.language, self.side.settings.color_by) {
            (Some(language), ColorBy::Features) => {
                let of = |f: &crate::scene::ViewFeatures| f.deviated.first().cloned();
                let vectors: Vec<Option<Vec<f32>>> =
                    std::iter::once(None).chain(language.by_identity.iter().map(of)).collect();
                overlay::main_directions(&vectors.iter().map(Option::as_deref).collect::<Vec<_>>())
            }
            _ => Vec::new(),
        };
        self.side.heat = newest.map_or_else(Vec::new, |q| q.answered.heat(&maps.identities));
        let layers = overlay::Layers {
            map: &maps.identities,
            codes: maps.codes.as_ref(),
            unknown: self.side.settings.color_by.tells_unknown().then_some(&maps.unknown),
            invented: (self.side.settings.color_by.tells_unknown() && !maps.invented.is_empty())
                .then_some(&maps.invented),
            identities: &semantics.identities,
            masks: &masks,
            // Without found identities there is nothing to dim.
            lit: lit.as_ref().filter(|lit| !lit.is_empty()),
            relevancy: &relevancy,
            features: &features,
            settings: self.side.settings.clone(),
        };
        layers.paint()
    }
}
