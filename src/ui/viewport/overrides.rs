//! The user's render settings of the view, in place of the scene's own.

use serde::{Deserialize, Serialize};

use crate::math::format::share;
use crate::render::{Cutoffs, RenderSettings};

/// Overrides of render settings, with the names of the settings.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct RenderOverrides {
    /// Highest spherical-harmonics degree.
    pub(crate) sh_degree: Option<u8>,
    /// The 2-D filter of Mip-Splatting.
    pub antialias: Option<bool>,
    /// Thresholds below which contributions are not drawn.
    pub(crate) cutoffs: Option<Cutoffs>,
}

impl RenderOverrides {
    /// Applies the overrides to settings. A GPU keeps its own cut-offs.
    pub(crate) fn over(&self, settings: RenderSettings, on_gpu: bool) -> RenderSettings {
        RenderSettings {
            sh_degree: self.sh_degree.unwrap_or(settings.sh_degree),
            antialias: self.antialias.unwrap_or(settings.antialias),
            cutoffs: self.cutoffs.filter(|_| !on_gpu).unwrap_or(settings.cutoffs),
            ..settings
        }
    }

    /// Reason why these settings are invalid, if they are.
    pub(crate) fn problem(&self) -> Option<&'static str> {
        let share = |v: f64| (1e-9..1.0).contains(&v);
        match self {
            Self { sh_degree: Some(4..), .. } => Some("invalid spherical-harmonics degree"),
            Self { cutoffs: Some(c), .. } if !share(c.alpha) || !share(c.transmittance) => {
                Some("cutoffs lie between 0 and 1")
            }
            _ => None,
        }
    }

    /// Description of the overrides for the user; `None` if there are none.
    pub(crate) fn words(&self) -> Option<String> {
        let degree = self.sh_degree.map(|d| format!("SH degree {d}"));
        let filter = self.antialias.map(|on| format!("filter {}", if on { "on" } else { "off" }));
        let cutoffs = self.cutoffs.map(|c| format!("cutoffs {} and {}", share(c.alpha), share(c.transmittance)));
        let all: Vec<String> = degree.into_iter().chain(filter).chain(cutoffs).collect();
        (!all.is_empty()).then(|| all.join(", "))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_what_was_chosen_differs() {
        let scene = RenderSettings { sh_degree: 2, near: 0.5, ..RenderSettings::default() };
        assert_eq!(RenderOverrides::default().over(scene.clone(), false), scene);
        let cutoffs = Cutoffs { alpha: 1.0 / 64.0, transmittance: 1e-4 };
        let chosen = RenderOverrides { sh_degree: Some(1), cutoffs: Some(cutoffs), ..RenderOverrides::default() };
        let drawn = chosen.over(scene.clone(), false);
        assert_eq!((drawn.sh_degree, drawn.cutoffs, drawn.near), (1, cutoffs, 0.5));
        assert_eq!(chosen.over(scene.clone(), true).cutoffs, scene.cutoffs, "a GPU would refuse them");
        assert_eq!(chosen.words().expect("differs"), "SH degree 1, cutoffs 1/64 and 1e-4");
        assert!(RenderOverrides::default().words().is_none());
    }

    #[test]
    fn impossible_settings_are_refused() {
        let with = |alpha| RenderOverrides {
            cutoffs: Some(Cutoffs { alpha, transmittance: 1e-4 }),
            ..RenderOverrides::default()
        };
        assert!(with(0.01).problem().is_none() && RenderOverrides::default().problem().is_none());
        assert!([0.0, -1.0, 1.0, f64::NAN].into_iter().all(|alpha| with(alpha).problem().is_some()));
        assert!(RenderOverrides { sh_degree: Some(9), ..RenderOverrides::default() }.problem().is_some());
    }
}
