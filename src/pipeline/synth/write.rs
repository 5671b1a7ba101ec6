//! Writer of the files of a synthetic data set.

use std::fs::{self, File};
use std::io::{BufWriter, Write};
use std::path::{Path, PathBuf};

use image::{ExtendedColorType, ImageEncoder, codecs::png::PngEncoder};
use npyz::WriterBuilder;
use serde_json::json;

use super::SynthError;
use super::levels::TrueIdentity;
use super::options::SynthOptions;
use super::view::SynthView;
use crate::io::folder_lock::FolderLock;
use crate::io::transforms::opengl_pose;
use crate::io::{IoError, atomic, files, points_ply};
use crate::scene::{Camera, SparsePoint};

/// File that marks the folder as a complete data set; written last.
pub(crate) const TRANSFORMS: &str = "transforms.json";
pub(crate) const SETTINGS: &str = "synth.json";

pub(crate) struct Writer {
    out: PathBuf,
    _lock: FolderLock,
    /// Number of digits in a photo's file name.
    digits: usize,
}

impl Writer {
    /// Makes the folders. Removes the mark of an earlier complete data set of this program; refuses a folder that holds
    /// anything else.
    pub(crate) fn new(out: &Path, views: usize) -> Result<Self, SynthError> {
        fs::create_dir_all(out).map_err(|source| SynthError::Write { path: out.into(), source })?;
        let lock = FolderLock::take(out, "making photos")?;
        if files::holds_something(out) && !out.join(SETTINGS).is_file() {
            let what = "holds something that 'fmlgs synth' has not written, which would be replaced";
            return Err(IoError::Occupied { folder: out.into(), what }.into());
        }
        for folder in ["images", "object_ids", "part_ids", "depth"] {
            let path = out.join(folder);
            fs::create_dir_all(&path).map_err(|source| SynthError::Write { path, source })?;
        }
        let path = out.join(TRANSFORMS);
        match fs::remove_file(&path) {
            Err(source) if source.kind() != std::io::ErrorKind::NotFound => {
                return Err(SynthError::Write { path, source });
            }
            _ => {}
        }
        let digits = views.saturating_sub(1).to_string().len().max(4);
        let writer = Self { out: out.to_owned(), _lock: lock, digits };
        // Marks the folder as this program's, even if writing is interrupted.
        writer.json(SETTINGS, &json!({ "version": 1, "complete": false }))?;
        Ok(writer)
    }

    /// Writes the files of photo `index`.
    pub(crate) fn photo(&self, index: usize, camera: &Camera, view: &SynthView) -> Result<(), SynthError> {
        let (w, h) = (camera.width_px, camera.height_px);
        let stem = self.stem(index);
        self.file(&format!("images/{stem}.png"), |f| png(f, view.rgb.as_flattened(), w, h, ExtendedColorType::Rgb8))?;
        for (folder, ids) in [("object_ids", &view.object), ("part_ids", &view.part)] {
            let bytes = bytemuck::cast_slice(ids);
            self.file(&format!("{folder}/{stem}.png"), |f| png(f, bytes, w, h, ExtendedColorType::L16))?;
        }
        self.file(&format!("depth/{stem}.npy"), |f| {
            let shape = [u64::from(h), u64::from(w)];
            let mut npy = npyz::WriteOptions::new().default_dtype().shape(&shape).writer(f).begin_nd()?;
            npy.extend(view.depth.iter().copied())?;
            npy.finish()
        })
    }

    /// Writes the other files. `views` holds all cameras, the indices of those with a photo, and the held-out flags.
    pub(crate) fn finish(
        &self,
        scene: &str,
        fingerprint: Option<u64>,
        options: &SynthOptions,
        views: (&[Camera], &[usize], &[bool]),
        identities: &[TrueIdentity],
        points: &[SparsePoint],
    ) -> Result<(), SynthError> {
        let identities = json!({ "version": 1, "scene": scene, "identities": identities });
        self.json("identities.json", &identities)?;
        if !points.is_empty() {
            points_ply::write(&self.out.join("points3D.ply"), points)?;
        }
        self.json(SETTINGS, &json!({ "version": 1, "scene": fingerprint, "options": options }))?;
        self.json(TRANSFORMS, &self.transforms(options, views, !points.is_empty()))
    }

    fn transforms(
        &self,
        options: &SynthOptions,
        (cameras, views, test): (&[Camera], &[usize], &[bool]),
        ply: bool,
    ) -> serde_json::Value {
        let name = |i: usize| format!("images/{}.png", self.stem(i));
        let frame = |&i: &usize| json!({ "file_path": name(i), "transform_matrix": opengl_pose(&cameras[i]) });
        let frames: Vec<_> = views.iter().map(frame).collect();
        let listed = |held: bool| views.iter().copied().filter(|&i| test[i] == held).map(name).collect::<Vec<_>>();
        // All photos of a run share one lens.
        let c = &cameras[0];
        let mut out = json!({
            "camera_model": "OPENCV",
            "w": c.width_px, "h": c.height_px,
            "fl_x": c.focal_px.x, "fl_y": c.focal_px.y,
            "cx": c.principal_px.x, "cy": c.principal_px.y,
            "k1": 0.0, "k2": 0.0, "p1": 0.0, "p2": 0.0,
            // glTF is in meters.
            "fmlgs": { "background": options.background.map(|b| f32::from(b) / 255.0), "metres_per_unit": 1.0 },
            "train_filenames": listed(false),
            "val_filenames": listed(true),
            "test_filenames": listed(true),
            "frames": frames,
        });
        if ply {
            out["ply_file_path"] = "points3D.ply".into();
        }
        out
    }

    fn stem(&self, index: usize) -> String {
        format!("{index:0digits$}", digits = self.digits)
    }

    fn json(&self, name: &str, value: &serde_json::Value) -> Result<(), SynthError> {
        Ok(atomic::write(&self.out.join(name), |w| serde_json::to_writer_pretty(w, value).map_err(Into::into))?)
    }

    fn file(
        &self,
        name: &str,
        write: impl FnOnce(&mut BufWriter<File>) -> std::io::Result<()>,
    ) -> Result<(), SynthError> {
        let path = self.out.join(name);
        let result = File::create(&path).map(BufWriter::new).and_then(|mut f| {
            write(&mut f)?;
            f.flush()
        });
        result.map_err(|source| SynthError::Write { path, source })
    }
}

fn png(f: &mut BufWriter<File>, bytes: &[u8], w: u32, h: u32, color: ExtendedColorType) -> std::io::Result<()> {
    PngEncoder::new(f).write_image(bytes, w, h, color).map_err(std::io::Error::other)
}
