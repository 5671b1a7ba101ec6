//! Measurements of a training run, kept with the trained scene.

use serde::{Deserialize, Serialize};

use crate::math::format::count;
use crate::math::stats::mean;

/// Measurements of one training step (reported every few steps).
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct StepMetrics {
    /// Steps done.
    pub step: u64,
    /// Seconds of training so far.
    pub secs: f64,
    /// Loss `0.8 L1 + 0.2 (1 - SSIM)`, mean over the steps since the last report.
    #[serde(with = "or_null")]
    pub loss: f64,
    /// PSNR in dB of the training photos of those steps, mean.
    #[serde(with = "or_null")]
    pub train_psnr: f64,
    /// Gaussians now.
    pub gaussians: usize,
}

/// Quality on one held-out photo.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct ViewScore {
    pub(crate) name: String,
    #[serde(with = "or_null")]
    pub(crate) psnr: f64,
    #[serde(with = "or_null")]
    pub(crate) ssim: f64,
}

/// Quality on the held-out photos.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Evaluation {
    /// Steps done.
    pub step: u64,
    /// Seconds of training so far (evaluation itself not counted).
    pub secs: f64,
    /// Mean PSNR in dB over the views.
    #[serde(with = "or_null")]
    pub psnr: f64,
    /// Mean SSIM over the views.
    #[serde(with = "or_null")]
    pub ssim: f64,
    /// Gaussians at that step.
    pub gaussians: usize,
    /// Each view.
    pub views: Vec<ViewScore>,
    /// The same after a fit of each held-out photo, if one was made.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub fitted: Option<FittedScore>,
}

/// Parts that are fitted of a held-out photo before it is scored.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct FittedParts {
    /// Its pose, to the trained scene.
    pub pose: bool,
    /// A gain and bias by channel.
    pub exposure: bool,
}

impl FittedParts {
    /// Itself, if anything is fitted.
    pub(crate) fn some(self) -> Option<Self> {
        (self.pose || self.exposure).then_some(self)
    }

    fn text(self) -> &'static str {
        match (self.pose, self.exposure) {
            (true, true) => "with each held-out pose aligned and the best gain and bias",
            (true, false) => "with each held-out pose aligned",
            (false, true) => "with the best gain and bias of each",
            (false, false) => "as they are",
        }
    }
}

/// Quality on the held-out photos after a fit.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct FittedScore {
    /// Parts that were fitted.
    #[serde(flatten)]
    pub parts: FittedParts,
    /// Mean PSNR in dB over the views.
    #[serde(with = "or_null")]
    pub psnr: f64,
    /// Mean SSIM over the views.
    #[serde(with = "or_null")]
    pub ssim: f64,
    /// Each view.
    pub views: Vec<ViewScore>,
}

impl FittedScore {
    /// The means of views' scores.
    pub(crate) fn of(parts: FittedParts, views: Vec<ViewScore>) -> Self {
        let of = |f: fn(&ViewScore) -> f64| mean(&views.iter().map(f).collect::<Vec<_>>());
        Self { parts, psnr: of(|s| s.psnr), ssim: of(|s| s.ssim), views }
    }

    /// `PSNR 24.10 dB, SSIM 0.812 with each held-out pose aligned`.
    pub(crate) fn line(&self) -> String {
        format!("PSNR {:.2} dB, SSIM {:.3} {}", self.psnr, self.ssim, self.parts.text())
    }
}

impl Evaluation {
    /// The means of views' scores after `step` steps, which took `secs`.
    pub(crate) fn of(views: Vec<ViewScore>, gaussians: usize, step: u64, secs: f64) -> Self {
        let of = |f: fn(&ViewScore) -> f64| mean(&views.iter().map(f).collect::<Vec<_>>());
        Self { step, secs, psnr: of(|s| s.psnr), ssim: of(|s| s.ssim), gaussians, views, fitted: None }
    }

    /// `step 500, 12.3 s: held-out PSNR 21.34 dB, SSIM 0.712 over 9 views, 23,121 Gaussians`.
    pub(crate) fn line(&self) -> String {
        let Self { step, secs, psnr, ssim, gaussians, views, fitted } = self;
        let (views, gaussians) = (views.len(), count(*gaussians as u64));
        let fitted = fitted.as_ref().map_or_else(String::new, |f| format!("; {}", f.line()));
        format!(
            "step {step}, {secs:.1} s: held-out PSNR {psnr:.2} dB, SSIM {ssim:.3} over {views} views, {gaussians} \
             Gaussians{fitted}"
        )
    }
}

/// JSON has no infinity (the PSNR of identical pictures) and no NaN: infinity is written as text,
/// NaN as `null`.
mod or_null {
    use serde::{Deserialize, Deserializer, Serializer};

    #[derive(Deserialize)]
    #[serde(untagged)]
    enum Value {
        Number(f64),
        Text(Infinity),
    }

    #[derive(Deserialize)]
    enum Infinity {
        #[serde(rename = "inf")]
        Positive,
        #[serde(rename = "-inf")]
        Negative,
    }

    pub(crate) fn serialize<S: Serializer>(v: &f64, s: S) -> Result<S::Ok, S::Error> {
        match *v {
            f64::INFINITY => s.serialize_str("inf"),
            f64::NEG_INFINITY => s.serialize_str("-inf"),
            v if v.is_nan() => s.serialize_none(),
            v => s.serialize_f64(v),
        }
    }

    pub(crate) fn deserialize<'de, D: Deserializer<'de>>(d: D) -> Result<f64, D::Error> {
        Ok(match Option::<Value>::deserialize(d)? {
            None => f64::NAN,
            Some(Value::Number(v)) => v,
            Some(Value::Text(Infinity::Positive)) => f64::INFINITY,
            Some(Value::Text(Infinity::Negative)) => f64::NEG_INFINITY,
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn measurements_survive_json_even_when_not_finite() {
        for v in [12.25, 0.1 + 0.2, f64::INFINITY, f64::NEG_INFINITY] {
            let m = StepMetrics { step: 3, secs: 1.5, loss: v, train_psnr: -v, gaussians: 7 };
            let text = serde_json::to_string(&m).expect("write");
            assert_eq!(serde_json::from_str::<StepMetrics>(&text).expect("read"), m, "{text}");
        }
        let m = StepMetrics { loss: f64::NAN, ..StepMetrics::default() };
        let text = serde_json::to_string(&m).expect("write");
        assert!(serde_json::from_str::<StepMetrics>(&text).expect("read").loss.is_nan());
    }
}
