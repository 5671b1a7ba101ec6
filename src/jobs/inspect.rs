//! Gaussians that contribute to a pixel of a view, and the known values of each.

use std::collections::BTreeMap;
use std::sync::Arc;

use serde::Serialize;

use super::JobError;
use crate::math::lanes::Lane;
use crate::math::{Real, rotation, sh};
use crate::render::{COLOR_MAX, ContributionSink, RenderSettings, Renderer, TILE_PX};
use crate::scene::{Camera, GaussianCloud, IdentityId, Level, NO_IDENTITY, SemanticMap};

/// Request to inspect a pixel.
#[derive(Clone, Debug)]
pub struct InspectRequest {
    /// The Gaussians that are drawn.
    pub(crate) cloud: Arc<GaussianCloud>,
    /// Their objects and parts.
    pub(crate) map: Option<Arc<SemanticMap>>,
    /// Their numbers in the scene, if `cloud` is not all of it.
    pub(crate) numbers: Option<Arc<Vec<usize>>>,
    pub(crate) camera: Camera,
    pub(crate) settings: RenderSettings,
    pub(crate) pixel: [u32; 2],
}

/// Contributions to a pixel.
#[derive(Clone, Debug)]
pub struct InspectedPixel {
    pub(crate) request: InspectRequest,
    /// Gaussians of [`InspectRequest::cloud`] with their weights in the pixel, the largest first.
    pub(crate) weights: Vec<(usize, f32)>,
    /// Accumulated opacity of the pixel.
    pub(crate) alpha: f32,
}

/// Record of a Gaussian, as it is copied.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub(crate) struct GaussianRecord {
    /// Number in the scene, from 0 as in its `.ply`.
    pub(crate) number: usize,
    /// Position in scene units, as are the scales.
    pub(crate) center: [f64; 3],
    /// Standard deviations along its own axes.
    pub(crate) scales: [f64; 3],
    /// World from its own axes, `[w, x, y, z]`, length 1; `None` if it has no direction.
    pub(crate) rotation_wxyz: Option<[f32; 4]>,
    pub(crate) opacity: f32,
    /// Color in the view's direction; `base_color` is the mean over all directions.
    pub(crate) color: [f32; 3],
    pub(crate) base_color: [f32; 3],
    /// Coefficients of red, green and blue; bands of degree 0, 1, 2, 3 have 1, 3, 5, 7.
    pub(crate) sh: Vec<[f32; 3]>,
    pub(crate) pixel: PixelRecord,
    /// Its identities, the innermost first; empty if it is unlabeled.
    pub(crate) identities: Vec<IdentityRecord>,
    /// Codes of its object and part.
    pub(crate) codes: Option<[[f32; 3]; 2]>,
    /// Other properties from its file.
    pub(crate) extras: BTreeMap<String, f32>,
}

/// Contribution of a Gaussian to a pixel.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub(crate) struct PixelRecord {
    pub(crate) x: u32,
    pub(crate) y: u32,
    /// Rank by weight, from 1; `of` is the number of ranks.
    pub(crate) place: usize,
    pub(crate) of: usize,
    /// Opacity in the pixel times the transmittance of the Gaussians in front.
    pub(crate) weight: f32,
    /// Share of the pixel's accumulated opacity.
    pub(crate) share: f32,
}

#[derive(Clone, Debug, PartialEq, Serialize)]
pub(crate) struct IdentityRecord {
    pub(crate) number: IdentityId,
    pub(crate) level: Level,
    pub(crate) name: String,
    /// Margin of the votes for this identity, 0 (a guess) to 1. Wholes have the margin of their part.
    pub(crate) weight: f32,
    /// Share of the pixel for this identity and its parts.
    pub(crate) pixel_share: f32,
}

/// Finds the weights of all Gaussians in the pixel.
pub(crate) fn run(request: InspectRequest) -> Result<InspectedPixel, JobError> {
    let at = request.pixel.map(|v| v as usize);
    // Rows of tiles below do not touch the pixel.
    let mut rows: Vec<PixelSink> = (0..=at[1] / TILE_PX).map(|_| PixelSink { at, weights: Vec::new() }).collect();
    Renderer::new().contributions(&request.cloud, &request.camera, &request.settings, &mut rows)?;
    let mut weights = rows.pop().map_or_else(Vec::new, |row| row.weights);
    weights.sort_by(|a, b| b.1.total_cmp(&a.1));
    let alpha = weights.iter().map(|w| w.1).sum();
    Ok(InspectedPixel { request, weights, alpha })
}

impl InspectedPixel {
    /// Returns the Gaussian of a rank by weight, from 0.
    pub(crate) fn record(&self, place: usize) -> Option<GaussianRecord> {
        let (i, weight) = *self.weights.get(place)?;
        let InspectRequest { cloud, map, numbers, camera, settings, pixel: [x, y] } = &self.request;
        let gaussian = cloud.gaussian(i);
        let center = cloud.world_position(i);
        let degree = settings.sh_degree.min(cloud.sh_degree);
        let seen_along = (center - camera.center).try_normalize().unwrap_or(glam::DVec3::Z).to_array();
        let basis = sh::basis(degree, seen_along.map(|v| v as f32));
        let color = |bands: usize| -> [f32; 3] {
            std::array::from_fn(|c| {
                let sum: f32 = gaussian.sh.iter().zip(basis).take(bands).map(|(k, b)| k[c] * b).sum();
                (0.5 + sum).clamp(0.0, COLOR_MAX as f32)
            })
        };
        let map = map.as_ref();
        let id = map.map_or(NO_IDENTITY, |map| map.identity_of[i]);
        let identities = map.map_or_else(Vec::new, |map| {
            let all = map.identities.ancestors(id).filter_map(|id| Some((id, map.identities.get(id)?)));
            let records = all.map(|(number, identity)| IdentityRecord {
                number,
                level: identity.level,
                name: map.identities.name(number),
                weight: map.margin[i],
                pixel_share: self.share_of(map, number),
            });
            records.collect()
        });
        let ours = |name: &str| name.starts_with("fmlgs_");
        let extras = cloud.extras.iter().filter(|e| !ours(&e.name)).map(|e| (e.name.clone(), e.values[i])).collect();
        Some(GaussianRecord {
            number: numbers.as_ref().map_or(i, |numbers| numbers[i]),
            center: center.to_array(),
            scales: gaussian.log_scale.map(|s| f64::from(s).exp()),
            rotation_wxyz: rotation::unit_quaternion(gaussian.quaternion),
            opacity: gaussian.opacity_logit.sigmoid(),
            color: color(sh::coefficients(degree)),
            base_color: color(1),
            sh: gaussian.sh.to_vec(),
            pixel: PixelRecord {
                x: *x,
                y: *y,
                place: place + 1,
                of: self.weights.len(),
                weight,
                share: weight / self.alpha,
            },
            identities,
            codes: map.map(|map| map.codes[i]).map(|[a, b, c, d, e, f]| [[a, b, c], [d, e, f]]),
            extras,
        })
    }

    /// Share of the pixel for an identity and its parts.
    fn share_of(&self, map: &SemanticMap, id: IdentityId) -> f32 {
        let inside = map.identities.descendants(id);
        let is_its = |i: usize| inside.get(map.identity_of[i] as usize) == Some(&true);
        self.weights.iter().filter(|(i, _)| is_its(*i)).map(|(_, weight)| weight).sum::<f32>() / self.alpha
    }
}

/// Collects the weights at one pixel.
struct PixelSink {
    at: [usize; 2],
    weights: Vec<(usize, f32)>,
}

impl ContributionSink<f32> for PixelSink {
    fn add(&mut self, gaussian: u32, x: usize, y: usize, weights: &Lane<f32>) {
        let place = self.at[0].checked_sub(x).filter(|_| y == self.at[1]);
        if let Some(weight) = place.and_then(|place| weights.get(place)).filter(|w| **w > 0.0) {
            self.weights.push((gaussian as usize, *weight));
        }
    }
}

#[cfg(test)]
mod tests {
    use glam::DVec3;

    use super::*;
    use crate::render::Features;
    use crate::scene::Identities;

    /// A small Gaussian before a large one, and one beside them; the eye looks along x.
    fn request(pixel: [u32; 2]) -> InspectRequest {
        let positions = vec![[2.0, 0.0, 0.0], [0.0; 3], [0.0, 3.0, 0.0]];
        let mut cloud = GaussianCloud { origin: DVec3::X, ..GaussianCloud::isotropic(positions, -0.5, 0.0) };
        cloud.log_scales[1] = [-2.0, -1.0, -1.5];
        cloud.opacity_logits = vec![3.0, 0.2, 1.0];
        cloud.sh_degree = 1;
        cloud.sh = (0..12).map(|i| [0.1 * i as f32, 0.2, -0.3]).collect();
        let mut identities = Identities::default();
        let kettle = identities.add(Level::Object, NO_IDENTITY, vec!["kettle".into()]);
        let lid = identities.add(Level::Part, kettle, vec!["lid".into()]);
        let map =
            SemanticMap::from_identities(identities, vec![kettle, lid, NO_IDENTITY], vec![1.0, 0.25, 0.0], vec![]);
        let camera = Camera::look_at(DVec3::new(-4.0, 0.0, 0.0), DVec3::X, DVec3::Z, 0.9, 65, 49).expect("valid");
        InspectRequest {
            cloud: Arc::new(cloud),
            map: Some(Arc::new(map)),
            numbers: Some(Arc::new(vec![10, 20, 30])),
            camera,
            settings: RenderSettings::default(),
            pixel,
        }
    }

    #[test]
    fn the_weights_of_a_pixel_are_those_it_is_drawn_with() {
        for pixel in [[32, 24], [30, 20], [0, 0], [64, 48], [12, 24]] {
            let request = request(pixel);
            let (cloud, camera, settings) = (request.cloud.clone(), request.camera.clone(), request.settings.clone());
            let frame = Renderer::new().render(&cloud, Features::NONE, &camera, &settings).expect("drawn");
            let at = pixel[1] as usize * 65 + pixel[0] as usize;
            let found = run(request).expect("inspected");
            assert!((found.alpha - frame.alpha[at]).abs() < 1e-5, "{pixel:?}: {} {}", found.alpha, frame.alpha[at]);
            // The colors of the records, blended by their weights, are the color of the pixel.
            let records: Vec<GaussianRecord> = (0..found.weights.len()).filter_map(|k| found.record(k)).collect();
            let light = 1.0 - frame.alpha[at];
            for c in 0..3 {
                let sum: f32 = records.iter().map(|r| r.pixel.weight * r.color[c]).sum();
                let drawn = frame.color[c][at] - light * settings.background[c];
                assert!((sum - drawn).abs() < 1e-4, "{pixel:?}: {sum} {drawn}");
            }
            assert!(records.is_sorted_by(|a, b| a.pixel.weight >= b.pixel.weight));
        }
    }

    #[test]
    fn a_record_has_every_property() {
        let found = run(request([32, 24])).expect("inspected");
        let first = found.record(0).expect("something is there");
        assert_eq!((first.number, first.pixel.place, first.pixel.of), (20, 1, 2), "the one in front, by its number");
        assert_eq!(first.center, [1.0, 0.0, 0.0]);
        assert!((first.opacity - 0.549_834).abs() < 1e-5 && (first.scales[2] - (-1.5_f64).exp()).abs() < 1e-6);
        assert_eq!((first.rotation_wxyz, first.sh.len()), (Some([1.0, 0.0, 0.0, 0.0]), 4));
        let names: Vec<(&str, f32)> = first.identities.iter().map(|i| (i.name.as_str(), i.weight)).collect();
        assert_eq!(names, [("lid", 0.25), ("kettle", 0.25)]);
        assert!((first.identities[0].pixel_share - first.pixel.share).abs() < 1e-6, "the lid is this one alone");
        assert!((first.identities[1].pixel_share - 1.0).abs() < 1e-6, "the kettle is both");
        assert_ne!(first.color, first.base_color, "the color depends on the direction");
        let second = found.record(1).expect("what is behind");
        assert_eq!((second.number, found.record(2)), (10, None));
        assert!((first.pixel.share + second.pixel.share - 1.0).abs() < 1e-6);
        let json = serde_json::to_value(&first).expect("numbers");
        assert_eq!((&json["number"], &json["identities"][1]["name"]), (&20.into(), &"kettle".into()));

        let beside = run(request([0, 0])).expect("inspected");
        assert!(beside.weights.is_empty() && beside.record(0).is_none(), "nothing is drawn there");
    }
}
