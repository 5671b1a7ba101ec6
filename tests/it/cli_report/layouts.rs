//! Rendered photos with labels, laid out like the data sets of the literature.

use std::collections::BTreeMap;
use std::fmt::Write;
use std::fs;
use std::path::{Path, PathBuf};

use glam::{DMat3, DQuat, DVec3};
use image::{GrayImage, ImageReader, Luma};
use npyz::WriterBuilder;
use serde_json::{Value, json};

use crate::cli_support::fmlgs;

/// Size of the photos, px.
pub const SIZE: [u32; 2] = [400, 300];

/// Photos as `fmlgs synth` leaves them.
pub struct Rendered {
    pub folder: PathBuf,
    transforms: Value,
    objects: Vec<(u16, String)>,
}

fn json(path: &Path) -> Value {
    serde_json::from_slice(&fs::read(path).unwrap()).unwrap()
}

impl Rendered {
    /// `views` photos of a scene of assets/eval.
    pub fn new(scene: &str, views: usize, folder: &Path) -> Self {
        let folder = folder.join(scene);
        let glb = Path::new(env!("CARGO_MANIFEST_DIR")).join(format!("assets/eval/{scene}.glb"));
        let (views, size) = (views.to_string(), format!("{}x{}", SIZE[0], SIZE[1]));
        let options = [
            "--held-out",
            "0",
            "--samples",
            "2",
            "--points",
            "16000",
            "--view-count",
            &views,
            "--size",
            &size,
            "--rig",
            "survey",
        ];
        let paths = ["synth", glb.to_str().unwrap(), "--out", folder.to_str().unwrap(), "-q"];
        fmlgs(&[&paths[..], &options].concat()).ok();
        Self::open(folder)
    }

    pub fn open(folder: PathBuf) -> Self {
        let list = json(&folder.join("identities.json"));
        let of = |i: &Value| (i["id"].as_u64().unwrap() as u16, i["name"].as_str().unwrap().to_owned());
        let is_object = |i: &&Value| i["level"] == "object";
        let objects = list["identities"].as_array().unwrap().iter().filter(is_object).map(of).collect();
        Self { transforms: json(&folder.join("transforms.json")), objects, folder }
    }

    pub fn views(&self) -> usize {
        self.transforms["frames"].as_array().unwrap().len()
    }

    fn photo(&self, view: usize) -> PathBuf {
        self.folder.join(format!("images/{view:04}.png"))
    }

    /// The objects' ids in a photo.
    fn ids(&self, view: usize) -> image::ImageBuffer<Luma<u16>, Vec<u16>> {
        let path = self.folder.join(format!("object_ids/{view:04}.png"));
        ImageReader::open(path).unwrap().decode().unwrap().into_luma16()
    }

    /// Columns right, up, back, and the center of a camera.
    fn pose(&self, view: usize) -> (DMat3, DVec3) {
        let frame = self.transforms["frames"]
            .as_array()
            .unwrap()
            .iter()
            .find(|f| f["file_path"].as_str().unwrap().ends_with(&format!("{view:04}.png")));
        let rows: Vec<[f64; 4]> = serde_json::from_value(frame.unwrap()["transform_matrix"].clone()).unwrap();
        let column = |c: usize| DVec3::new(rows[0][c], rows[1][c], rows[2][c]);
        (DMat3::from_cols(column(0), column(1), column(2)), column(3))
    }

    fn number(&self, key: &str) -> f64 {
        self.transforms[key].as_f64().unwrap()
    }

    /// The photos as JPEG files, `name(view)` each.
    fn photos(&self, folder: &Path, [w, h]: [u32; 2], name: impl Fn(usize) -> String) {
        fs::create_dir_all(folder).unwrap();
        for view in 0..self.views() {
            let mut photo = ImageReader::open(self.photo(view)).unwrap().decode().unwrap().into_rgb8();
            // These layouts do not tell what is behind everything; nothing is drawn as black.
            let ids = self.ids(view);
            photo.pixels_mut().zip(ids.pixels()).filter(|(_, id)| id.0[0] == 0).for_each(|(p, _)| p.0 = [0; 3]);
            let photo = image::imageops::resize(&photo, w, h, image::imageops::FilterType::Triangle);
            photo.save(folder.join(name(view))).unwrap();
        }
    }

    /// The mask of an object, 255 inside.
    fn mask(&self, view: usize, object: &str) -> GrayImage {
        let id = self.objects.iter().find(|o| o.1 == object).unwrap_or_else(|| panic!("no {object}")).0;
        let ids = self.ids(view);
        GrayImage::from_fn(ids.width(), ids.height(), |x, y| {
            Luma([if ids.get_pixel(x, y).0[0] == id { 255 } else { 0 }])
        })
    }

    /// COLMAP's text files of the cameras and sparse points, for photos called `name(view)`.
    fn colmap(&self, folder: &Path, name: impl Fn(usize) -> String) {
        fs::create_dir_all(folder).unwrap();
        let [w, h] = SIZE;
        let lens = ["fl_x", "fl_y", "cx", "cy"].map(|k| self.number(k).to_string()).join(" ");
        fs::write(folder.join("cameras.txt"), format!("# cameras\n1 PINHOLE {w} {h} {lens}\n")).unwrap();
        let mut images = "# images\n".to_owned();
        for view in 0..self.views() {
            let (axes, center) = self.pose(view);
            let world_from_camera = DMat3::from_cols(axes.x_axis, -axes.y_axis, -axes.z_axis);
            let camera_from_world = world_from_camera.transpose();
            let q = DQuat::from_mat3(&camera_from_world);
            let t = -(camera_from_world * center);
            let number = view + 1;
            writeln!(images, "{number} {} {} {} {} {} {} {} 1 {}\n", q.w, q.x, q.y, q.z, t.x, t.y, t.z, name(view))
                .unwrap();
        }
        fs::write(folder.join("images.txt"), images).unwrap();
        let mut points = "# points\n".to_owned();
        for (i, (p, rgb)) in self.points().into_iter().enumerate() {
            writeln!(points, "{} {} {} {} {} {} {} 0.5", i + 1, p[0], p[1], p[2], rgb[0], rgb[1], rgb[2]).unwrap();
        }
        fs::write(folder.join("points3D.txt"), points).unwrap();
    }

    fn points(&self) -> Vec<([f32; 3], [u8; 3])> {
        let bytes = fs::read(self.folder.join("points3D.ply")).unwrap();
        let end = b"end_header\n";
        let at = bytes.windows(end.len()).position(|w| w == end).unwrap() + end.len();
        let number = |b: &[u8]| f32::from_le_bytes(b.try_into().unwrap());
        let point = |b: &[u8]| ([number(&b[..4]), number(&b[4..8]), number(&b[8..12])], [b[12], b[13], b[14]]);
        bytes[at..].chunks_exact(15).map(point).collect()
    }

    /// LLFF's `poses_bounds.npy`, and what COLMAP leaves where its script made that.
    fn llff(&self, folder: &Path, name: impl Fn(usize) -> String) {
        self.colmap(&folder.join("sparse/0"), name);
        let mut values = Vec::new();
        for view in 0..self.views() {
            let (axes, center) = self.pose(view);
            let size = DVec3::new(f64::from(SIZE[1]), f64::from(SIZE[0]), self.number("fl_x"));
            let columns = [-axes.y_axis, axes.x_axis, axes.z_axis, center, size];
            (0..3).for_each(|row| values.extend(columns.map(|c| c[row])));
            values.extend([0.1, 5.0]);
        }
        let mut out = Vec::new();
        let shape = [self.views() as u64, 17];
        let mut writer = npyz::WriteOptions::new().default_dtype().shape(&shape).writer(&mut out).begin_nd().unwrap();
        writer.extend(values).unwrap();
        writer.finish().unwrap();
        fs::write(folder.join("poses_bounds.npy"), out).unwrap();
    }

    /// `data/SCENE` and `data/label/SCENE` as in lerf_ovs, with labels of the photos `labeled`.
    pub fn lerf_ovs(&self, data: &Path, scene: &str, labeled: &[usize]) {
        let name = |view: usize| format!("frame_{:05}.jpg", view + 1);
        self.photos(&data.join(scene).join("images"), SIZE, name);
        self.colmap(&data.join(scene).join("sparse/0"), name);
        let labels = data.join("label").join(scene);
        fs::create_dir_all(&labels).unwrap();
        for &view in labeled {
            let text = self.isat(view, &name(view)).to_string();
            fs::write(labels.join(name(view)).with_extension("json"), text).unwrap();
        }
    }

    /// The objects of a photo as polygons, a row of pixels each; vertices on pixels' centers.
    fn isat(&self, view: usize, name: &str) -> Value {
        let ids = self.ids(view);
        let mut objects = Vec::new();
        for (id, category) in &self.objects {
            for y in 0..ids.height() {
                let mut x = 0;
                while x < ids.width() {
                    let run = (x..ids.width()).take_while(|x| ids.get_pixel(*x, y).0[0] == *id).count() as u32;
                    if run > 0 {
                        let last = x + run - 1;
                        let box_of = [x, y, last, y + 1];
                        let corners = [[x, y], [last, y], [last, y + 1], [x, y + 1]].map(|c| c.map(f64::from));
                        objects.push(json!({
                            "category": category, "segmentation": corners, "bbox": box_of, "area": run,
                            "group": objects.len() + 1, "layer": 1.0, "iscrowd": false, "note": "",
                        }));
                    }
                    x += run + 1;
                }
            }
        }
        json!({ "info": { "name": name, "width": ids.width(), "height": ids.height() }, "objects": objects })
    }

    /// `data/SCENE` as in SPIn-NeRF: one object's masks beside reduced photos.
    pub fn spin_nerf(&self, data: &Path, scene: &str, object: &str) {
        let scene = data.join(scene);
        let reduced = SIZE.map(|s| s / 2);
        self.photos(&scene.join("images"), SIZE, |v| format!("IMG_{v:04}.jpg"));
        self.photos(&scene.join("images_2"), reduced, |v| format!("IMG_{v:04}.png"));
        self.llff(&scene, |v| format!("IMG_{v:04}.jpg"));
        self.spin_labels(&scene, object);
    }

    /// The masks of an object in a scene of SPIn-NeRF's.
    pub fn spin_labels(&self, scene: &Path, object: &str) {
        let (labels, [w, h]) = (scene.join("images_2/label"), SIZE.map(|s| s / 2));
        fs::create_dir_all(&labels).unwrap();
        for view in 0..self.views() {
            let mask = self.mask(view, object);
            let small = image::imageops::resize(&mask, w, h, image::imageops::FilterType::Nearest);
            small.save(labels.join(format!("IMG_{view:04}.png"))).unwrap();
        }
        // Its helper pictures, which are no labels.
        GrayImage::new(w, h).save(labels.join("IMG_0000_cutout.png")).unwrap();
    }

    /// `data/SCENE` as in 3D-OVS: masks of every class in the photos `labeled`.
    pub fn ovs_3d(&self, data: &Path, scene: &str, labeled: &[usize]) {
        let scene = data.join(scene);
        self.photos(&scene.join("images"), SIZE, |v| format!("{v:02}.jpg"));
        self.llff(&scene, |v| format!("{v:02}.jpg"));
        let folder = scene.join("segmentations");
        fs::create_dir_all(&folder).unwrap();
        let classes: Vec<&str> = self.objects.iter().map(|o| o.1.as_str()).collect();
        fs::write(folder.join("classes.txt"), classes.join("\n") + "\n").unwrap();
        for view in labeled {
            let own = folder.join(format!("{view:02}"));
            fs::create_dir_all(&own).unwrap();
            classes.iter().for_each(|c| self.mask(*view, c).save(own.join(format!("{c}.png"))).unwrap());
        }
    }

    /// `data/SCENE` as in Ref-LERF, with lists of the photos `labeled`.
    pub fn ref_lerf(&self, data: &Path, scene: &str, labeled: &[usize]) {
        let (scene, name) = (data.join(scene), |view: usize| format!("frame_{view:05}.jpg"));
        self.photos(&scene.join("images"), SIZE, name);
        self.colmap(&scene.join("sparse/0"), name);
        self.ref_lerf_lists(&scene, labeled, 0);
    }

    /// The lists and masks of a scene of Ref-LERF; the first photo is no test. Sentences refer to the object `shift`
    /// places later.
    pub fn ref_lerf_lists(&self, scene: &Path, labeled: &[usize], shift: usize) {
        for (k, &view) in labeled.iter().enumerate() {
            let (lists, masks) = if k == 0 { ("train_json", "gt_mask") } else { ("test_json", "mask") };
            let (lists, masks, photo) = (scene.join("json").join(lists), scene.join(masks), format!("frame_{view:05}"));
            fs::create_dir_all(&lists).unwrap();
            fs::create_dir_all(masks.join(&photo)).unwrap();
            let object = |i: usize| {
                let (own, other) = (&self.objects[i].1, &self.objects[(i + shift) % self.objects.len()].1);
                let file = format!("{photo}/{own}.png");
                self.mask(view, own).save(masks.join(&file)).unwrap();
                json!({ "category": own, "segmentation": file, "sentence": [format!("the {other}"), other] })
            };
            let objects: Vec<Value> = (0..self.objects.len()).map(object).collect();
            fs::write(lists.join(photo + ".json"), json!({ "object": objects }).to_string()).unwrap();
        }
    }

    /// Pixels of each object in a photo.
    pub fn areas(&self, view: usize) -> BTreeMap<&str, usize> {
        let ids = self.ids(view);
        self.objects.iter().map(|(id, name)| (name.as_str(), ids.pixels().filter(|p| p.0[0] == *id).count())).collect()
    }
}
