//! The common shape of other methods' results: Gaussians, and for each level the values from which a phrase, a click or
//! a number is answered.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use super::decoder::Decoder;
use super::product::ProductCodes;
use super::rows::FeatureRows;
use super::sparse::SparseRows;
use crate::io::trained::SceneCamera;
use crate::io::{IoError, gs_output};
use crate::scene::GaussianCloud;
use crate::scene::identity::whole_names::key;

/// Method that made a result.
#[derive(Clone, Copy, Debug, PartialEq, Eq, strum::VariantArray)]
pub enum Method {
    /// Gaussian Grouping, and Gaga, which writes the same files.
    GaussianGrouping,
    /// OmniSeg3D-GS.
    OmniSeg3d,
    /// OpenGaussian.
    OpenGaussian,
    /// Feature 3DGS.
    Feature3dgs,
    /// SAGA (Segment Any 3D Gaussians).
    Saga,
    /// LEGaussians.
    LeGaussians,
    /// LangSplat.
    LangSplat,
    /// LangSplatV2.
    LangSplatV2,
    /// Occam's LGS.
    OccamsLgs,
    /// Dr.Splat.
    DrSplat,
    /// THGS, and ReLaGS, which writes the same files.
    Thgs,
    /// splat-distiller.
    SplatDistiller,
    /// LUDVIG.
    Ludvig,
    /// GAGS.
    Gags,
    /// LaGa.
    Laga,
    /// Semantic Gaussians with features of LSeg, of 512 numbers.
    SemanticGaussians,
    /// Semantic Gaussians with features of OpenSeg, of 768 numbers.
    SemanticGaussiansOpenSeg,
}

/// OpenCLIP's ViT-B/16 of `laion2b_s34b_b88k`, by its name in the list of models.
pub const OPEN_CLIP: &str = "clip-vit-b16";
/// OpenAI's CLIP ViT-B/32, by its name in the list of models.
pub const CLIP_B32: &str = "clip-vit-b32";

/// Kind of what a method adds to the Gaussians.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum MethodKind {
    /// Classes of a classifier.
    Classes,
    /// Groups of Gaussians with an embedding each.
    Clusters,
    /// Features that are alike where Gaussians belong together.
    Affinities,
    /// Embeddings of Gaussians.
    Embeddings,
}

impl Method {
    /// Kind of what it adds to the Gaussians.
    pub fn kind(self) -> MethodKind {
        match self {
            Self::GaussianGrouping => MethodKind::Classes,
            Self::OpenGaussian | Self::Thgs | Self::Laga => MethodKind::Clusters,
            Self::OmniSeg3d | Self::Saga => MethodKind::Affinities,
            _ => MethodKind::Embeddings,
        }
    }

    /// Its name as its authors write it.
    pub fn name(self) -> &'static str {
        match self {
            Self::GaussianGrouping => "Gaussian Grouping",
            Self::OmniSeg3d => "OmniSeg3D-GS",
            Self::OpenGaussian => "OpenGaussian",
            Self::Feature3dgs => "Feature 3DGS",
            Self::Saga => "SAGA",
            Self::LeGaussians => "LEGaussians",
            Self::LangSplat => "LangSplat",
            Self::LangSplatV2 => "LangSplatV2",
            Self::OccamsLgs => "Occam's LGS",
            Self::DrSplat => "Dr.Splat",
            Self::Thgs => "THGS",
            Self::SplatDistiller => "splat-distiller",
            Self::Ludvig => "LUDVIG",
            Self::Gags => "GAGS",
            Self::Laga => "LaGa",
            Self::SemanticGaussians | Self::SemanticGaussiansOpenSeg => "Semantic Gaussians",
        }
    }

    /// Text encoder of its authors; `None` if it knows no language, or if that encoder is not in the list of models.
    pub fn encoder(self) -> Option<&'static str> {
        match self {
            Self::GaussianGrouping | Self::OmniSeg3d | Self::Saga | Self::SemanticGaussiansOpenSeg => None,
            Self::Feature3dgs | Self::SemanticGaussians => Some(CLIP_B32),
            _ => Some(OPEN_CLIP),
        }
    }

    /// Text encoder that its values need, if the list of models lacks it, in words.
    pub fn missing_encoder(self) -> Option<&'static str> {
        (self == Self::SemanticGaussiansOpenSeg).then_some("CLIP ViT-L/14 at 336 px of OpenAI")
    }
}

/// Result of another method: Gaussians with the values from which a phrase, a click or a number is answered.
#[derive(Clone, Debug)]
pub struct MethodResult {
    /// Method that made it.
    pub method: Method,
    /// File or folder that it was read from.
    pub path: PathBuf,
    /// The Gaussians, without the properties that became values.
    pub cloud: Arc<GaussianCloud>,
    /// Text encoder whose embeddings its values are compared with, by its name in the list of models; `None` if it knows
    /// no language.
    pub encoder: Option<String>,
    /// Cameras of the photos, if they lie beside it.
    pub cameras: Vec<SceneCamera>,
    /// Levels, in the order of their files.
    pub levels: Vec<ResultLevel>,
}

/// A level of a result.
#[derive(Clone, Debug)]
pub struct ResultLevel {
    /// Its name for display.
    pub name: String,
    /// Gaussians that the values belong to: those of the result, unless the method left some out at this level.
    pub cloud: Arc<GaussianCloud>,
    /// Values of the Gaussians.
    pub values: LevelValues,
}

/// Values of the Gaussians of a level.
#[derive(Clone, Debug, PartialEq)]
pub enum LevelValues {
    /// Embeddings, or codes that a decoder turns into embeddings.
    Embedded(EmbeddedLevel),
    /// Features that a classifier turns into classes.
    Classes {
        /// One for each Gaussian.
        features: FeatureRows,
        /// From a feature to a score for each class.
        classifier: Classifier,
    },
    /// Groups of Gaussians with an embedding each.
    Clusters(ClusterLevel),
    /// Features that are alike where Gaussians belong together.
    Affinity {
        /// One for each Gaussian.
        features: FeatureRows,
        /// Weights of the channels at a scale.
        gate: Option<ScaleGate>,
    },
}

/// Embeddings of Gaussians, as they are or in short.
#[derive(Clone, Debug, PartialEq)]
pub struct EmbeddedLevel {
    /// One code for each Gaussian.
    pub codes: LevelCodes,
    /// Divide a Gaussian's code by its length before it is blended.
    pub is_unit: bool,
    /// From a code, blended or not, to an embedding of any length.
    pub decoder: Decoder,
}

/// Codes of Gaussians.
#[derive(Clone, Debug, PartialEq)]
pub enum LevelCodes {
    /// All numbers.
    Dense(FeatureRows),
    /// A few weights among many.
    Sparse(SparseRows),
    /// Numbers of entries of several codebooks.
    Product(ProductCodes),
}

impl LevelCodes {
    /// Number of codes.
    pub fn len(&self) -> usize {
        match self {
            Self::Dense(rows) => rows.len(),
            Self::Sparse(rows) => rows.len(),
            Self::Product(rows) => rows.len(),
        }
    }

    /// Returns whether there are no codes.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// Numbers of a code.
    pub fn dim(&self) -> usize {
        match self {
            Self::Dense(rows) => rows.dim(),
            Self::Sparse(rows) => rows.dim(),
            Self::Product(rows) => rows.dim(),
        }
    }

    /// Copies numbers of code `i` from number `from` on into `out`.
    pub fn copy(&self, i: usize, from: usize, out: &mut [f32]) {
        match self {
            Self::Dense(rows) => rows.copy(i, from, out),
            Self::Sparse(rows) => rows.copy(i, from, out),
            Self::Product(rows) => rows.copy(i, from, out),
        }
    }
}

/// Linear classifier of features.
#[derive(Clone, Debug, PartialEq)]
pub struct Classifier {
    /// `[classes, dim]`.
    pub weight: FeatureRows,
    /// Bias of each class.
    pub bias: Vec<f32>,
    /// Names of classes that have one.
    pub names: BTreeMap<u32, String>,
}

impl Classifier {
    /// The class of this name; letter case and articles in front do not count.
    pub fn named(&self, name: &str) -> Option<u32> {
        self.names.iter().find(|(_, own)| key(own) == key(name)).map(|(class, _)| *class)
    }
}

/// Gaussians in groups.
#[derive(Clone, Debug, PartialEq)]
pub struct ClusterLevel {
    /// Group of each Gaussian; `None` for those in no group.
    pub of: Vec<Option<u32>>,
    /// Embedding of each group, or its several embeddings one after the other; all zeros for those that have none.
    pub features: FeatureRows,
    /// Weights of the embeddings of groups that have several; `None` if each group has one.
    pub several: Option<Descriptors>,
    /// Groups in which a method looks for more of what it found; OpenGaussian's leaves.
    pub leaves: Option<Leaves>,
}

/// LaGa's several embeddings of each group.
#[derive(Clone, Debug, PartialEq)]
pub struct Descriptors {
    /// Embeddings of each group.
    pub each: usize,
    /// Weight of each embedding; 0 for those that fill up a group.
    pub weights: Vec<f32>,
}

impl ClusterLevel {
    /// Number of groups.
    pub fn count(&self) -> usize {
        self.features.len() / self.each()
    }

    /// Embeddings of each group.
    pub fn each(&self) -> usize {
        self.several.as_ref().map_or(1, |several| several.each.max(1))
    }

    /// Embeddings of group `k`, by their rows, each with its weight.
    pub fn weighted(&self, k: usize) -> impl Iterator<Item = (usize, f32)> {
        let each = self.each();
        let weight = |row: usize| self.several.as_ref().map_or(1.0, |several| several.weights[row]);
        (k * each..(k + 1) * each).map(move |row| (row, weight(row)))
    }
}

/// OpenGaussian's small clusters within its large ones.
#[derive(Clone, Debug, PartialEq)]
pub struct Leaves {
    /// Small clusters of each large one.
    pub in_root: usize,
    /// Instance feature of each small cluster, if its codebook is there.
    pub codes: Option<FeatureRows>,
}

/// SAGA's weights of channels at a scale: `sigmoid(weight * scale + bias)`.
#[derive(Clone, Debug, PartialEq)]
pub struct ScaleGate {
    /// One for each channel.
    pub weight: Vec<f32>,
    /// One for each channel.
    pub bias: Vec<f32>,
}

impl ScaleGate {
    /// Weights of the channels at a scale from 0 (details) to 1 (the largest things).
    pub fn at(&self, scale: f32) -> Vec<f32> {
        let one = |(w, b): (&f32, &f32)| 1.0 / (1.0 + (-(w * scale + b)).exp());
        self.weight.iter().zip(&self.bias).map(one).collect()
    }
}

impl MethodResult {
    /// Assembles a result whose levels all have the result's Gaussians; `splat` is the file of the Gaussians.
    pub(crate) fn of_one_cloud(
        method: Method,
        splat: &Path,
        cloud: GaussianCloud,
        levels: Vec<(String, LevelValues)>,
    ) -> Result<Self, IoError> {
        let cloud = Arc::new(cloud);
        let level = |(name, values)| ResultLevel { name, cloud: cloud.clone(), values };
        let levels: Vec<ResultLevel> = levels.into_iter().map(level).collect();
        Self::new(method, splat, cloud, levels)
    }

    /// Assembles a result, with the cameras beside it.
    ///
    /// # Errors
    /// If a level has not one value for each of its Gaussians.
    pub(crate) fn new(
        method: Method,
        splat: &Path,
        cloud: Arc<GaussianCloud>,
        levels: Vec<ResultLevel>,
    ) -> Result<Self, IoError> {
        for level in &levels {
            let (have, want) = (level.values.len(), level.cloud.len());
            if have != want {
                let name = &level.name;
                let reason = format!(
                    "level '{name}' has values of {have} Gaussians, but there are {want}; the files are not of one run"
                );
                return Err(IoError::syntax(splat, method.name(), reason));
            }
        }
        let beside = gs_output::beside(splat).unwrap_or_default();
        let encoder = method.encoder().map(str::to_owned);
        Ok(Self { method, path: splat.into(), cloud, encoder, cameras: beside.cameras, levels })
    }
}

impl LevelValues {
    /// Number of Gaussians that have values.
    pub fn len(&self) -> usize {
        match self {
            Self::Embedded(level) => level.codes.len(),
            Self::Classes { features, .. } | Self::Affinity { features, .. } => features.len(),
            Self::Clusters(level) => level.of.len(),
        }
    }

    /// Returns whether there are no Gaussians.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// Numbers of a Gaussian's code; `None` if Gaussians have numbers of clusters instead.
    pub fn code_dim(&self) -> Option<usize> {
        match self {
            Self::Embedded(level) => Some(level.codes.dim()),
            Self::Classes { features, .. } | Self::Affinity { features, .. } => Some(features.dim()),
            Self::Clusters(_) => None,
        }
    }

    /// Copies the code of Gaussian `i` into `out`, as the method stores it; leaves `out` as it is without codes.
    pub fn copy_code(&self, i: usize, out: &mut [f32]) {
        match self {
            Self::Embedded(level) => level.codes.copy(i, 0, out),
            Self::Classes { features, .. } | Self::Affinity { features, .. } => features.copy(i, 0, out),
            Self::Clusters(_) => {}
        }
    }

    /// Numbers of a Gaussian's embedding; `None` if the method knows no language.
    pub fn embedding_dim(&self) -> Option<usize> {
        match self {
            Self::Embedded(level) => Some(level.decoder.outputs()),
            Self::Clusters(level) => Some(level.features.dim()),
            Self::Classes { .. } | Self::Affinity { .. } => None,
        }
    }
}
