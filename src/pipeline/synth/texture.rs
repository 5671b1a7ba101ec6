//! Texture lookup in linear light, with mip maps.

use glam::{Vec2, Vec4};

use crate::io::gltf_mesh::{TextureImage, TextureUse, Wrap};
use crate::math::srgb;

pub(crate) struct Texture {
    levels: Vec<TextureImage>,
    decode: [f32; 256],
}

impl Texture {
    /// Builds the smaller resolutions.
    pub(crate) fn new(image: &TextureImage) -> Self {
        let decode = std::array::from_fn(|i| srgb::linear(i as f32 / 255.0));
        let mut texture = Self { levels: vec![image.clone()], decode };
        while let Some(last) = texture.levels.last().filter(|l| l.width_px > 1 || l.height_px > 1) {
            let (w, h) = ((last.width_px / 2).max(1), (last.height_px / 2).max(1));
            let level = texture.levels.len() - 1;
            let rgba = (0..h)
                .flat_map(|y| (0..w).map(move |x| (x, y)))
                .map(|(x, y)| {
                    // Every texel that the smaller one covers; three along a side where it is odd.
                    let span = |i: u32, n: u32, full: u32| (i * full / n)..((i + 1) * full).div_ceil(n);
                    let (mut sum, mut count) = (Vec4::ZERO, 0.0);
                    for v in span(y, h, last.height_px) {
                        for u in span(x, w, last.width_px) {
                            sum += texture.texel(level, u, v);
                            count += 1.0;
                        }
                    }
                    let mean = sum / count;
                    let alpha = (mean.w * 255.0 + 0.5) as u8;
                    [srgb::byte(mean.x), srgb::byte(mean.y), srgb::byte(mean.z), alpha]
                })
                .collect();
            texture.levels.push(TextureImage { width_px: w, height_px: h, rgba });
        }
        texture
    }

    /// Texels of the full resolution.
    pub(crate) fn texels(&self) -> f32 {
        self.levels[0].width_px as f32 * self.levels[0].height_px as f32
    }

    /// Mean color, linear.
    pub(crate) fn mean(&self) -> Vec4 {
        self.texel(self.levels.len() - 1, 0, 0)
    }

    /// Linear color and alpha at `uv`, filtered over `footprint` texels of the full resolution along a side.
    pub(crate) fn sample(&self, usage: &TextureUse, uv: Vec2, footprint: f32) -> Vec4 {
        if !uv.is_finite() {
            return self.mean();
        }
        if footprint <= 1.0 {
            return self.bilinear(0, usage, uv);
        }
        let level = footprint.log2().min((self.levels.len() - 1) as f32);
        let lower = level as usize;
        let a = self.bilinear(lower, usage, uv);
        if lower + 1 >= self.levels.len() {
            return a;
        }
        a.lerp(self.bilinear(lower + 1, usage, uv), level.fract())
    }

    fn bilinear(&self, level: usize, usage: &TextureUse, uv: Vec2) -> Vec4 {
        let image = &self.levels[level];
        let size = Vec2::new(image.width_px as f32, image.height_px as f32);
        let [wrap_u, wrap_v] = usage.wrap;
        if usage.nearest && level == 0 {
            let p = (uv * size).floor();
            return self.texel(level, wrapped(p.x, image.width_px, wrap_u), wrapped(p.y, image.height_px, wrap_v));
        }
        let p = uv * size - 0.5;
        let base = p.floor();
        let f = p - base;
        let u = [0.0, 1.0].map(|d| wrapped(base.x + d, image.width_px, wrap_u));
        let v = [0.0, 1.0].map(|d| wrapped(base.y + d, image.height_px, wrap_v));
        let row = |v: u32| self.texel(level, u[0], v).lerp(self.texel(level, u[1], v), f.x);
        row(v[0]).lerp(row(v[1]), f.y)
    }

    fn texel(&self, level: usize, x: u32, y: u32) -> Vec4 {
        let image = &self.levels[level];
        let [r, g, b, a] = image.rgba[y as usize * image.width_px as usize + x as usize];
        let d = |c: u8| self.decode[usize::from(c)];
        Vec4::new(d(r), d(g), d(b), f32::from(a) / 255.0)
    }
}

/// Texel index of position `i` along a side of `n` texels.
fn wrapped(i: f32, n: u32, wrap: Wrap) -> u32 {
    let i = i as i64;
    let n = i64::from(n);
    let at = match wrap {
        Wrap::Repeat => i.rem_euclid(n),
        Wrap::Clamp => i.clamp(0, n - 1),
        Wrap::Mirror => {
            let k = i.rem_euclid(2 * n);
            if k < n { k } else { 2 * n - 1 - k }
        }
    };
    at as u32
}
