//! RGB to the planes of video and back: BT.709, limited range, color at half the size.

/// The planes of a picture of even sides, each row by row.
pub(super) struct YuvPlanes {
    pub(super) width: usize,
    pub(super) height: usize,
    pub(super) y: Vec<u8>,
    pub(super) u: Vec<u8>,
    pub(super) v: Vec<u8>,
}

/// BT.709's weights of red and blue in luma (ITU-R BT.709-6, 3.2); green has the rest.
const RED: f32 = 0.2126;
const BLUE: f32 = 0.0722;

impl YuvPlanes {
    pub(super) fn new(width: usize, height: usize) -> Self {
        let color = vec![128; width / 2 * (height / 2)];
        Self { width, height, y: vec![16; width * height], u: color.clone(), v: color }
    }

    /// Converts the picture `rgb` with `row_px` pixels a row, cropped to the planes.
    ///
    /// A color sample lies on the left column of its four pixels, halfway between their rows (H.264's default), so the
    /// columns weigh 1 : 2 : 1 about it.
    pub(super) fn fill(&mut self, rgb: &[u8], row_px: usize) {
        let color_row = self.width / 2;
        let pixel = |row: usize, column: usize| {
            let at = (row * row_px + column) * 3;
            [f32::from(rgb[at]), f32::from(rgb[at + 1]), f32::from(rgb[at + 2])]
        };
        for row in 0..self.height {
            for column in 0..self.width {
                // 219 steps from 16 to 235.
                self.y[row * self.width + column] = byte(16.0 + luma(pixel(row, column)) * (219.0 / 255.0));
            }
        }
        for row in 0..self.height / 2 {
            for column in 0..color_row {
                let middle = 2 * column;
                let columns = [(middle.saturating_sub(1), 0.125), (middle, 0.25), (middle + 1, 0.125)];
                let mut mean = [0.0_f32; 3];
                for (c, weight) in columns {
                    for r in [2 * row, 2 * row + 1] {
                        for (sum, value) in mean.iter_mut().zip(pixel(r, c)) {
                            *sum += weight * value;
                        }
                    }
                }
                let y = luma(mean);
                // 224 steps from 16 to 240.
                let color =
                    |value: f32, weight: f32| byte(128.0 + (value - y) / (2.0 - 2.0 * weight) * (224.0 / 255.0));
                self.u[row * color_row + column] = color(mean[2], BLUE);
                self.v[row * color_row + column] = color(mean[0], RED);
            }
        }
    }
}

/// Planes of a decoded picture, with the bytes of a row of luma and of color.
#[derive(Clone, Copy)]
pub(super) struct YuvView<'a> {
    pub(super) planes: [&'a [u8]; 3],
    pub(super) rows: [usize; 3],
    pub(super) size_px: (usize, usize),
}

impl YuvView<'_> {
    /// Luma without gaps between rows, 0 to 255 for black to white.
    pub(super) fn luma(&self) -> Vec<f32> {
        let (width, height) = self.size_px;
        let row = |y: usize| self.planes[0].iter().skip(y * self.rows[0]).take(width);
        (0..height).flat_map(|y| row(y).map(|v| (f32::from(*v) - 16.0) * (255.0 / 219.0))).collect()
    }

    /// RGB row by row. A pixel takes the color sample of its block.
    pub(super) fn rgb(&self) -> Vec<u8> {
        let (width, height) = self.size_px;
        let at = |plane: usize, x: usize, y: usize| {
            self.planes[plane].get(y * self.rows[plane] + x).map_or(128.0, |v| f32::from(*v))
        };
        let mut rgb = Vec::with_capacity(3 * width * height);
        for y in 0..height {
            for x in 0..width {
                let luma = (at(0, x, y) - 16.0) / 219.0;
                let color =
                    |plane: usize, weight: f32| luma + (at(plane, x / 2, y / 2) - 128.0) / 224.0 * (2.0 - 2.0 * weight);
                let (r, b) = (color(2, RED), color(1, BLUE));
                let g = (luma - RED * r - BLUE * b) / (1.0 - RED - BLUE);
                rgb.extend([r, g, b].map(|v| byte(255.0 * v.clamp(0.0, 1.0))));
            }
        }
        rgb
    }
}

pub(super) fn luma([r, g, b]: [f32; 3]) -> f32 {
    RED * r + (1.0 - RED - BLUE) * g + BLUE * b
}

fn byte(value: f32) -> u8 {
    (value + 0.5) as u8
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn colors_are_those_of_the_standard() {
        // Y, Cb, Cr of 8-bit BT.709 limited range.
        let cases = [
            ([0, 0, 0], [16, 128, 128]),
            ([255, 255, 255], [235, 128, 128]),
            ([255, 0, 0], [63, 102, 240]),
            ([0, 255, 0], [173, 42, 26]),
            ([0, 0, 255], [32, 240, 118]),
            ([128, 128, 128], [126, 128, 128]),
        ];
        for (rgb, [y, u, v]) in cases {
            let mut planes = YuvPlanes::new(4, 2);
            planes.fill(&rgb.repeat(8), 4);
            let view = YuvView { planes: [&planes.y, &planes.u, &planes.v], rows: [4, 2, 2], size_px: (4, 2) };
            let back = view.rgb();
            let off = |(a, b): (&u8, u8)| a.abs_diff(b);
            assert!(back.iter().zip(rgb.repeat(8)).map(off).max() <= Some(2), "{rgb:?} {back:?}");
            assert!((view.luma()[5] - luma(rgb.map(f32::from))).abs() < 1.0, "{rgb:?}");
            assert_eq!((planes.y, planes.u, planes.v), (vec![y; 8], vec![u; 2], vec![v; 2]), "{rgb:?}");
        }
    }

    #[test]
    fn a_last_odd_column_and_row_are_left_out() {
        let mut rgb = vec![0; 5 * 3 * 3];
        for (i, px) in rgb.chunks_exact_mut(3).enumerate() {
            px.fill(if i % 5 == 4 || i >= 10 { 255 } else { 90 });
        }
        let mut planes = YuvPlanes::new(4, 2);
        planes.fill(&rgb, 5);
        assert_eq!(planes.y, vec![93; 8]);
    }
}
