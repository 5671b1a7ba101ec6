//! The meaning of transparent pixels of photos.

use std::borrow::Cow;

use serde::{Deserialize, Serialize};

use super::Dataset;

/// Background color of a dataset that states none.
const BLACK: [f32; 3] = [0.0; 3];

/// Meaning of transparent photo pixels in training.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, clap::ValueEnum)]
#[serde(rename_all = "lowercase")]
pub enum AlphaUse {
    /// Pixels that do not count: anything may be there.
    Ignore,
    /// Nothing is there: what was cut out stands alone.
    Empty,
    /// The background color is seen there, as if the photos were opaque.
    Background,
}

impl AlphaUse {
    /// Its name on the command line.
    pub(crate) fn word(self) -> &'static str {
        match self {
            Self::Ignore => "ignore",
            Self::Empty => "empty",
            Self::Background => "background",
        }
    }

    /// Short description for lists and notes.
    pub(crate) fn title(self) -> &'static str {
        match self {
            Self::Ignore => "not counted, so anything may grow there",
            Self::Empty => "kept empty, as around an object that was cut out",
            Self::Background => "trained as the background color",
        }
    }
}

impl Dataset {
    /// Sets the meaning of transparent pixels, and `self.background` to the color behind the scene.
    pub(crate) fn use_alpha(&mut self, alpha: AlphaUse) {
        if alpha == AlphaUse::Ignore {
            // Photos without transparency may still show the color that the dataset states.
            let stated = self.photos.iter().any(|p| p.background.is_some());
            self.background = self.background.filter(|_| !stated);
        } else {
            self.background = self.background.or(Some(BLACK));
        }
        for photo in &mut self.photos {
            photo.background = self.background.filter(|_| alpha != AlphaUse::Ignore);
            photo.cut_out = alpha == AlphaUse::Empty;
        }
        self.alpha = Some(alpha);
    }

    /// This dataset with transparent pixels used as `alpha`, if one is given and any photo has transparency.
    pub(crate) fn with_alpha(&self, alpha: Option<AlphaUse>) -> Cow<'_, Self> {
        match alpha.filter(|a| self.alpha.is_some_and(|own| own != *a)) {
            None => Cow::Borrowed(self),
            Some(alpha) => {
                let mut other = self.clone();
                other.use_alpha(alpha);
                Cow::Owned(other)
            }
        }
    }

    /// Number of photos with a mask of the pixels that count.
    pub(crate) fn masked(&self) -> usize {
        self.photos.iter().filter(|p| p.mask.is_some()).count()
    }

    /// Notes for the user on transparent and masked pixels.
    pub(crate) fn pixel_notes(&self) -> Vec<String> {
        let alpha = self.alpha.map(|a| format!("Transparent pixels are {} (--alpha)", a.title()));
        let (masked, photos) = (self.masked(), self.photos.len());
        let masks = (masked > 0)
            .then(|| format!("{masked} of {photos} photos have a mask; what is black there does not count"));
        alpha.into_iter().chain(masks).collect()
    }
}

#[cfg(test)]
mod tests {
    use glam::DVec3;

    use super::*;
    use crate::scene::{Camera, Photo};

    #[test]
    fn what_is_asked_for_goes_before_what_the_photos_say() {
        let camera = Camera::look_at(DVec3::Y, DVec3::ZERO, DVec3::Z, 0.8, 8, 8).expect("valid");
        let mut set = Dataset { photos: vec![Photo::new("a", "a.png", camera)], ..Dataset::default() };
        assert!(matches!(set.with_alpha(Some(AlphaUse::Empty)), Cow::Borrowed(_)), "nothing is transparent");
        set.use_alpha(AlphaUse::Empty);
        assert_eq!((set.background, set.photos[0].background, set.photos[0].cut_out), (Some(BLACK), Some(BLACK), true));
        let ignored = set.with_alpha(Some(AlphaUse::Ignore)).into_owned();
        assert_eq!((ignored.background, ignored.photos[0].background, ignored.photos[0].cut_out), (None, None, false));
        let white =
            Dataset { background: Some([1.0; 3]), ..ignored }.with_alpha(Some(AlphaUse::Background)).into_owned();
        assert_eq!((white.photos[0].background, white.photos[0].cut_out), (Some([1.0; 3]), false));
        assert_eq!(white.pixel_notes().len(), 1);
    }
}
