//! Published answers of networks with their official weights, to check that an installation reproduces them.

use std::path::{Path, PathBuf};

use serde::{Deserialize, Serialize};

use super::clip::ClipEncoder;
use super::sam::{PromptedMasks, Sam, in_square};
use super::sam2::Sam2;
use super::tensor::Tensor;
use super::{Encoder, ModelError, manifest};
use crate::math::vector::dot;
use crate::scene::PhotoPixels;

/// Factor by which CLIP multiplies cosines before its softmax over texts.
const CLIP_SCALE: f64 = 100.0;

/// Question with its published answer.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct KnownAnswer {
    /// Address of the picture.
    pub(crate) picture: String,
    /// Source of the answer, and permitted differences.
    pub(crate) published: String,
    /// Texts; the answer has the probability of each.
    #[serde(default)]
    texts: Vec<String>,
    /// Click, px; the answer has the predicted IoU of the three candidates, the greatest first.
    #[serde(default)]
    click: [f64; 2],
    numbers: Vec<f64>,
    /// Largest accepted difference.
    tolerance: f64,
}

/// Result of a question on this machine.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub(crate) struct KnownResult {
    pub(crate) published: String,
    pub(crate) expected: Vec<f64>,
    pub(crate) got: Vec<f64>,
    pub(crate) tolerance: f64,
    pub(crate) agrees: bool,
}

impl KnownAnswer {
    /// Path of its fetched picture.
    pub(crate) fn picture_in(&self, folder: &Path) -> PathBuf {
        folder.join(self.picture.rsplit('/').next().unwrap_or_default())
    }

    /// Runs the model of `description` on the question.
    pub(crate) fn ask(&self, description: &Path, picture: &PhotoPixels) -> Result<KnownResult, ModelError> {
        let got = match manifest::kind(description)?.as_str() {
            "clip" => probabilities(ClipEncoder::open(description)?, picture, &self.texts)?,
            "sam2" => candidates(&mut Sam2::open(description)?, picture, self.click)?,
            _ => candidates(&mut Sam::open(description)?, picture, self.click)?,
        };
        let (published, expected, tolerance) = (self.published.clone(), self.numbers.clone(), self.tolerance);
        let near = |(a, b): (&f64, &f64)| (a - b).abs() <= tolerance;
        let agrees = got.len() == expected.len() && got.iter().zip(&expected).all(near);
        Ok(KnownResult { published, expected, got, tolerance, agrees })
    }
}

/// Probability of each text for the picture, among these texts.
fn probabilities(mut clip: ClipEncoder, picture: &PhotoPixels, texts: &[String]) -> Result<Vec<f64>, ModelError> {
    let pixels = clip.prepare().picture(picture).ok_or(ModelError::NoPicture)?;
    let picture = clip.embed_pixels(pixels)?.concat();
    let texts: Vec<Vec<f32>> = texts.iter().map(|t| clip.text(t)).collect::<Result<_, _>>()?;
    Ok(shares(texts.iter().map(|text| CLIP_SCALE * f64::from(dot(text, &picture))).collect()))
}

/// Softmax.
fn shares(logits: Vec<f64>) -> Vec<f64> {
    let most = logits.iter().copied().fold(f64::NEG_INFINITY, f64::max);
    let weights: Vec<f64> = logits.iter().map(|l| (l - most).exp()).collect();
    let sum: f64 = weights.iter().sum();
    weights.into_iter().map(|w| w / sum).collect()
}

/// Predicted IoU of the three candidates of a click, the greatest first.
fn candidates(network: &mut dyn PromptedMasks, picture: &PhotoPixels, click: [f64; 2]) -> Result<Vec<f64>, ModelError> {
    network.look(picture)?;
    let scale = in_square(network, [picture.width_px as usize, picture.height_px as usize]);
    let [x, y] = [0, 1].map(|i| (click[i] * scale[i]) as f32);
    let (coords, labels) = (Tensor::new(&[1, 2, 2], vec![x, y, 0.0, 0.0]), Tensor::new(&[1, 2], vec![1.0, -1.0]));
    let iou = network.masks(coords, labels, None)?.iou;
    let mut three: Vec<f64> = iou.values.iter().skip(1).map(|v| f64::from(*v)).collect();
    three.sort_by(|a, b| b.total_cmp(a));
    Ok(three)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn fixture(name: &str) -> PathBuf {
        Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/fixtures/networks").join(name)
    }

    fn pattern(blue: u8) -> PhotoPixels {
        let color = |i: u32| [(i % 96 * 2) as u8, (i / 96 * 3) as u8, blue];
        PhotoPixels { width_px: 96, height_px: 72, rgb: (0..96 * 72).map(color).collect(), coverage: None, alpha: None }
    }

    fn known(numbers: Vec<f64>) -> KnownAnswer {
        KnownAnswer {
            picture: "https://example.org/a/picture.png".into(),
            published: "here".into(),
            texts: vec!["a cat".into()],
            click: [48.0, 36.0],
            numbers,
            tolerance: 1e-4,
        }
    }

    #[test]
    fn an_answer_agrees_with_what_was_recorded_and_with_nothing_else() {
        for name in ["sam.json", "sam2.json"] {
            let description = fixture(name);
            let recorded = known(Vec::new()).ask(&description, &pattern(90)).expect("answers");
            assert!(!recorded.agrees, "{name}: nothing is no answer");
            assert!(recorded.got.len() == 3 && recorded.got.is_sorted_by(|a, b| a >= b), "{recorded:?}");
            let again = known(recorded.got.clone()).ask(&description, &pattern(90)).expect("answers");
            assert!(again.agrees && again.got == recorded.got, "{name}");
            // Another picture, another click, another number.
            let known = known(recorded.got.clone());
            assert!(!known.ask(&description, &pattern(0)).expect("answers").agrees, "{name}: another picture");
            let moved = KnownAnswer { click: [5.0, 60.0], ..known.clone() };
            assert!(!moved.ask(&description, &pattern(90)).expect("answers").agrees, "{name}: another click");
            let mut wrong = known;
            wrong.numbers[2] += 2e-4;
            assert!(!wrong.ask(&description, &pattern(90)).expect("answers").agrees, "{name}: another number");
        }
        // The reduced CLIP has the first thousand tokens only.
        let error = known(vec![1.0]).ask(&fixture("clip.json"), &pattern(90));
        assert!(matches!(error, Err(ModelError::Token { .. })), "{error:?}");
        let path = known(Vec::new()).picture_in(Path::new("/models"));
        assert_eq!(path, Path::new("/models/picture.png"));
    }

    #[test]
    fn probabilities_are_those_of_the_published_cosines() {
        // Three cosines whose differences give OpenAI's example.
        let published = [0.992_793_7_f64, 0.004_210_68, 0.002_995_72];
        let got = shares(published.map(f64::ln).to_vec());
        assert!(got.iter().zip(&published).all(|(a, b)| (a - b).abs() < 1e-6), "{got:?}");
        assert_eq!(shares(vec![1e6, -1e6]), [1.0, 0.0]);
    }
}
