//! Materials and the images that they use.

use std::io::Cursor;

use glam::{Vec2, Vec3, Vec4};
use gltf::json::material::AlphaMode as JsonAlphaMode;
use gltf::json::texture::{Info, MagFilter, WrappingMode};
use gltf::json::validation::Checked;

use super::{AlphaMode, File, MAX_FILE_BYTES, Material, TextureImage, TextureUse, Wrap, resource};
use crate::io::IoError;

const MAX_TEXTURE_SIDE_PX: u32 = 16_384;
/// Most bytes that all decoded textures together may take.
const MAX_TEXTURE_BYTES: u64 = 1 << 30;

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

/// Images decoded so far: by index in the file, where that image could be read.
struct Images {
    list: Vec<TextureImage>,
    known: Vec<Option<Option<usize>>>,
    bytes_left: u64,
}

impl File<'_> {
    /// All materials, the default one appended, and the images that they use.
    pub(super) fn materials(&mut self) -> Result<(Vec<Material>, Vec<TextureImage>), IoError> {
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

    /// Index of the decoded image, or `None` with a warning where it is missing or does not decode.
    fn image(&mut self, index: usize, place: &str, images: &mut Images) -> Result<Option<usize>, IoError> {
        self.item(&self.root.images, index, "images", place)?;
        if let Some(known) = images.known[index] {
            return Ok(known);
        }
        let place = format!("images[{index}]");
        let json = &self.root.images[index];
        let loaded;
        let bytes: &[u8] = match (&json.uri, json.buffer_view) {
            (Some(uri), _) => match resource::load_uri(uri, &place, self.path, self.folder, MAX_FILE_BYTES) {
                Ok(bytes) => {
                    loaded = bytes;
                    &loaded
                }
                Err(e @ (IoError::Outside { .. } | IoError::Syntax { .. })) => return Err(e),
                Err(e) => {
                    self.warnings.push(format!("{place}: {e}; drawn without it"));
                    images.known[index] = Some(None);
                    return Ok(None);
                }
            },
            (None, Some(view)) => self.view_bytes(view.value(), &place)?,
            (None, None) => return Err(self.content(place, "has neither a URI nor a bufferView")),
        };
        let decoded = decode(bytes, images.bytes_left);
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
