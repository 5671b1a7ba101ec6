//! Visible colors of each identity, measured from its Gaussians: shares of the color terms, lightness, colorfulness.

mod oklab;
mod regions;
mod terms;

use std::sync::Arc;

use serde::{Deserialize, Serialize};

use self::oklab::OkColor;
use self::terms::{BROWN, SHADED_BROWN};
pub(crate) use self::terms::{COLORS, ColorTone, row, tone};
use super::{GaussianCloud, IdentityId, SemanticMap};
use crate::math::Real;
use crate::math::sh::SH_C0;

/// Shares of the visible surface from which a color is there in part, and from which the whole can be called so.
///
/// Measured on all pairs of 56 objects of five synthetic scenes and 13 colors, each of which must, may or must not
/// be said by eye. In photos, at 0.3, 58 of 63 that must be are said and none that must not; in trained Gaussians 54
/// and none. At 0.12, none that must be is denied, and 14 of the 577 that must not be count as parts.
const SHARES: [f64; 2] = [0.12, 0.3];
/// Distances from the usual lightness from which a color may be dark or light, and from which it is. At 0.1 from the
/// survey's plain names, three quarters of its "dark" and "light" ones are said so, and 1 % the other way round.
const TONES: [f64; 2] = [0.0, 0.1];
/// Lightness of what is neither dark nor light, whatever its color.
const MIDDLE: f64 = 0.5;
/// Spread of hues from which something may be colorful, and from which it is: 0 is one hue, 1 all alike. Bowls of
/// fruit, a rocket and a chair of three colors have 0.39 to 0.52; controllers, a kettle and a bear up to 0.1.
const SPREADS: [f64; 2] = [0.25, 0.38];
/// Least mean chroma of something colorful.
const VIVID: f64 = 0.05;
/// Weight from which a Gaussian is broken. Sums of lesser ones stay finite.
const BROKEN: f64 = 1e30;

/// Answer to a question for a color.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) enum ColorVerdict {
    No,
    /// A guess: some of it is so.
    Partly,
    Yes,
}

impl ColorVerdict {
    fn of(value: f64, [part, whole]: [f64; 2]) -> Self {
        match value {
            v if v >= whole => Self::Yes,
            v if v >= part => Self::Partly,
            _ => Self::No,
        }
    }
}

/// Colors of one identity, pieces included. All but the weight are sums by weight.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
struct ColorSums {
    /// Visible amount of its Gaussians: opacity times area.
    weight: f64,
    /// Lightness, and the two axes of hue.
    lab: [f64; 3],
    chroma: f64,
    /// Weight of the Gaussians that can be called by each row.
    called: [f64; COLORS.len()],
    /// Lightness of those.
    lightness: [f64; COLORS.len()],
    /// Weight of what is brown or the shade of orange and yellow, and of bright orange and yellow.
    dim: f64,
    bright: f64,
}

impl ColorSums {
    fn of(weight: f64, color: &OkColor) -> Self {
        let called = regions::called(color);
        let by_row = |value: f64| called.map(|is| if is { value } else { 0.0 });
        let if_so = |is: bool| if is { weight } else { 0.0 };
        let is_dim = regions::is_dim(color);
        Self {
            weight,
            lab: [color.lightness, color.a, color.b].map(|v| v * weight),
            chroma: color.chroma * weight,
            called: by_row(weight),
            lightness: by_row(weight * color.lightness),
            dim: if_so(is_dim && !called[BROWN]),
            bright: if_so(!is_dim && SHADED_BROWN.iter().any(|row| called[*row])),
        }
    }

    fn add(&mut self, other: &Self) {
        let add = |sums: &mut [f64], more: &[f64]| sums.iter_mut().zip(more).for_each(|(sum, v)| *sum += v);
        add(&mut self.lab, &other.lab);
        add(&mut self.called, &other.called);
        add(&mut self.lightness, &other.lightness);
        self.weight += other.weight;
        self.chroma += other.chroma;
        self.dim += other.dim;
        self.bright += other.bright;
    }
}

/// Colors of all identities, by number; empty until computed.
#[derive(Clone, Debug, Default, Serialize, Deserialize)]
#[serde(from = "Vec<ColorSums>", into = "Vec<ColorSums>")]
pub(crate) struct SeenColors(Arc<[ColorSums]>);

impl From<Vec<ColorSums>> for SeenColors {
    fn from(sums: Vec<ColorSums>) -> Self {
        Self(sums.into())
    }
}

impl From<SeenColors> for Vec<ColorSums> {
    fn from(colors: SeenColors) -> Self {
        colors.0.to_vec()
    }
}

impl PartialEq for SeenColors {
    /// Always equal: colors follow from the Gaussians.
    fn eq(&self, _: &Self) -> bool {
        true
    }
}

impl SeenColors {
    /// Colors of the identities of a cloud.
    pub(crate) fn of(cloud: &GaussianCloud, map: &SemanticMap) -> Self {
        let mut sums = vec![ColorSums::default(); map.identities.len() + 1];
        let stride = cloud.sh_stride();
        for (i, id) in map.identity_of.iter().enumerate().take(cloud.len()) {
            let Some((own, sh)) = sums.get_mut(*id as usize).zip(cloud.sh.get(i * stride)) else { continue };
            let [a, b, c] = cloud.log_scales[i].map(|s| f64::from(s).exp());
            // The two larger extents are the visible ones.
            let weight = f64::from(cloud.opacity_logits[i].sigmoid()) * (a * b).max(b * c).max(a * c);
            if weight < BROKEN && sh.iter().all(|v| v.is_finite()) {
                own.add(&ColorSums::of(weight, &OkColor::of(sh.map(|v| 0.5 + SH_C0 * f64::from(v)))));
            }
        }
        // Wholes have smaller numbers than their pieces.
        for id in (1..sums.len()).rev() {
            let whole = map.identities.get(id as IdentityId).map_or(0, |i| i.parent) as usize;
            if (1..id).contains(&whole) {
                let own = sums[id];
                sums[whole].add(&own);
            }
        }
        Self(sums.into())
    }

    fn sums(&self, id: IdentityId) -> Option<&ColorSums> {
        self.0.get(id as usize).filter(|of| of.weight > 0.0)
    }

    /// Returns whether an identity has the color of a row; `None` if its colors are unknown, or only a part has it.
    pub(crate) fn has(&self, id: IdentityId, row: usize) -> Option<bool> {
        match self.judge(id, row)? {
            ColorVerdict::Yes => Some(true),
            ColorVerdict::Partly => None,
            ColorVerdict::No => Some(false),
        }
    }

    /// Share of the visible surface of an identity, parts included, that can be called by the color of a row, 0..1.
    /// Several colors can have a large share.
    pub(crate) fn share(&self, id: IdentityId, row: usize) -> Option<f64> {
        let of = self.sums(id)?;
        let own = *of.called.get(row)?;
        let shade = if row == BROWN && of.dim > of.bright { of.dim } else { 0.0 };
        Some(((own + shade) / of.weight).clamp(0.0, 1.0))
    }

    /// Returns whether an identity can be called by the color of a row. `None` if its colors are unknown.
    pub(crate) fn judge(&self, id: IdentityId, row: usize) -> Option<ColorVerdict> {
        self.share(id, row).map(|share| ColorVerdict::of(share, SHARES))
    }

    /// Mean lightness of an identity's visible surface, 0 (black) to 1 (white), as people see it.
    pub(crate) fn lightness(&self, id: IdentityId) -> Option<f64> {
        self.sums(id).map(|of| (of.lab[0] / of.weight).clamp(0.0, 1.0))
    }

    /// Returns whether an identity is dark, light or colorful; with a row, whether it has that color, and so dark or
    /// light: a dark blue is lighter than a dark red. `None` if its colors are unknown.
    pub(crate) fn judge_tone(&self, id: IdentityId, tone: ColorTone, row: Option<usize>) -> Option<ColorVerdict> {
        let of = self.sums(id)?;
        let own = row.map_or(Some(ColorVerdict::Yes), |row| self.judge(id, row))?;
        let (lightness, usual) = match row {
            Some(row) if of.called[row] > 0.0 => (of.lightness[row] / of.called[row], regions::USUAL[row]),
            _ => (self.lightness(id)?, MIDDLE),
        };
        let seen = match tone {
            ColorTone::Dark => ColorVerdict::of(usual - lightness, TONES),
            ColorTone::Light => ColorVerdict::of(lightness - usual, TONES),
            ColorTone::Colorful if of.chroma < VIVID * of.weight => ColorVerdict::No,
            // Hues of all around the circle cancel each other out.
            ColorTone::Colorful => ColorVerdict::of(1.0 - of.lab[1].hypot(of.lab[2]) / of.chroma, SPREADS),
        };
        Some(own.min(seen))
    }
}

#[cfg(test)]
mod tests;
