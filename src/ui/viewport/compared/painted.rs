//! Picture of one scene's answer over its view: relevancy in colors, and the outline of the mask.

use egui::{Color32, ColorImage, Rect, TextureHandle, TextureOptions, Ui, pos2};
use rayon::prelude::*;

use super::super::outline::{Outline, with_alpha};
use super::{COLORS, ComparedChoices};
use crate::jobs::compare::answer::PhraseAnswer;

/// Color of outlines.
const LINE: [u8; 3] = [255; 3];
/// All of a texture.
const FULL: Rect = Rect { min: pos2(0.0, 0.0), max: pos2(1.0, 1.0) };

/// An answer as a picture, kept until something changes.
#[derive(Default)]
pub(super) struct PaintedAnswer {
    texture: Option<TextureHandle>,
    /// Answers, choices and range that it was painted from.
    of: Option<(u64, ComparedChoices, [f32; 2])>,
}

impl PaintedAnswer {
    /// Paints an answer of these answers' generation into `rect`.
    pub(super) fn paint(
        &mut self,
        ui: &Ui,
        rect: Rect,
        generation: u64,
        answer: &PhraseAnswer,
        choices: &ComparedChoices,
        range: [f32; 2],
    ) {
        let of = (generation, choices.clone(), range);
        if self.of.as_ref() != Some(&of) {
            let image = image(answer, choices, range);
            match &mut self.texture {
                Some(texture) => texture.set(image, TextureOptions::LINEAR),
                None => self.texture = Some(ui.ctx().load_texture("answer", image, TextureOptions::LINEAR)),
            }
            self.of = Some(of);
        }
        if let Some(texture) = &self.texture {
            ui.painter().with_clip_rect(rect).image(texture.id(), rect, FULL, Color32::WHITE);
        }
    }
}

/// The colors of an answer; what has no relevancy stays clear.
fn image(answer: &PhraseAnswer, choices: &ComparedChoices, [least, most]: [f32; 2]) -> ColorImage {
    let (values, mask) = (answer.values(choices.scale), &choices.mask(answer).mask);
    let size = [mask.width_px(), mask.height_px()];
    let pixel = |i: usize| match Outline::at(mask, i) {
        line @ (Outline::Line | Outline::Halo) => line.color(LINE).unwrap_or_default(),
        Outline::Fill | Outline::Outside => match values.get(i).copied().filter(|v| *v > 0.0) {
            Some(value) => with_alpha(COLORS.color((value - least) / (most - least).max(1e-6)), choices.opacity),
            None => Color32::TRANSPARENT,
        },
    };
    ColorImage::new(size, (0..size[0] * size[1]).into_par_iter().map(pixel).collect())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::jobs::compare::cell::{AnswerMs, ShownRelevancy};
    use crate::pipeline::semantics::query::foreign::own_rules::ForeignMask;
    use crate::scene::Mask;

    /// Relevancy that grows to the right, with the right half as own mask and the lower half as common one.
    fn answer() -> PhraseAnswer {
        let found = |inside: fn(usize) -> bool| ForeignMask {
            mask: Mask::from_fn(20, 20, inside),
            level: 0,
            values: vec![0.25; 400],
            peak: None,
            rule: "a rule",
        };
        let raw = (0..400).map(|i| (i % 20) as f32 / 20.0).collect();
        let (own, common) = (Some(found(|i| i % 20 >= 10)), found(|i| i / 20 >= 10));
        PhraseAnswer { raw, own, common, ms: AnswerMs::default() }
    }

    #[test]
    fn relevancy_is_colored_on_the_range_and_the_chosen_mask_is_outlined() {
        let (answer, raw) = (answer(), ComparedChoices::default());
        let picture = image(&answer, &raw, [0.0, 1.0]);
        let at = |picture: &ColorImage, x: usize, y: usize| picture.pixels[y * 20 + x];
        assert_eq!(picture.size, [20, 20]);
        assert_eq!(at(&picture, 0, 5), Color32::TRANSPARENT, "no relevancy");
        assert_eq!(at(&picture, 5, 5), with_alpha(COLORS.color(0.25), 0.75));
        assert_eq!(at(&picture, 10, 5), Color32::from_rgb(255, 255, 255), "the border of the own mask");
        assert_ne!(at(&image(&answer, &raw, [0.2, 0.5]), 5, 5), at(&picture, 5, 5), "another range");
        let common = ComparedChoices { by_common_rule: true, ..raw.clone() };
        let picture = image(&answer, &common, [0.0, 1.0]);
        assert_ne!(at(&picture, 10, 5), Color32::from_rgb(255, 255, 255));
        assert_eq!(at(&picture, 5, 10), Color32::from_rgb(255, 255, 255), "the border of the common mask");
        let own = ComparedChoices { scale: ShownRelevancy::Own, ..raw };
        assert_eq!(at(&image(&answer, &own, [0.0, 1.0]), 0, 5), with_alpha(COLORS.color(0.25), 0.75));
    }
}
