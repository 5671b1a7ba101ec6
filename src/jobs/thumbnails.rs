//! Small pictures of a scene's objects and parts in its first view, and the appearance of those without a name.

use super::JobError;
use crate::pipeline::semantics::thumbnails::{Thumbnails, draw_thumbnails};
use crate::render::RenderSettings;
use crate::scene::appearance::{self, Appearance};
use crate::scene::resource_log::{self, ResourceKind};
use crate::scene::{GaussianCloud, HomeView, SemanticMap};

/// Ground of the pictures in any scene: dark things and light ones stand out from it.
const GROUND: [f32; 3] = [0.82, 0.85, 0.88];

/// Pictures and appearances of objects and parts, by number less one.
#[derive(Clone, Debug)]
pub struct ThumbnailSet {
    pub(crate) pictures: Thumbnails,
    /// Appearance of identities without a name.
    pub(crate) appearances: Vec<Option<Appearance>>,
}

/// Draws every object and part by itself.
pub(crate) fn draw(
    cloud: &GaussianCloud,
    map: &SemanticMap,
    settings: &RenderSettings,
    home: &HomeView,
) -> Result<ThumbnailSet, JobError> {
    let from = home.camera.as_ref().map_or(home.bounds.center() + home.up, |c| c.center);
    resource_log::record(ResourceKind::Thumbnails, "thumbnails of objects and parts", "a list of them is shown", 0);
    let appearances = appearance::of_unnamed(cloud, map);
    let settings = RenderSettings { background: GROUND, ..settings.clone() };
    Ok(ThumbnailSet { pictures: draw_thumbnails(cloud, map, &settings, from, home.up)?, appearances })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::{Bounds, Identities, Level, NO_IDENTITY};

    #[test]
    fn a_black_thing_stands_out_from_its_ground() {
        let mut all = Identities::default();
        let piano = all.add(Level::Object, NO_IDENTITY, vec![]);
        let place = |i: usize| [(i as f32).sin(), (i as f32 * 1.7).cos(), (i as f32 * 0.3).sin()];
        // Black, in a scene on black.
        let cloud = GaussianCloud {
            sh: vec![[-1.77; 3]; 30],
            ..GaussianCloud::isotropic((0..30).map(place).collect(), -1.5, 4.0)
        };
        let map = SemanticMap::from_identities(all, vec![piano; 30], vec![1.0; 30], vec![]);
        let settings = RenderSettings { background: [0.0; 3], ..RenderSettings::default() };
        let bounds = Bounds { min: glam::DVec3::NEG_ONE, max: glam::DVec3::ONE };
        let home = HomeView { camera: None, bounds, up: glam::DVec3::Z };
        let shades = |pictures: Thumbnails| {
            let picture = pictures.into_iter().next().flatten().expect("a picture");
            [0, 1].map(|k| {
                picture.iter().map(|p| p[1]).fold(if k == 0 { 255 } else { 0 }, if k == 0 { u8::min } else { u8::max })
            })
        };
        let [dark, light] = shades(draw(&cloud, &map, &settings, &home).expect("drawn").pictures);
        assert!(dark < 40 && light > 200, "{dark} to {light}");
        // Control: on the ground of the scene it is a black square.
        let from = home.bounds.center() + home.up;
        let [_, light] = shades(draw_thumbnails(&cloud, &map, &settings, from, home.up).expect("drawn"));
        assert!(light < 40, "{light}");
    }
}
