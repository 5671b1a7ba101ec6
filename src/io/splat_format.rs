//! Formats that Gaussians are written in, each by its ending, and the losses of each.

use std::borrow::Cow;
use std::io::{self, Write};
use std::path::Path;

use glam::DVec3;
use serde::{Deserialize, Serialize};
use strum::VariantArray;

use super::atomic::{self, WriteProgress};
use super::{IoError, compressed_ply, khr_gltf, shift, sog, splat, splat_ply, spz};
use crate::scene::{GaussianCloud, SplatRenderMode};

/// A format for Gaussians.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, clap::ValueEnum, strum::VariantArray)]
pub enum SplatFormat {
    /// Any splat viewer's, without loss
    Ply,
    /// A quarter of a .ply, of PlayCanvas and SuperSplat
    #[value(name = "compressed.ply")]
    CompressedPly,
    /// Niantic's, a tenth of a .ply
    Spz,
    /// PlayCanvas's, a tenth of a .ply
    Sog,
    /// SOG's pictures in a folder
    #[value(skip)]
    SogFolder,
    /// The first viewers' on the web, one color from everywhere
    Splat,
    /// glTF with KHR_gaussian_splatting
    Glb,
    /// The same as text
    Gltf,
}

impl SplatFormat {
    /// Returns the format of a file name; of `.json` files, only a SOG's `meta.json`.
    pub(crate) fn of(path: &Path) -> Option<Self> {
        let name = path.file_name()?.to_string_lossy().to_lowercase();
        let fits = |format: &Self| match format {
            Self::SogFolder => name == sog::META_FILE,
            _ => name.ends_with(format.ending()),
        };
        // The longest ending counts: a compressed .ply ends in .ply too.
        Self::VARIANTS.iter().filter(|format| fits(format)).max_by_key(|format| format.ending().len()).copied()
    }

    /// Ending of its files, or their name.
    pub(crate) fn ending(self) -> &'static str {
        match self {
            Self::Ply => ".ply",
            Self::CompressedPly => ".compressed.ply",
            Self::Spz => ".spz",
            Self::Sog => ".sog",
            Self::SogFolder => sog::META_FILE,
            Self::Splat => ".splat",
            Self::Glb => ".glb",
            Self::Gltf => ".gltf",
        }
    }

    /// Name in a list of formats.
    pub(crate) fn title(self) -> &'static str {
        match self {
            Self::Ply => "PLY (.ply)",
            Self::CompressedPly => "Compressed PLY (.compressed.ply)",
            Self::Spz => "SPZ (.spz)",
            Self::Sog => "SOG (.sog)",
            Self::SogFolder => "SOG pictures (meta.json)",
            Self::Splat => "Splat (.splat)",
            Self::Glb => "glTF (.glb)",
            Self::Gltf => "glTF as text (.gltf)",
        }
    }

    /// Description for a user who chooses a format.
    pub(crate) fn about(self) -> &'static str {
        match self {
            Self::Ply => "Read by every viewer and editor of Gaussians.",
            Self::CompressedPly => "PlayCanvas and SuperSplat. Quick to load.",
            Self::Spz => "Niantic and Scaniverse. Small, for phones and the web.",
            Self::Sog => "PlayCanvas. Small, for the web; slow to write.",
            Self::SogFolder => "The same as SOG, as pictures in a folder.",
            Self::Splat => "The first viewers on the web.",
            Self::Glb => "glTF with KHR_gaussian_splatting, in one file.",
            Self::Gltf => "The same as .glb, as text.",
        }
    }

    /// All endings, for display.
    pub(crate) fn endings() -> String {
        Self::VARIANTS.iter().map(|format| format.ending()).collect::<Vec<_>>().join(", ")
    }

    /// Rounded values, in a few words; `None` if all numbers are floats.
    pub(crate) fn rounding(self) -> Option<&'static str> {
        match self {
            Self::Ply | Self::Glb | Self::Gltf => None,
            Self::CompressedPly => Some("positions and scales in 11 bits of each chunk of 256, colors in 8"),
            Self::Spz => Some("positions in 24 bits, scales in steps of 1/16, colors in 8 bits, harmonics in 4 or 5"),
            Self::Sog | Self::SogFolder => {
                Some("positions in 16 bits, scales and colors of 256 values, harmonics of a palette")
            }
            Self::Splat => Some("rotations and colors in 8 bits"),
        }
    }

    /// Lists properties of this cloud that are left out or do not fit, each in a few words.
    pub(crate) fn left_out(self, cloud: &GaussianCloud) -> Vec<String> {
        let mut all = Vec::new();
        let floats = self.rounding().is_none();
        if self == Self::Splat && cloud.sh_degree > 0 {
            all.push("view-dependent color".to_owned());
        }
        let extras = cloud.extras.iter().map(|e| e.name.as_str()).filter(|_| !floats);
        // The program's own properties say which Gaussians belong to what.
        let (own, others): (Vec<&str>, Vec<&str>) = extras.partition(|name| name.starts_with("fmlgs_"));
        if !own.is_empty() {
            all.push("objects and parts".to_owned());
        }
        if !others.is_empty() {
            all.push(format!("the properties {}", others.join(", ")));
        }
        let mode = match (self, cloud.render_mode) {
            (_, SplatRenderMode::Plain) | (Self::Ply | Self::CompressedPly | Self::Sog | Self::SogFolder, _) => None,
            (Self::Spz, SplatRenderMode::Mip) => None,
            (_, SplatRenderMode::Mip) => Some("anti-aliasing flag (Mip-Splatting)"),
            (_, SplatRenderMode::Surfels) => Some("flag of surfels"),
        };
        all.extend(mode.map(str::to_owned));
        if self == Self::Splat && self.shift(cloud).is_some() {
            all.push("where zero is, which has to be added to its places again".to_owned());
        }
        all
    }

    /// Prepares the cloud for writing: with `-y` upward if the format cannot state the up direction.
    pub(crate) fn prepared(self, cloud: &GaussianCloud) -> Cow<'_, GaussianCloud> {
        match (self, cloud.up) {
            (Self::Ply, _) | (_, None) => Cow::Borrowed(cloud),
            _ => Cow::Owned(cloud.clone().upright()),
        }
    }

    /// Shift of a [`Self::prepared`] cloud that is far from zero; none for glTF, which has nodes for that.
    pub(crate) fn shift(self, cloud: &GaussianCloud) -> Option<DVec3> {
        if matches!(self, Self::Glb | Self::Gltf) { None } else { shift::of(cloud) }
    }

    /// Bytes of the file, or of all files of a folder, that was written at `path`; 0 if it is gone.
    pub(crate) fn bytes(self, path: &Path) -> u64 {
        let bytes = |path: &Path| std::fs::metadata(path).map_or(0, |m| m.len());
        match self {
            Self::SogFolder => sog::files_of(path).iter().map(|file| bytes(file)).sum(),
            _ => bytes(path),
        }
    }

    /// Writes the cloud, replacing the file atomically. `progress` gets the number of Gaussians written.
    ///
    /// # Errors
    /// If the cloud is not valid, the format cannot hold it, `progress` asks to stop or the file cannot be written.
    pub(crate) fn write(
        self,
        path: &Path,
        cloud: &GaussianCloud,
        progress: &mut WriteProgress<'_>,
    ) -> Result<(), IoError> {
        if self == Self::Ply {
            splat_ply::check(path, cloud)?;
        } else {
            cloud.validate().map_err(|cause| IoError::Cloud { path: path.into(), cause })?;
            if cloud.is_empty() {
                let remedy = "a .ply can be empty";
                return Err(IoError::Unsupported { path: path.into(), what: "no Gaussians at all".into(), remedy });
            }
        }
        let cloud = &*self.prepared(cloud);
        match self {
            Self::SogFolder => sog::write_folder(path, cloud, progress),
            _ => atomic::write(path, |w| self.encode(w, cloud, progress)),
        }
    }

    fn encode(self, out: &mut dyn Write, cloud: &GaussianCloud, progress: &mut WriteProgress<'_>) -> io::Result<()> {
        match self {
            Self::Ply => splat_ply::encode_near_zero(out, cloud, progress),
            Self::CompressedPly => compressed_ply::encode(out, cloud, progress),
            Self::Spz => spz::encode(out, cloud, progress),
            Self::Sog | Self::SogFolder => sog::encode(out, cloud, progress),
            Self::Splat => splat::encode(out, cloud, progress),
            Self::Glb => khr_gltf::encode_binary(out, cloud, progress),
            Self::Gltf => khr_gltf::encode_text(out, cloud, progress),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_ask_for_formats() {
        let of = |name: &str| SplatFormat::of(Path::new(name));
        for (name, format) in [
            ("a.ply", SplatFormat::Ply),
            ("b/A.Compressed.PLY", SplatFormat::CompressedPly),
            ("meta.json", SplatFormat::SogFolder),
            ("a.gltf", SplatFormat::Gltf),
            ("a.spz", SplatFormat::Spz),
        ] {
            assert_eq!(of(name), Some(format), "{name}");
        }
        assert!(["a.json", "ply", "ameta.json", "a.ksplat", ""].iter().all(|name| of(name).is_none()));
    }
}
