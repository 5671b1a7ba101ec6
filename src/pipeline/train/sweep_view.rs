//! Small pictures for the plane sweep, with their background pixels.

use glam::{DMat3, DVec2, DVec3};

use super::TrainView;
use crate::io::photo;
use crate::math::stats::median;
use crate::scene::Camera;

/// Largest side of the small pictures, px; photos are halved until they fit.
const SIDE_PX: u32 = 200;
/// Alpha (of 255) below which a pixel is background, and coverage (of 255) below which it is unknown.
const LEAST: u8 = 6;
/// Largest difference (of 255) to the background color at which a pixel is background.
const LIKE_BACKGROUND: u8 = 4;
/// Share of the edge pixels with one color from which that color is the backdrop.
const BACKDROP_SHARE: f64 = 0.8;
/// Views that each view is compared with.
const NEIGHBORS: usize = 6;
/// Best angle between two views of a point, and the range of useful ones, degrees.
const ANGLES: [f64; 3] = [3.0, 12.0, 50.0];

/// Content of a pixel.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Shows {
    Something,
    /// Background: its ray meets no surface.
    Nothing,
    /// Not covered by the photo.
    Unknown,
}

/// Photo at a small size.
pub(super) struct SmallView {
    pub(super) camera: Camera,
    width: usize,
    height: usize,
    pub(super) rgb: Vec<[f32; 3]>,
    pub(super) shows: Vec<Shows>,
}

impl SmallView {
    pub(super) fn new(view: &TrainView, background: Option<[u8; 3]>) -> Self {
        let (mut pixels, mut camera) = (view.pixels.clone(), view.camera.clone());
        while camera.width_px.max(camera.height_px) > SIDE_PX {
            (pixels, camera) = photo::half(&pixels, &camera);
        }
        let is_background = |rgb: &[u8; 3]| background.is_some_and(|b| alike(rgb, &b));
        let shows = |i: usize| {
            let under = |plane: &Option<Vec<u8>>| plane.as_ref().is_some_and(|p| p[i] < LEAST);
            match () {
                () if under(&pixels.coverage) => Shows::Unknown,
                () if under(&pixels.alpha) => Shows::Nothing,
                () if pixels.alpha.is_none() && is_background(&pixels.rgb[i]) => Shows::Nothing,
                () => Shows::Something,
            }
        };
        Self {
            shows: (0..pixels.len()).map(shows).collect(),
            rgb: pixels.rgb.iter().map(|p| p.map(|c| f32::from(c) / 255.0)).collect(),
            width: pixels.width_px as usize,
            height: pixels.height_px as usize,
            camera,
        }
    }

    /// Index of the pixel at an image position; `None` outside.
    pub(super) fn pixel(&self, at: DVec2) -> Option<usize> {
        // These comparisons put NaN outside.
        let inside = at.x >= 0.0 && at.y >= 0.0 && at.x < self.width as f64 && at.y < self.height as f64;
        inside.then(|| at.y as usize * self.width + at.x as usize)
    }

    /// Center of a pixel.
    pub(super) fn place(&self, pixel: usize) -> DVec2 {
        DVec2::new((pixel % self.width) as f64 + 0.5, (pixel / self.width) as f64 + 0.5)
    }

    /// Content of the pixel at a world point; `None` outside the picture.
    pub(super) fn at(&self, point: DVec3) -> Option<Shows> {
        self.camera.project(point).and_then(|p| self.pixel(p)).map(|i| self.shows[i])
    }
}

fn alike(a: &[u8; 3], b: &[u8; 3]) -> bool {
    a.iter().zip(b).all(|(a, b)| a.abs_diff(*b) <= LIKE_BACKGROUND)
}

/// Color of an undeclared backdrop: that of nearly all edge pixels of the photos.
pub(super) fn common_backdrop(views: &[TrainView]) -> Option<[u8; 3]> {
    let edge = |view: &TrainView| -> Vec<[u8; 3]> {
        let (w, h) = (view.pixels.width_px as usize, view.pixels.height_px as usize);
        let rows = (0..w).flat_map(|x| [x, w * (h - 1) + x]);
        rows.chain((0..h).flat_map(|y| [y * w, y * w + w - 1])).map(|i| view.pixels.rgb[i]).collect()
    };
    let edges: Vec<[u8; 3]> =
        views.iter().filter(|v| v.pixels.coverage.is_none() && !v.pixels.is_empty()).flat_map(edge).collect();
    let middle: [u8; 3] =
        std::array::from_fn(|c| median(&edges.iter().map(|p| f64::from(p[c])).collect::<Vec<_>>()) as u8);
    let same = edges.iter().filter(|p| alike(p, &middle)).count();
    (!edges.is_empty() && same as f64 >= BACKDROP_SHARE * edges.len() as f64).then_some(middle)
}

/// Map from the rays of one view to the pixels of another.
pub(super) struct ViewPair {
    /// The other view.
    pub(super) other: usize,
    /// Turns a ray of camera depth 1 to the other camera's pixels, homogeneous.
    turn: DMat3,
    shift: DVec3,
}

impl ViewPair {
    fn new(from: &Camera, to: &Camera, other: usize) -> Self {
        let (f, c) = (to.focal_px, to.principal_px);
        let lens = DMat3::from_cols(DVec3::new(f.x, 0.0, 0.0), DVec3::new(0.0, f.y, 0.0), DVec3::new(c.x, c.y, 1.0));
        let into = to.world_from_camera.transpose();
        Self { other, turn: lens * into * from.world_from_camera, shift: lens * (into * (from.center - to.center)) }
    }

    /// Projects the point at `depth` along a ray, in camera axes with depth 1, into the other picture.
    pub(super) fn place(&self, ray: DVec3, depth: f64) -> Option<DVec2> {
        let q = self.turn * ray * depth + self.shift;
        (q.z > 0.0).then(|| DVec2::new(q.x, q.y) / q.z)
    }
}

/// Neighboring views of each view, at a useful angle to it as seen from the focus.
pub(super) fn neighbors(views: &[SmallView], focus: DVec3) -> Vec<Vec<ViewPair>> {
    let [least, best, most] = ANGLES;
    let toward: Vec<DVec3> = views.iter().map(|v| (v.camera.center - focus).normalize_or_zero()).collect();
    let of = |i: usize| -> Vec<ViewPair> {
        let mut near: Vec<(f64, usize)> = (0..views.len())
            .filter(|&j| j != i && views[i].camera.forward().dot(views[j].camera.forward()) > 0.3)
            .map(|j| (toward[i].dot(toward[j]).clamp(-1.0, 1.0).acos().to_degrees(), j))
            .filter(|(angle, _)| (least..most).contains(angle))
            .map(|(angle, j)| ((angle / best).ln().abs(), j))
            .collect();
        near.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
        near.truncate(NEIGHBORS);
        near.into_iter().map(|(_, j)| ViewPair::new(&views[i].camera, &views[j].camera, j)).collect()
    };
    (0..views.len()).map(of).collect()
}
