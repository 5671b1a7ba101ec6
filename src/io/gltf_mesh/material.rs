//! Materials and the images that they use.

use std::borrow::Cow;
use std::collections::BTreeSet;
use std::io::Cursor;

use glam::{Vec2, Vec3, Vec4};
use gltf::json::material::AlphaMode as JsonAlphaMode;
use gltf::json::texture::{Info, MagFilter, WrappingMode};
use gltf::json::validation::Checked;

use super::{AlphaMode, File, MAX_FILE_BYTES, Material, TextureImage, TextureUse, Wrap, resource};
use crate::io::IoError;
use crate::math::format::{count, things};

const MAX_TEXTURE_SIDE_PX: u32 = 16_384;
/// Most bytes that all decoded textures together may take, and their pixels, of four bytes each.
const MAX_TEXTURE_BYTES: u64 = 1 << 30;
const MAX_TEXTURE_PX: u64 = MAX_TEXTURE_BYTES / 4;

impl Default for Material {
    /// glTF's default material, matt instead of metallic.
    fn default() -> Self {
        Self {
            base_color: Vec4::ONE,
            base_texture: None,
            emission: Vec3::ZERO,
            emission_texture: None,
            metallic: 0.0,
            roughness: 1.0,
            alpha: AlphaMode::Opaque,
            unlit: false,
        }
    }
}

/// Images decoded so far; `known` maps an image of the file to its index, `None` if it could not be read.
struct Images {
    list: Vec<TextureImage>,
    known: Vec<Option<Option<usize>>>,
    bytes_left: u64,
}

impl File<'_> {
    /// Converts all materials, the default one appended, and the images that they use.
    pub(super) fn materials(&mut self) -> Result<(Vec<Material>, Vec<TextureImage>), IoError> {
        self.check_sizes()?;
        let root = self.root;
        let known = vec![None; root.images.len()];
        let mut images = Images { list: Vec::new(), known, bytes_left: MAX_TEXTURE_BYTES };
        let mut materials = Vec::with_capacity(root.materials.len() + 1);
        for (i, material) in root.materials.iter().enumerate() {
            let place = format!("materials[{i}]");
            let pbr = &material.pbr_metallic_roughness;
            let alpha = match material.alpha_mode {
                Checked::Valid(JsonAlphaMode::Opaque) => AlphaMode::Opaque,
                Checked::Valid(JsonAlphaMode::Mask) => AlphaMode::Mask(material.alpha_cutoff.map_or(0.5, |c| c.0)),
                Checked::Valid(JsonAlphaMode::Blend) => AlphaMode::Blend,
                Checked::Invalid => return Err(self.content(place, "its alphaMode is unknown")),
            };
            let out = Material {
                base_color: Vec4::from_array(pbr.base_color_factor.0),
                base_texture: self.texture(pbr.base_color_texture.as_ref(), &place, &mut images)?,
                emission: Vec3::from_array(material.emissive_factor.0),
                emission_texture: self.texture(material.emissive_texture.as_ref(), &place, &mut images)?,
                metallic: pbr.metallic_factor.0,
                roughness: pbr.roughness_factor.0,
                alpha,
                unlit: material.extensions.as_ref().is_some_and(|e| e.unlit.is_some()),
            };
            let scalars = [out.metallic, out.roughness];
            if !(out.base_color.is_finite() && out.emission.is_finite() && scalars.iter().all(|s| s.is_finite())) {
                return Err(self.content(place, "a factor is not finite"));
            }
            materials.push(out);
        }
        materials.push(Material::default());
        Ok((materials, images.list))
    }

    fn texture(
        &mut self,
        info: Option<&Info>,
        place: &str,
        images: &mut Images,
    ) -> Result<Option<TextureUse>, IoError> {
        let Some(info) = info else { return Ok(None) };
        let root = self.root;
        let index = info.index.value();
        let texture = self.item(&root.textures, index, "textures", place)?;
        let place = format!("textures[{index}]");
        // A texture may have no plain source, only one in an extension that is not supported.
        if texture.source.value() == u32::MAX as usize {
            self.warnings.push(format!("{place}: has no PNG or JPEG source, left out"));
            return Ok(None);
        }
        let Some(image) = self.image(texture.source.value(), &place, images)? else { return Ok(None) };
        let (mut wrap, mut nearest) = ([Wrap::Repeat; 2], false);
        if let Some(sampler) = texture.sampler {
            let sampler = self.item(&root.samplers, sampler.value(), "samplers", &place)?;
            wrap = [&sampler.wrap_s, &sampler.wrap_t].map(|w| match w {
                Checked::Valid(WrappingMode::ClampToEdge) => Wrap::Clamp,
                Checked::Valid(WrappingMode::MirroredRepeat) => Wrap::Mirror,
                _ => Wrap::Repeat,
            });
            nearest = matches!(sampler.mag_filter, Some(Checked::Valid(MagFilter::Nearest)));
        }
        let transform = info.extensions.as_ref().and_then(|e| e.texture_transform.as_ref());
        let (offset, rotation_rad, scale) =
            transform.map_or(([0.0; 2], 0.0, [1.0; 2]), |t| (t.offset.0, t.rotation.0, t.scale.0));
        let (offset, scale) = (Vec2::from_array(offset), Vec2::from_array(scale));
        if !(offset.is_finite() && scale.is_finite() && rotation_rad.is_finite()) {
            return Err(self.content(place, "its KHR_texture_transform is not finite"));
        }
        let uv_set = transform.and_then(|t| t.tex_coord).unwrap_or(info.tex_coord) as usize;
        Ok(Some(TextureUse { image, uv_set, offset, rotation_rad, scale, wrap, nearest }))
    }

    /// Returns the index of the decoded image, or `None` with a warning if it is missing or does not decode.
    fn image(&mut self, index: usize, place: &str, images: &mut Images) -> Result<Option<usize>, IoError> {
        self.item(&self.root.images, index, "images", place)?;
        if let Some(known) = images.known[index] {
            return Ok(known);
        }
        let place = format!("images[{index}]");
        let is_beside = self.root.images[index].uri.is_some();
        let decoded = match self.image_bytes(index, &place) {
            Ok(bytes) => decode(&bytes, images.bytes_left).map_err(|e| e.to_string()),
            Err(e) if !is_beside || matches!(e, IoError::Outside { .. } | IoError::Syntax { .. }) => return Err(e),
            Err(e) => Err(e.to_string()),
        };
        let out = match decoded {
            Ok(image) => {
                images.bytes_left = images.bytes_left.saturating_sub(image.rgba.len() as u64 * 4);
                images.list.push(image);
                Some(images.list.len() - 1)
            }
            Err(e) => {
                self.warnings.push(format!("{place}: {e}; drawn without it"));
                None
            }
        };
        images.known[index] = Some(out);
        Ok(out)
    }

    /// Returns the encoded bytes of an image.
    fn image_bytes(&self, index: usize, place: &str) -> Result<Cow<'_, [u8]>, IoError> {
        let json = &self.root.images[index];
        match (&json.uri, json.buffer_view) {
            (Some(uri), _) => resource::load_uri(uri, place, self.path, self.folder, MAX_FILE_BYTES).map(Cow::Owned),
            (None, Some(view)) => self.view_bytes(view.value(), place).map(Cow::Borrowed),
            (None, None) => Err(self.content(place, "has neither a URI nor a bufferView")),
        }
    }

    /// Refuses textures that are too large together, before any is decoded. Unreadable images are reported later.
    fn check_sizes(&self) -> Result<(), IoError> {
        let root = self.root;
        let used: BTreeSet<usize> = root
            .materials
            .iter()
            .flat_map(|m| [m.pbr_metallic_roughness.base_color_texture.as_ref(), m.emissive_texture.as_ref()])
            .flatten()
            .filter_map(|info| Some(root.textures.get(info.index.value())?.source.value()))
            .filter(|image| *image < root.images.len())
            .collect();
        let size = |image: usize| size_of_image(&self.image_bytes(image, "").ok()?);
        let sizes: Vec<[u64; 2]> = used.into_iter().filter_map(size).collect();
        let all = sizes.iter().fold(0_u64, |all, [w, h]| all.saturating_add(w * h));
        let Some([w, h]) = sizes.iter().max_by_key(|[w, h]| w * h).filter(|_| all > MAX_TEXTURE_PX) else {
            return Ok(());
        };
        Err(self.content(
            "images",
            format!(
                "{} have {} pixels together (the largest is {w} x {h} px), and at most {} are read; make them smaller",
                things(sizes.len(), "texture"),
                count(all),
                count(MAX_TEXTURE_PX)
            ),
        ))
    }
}

/// Reads width and height from an image's header, px.
fn size_of_image(bytes: &[u8]) -> Option<[u64; 2]> {
    let reader = image::ImageReader::new(Cursor::new(bytes)).with_guessed_format().ok()?;
    reader.into_dimensions().ok().map(|(w, h)| [w, h].map(u64::from))
}

fn decode(bytes: &[u8], max_bytes: u64) -> Result<TextureImage, image::ImageError> {
    let mut reader = image::ImageReader::new(Cursor::new(bytes)).with_guessed_format()?;
    let mut limits = image::Limits::default();
    limits.max_image_width = Some(MAX_TEXTURE_SIDE_PX);
    limits.max_image_height = Some(MAX_TEXTURE_SIDE_PX);
    limits.max_alloc = Some(max_bytes);
    reader.limits(limits);
    let rgba = reader.decode()?.into_rgba8();
    let (width_px, height_px) = rgba.dimensions();
    Ok(TextureImage { width_px, height_px, rgba: rgba.pixels().map(|p| p.0).collect() })
}
