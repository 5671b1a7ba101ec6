//! What every pixel of a view belongs to: the identity of largest accumulated weight, exactly.
//!
//! Rendered once per view; every query then only reads it.

use rayon::prelude::*;

use crate::render::{DrawError, PixelWeights, RenderSettings, Renderer};
use crate::scene::{Camera, GaussianCloud, Identities, IdentityId, Mask, NOBODY};

use super::votes::UNKNOWN;

/// Identities of a view's pixels, row-major.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct ViewMap {
    /// Width in px.
    pub width_px: usize,
    /// Height in px.
    pub height_px: usize,
    /// Innermost identity; `NOBODY` where none wins or nothing is, `UNKNOWN` where Gaussians win
    /// that no vote reached.
    pub identity: Vec<IdentityId>,
    /// Share of the pixel's weight that belongs to the winner's object.
    pub(crate) share: Vec<f32>,
    pub(crate) alpha: Vec<f32>,
}

impl ViewMap {
    /// Opaque pixels without a doubt, in rows of `width_px`.
    pub(crate) fn certain(width_px: usize, identity: Vec<IdentityId>) -> Self {
        let n = identity.len();
        Self { width_px, height_px: n / width_px.max(1), identity, share: vec![1.0; n], alpha: vec![1.0; n] }
    }

    /// Draws the identities `of` the Gaussians of `cloud`.
    pub fn render(
        renderer: &mut Renderer,
        cloud: &GaussianCloud,
        of: &[IdentityId],
        identities: &Identities,
        camera: &Camera,
        settings: &RenderSettings,
    ) -> Result<Self, DrawError> {
        let (width_px, height_px) = (camera.width_px as usize, camera.height_px as usize);
        let objects: Vec<IdentityId> = (0..=identities.len() as IdentityId).map(|i| identities.object_of(i)).collect();
        let weights = renderer.label_weights(cloud, of, camera, settings)?;
        let winners = weights.par_iter().map(|places| winner(places, &objects));
        let (identity, (share, alpha)) = winners.map(|(identity, share, alpha)| (identity, (share, alpha))).unzip();
        Ok(Self { width_px, height_px, identity, share, alpha })
    }

    /// The pixels of an identity and its pieces.
    pub fn mask(&self, identities: &Identities, id: IdentityId) -> Mask {
        let inside = identities.descendants(id);
        Mask::from_fn(self.width_px, self.height_px, |i| {
            inside.get(self.identity[i] as usize).copied().unwrap_or(false)
        })
    }
}

/// Winner of a pixel, the share of its object, and the pixel's alpha. An unknown Gaussian counts as
/// an object of its own; where less than half of the light is blocked, nobody is there.
fn winner(slots: &PixelWeights, objects: &[IdentityId]) -> (IdentityId, f32, f32) {
    let alpha: f32 = slots.iter().map(|s| s.1).sum();
    if alpha < 0.5 {
        return (NOBODY, 0.0, alpha);
    }
    let object_of =
        |id: IdentityId| if id == UNKNOWN { UNKNOWN } else { objects.get(id as usize).copied().unwrap_or(NOBODY) };
    let together = |object: IdentityId| slots.iter().filter(|s| object_of(s.0) == object).map(|s| s.1).sum::<f32>();
    let (mut best, mut most) = (NOBODY, 0.0);
    for slot in slots.iter().filter(|s| s.1 > 0.0) {
        let object = object_of(slot.0);
        let sum = together(object);
        if sum > most {
            (best, most) = (object, sum);
        }
    }
    let inner = slots.iter().filter(|s| s.1 > 0.0 && object_of(s.0) == best);
    let identity = inner.max_by(|a, b| a.1.total_cmp(&b.1)).map_or(NOBODY, |s| s.0);
    (identity, most / alpha, alpha)
}

#[cfg(test)]
mod tests {
    use glam::DVec3;

    use super::*;
    use crate::scene::Level;

    #[test]
    fn the_object_wins_before_its_piece() {
        let objects = [0, 1, 2, 1, 1];
        let mut slots = [(NOBODY, 0.0); 8];
        slots[..3].copy_from_slice(&[(3, 0.25), (4, 0.2), (2, 0.4)]);
        let (identity, share, alpha) = winner(&slots, &objects);
        assert_eq!(identity, 3);
        assert!((share - 0.45 / 0.85).abs() < 1e-6 && (alpha - 0.85).abs() < 1e-6);
        slots[2] = (UNKNOWN, 0.5);
        assert_eq!(winner(&slots, &objects).0, UNKNOWN);
        assert_eq!(winner(&[(1, 0.05); 8], &objects).0, NOBODY, "mostly see-through");
    }

    #[test]
    fn what_stands_in_front_hides_what_is_behind() {
        let mut all = Identities::default();
        let (front, behind) = (all.add(Level::Object, NOBODY, vec![]), all.add(Level::Object, NOBODY, vec![]));
        let cloud = GaussianCloud {
            log_scales: vec![[-1.8; 3], [-0.9; 3]],
            ..GaussianCloud::isotropic(vec![[0.0, 0.0, -0.5], [0.0, 0.0, 0.5]], 0.0, 4.0)
        };
        let camera =
            Camera::look_at(DVec3::new(0.0, 0.0, -3.0), DVec3::ZERO, DVec3::NEG_Y, 0.6, 50, 37).expect("valid");
        let settings = RenderSettings::default();
        let mut renderer = Renderer::new();
        let map = ViewMap::render(&mut renderer, &cloud, &[front, behind], &all, &camera, &settings).expect("drawn");
        let frame = renderer.render(&cloud, crate::render::Features::NONE, &camera, &settings).expect("drawn");
        for (a, b) in map.alpha.iter().zip(&frame.alpha) {
            assert!((a - b).abs() < 1e-4, "{a} {b}");
        }
        assert_eq!(map.identity[18 * 50 + 25], front);
        let (a, b) = (map.mask(&all, front), map.mask(&all, behind));
        assert!(b.area() > a.area() && a.overlap(&b) == 0 && !a.is_empty());
        // Seen from the other side, the order is the other way round.
        let back = Camera::look_at(DVec3::new(0.0, 0.0, 3.0), DVec3::ZERO, DVec3::NEG_Y, 0.6, 50, 37).expect("valid");
        let map = ViewMap::render(&mut renderer, &cloud, &[front, behind], &all, &back, &settings).expect("drawn");
        assert!(map.mask(&all, front).is_empty());
    }

    #[test]
    fn of_two_that_are_equal_the_first_wins() {
        let objects = [0, 1, 2];
        let mut slots = [(NOBODY, 0.0); 8];
        slots[..2].copy_from_slice(&[(2, 0.25), (1, 0.25)]);
        assert_eq!(winner(&slots, &objects), (2, 0.5, 0.5), "half of the light is enough");
        slots[1].1 = 0.24;
        assert_eq!(winner(&slots, &objects).0, NOBODY);
        slots[..2].copy_from_slice(&[(99, 0.6), (1, 0.3)]);
        let (identity, share, _) = winner(&slots, &objects);
        assert!(identity == 99 && (share - 0.6 / 0.9).abs() < 1e-6, "a number that nobody has is nobody's");
        assert_eq!(winner(&[(NOBODY, 0.0); 8], &objects), (NOBODY, 0.0, 0.0));
    }
}
