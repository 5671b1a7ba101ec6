//! Thumbnails of objects and parts, each rendered alone, for lists.

use glam::DVec3;

use crate::render::{Features, RenderError, RenderSettings, Renderer};
use crate::scene::{Bounds, Camera, GaussianCloud, SemanticMap};

/// Width and height of a thumbnail, px.
pub(crate) const SIDE_PX: usize = 64;
/// Field of view, radians; narrow, so that near and far Gaussians have similar sizes.
const FOV_RAD: f64 = 0.5;

/// Thumbnail of each identity by number less one, SIDE_PX x SIDE_PX, row-major; `None` for those without Gaussians.
pub(crate) type Thumbnails = Vec<Option<Vec<[u8; 3]>>>;

/// Renders every identity as seen from `from`.
pub(crate) fn draw_thumbnails(
    cloud: &GaussianCloud,
    map: &SemanticMap,
    settings: &RenderSettings,
    from: DVec3,
    up: DVec3,
) -> Result<Thumbnails, RenderError> {
    let mut renderer = Renderer::new();
    let mut list = Vec::with_capacity(map.identities.len());
    for (id, _) in map.identities.iter() {
        let alone = cloud.select(&map.members(id));
        list.push(match camera(&alone, from, up) {
            Some(camera) => Some(renderer.render(&alone, Features::NONE, &camera, settings)?.to_rgb8()),
            None => None,
        });
    }
    Ok(list)
}

/// Returns a camera in the direction of `from` that sees all of a cloud.
fn camera(cloud: &GaussianCloud, from: DVec3, up: DVec3) -> Option<Camera> {
    let bounds = Bounds::robust((0..cloud.len()).map(|i| cloud.world_position(i)))?;
    let center = bounds.center();
    let toward = (from - center).try_normalize().unwrap_or(up);
    // Along the up axis, any other axis is up.
    let up = if toward.dot(up).abs() > 0.99 { up.any_orthonormal_vector() } else { up };
    let radius = (0.5 * bounds.size().length()).max(1e-9);
    let distance = radius / (0.5 * FOV_RAD).sin();
    let side = SIDE_PX as u32;
    Camera::look_at(center + toward * distance, center, up, FOV_RAD, side, side)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::{Identities, Level, NO_IDENTITY};

    #[test]
    fn everything_is_drawn_alone_and_fills_its_picture() {
        let mut all = Identities::default();
        let doll = all.add(Level::Object, NO_IDENTITY, vec![]);
        let cat = all.add(Level::Object, NO_IDENTITY, vec![]);
        all.add(Level::Object, NO_IDENTITY, vec!["nothing".into()]);
        // A white blob and one a hundred times as large around it.
        let n = 40;
        let place = |i: usize| {
            let scale = if i < n / 2 { 0.01 } else { 1.0 };
            [scale * (i as f32).sin(), scale * (i as f32 * 1.7).cos(), scale * (i as f32 * 0.3).sin()]
        };
        let scale = |i: usize| if i < n / 2 { 0.004_f32.ln() } else { 0.4_f32.ln() };
        let cloud = GaussianCloud {
            log_scales: (0..n).map(|i| [scale(i); 3]).collect(),
            sh: vec![[1.7; 3]; n],
            ..GaussianCloud::isotropic((0..n).map(place).collect(), 0.0, 4.0)
        };
        let of = (0..n).map(|i| if i < n / 2 { doll } else { cat }).collect();
        let map = SemanticMap::from_identities(all, of, vec![1.0; n], vec![]);
        let settings = RenderSettings::default();
        // From above too, where up and the line of sight are the same.
        for from in [DVec3::new(5.0, 1.0, 0.0), DVec3::new(0.0, 0.0, 9.0)] {
            let list = draw_thumbnails(&cloud, &map, &settings, from, DVec3::Z).expect("drawn");
            assert_eq!(list.len(), 3);
            assert!(list[0].is_some() && list[1].is_some() && list[2].is_none(), "nothing to draw");
            for picture in list.iter().flatten() {
                assert_eq!(picture.len(), SIDE_PX * SIDE_PX);
                let bright = picture.iter().filter(|p| p[0] > 128).count();
                assert!(bright > SIDE_PX * SIDE_PX / 8 && bright < SIDE_PX * SIDE_PX * 19 / 20, "{bright}");
            }
        }
    }

    #[test]
    fn a_portrait_is_taken_from_where_one_stands() {
        let corners = [[-1.0, -1.0, -1.0], [1.0, 1.0, 1.0]];
        let cloud =
            GaussianCloud { positions: corners.to_vec(), origin: DVec3::splat(5.0), ..GaussianCloud::default() };
        let from = DVec3::new(9.0, 5.0, 5.0);
        let c = camera(&cloud, from, DVec3::Z).expect("something");
        // Half of the diagonal is sqrt(3); it fills half of the field of view.
        assert!((c.center.distance(DVec3::splat(5.0)) - 3.0_f64.sqrt() / 0.25_f64.sin()).abs() < 1e-9);
        assert!((c.forward() + DVec3::X).length() < 1e-12 && (c.world_from_camera.y_axis + DVec3::Z).length() < 1e-12);
        assert_eq!((c.width_px, c.height_px), (64, 64));
        assert!((c.fov_y_rad() - FOV_RAD).abs() < 1e-12);
        // From straight above, up is another axis; from the center, the camera looks from above.
        for from in [DVec3::new(5.0, 5.0, 50.0), DVec3::splat(5.0)] {
            let c = camera(&cloud, from, DVec3::Z).expect("something");
            assert!((c.forward() + DVec3::Z).length() < 1e-9, "{}", c.forward());
        }
        assert_eq!(camera(&GaussianCloud::default(), from, DVec3::Z), None);
    }
}
