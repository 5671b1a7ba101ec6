//! Textures, painted by arithmetic that gives the same bytes on every machine (no library
//! functions but the square root).

use image::{ExtendedColorType, ImageEncoder, codecs::png};

/// A square picture, sRGB.
#[derive(Clone, Debug, PartialEq, Eq, Hash)]
pub struct Picture {
    /// Side in px.
    pub side_px: u32,
    /// Row-major.
    pub rgb: Vec<[u8; 3]>,
}

impl Picture {
    /// Paints `color(u, v)` with u, v in 0..1. Colours are rounded to 6 bits, which halves the file
    /// and cannot be seen.
    pub fn paint(side_px: u32, color: impl Fn(f32, f32) -> [f32; 3]) -> Self {
        let at = |i: u32| (i as f32 + 0.5) / side_px as f32;
        let byte = |c: f32| ((c.clamp(0.0, 255.0) / 4.0 + 0.5) as u8).min(63) << 2;
        let rgb = (0..side_px * side_px).map(|i| color(at(i % side_px), at(i / side_px)).map(byte)).collect();
        Self { side_px, rgb }
    }

    /// As a PNG file.
    pub fn png(&self) -> Result<Vec<u8>, image::ImageError> {
        let mut bytes = Vec::new();
        png::PngEncoder::new_with_quality(&mut bytes, png::CompressionType::Best, png::FilterType::Adaptive)
            .write_image(self.rgb.as_flattened(), self.side_px, self.side_px, ExtendedColorType::Rgb8)?;
        Ok(bytes)
    }
}

/// From `a` to `b`.
pub fn mix(a: [f32; 3], b: [f32; 3], t: f32) -> [f32; 3] {
    let t = t.clamp(0.0, 1.0);
    std::array::from_fn(|i| a[i] + (b[i] - a[i]) * t)
}

/// 0 below `from`, 1 above `to`, smooth between.
pub fn step(from: f32, to: f32, x: f32) -> f32 {
    let t = ((x - from) / (to - from)).clamp(0.0, 1.0);
    t * t * (3.0 - 2.0 * t)
}

/// A number in 0..1 for a lattice point.
pub fn hash(x: i32, y: i32, seed: u32) -> f32 {
    let mut h =
        (x as u32).wrapping_mul(0x8da6_b343) ^ (y as u32).wrapping_mul(0xd816_3841) ^ seed.wrapping_mul(0xcb1a_b31f);
    h = (h ^ (h >> 15)).wrapping_mul(0x2c1b_3c6d);
    h = (h ^ (h >> 12)).wrapping_mul(0x297a_2d39);
    (h ^ (h >> 15)) as f32 / 4_294_967_296.0
}

/// Smooth noise in 0..1 with one value per unit; repeats every `period` units.
pub fn noise(x: f32, y: f32, period: i32, seed: u32) -> f32 {
    let (fx, fy) = (x.floor(), y.floor());
    let (tx, ty) = (step(0.0, 1.0, x - fx), step(0.0, 1.0, y - fy));
    let at = |dx: i32, dy: i32| hash((fx as i32 + dx).rem_euclid(period), (fy as i32 + dy).rem_euclid(period), seed);
    let row = |dy: i32| at(0, dy) + (at(1, dy) - at(0, dy)) * tx;
    row(0) + (row(1) - row(0)) * ty
}

/// Four octaves of noise, in 0..1; repeats every `period` units.
pub fn cloud(x: f32, y: f32, period: i32, seed: u32) -> f32 {
    let (mut sum, mut weight, mut scale) = (0.0, 0.5, 1);
    for octave in 0..4 {
        let s = scale as f32;
        sum += weight * noise(x * s, y * s, period * scale, seed + octave);
        weight *= 0.5;
        scale *= 2;
    }
    sum / 0.9375
}

/// A wave in 0..1 with period 1.
pub fn wave(x: f32) -> f32 {
    let t = (x - x.floor()) * 2.0 - 1.0;
    step(0.0, 1.0, t.abs())
}

/// Planks with grain along u; `planks` of them across v.
pub fn wood(side_px: u32, planks: u32, light: [f32; 3], dark: [f32; 3], seed: u32) -> Picture {
    Picture::paint(side_px, |u, v| {
        let across = v * planks as f32;
        let plank = across as i32;
        let shift = hash(plank, 7, seed) * 8.0;
        let warp = cloud(u * 3.0 + shift, across * 1.5, 64, seed) * 2.2;
        let rings = wave(across * 5.0 + warp * 1.6 + shift);
        let fibre = noise(u * 14.0 + shift, across * 46.0, 1024, seed + 9);
        let tone = 0.5 * rings + 0.34 * fibre + 0.32 * hash(plank, 3, seed) - 0.08;
        let gap = step(0.0, 0.035, (across - across.floor()).min(across.ceil() - across));
        mix(mix([42.0, 26.0, 16.0], dark, 0.35), mix(light, dark, tone), 0.25 + 0.75 * gap)
    })
}

/// Threads over and under each other, in two colors.
pub fn weave(side_px: u32, threads: u32, warp: [f32; 3], weft: [f32; 3], seed: u32) -> Picture {
    Picture::paint(side_px, |u, v| {
        let (x, y) = (u * threads as f32, v * threads as f32);
        let over = (x as i32 + y as i32) % 2 == 0;
        let (across, color) = if over { (x - x.floor(), warp) } else { (y - y.floor(), weft) };
        let round = 1.0 - (2.0 * across - 1.0) * (2.0 * across - 1.0);
        let fuzz = 0.86 + 0.24 * cloud(u * 8.0, v * 8.0, 8, seed);
        color.map(|c| c * (0.6 + 0.4 * round) * fuzz)
    })
}

/// Speckles of glaze on a ground.
pub fn speckle(side_px: u32, ground: [f32; 3], spot: [f32; 3], seed: u32) -> Picture {
    Picture::paint(side_px, |u, v| {
        let (x, y) = (u * 30.0, v * 30.0);
        let mut near: f32 = 9.0;
        for dy in -1..=1 {
            for dx in -1..=1 {
                let (cx, cy) = (x.floor() as i32 + dx, y.floor() as i32 + dy);
                let (hx, hy) = (cx.rem_euclid(30), cy.rem_euclid(30));
                let (px, py) = (cx as f32 + hash(hx, hy, seed), cy as f32 + hash(hx, hy, seed + 1));
                let radius = 0.12 + 0.3 * hash(hx, hy, seed + 2) * hash(hx, hy, seed + 3);
                near = near.min(((x - px) * (x - px) + (y - py) * (y - py)).sqrt() / radius);
            }
        }
        let shade = 0.93 + 0.14 * cloud(u * 6.0, v * 6.0, 6, seed + 5);
        mix(spot, ground, step(0.7, 1.15, near)).map(|c| c * shade)
    })
}

/// Veins through stone.
pub fn marble(side_px: u32, ground: [f32; 3], vein: [f32; 3], seed: u32) -> Picture {
    Picture::paint(side_px, |u, v| {
        let bend = cloud(u * 4.0, v * 4.0, 4, seed) * 3.2;
        let line = wave(u * 2.0 + v + bend);
        let fine = cloud(u * 10.0, v * 10.0, 10, seed + 20);
        mix(vein, ground, step(0.02, 0.34, line) * (0.75 + 0.5 * fine))
    })
}

/// Short fur.
pub fn fur(side_px: u32, light: [f32; 3], dark: [f32; 3], seed: u32) -> Picture {
    Picture::paint(side_px, |u, v| {
        let bend = noise(u * 12.0, v * 12.0, 12, seed) * 0.9;
        let hair = noise(u * 96.0 + bend * 8.0, v * 26.0, 1024, seed + 1);
        mix(dark, light, 0.55 * hair + 0.6 * cloud(u * 8.0, v * 8.0, 8, seed + 2) - 0.05)
    })
}

/// A leaf: midrib along v, side veins, lighter rim.
pub fn leaf(side_px: u32, green: [f32; 3], vein: [f32; 3], seed: u32) -> Picture {
    Picture::paint(side_px, |u, v| {
        let across = (u - 0.5).abs() * 2.0;
        let rib = 1.0 - step(0.03, 0.09, across);
        let side = 1.0 - step(0.05, 0.2, wave((v - across * 0.22) * 9.0));
        let tone = 0.82 + 0.34 * cloud(u * 6.0, v * 6.0, 6, seed);
        mix(green.map(|c| c * tone), vein, (rib + 0.5 * side * (1.0 - across)).min(1.0) * 0.75)
    })
}

/// Bands of color along v, with soft cloth shading.
pub fn bands(side_px: u32, colors: &[[f32; 3]], seed: u32) -> Picture {
    Picture::paint(side_px, |u, v| {
        let at = v * colors.len() as f32;
        let i = (at as usize).min(colors.len() - 1);
        let shade = 0.88 + 0.24 * cloud(u * 16.0, v * 16.0, 16, seed);
        colors[i].map(|c| c * shade)
    })
}
