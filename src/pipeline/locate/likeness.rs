//! Agreement of a photo with the scene: correlation by block between photo and rendering, which no exposure changes and no
//! other picture reaches.

use super::gray::GrayPlane;

/// Side of a block, px.
const BLOCK_PX: usize = 8;
/// Longer side of the compared pictures at most, px, and of those of which the training photos had few samples.
pub(super) const COMPARED_PX: usize = 200;
const LEAST_COMPARED_PX: usize = 64;
/// Pixels of the compared pictures for a sample of the training photos: less detail than this needs is in the scene.
const PX_PER_SAMPLE: f64 = 2.0;
/// Standard deviation below which a block has no structure, in full scale: noise of cameras.
const FLAT: f32 = 0.012;
/// Correlation from which a block is explained: half of its variance is not by chance.
const EXPLAINED: f32 = 0.5;
/// Fewest blocks with structure that say anything.
const FEWEST_BLOCKS: usize = 12;

/// Agreement of a photo with a rendering.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct Likeness {
    /// Share of the blocks with structure that the rendering explains.
    pub(super) explained: f64,
    /// Mean correlation of the blocks with structure.
    pub(super) correlation: f64,
}

impl Likeness {
    /// By which poses are compared.
    pub(super) fn sum(&self) -> f64 {
        self.explained + self.correlation
    }
}

/// Longer side at which a picture is compared of which the training photos had so many samples along it, px.
pub(super) fn compared_px(samples: Option<f64>) -> usize {
    samples.map_or(COMPARED_PX, |n| ((PX_PER_SAMPLE * n) as usize).clamp(LEAST_COMPARED_PX, COMPARED_PX))
}

/// Compares a rendering with a photo of its size, at most so large; pixels of coverage 0 do not count.
pub(super) fn likeness(rendered: &GrayPlane, photo: &GrayPlane, coverage: &[f32], most_px: usize) -> Likeness {
    let longer = photo.width.max(photo.height);
    if longer > most_px {
        let side = |s: usize| (s * most_px / longer).max(1);
        let (w, h) = (side(photo.width), side(photo.height));
        let covered = GrayPlane { values: coverage.to_vec(), ..*photo };
        return likeness(&rendered.resized(w, h), &photo.resized(w, h), &covered.resized(w, h).values, most_px);
    }
    let (mut blocks, mut explained, mut sum) = (0_usize, 0_usize, 0.0);
    for top in (0..photo.height.saturating_sub(BLOCK_PX - 1)).step_by(BLOCK_PX) {
        for left in (0..photo.width.saturating_sub(BLOCK_PX - 1)).step_by(BLOCK_PX) {
            let at = |k: usize| (top + k / BLOCK_PX) * photo.width + left + k % BLOCK_PX;
            let places = (0..BLOCK_PX * BLOCK_PX).map(at);
            if places.clone().any(|i| coverage[i] < 0.5) {
                continue;
            }
            let of = |plane: &GrayPlane| centered(places.clone().map(|i| plane.values[i]).collect());
            let ((a, of_a), (b, of_b)) = (of(rendered), of(photo));
            if of_a < FLAT && of_b < FLAT {
                continue;
            }
            let product = a.iter().zip(&b).map(|(a, b)| a * b).sum::<f32>() / a.len() as f32;
            let correlation = product / (of_a.max(0.5 * FLAT) * of_b.max(0.5 * FLAT));
            blocks += 1;
            explained += usize::from(correlation >= EXPLAINED);
            sum += f64::from(correlation);
        }
    }
    if blocks < FEWEST_BLOCKS {
        return Likeness::default();
    }
    Likeness { explained: explained as f64 / blocks as f64, correlation: sum / blocks as f64 }
}

/// Values less their mean, and their standard deviation.
fn centered(mut values: Vec<f32>) -> (Vec<f32>, f32) {
    let n = values.len() as f32;
    let mean = values.iter().sum::<f32>() / n;
    values.iter_mut().for_each(|v| *v -= mean);
    let deviation = (values.iter().map(|v| v * v).sum::<f32>() / n).sqrt();
    (values, deviation)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn plane(of: impl Fn(usize, usize) -> f32) -> GrayPlane {
        GrayPlane { width: 96, height: 80, values: (0..96 * 80).map(|i| of(i % 96, i / 96)).collect() }
    }

    #[test]
    fn exposure_and_boxes_leave_it_and_another_picture_is_not_alike() {
        let wave = |x: usize, y: usize, k: f32| 0.5 + 0.1 * (x as f32 * 0.9 * k).sin() * (y as f32 * 0.7 + k).cos();
        let rendered = plane(|x, y| wave(x, y, 1.0));
        let covered = vec![1.0; 96 * 80];
        let photo = plane(|x, y| if x < 16 { 0.3 } else { 1.3 * wave(x, y, 1.0) - 0.1 });
        let same = likeness(&rendered, &photo, &covered, COMPARED_PX);
        assert!((same.explained - 10.0 / 12.0).abs() < 0.02 && same.correlation > 0.8, "{same:?}");
        let other = likeness(&rendered, &plane(|x, y| wave(x, y, 1.37)), &covered, COMPARED_PX);
        assert!(other.explained < 0.3 && other.correlation < 0.3, "{other:?}");
        assert_eq!(likeness(&rendered, &photo, &vec![0.0; 96 * 80], COMPARED_PX), Likeness::default());
        let flat = plane(|_, _| 0.5);
        assert_eq!(likeness(&flat, &flat, &covered, COMPARED_PX), Likeness::default());
    }
    #[test]
    fn detail_that_the_scene_cannot_show_does_not_count_where_its_samples_are_few() {
        let size = 192 * 160;
        let coarse = |i: usize| ((i % 192) as f32 * 0.21).sin() * ((i / 192) as f32 * 0.17).cos();
        let fine = |i: usize| ((i % 192) as f32 * 2.1).sin() * ((i / 192) as f32 * 2.3).cos();
        let of = |value: &dyn Fn(usize) -> f32| GrayPlane {
            width: 192,
            height: 160,
            values: (0..size).map(value).collect(),
        };
        let blurred = of(&|i| 0.5 + 0.1 * coarse(i));
        let photo = of(&|i| 0.5 + 0.1 * coarse(i) + 0.2 * fine(i));
        let at = |samples: f64| likeness(&blurred, &photo, &vec![1.0; size], compared_px(Some(samples)));
        assert!(at(900.0).explained < 0.5 && at(32.0).explained > 0.9, "{:?} {:?}", at(900.0), at(32.0));
        let other = of(&|i| 0.5 + 0.1 * coarse(size - i) + 0.2 * fine(i));
        let other = likeness(&blurred, &other, &vec![1.0; size], compared_px(Some(32.0)));
        assert!(other.explained < 0.35, "{other:?}");
        assert_eq!([compared_px(None), compared_px(Some(1e9)), compared_px(Some(1.0))], [200, 200, 64]);
    }
}
