//! Photos of a made-up thing, two checkered balls, cut out or before a color: in Blender's layout, or nerfstudio's.

use std::fs;
use std::path::Path;

use glam::{DMat3, DVec3};
use image::{Rgba, RgbaImage};
use serde_json::{Value, json};

/// Centers and radii of the balls.
pub const BALLS: [([f64; 3], f64); 2] = [([0.0, 0.0, 0.0], 1.0), ([0.9, 0.5, 0.7], 0.5)];
const FOV: f64 = 0.7;
const DISTANCE: f64 = 4.0;

/// Settings of made-up photos of an object.
#[derive(Clone, Copy)]
pub struct ObjectPhotos {
    pub side_px: u32,
    pub views: usize,
    /// Every so many photos are for testing.
    pub test_every: usize,
    /// Color behind the object; `None` = transparent.
    pub backdrop: Option<[u8; 3]>,
    /// Scene units of the larger ball's radius.
    pub scale: f64,
}

impl Default for ObjectPhotos {
    fn default() -> Self {
        Self { side_px: 48, views: 40, test_every: 8, backdrop: None, scale: 1.0 }
    }
}

impl ObjectPhotos {
    /// Writes `transforms_{train,test}.json` and the photos.
    pub fn blender(&self, folder: &Path) {
        let (test, train): (Vec<usize>, Vec<usize>) = (0..self.views).partition(|i| i % self.test_every == 0);
        for (split, views) in [("train", train), ("test", test)] {
            fs::create_dir_all(folder.join(split)).expect("folder");
            let frame =
                |i: &usize| json!({ "file_path": format!("./{split}/r_{i}"), "transform_matrix": self.pose(*i) });
            let frames: Vec<Value> = views.iter().map(frame).collect();
            write(
                &folder.join(format!("transforms_{split}.json")),
                &json!({ "camera_angle_x": FOV, "frames": frames }),
            );
            views.iter().for_each(|&i| self.photo(i).save(folder.join(format!("{split}/r_{i}.png"))).expect("save"));
        }
    }

    /// Writes `transforms.json` and `images/`; `more` changes a frame.
    pub fn nerfstudio(&self, folder: &Path, more: impl Fn(usize, &mut Value)) {
        fs::create_dir_all(folder.join("images")).expect("folder");
        let frame = |i: usize| {
            let mut frame = json!({ "file_path": format!("images/{i:02}.png"), "transform_matrix": self.pose(i) });
            more(i, &mut frame);
            self.photo(i).save(folder.join(format!("images/{i:02}.png"))).expect("save");
            frame
        };
        let frames: Vec<Value> = (0..self.views).map(frame).collect();
        write(&folder.join("transforms.json"), &json!({ "camera_angle_x": FOV, "frames": frames }));
    }

    /// Camera positions: all around, by the golden angle.
    pub fn eye(&self, i: usize) -> DVec3 {
        let z = 1.0 - 1.6 * (i as f64 + 0.5) / self.views as f64;
        let (sin, cos) = (i as f64 * 2.399_963).sin_cos();
        let r = (1.0 - z * z).sqrt();
        DVec3::new(r * cos, r * sin, z) * DISTANCE * self.scale
    }

    /// OpenGL's world_from_camera.
    pub fn pose(&self, i: usize) -> [[f64; 4]; 4] {
        let (m, e) = (self.axes(i), self.eye(i));
        let row = |k: usize| [m.x_axis[k], m.y_axis[k], m.z_axis[k], e[k]];
        [row(0), row(1), row(2), [0.0, 0.0, 0.0, 1.0]]
    }

    fn axes(&self, i: usize) -> DMat3 {
        let back = self.eye(i).normalize_or_zero();
        let right = DVec3::Z.cross(back).normalize_or_zero();
        DMat3::from_cols(right, back.cross(right), back)
    }

    /// Renders photo `i`, the mean of nine samples a pixel.
    pub fn photo(&self, i: usize) -> RgbaImage {
        let (axes, eye) = (self.axes(i), self.eye(i) / self.scale);
        let half = (0.5 * FOV).tan();
        RgbaImage::from_fn(self.side_px, self.side_px, |x, y| {
            let mut sum = [0.0; 4];
            for k in 0..9 {
                let along = |p: u32, sub: u32| {
                    (f64::from(p) + (f64::from(sub) + 0.5) / 3.0) / f64::from(self.side_px) * 2.0 - 1.0
                };
                let (u, v) = (along(x, k % 3), along(y, k / 3));
                let ray = (axes * DVec3::new(u * half, -v * half, -1.0)).normalize_or_zero();
                if let Some(color) = seen(eye, ray) {
                    (0..3).for_each(|c| sum[c] += color[c] / 9.0);
                    sum[3] += 1.0 / 9.0;
                }
            }
            let a = sum[3];
            match self.backdrop {
                Some(b) => {
                    let [r, g, b] =
                        std::array::from_fn(|c| (255.0 * sum[c] + f64::from(b[c]) * (1.0 - a)).round() as u8);
                    Rgba([r, g, b, 255])
                }
                None => {
                    let [r, g, b] = std::array::from_fn(|c| (255.0 * sum[c] / a.max(1e-9)).round() as u8);
                    Rgba([r, g, b, (255.0 * a).round() as u8])
                }
            }
        })
    }
}

/// The color that a ray meets.
fn seen(eye: DVec3, ray: DVec3) -> Option<[f64; 3]> {
    let hit = |(center, radius): &([f64; 3], f64)| {
        let from = eye - DVec3::from(*center);
        let (b, c) = (from.dot(ray), from.length_squared() - radius * radius);
        let root = (b * b - c).sqrt();
        root.is_finite().then(|| -b - root)
    };
    let depth = BALLS.iter().filter_map(hit).reduce(f64::min)?;
    let p = (eye + ray * depth) * 5.0;
    let check = if (p.x.floor() + p.y.floor() + p.z.floor()).rem_euclid(2.0) < 1.0 { 0.9 } else { 0.25 };
    Some([check, 0.2 + 0.1 * (p.x * 0.5).sin(), 0.9 * (1.1 - check)])
}

fn write(path: &Path, value: &Value) {
    fs::write(path, value.to_string()).expect("write");
}
