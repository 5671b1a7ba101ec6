//! Gaussians that a shape takes: under pixels of the view, in a ball, of a color.

use glam::{DVec2, DVec3};

use super::super::super::split::ViewArea;
use super::super::ToolScene;
use crate::scene::{Camera, GaussianCloud, Mask};
use crate::ui::ctx::Ctx;
use crate::worker::ViewMode;

/// Largest depth of a center behind the rendered surface to count as on it, as a share of its depth.
const ON_SURFACE: f64 = 0.02;

/// Numbers of the drawn Gaussians; `None` draws all.
pub(super) type DrawnOnly<'a> = Option<&'a [usize]>;

/// Color of the frame at a relative place of a view. Other modes show colors that no Gaussian has, and another scene
/// has other Gaussians.
pub(super) fn color_at(at: DVec2, area: ViewArea, scene: &ToolScene<'_>, cx: &mut Ctx<'_>) -> Option<[u8; 3]> {
    if *cx.layout.mode_of(area.second) != ViewMode::Rgb || area.is_other {
        return None;
    }
    let pixels = scene.display.picture()?.pixels(area.second).ok()?;
    let x = ((at.x * f64::from(pixels.width_px)) as u32).min(pixels.width_px - 1);
    let y = ((at.y * f64::from(pixels.height_px)) as u32).min(pixels.height_px - 1);
    pixels.rgb.get((y * pixels.width_px + x) as usize).copied()
}

fn all_drawn(cloud: &GaussianCloud, drawn: DrawnOnly<'_>, takes: impl Fn(usize) -> bool) -> Vec<u32> {
    match drawn {
        Some(drawn) => drawn.iter().copied().filter(|i| takes(*i)).map(|i| i as u32).collect(),
        None => (0..cloud.len()).filter(|i| takes(*i)).map(|i| i as u32).collect(),
    }
}

/// Gaussians with centers in the pixels of `area`, a mask of the camera's frame at any size; with `depth`, only those
/// on or before the surface.
pub(super) fn under(
    cloud: &GaussianCloud,
    drawn: DrawnOnly<'_>,
    camera: &Camera,
    depth: Option<&[f32]>,
    area: &Mask,
) -> Vec<u32> {
    let (w, h) = (camera.width_px as usize, camera.height_px as usize);
    let scale = area.width_px() as f64 / w as f64;
    all_drawn(cloud, drawn, |i| {
        let world = cloud.world_position(i);
        let Some(at) = camera.project(world) else { return false };
        if at.min_element() < 0.0 || at.x >= w as f64 || at.y >= h as f64 {
            return false;
        }
        let row = ((at.y * scale) as usize).min(area.height_px().saturating_sub(1));
        let column = ((at.x * scale) as usize).min(area.width_px().saturating_sub(1));
        if !area.contains(row * area.width_px() + column) {
            return false;
        }
        let surface = |depth: &[f32]| depth.get(at.y as usize * w + at.x as usize).copied().unwrap_or(0.0);
        depth.is_none_or(|depth| {
            let surface = f64::from(surface(depth));
            surface <= 0.0 || camera.camera_from_world(world).z <= surface * (1.0 + ON_SURFACE)
        })
    })
}

/// Gaussians with centers in any of the balls, each a middle and a radius in scene units.
pub(super) fn in_balls(cloud: &GaussianCloud, drawn: DrawnOnly<'_>, balls: &[(DVec3, f64)]) -> Vec<u32> {
    all_drawn(cloud, drawn, |i| {
        let at = cloud.world_position(i);
        balls.iter().any(|(middle, radius)| at.distance_squared(*middle) <= radius * radius)
    })
}

/// Gaussians whose view-independent color is within `tolerance` of `color`, as a distance in red, green and blue, 0 to
/// 1 each.
pub(super) fn of_color(cloud: &GaussianCloud, drawn: DrawnOnly<'_>, color: [u8; 3], tolerance: f32) -> Vec<u32> {
    let color = color.map(|v| f32::from(v) / 255.0);
    all_drawn(cloud, drawn, |i| {
        let own = cloud.mean_color(i);
        (0..3).map(|k| (own[k] - color[k]).powi(2)).sum::<f32>().sqrt() <= tolerance
    })
}

/// The Gaussian of `among` whose center is nearest to a point.
pub(super) fn nearest(cloud: &GaussianCloud, among: &[u32], point: DVec3) -> Option<u32> {
    let distance = |i: &u32| cloud.world_position(*i as usize).distance_squared(point);
    among.iter().copied().filter(|i| (*i as usize) < cloud.len()).min_by(|a, b| distance(a).total_cmp(&distance(b)))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::sh::SH_C0;

    #[test]
    fn what_is_before_the_surface_or_on_it_is_taken_and_what_is_behind_only_through_it() {
        let camera = Camera::look_at(DVec3::new(0.0, -4.0, 0.0), DVec3::ZERO, DVec3::Z, 0.8, 40, 40).expect("valid");
        // Before the surface, on it, behind it, beside it on it, and behind the camera.
        let positions = vec![[0.0, -2.0, 0.0], [0.0, 0.03, 0.0], [0.0, 2.0, 0.0], [1.0, 0.0, 0.0], [0.0, -9.0, 0.0]];
        let cloud = GaussianCloud::isotropic(positions, 0.0, 0.0);
        let depth = vec![4.0; 40 * 40];
        // The mask is half as large as the frame.
        let middle = Mask::from_fn(20, 20, |i| (8..12).contains(&(i % 20)) && (8..12).contains(&(i / 20)));
        let under = |depth, drawn| under(&cloud, drawn, &camera, depth, &middle);
        assert_eq!(under(Some(&depth[..]), None), [0, 1]);
        assert_eq!(under(None, None), [0, 1, 2]);
        assert_eq!(under(None, Some(&[1, 3])), [1], "of those that are drawn");
    }

    #[test]
    fn a_ball_takes_what_is_inside_and_the_nearest_is_near() {
        let cloud = GaussianCloud::isotropic((0..10).map(|i| [i as f32, 0.0, 0.0]).collect(), 0.0, 0.0);
        let balls = [(DVec3::new(2.0, 0.0, 0.0), 1.1), (DVec3::new(8.0, 0.0, 0.5), 0.6)];
        assert_eq!(in_balls(&cloud, None, &balls), [1, 2, 3, 8]);
        assert_eq!(in_balls(&cloud, Some(&[2, 9]), &balls), [2], "of those that are drawn");
        assert!(in_balls(&cloud, None, &[]).is_empty());
        assert_eq!(nearest(&cloud, &[1, 7, 99], DVec3::new(5.0, 0.0, 0.0)), Some(7));
        assert_eq!(nearest(&cloud, &[], DVec3::ZERO), None);
    }

    #[test]
    fn the_color_and_the_tolerance_decide_among_what_is_drawn() {
        let sh = |color: [f32; 3]| color.map(|v| (v - 0.5) / SH_C0 as f32);
        let cloud = GaussianCloud {
            sh: vec![sh([1.0, 0.0, 0.0]), sh([0.9, 0.1, 0.0]), sh([0.0, 0.0, 1.0])],
            ..GaussianCloud::isotropic(vec![[0.0; 3]; 3], 0.0, 0.0)
        };
        let red = [255, 0, 0];
        assert_eq!(of_color(&cloud, None, red, 0.05), [0]);
        assert_eq!(of_color(&cloud, None, red, 0.2), [0, 1]);
        assert_eq!(of_color(&cloud, Some(&[1, 2]), red, 0.2), [1], "of those that are drawn");
        assert!(of_color(&cloud, None, [0, 255, 0], 0.2).is_empty());
    }
}
