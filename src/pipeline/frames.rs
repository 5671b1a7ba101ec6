//! Choice of the frames of a video that become photos: the sharpest ones, evenly by how much the picture changes.

use crate::math::resize::{Filter, resize};

/// Photos that a video gives, if it is long enough.
const LEAST: usize = 100;
/// Photos at most: more take time and add little.
const MOST: usize = 300;
/// Change of the picture between two photos that is aimed at, as [`FrameLook::change`].
const STEP: f64 = 0.35;
/// Change below which a frame shows the same as the one before.
const SAME: f64 = 0.01;
/// Longer side of the picture that sharpness is seen in, px.
const SEEN_PX: usize = 640;
/// Longer side of the picture that changes are seen in, px.
const THUMBNAIL_PX: usize = 64;

/// Picture in gray levels, 0 to 255.
pub(crate) struct Gray {
    values: Vec<f32>,
    size: (usize, usize),
}

impl Gray {
    /// A picture of these values, row by row.
    pub(crate) fn new(values: Vec<f32>, size: (usize, usize)) -> Self {
        Self { values, size }
    }

    /// The green channel of a picture, row by row, which is nearest to what eyes see.
    pub(crate) fn of_rgb(rgb: &[u8], width: u32, height: u32) -> Self {
        let values = rgb.chunks_exact(3).map(|p| f32::from(p[1])).collect();
        Self { values, size: (width as usize, height as usize) }
    }

    fn limited_to(&self, side: usize) -> Self {
        let (width, height) = self.size;
        let factor = (side as f64 / width.max(height) as f64).min(1.0);
        let to = [width, height].map(|n| ((n as f64 * factor).round() as usize).max(1));
        Self { values: resize(&self.values, self.size, (to[0], to[1]), Filter::Area), size: (to[0], to[1]) }
    }
}

/// Variance of the Laplacian: how sharp a picture is.
pub(crate) fn sharpness(picture: &Gray) -> f64 {
    let small = picture.limited_to(SEEN_PX);
    let (width, height) = small.size;
    let (mut n, mut sum, mut squares) = (0.0, 0.0, 0.0);
    for y in 1..height.saturating_sub(1) {
        for x in 1..width - 1 {
            let at = y * width + x;
            let v = &small.values;
            let laplacian = f64::from(v[at - 1] + v[at + 1] + v[at - width] + v[at + width] - 4.0 * v[at]);
            n += 1.0;
            sum += laplacian;
            squares += laplacian * laplacian;
        }
    }
    if n > 0.0 { squares / n - (sum / n) * (sum / n) } else { 0.0 }
}

/// Look of a frame.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct FrameLook {
    /// Sharpness.
    pub(crate) sharpness: f64,
    /// Distance of the small picture from that of the frame before, both with mean 0 and length 1: 0 to 2.
    pub(crate) change: f64,
}

/// Looks at frames one after the other.
#[derive(Default)]
pub(crate) struct FrameWatch {
    before: Option<Vec<f32>>,
}

impl FrameWatch {
    /// Looks at the next frame.
    pub(crate) fn look(&mut self, picture: &Gray) -> FrameLook {
        let mut small = picture.limited_to(THUMBNAIL_PX).values;
        let mean = small.iter().sum::<f32>() / small.len() as f32;
        small.iter_mut().for_each(|v| *v -= mean);
        // One gray level a pixel at least, so that noise in the dark is no change.
        let length = small.iter().map(|v| v * v).sum::<f32>().sqrt().max((small.len() as f32).sqrt());
        small.iter_mut().for_each(|v| *v /= length);
        let differs = |before: &Vec<f32>| {
            let squares = before.iter().zip(&small).map(|(a, b)| f64::from(a - b).powi(2)).sum::<f64>();
            // Another size is another scene.
            if before.len() == small.len() { squares.sqrt() } else { 2.0 }
        };
        let change = self.before.as_ref().map_or(0.0, differs);
        self.before = Some(small);
        FrameLook { sharpness: sharpness(picture), change }
    }
}

/// Chooses frames by their looks; returns their numbers, in order. `wanted` is a number of photos, by default one that
/// follows from how much the picture changes.
pub(crate) fn choose(looks: &[FrameLook], wanted: Option<usize>) -> Vec<usize> {
    if wanted.is_none_or(|n| n >= looks.len()) && looks.len() <= LEAST {
        return (0..looks.len()).filter(|&i| i == 0 || looks[i].change > SAME).collect();
    }
    let total: f64 = looks.iter().map(|look| look.change).sum();
    let n = wanted.unwrap_or_else(|| ((total / STEP).round() as usize).clamp(LEAST, MOST)).min(looks.len());
    let mut best: Vec<Option<usize>> = vec![None; n];
    let mut so_far = 0.0;
    for (i, look) in looks.iter().enumerate() {
        so_far += look.change;
        let window = if total > 0.0 { ((so_far / total * n as f64) as usize).min(n - 1) } else { 0 };
        let place = &mut best[window];
        if place.is_none_or(|other| look.sharpness > looks[other].sharpness) {
            *place = Some(i);
        }
    }
    best.into_iter().flatten().collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn stripes(shift: f32, blur: f32) -> Gray {
        let wave = |x: usize| 128.0 + 100.0 * ((x as f32 + shift) * 0.7).sin() * (-blur).exp();
        Gray::new((0..48 * 32).map(|i| wave(i % 48)).collect(), (48, 32))
    }

    #[test]
    fn blur_and_change_are_seen() {
        assert!(sharpness(&stripes(0.0, 0.0)) > 4.0 * sharpness(&stripes(0.0, 1.0)));
        let mut watch = FrameWatch::default();
        let mut change = |shift, blur| watch.look(&stripes(shift, blur)).change;
        assert_eq!((change(0.0, 0.0), change(0.0, 0.0)), (0.0, 0.0));
        let (little, more) = (change(0.3, 0.0), change(1.5, 0.0));
        assert!(0.0 < little && little < more, "{little} {more}");
        assert!(change(1.5, 0.5) < 1e-3, "contrast alone is no change");
    }

    #[test]
    fn the_sharpest_frame_of_each_window_is_taken() {
        // The camera rests in the middle third; every third frame is sharp.
        let look = |i: usize| FrameLook {
            sharpness: if i.is_multiple_of(3) { 9.0 } else { 1.0 },
            change: if (400..800).contains(&i) { 0.0 } else { 0.1 },
        };
        let looks: Vec<FrameLook> = (0..1200).map(look).collect();
        let chosen = choose(&looks, None);
        assert!((LEAST..=MOST).contains(&chosen.len()), "{}", chosen.len());
        assert!(chosen.iter().filter(|i| (400..800).contains(*i)).count() <= 2, "rest gives one photo");
        let sharp = chosen.iter().filter(|i| i.is_multiple_of(3)).count();
        assert!(sharp > chosen.len() / 2, "{sharp} of {}", chosen.len());
        assert!(chosen.windows(2).all(|w| w[0] < w[1]), "in order, none twice");
        assert_eq!(choose(&looks, Some(10)).len(), 10);
        assert!(choose(&looks[..50], None).len() == 50, "a short video gives all frames");
        assert_eq!(choose(&looks[450..500], None), [0], "but not those that show the same");
        assert_eq!(choose(&[], None), Vec::<usize>::new());
    }
}
