//! LaMa (Suvorov et al. 2022): inpaints missing pixels of a picture.
//!
//! The published ONNX graph takes `image` `[1, 3, S, S]` (0 to 1) and `mask` `[1, 1, S, S]` (1 = missing) and gives
//! `output` `[1, 3, S, S]` (0 to 255).

use std::path::{Path, PathBuf};

use serde::Deserialize;
use serde_json::json;

use super::network::Network;
use super::tensor::Tensor;
use super::{ModelError, manifest};
use crate::math::resize::nearest;

/// Name in the list of models, and kind in its description.
pub(crate) const LAMA: &str = "lama";
/// Side of the pictures of the listed graph, px.
const SIDE_PX: usize = 512;

#[derive(Debug, Deserialize)]
struct Metadata {
    image_size: usize,
    graphs: Graphs,
}

#[derive(Debug, Deserialize)]
struct Graphs {
    network: manifest::GraphFile,
}

/// The network; its graph is loaded at first use.
pub(crate) struct Lama {
    folder: PathBuf,
    about: Metadata,
    network: Option<Network>,
}

impl Lama {
    /// Opens the model of a description; its graph lies beside it.
    pub(crate) fn open(path: &Path) -> Result<Self, ModelError> {
        let about: Metadata = manifest::read(path, LAMA)?;
        manifest::check_pictures(path, about.image_size, [0.0; 3], [1.0; 3])?;
        Ok(Self { folder: path.parent().map(Path::to_path_buf).unwrap_or_default(), about, network: None })
    }

    /// Returns the colors (0 to 1, row by row) of a picture, of which only the `known` pixels are given. The network
    /// sees the picture squeezed into its square.
    pub(crate) fn paint(
        &mut self,
        color: &[[f32; 3]],
        size: [usize; 2],
        known: &[bool],
    ) -> Result<Vec<[f32; 3]>, ModelError> {
        let side = self.about.image_size;
        let [w, h] = size;
        let from = |i: usize| nearest(i / side, h, side) * w + nearest(i % side, w, side);
        let at: Vec<usize> = (0..side * side).map(from).collect();
        let shown = |c: usize| at.iter().map(move |&i| if known[i] { color[i][c].clamp(0.0, 1.0) } else { 0.0 });
        let image = Tensor::new(&[1, 3, side, side], (0..3).flat_map(shown).collect());
        let mask = at.iter().map(|&i| f32::from(u8::from(!known[i]))).collect();
        let mask = Tensor::new(&[1, 1, side, side], mask);
        let network = self.about.graphs.network.ready(&mut self.network, &self.folder)?;
        let output = network.run(vec![("image", image.into()), ("mask", mask.into())])?.take("output")?;
        if output.shape != [1, 3, side, side] {
            let (expected, got) = (3 * side * side, output.values.len());
            return Err(ModelError::Output { model: LAMA.into(), expected, got });
        }
        let back = |i: usize| {
            let place = nearest(i / w, side, h) * side + nearest(i % w, side, w);
            [0, 1, 2].map(|c| (output.values[c * side * side + place] / 255.0).clamp(0.0, 1.0))
        };
        Ok((0..w * h).map(back).collect())
    }
}

/// Description of a graph of LaMa in a file.
pub(super) fn description(file: &str, bytes: u64, sha256: &str) -> serde_json::Value {
    json!({
        "version": 1, "kind": LAMA, "image_size": SIDE_PX, "checkpoint_sha256": sha256,
        "graphs": { "network": { "file": file, "bytes": bytes, "sha256": sha256 } },
    })
}

#[cfg(test)]
pub(crate) mod tests {
    use super::*;

    /// Folder with a network that fills missing pixels with the mean of the rest.
    pub(crate) fn fixture() -> tempfile::TempDir {
        let folder = tempfile::tempdir().expect("folder");
        let graph = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/fixtures/networks/lama.onnx");
        let bytes = std::fs::copy(&graph, folder.path().join("lama.onnx")).expect("copied");
        let sha256 = crate::models::fetch::sha256(&graph).expect("read");
        let mut about = description("lama.onnx", bytes, &sha256);
        about["image_size"] = 32.into();
        std::fs::write(folder.path().join("lama.json"), about.to_string()).expect("written");
        folder
    }

    #[test]
    fn what_is_missing_is_painted_and_sizes_fit_the_square() {
        let folder = fixture();
        let mut lama = Lama::open(&folder.path().join("lama.json")).expect("opened");
        let (w, h) = (50, 20);
        let known: Vec<bool> = (0..w * h).map(|i| i % w >= 25).collect();
        let color: Vec<[f32; 3]> =
            (0..w * h).map(|i| if known[i] { [0.25, 0.5, 0.75] } else { [9.0, f32::NAN, 0.0] }).collect();
        let painted = lama.paint(&color, [w, h], &known).expect("painted");
        let off =
            painted.iter().flat_map(|c| [c[0] - 0.25, c[1] - 0.5, c[2] - 0.75]).fold(0.0, |a: f32, b| a.max(b.abs()));
        assert!(painted.len() == w * h && off < 1e-5, "{off}");
    }

    #[test]
    fn a_graph_of_another_size_and_a_description_of_another_model_are_refused() {
        let folder = fixture();
        let path = folder.path().join("lama.json");
        let text = std::fs::read_to_string(&path).expect("read");
        std::fs::write(&path, text.replace("32", "64")).expect("written");
        let known = [true, false, true, true];
        let mut lama = Lama::open(&path).expect("opened");
        assert!(lama.paint(&[[0.5; 3]; 4], [2, 2], &known).is_err());
        std::fs::write(&path, text.replace("\"lama\"", "\"sam\"")).expect("written");
        assert!(Lama::open(&path).is_err_and(|e| e.to_string().contains("'sam'")));
    }
}
