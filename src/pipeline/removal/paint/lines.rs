//! Continuation of lines, such as grain and seams, through a hole: colors from both ends of the line through each
//! texel.
//!
//! The direction of the lines is that of least change in the known texels (structure tensor), and a film of it in the
//! hole. Where both ends differ more than the surface does, there is no line.

use rayon::prelude::*;

use super::{blurred, film};
use crate::math::stats::median;

/// Step along a line, and the length over which colors at its end are averaged, texels.
const STEP: f32 = 0.5;
const END: f32 = 2.0;
/// Longest piece of a line through texels that are neither known nor to be painted, texels.
const SKIPPED: f32 = 4.0;
/// Clarity of a direction (0 = none, 1 = stripes) from which lines begin to count, and from which they count fully.
const CLEAR: (f32, f32) = (0.3, 0.6);
/// Difference of a line's ends at which it counts half, in standard deviations of the surface's colors.
const APART: f32 = 2.0;

/// Continues lines of the `plain` texels, with the light of the surface itself, through the `hole`. Texels in deep
/// `shade` keep their brightness and get the texture of the lines.
pub(in crate::pipeline::removal) fn continue_lines(
    color: &mut [[f32; 3]],
    size: [usize; 2],
    plain: &[bool],
    hole: &[bool],
    shade: &[bool],
) {
    let n = color.len();
    let wanted: Vec<bool> = (0..n).map(|i| hole[i] || shade[i]).collect();
    let Some(surface) = LinedSurface::new(color, size, plain, &wanted) else { return };
    let found = surface.continued();
    let drawn: Vec<[f32; 3]> = (0..n).map(|i| found[i].map_or(color[i], |line| line.0)).collect();
    let all: Vec<bool> = (0..n).map(|i| plain[i] || wanted[i]).collect();
    let [smooth, own] = [&drawn, &*color].map(|of| blurred(of, size, &all));
    for (i, (line, share)) in found.into_iter().enumerate().filter_map(|(i, line)| Some((i, line?))) {
        for c in 0..3 {
            let brighter = if hole[i] { 0.0 } else { own[i][c] - smooth[i][c] };
            color[i][c] += share * (line[c] + brighter - color[i][c]);
        }
    }
}

/// Picture of a surface with a hole.
struct LinedSurface<'a> {
    color: &'a [[f32; 3]],
    size: [usize; 2],
    /// Texels from which lines come, and to which they go on.
    known: &'a [bool],
    wanted: &'a [bool],
    /// Change of the colors at each texel: squares along both axes, and the product.
    tensor: Vec<[f32; 3]>,
    /// Usual color, and the deviation of colors from it.
    usual: [f32; 3],
    deviation: f32,
}

impl<'a> LinedSurface<'a> {
    /// Measures the lines; `None` if no known texels lie together.
    fn new(color: &'a [[f32; 3]], size: [usize; 2], known: &'a [bool], wanted: &'a [bool]) -> Option<Self> {
        let tensor = tensor(color, size, known)?;
        let all: Vec<[f32; 3]> = color.iter().zip(known).filter(|(_, k)| **k).map(|(c, _)| *c).collect();
        let usual = [0, 1, 2].map(|c| median(&all.iter().map(|v| f64::from(v[c])).collect::<Vec<_>>()) as f32);
        let off: Vec<f64> = all.iter().map(|v| f64::from(apart(*v, usual))).collect();
        Some(Self { color, size, known, wanted, tensor, usual, deviation: 1.5 * median(&off) as f32 })
    }

    /// Returns for each wanted texel the color by the line through it, and how much it counts, 0 to 1.
    fn continued(&self) -> Vec<Option<([f32; 3], f32)>> {
        (0..self.color.len()).into_par_iter().map(|i| if self.wanted[i] { self.through(i) } else { None }).collect()
    }

    fn through(&self, i: usize) -> Option<([f32; 3], f32)> {
        let (direction, clear) = self.direction(i);
        let ends = [direction, direction.map(|v| -v)].map(|toward| self.end(i, toward));
        let (color, off) = match ends {
            [Some((a, to_a)), Some((b, to_b))] => {
                let blend = |c: usize| (a[c] * to_b + b[c] * to_a) / (to_a + to_b);
                ([0, 1, 2].map(blend), apart(a, b))
            }
            [Some((one, _)), None] | [None, Some((one, _))] => (one, apart(one, self.usual)),
            [None, None] => return None,
        };
        let fits = 1.0 / (1.0 + (off / (APART * self.deviation).max(1e-6)).powi(4));
        Some((color, ((clear - CLEAR.0) / (CLEAR.1 - CLEAR.0)).clamp(0.0, 1.0) * fits))
    }

    /// Returns the direction of lines at a texel, and its clarity.
    fn direction(&self, i: usize) -> ([f32; 2], f32) {
        let [xx, xy, yy] = self.tensor[i];
        let (half, spread) = (0.5 * (xx - yy), (0.5 * (xx - yy)).hypot(xy));
        // Lines run across the strongest change.
        let (sin, cos) = (0.5 * xy.atan2(half)).sin_cos();
        ([-sin, cos], spread / (0.5 * (xx + yy)).max(f32::MIN_POSITIVE))
    }

    /// Follows the line from a texel toward one side: returns the known color at its end and the way there; `None` if
    /// it leaves the surface.
    fn end(&self, from: usize, toward: [f32; 2]) -> Option<([f32; 3], f32)> {
        let [width, height] = self.size;
        let (mut at, mut last) = ([(from % width) as f32 + 0.5, (from / width) as f32 + 0.5], toward);
        let (mut way, mut skipped, mut sum, mut count) = (0.0, 0.0, [0.0_f32; 3], 0.0_f32);
        let mut found = None;
        while way < (2 * (width + height)) as f32 {
            let Some(here) = self.texel(at) else { break };
            if self.known[here] {
                let first = *found.get_or_insert(way);
                let color = self.sample(at);
                (0..3).for_each(|c| sum[c] += color[c]);
                count += 1.0;
                if way - first >= END {
                    break;
                }
            } else if found.is_some() {
                break;
            } else if !self.wanted[here] {
                skipped += STEP;
                if skipped > SKIPPED {
                    return None;
                }
            }
            let direction = self.direction(here).0;
            let sign = if direction[0] * last[0] + direction[1] * last[1] < 0.0 { -1.0 } else { 1.0 };
            last = direction.map(|v| sign * v);
            at = [at[0] + STEP * last[0], at[1] + STEP * last[1]];
            way += STEP;
        }
        found.map(|way| (sum.map(|s| s / count), way))
    }

    fn texel(&self, at: [f32; 2]) -> Option<usize> {
        let inside = (0..2).all(|k| at[k] >= 0.0 && at[k] < self.size[k] as f32);
        inside.then(|| at[1] as usize * self.size[0] + at[0] as usize)
    }

    /// Interpolates the known ones of the four texels around a place in a known texel.
    fn sample(&self, at: [f32; 2]) -> [f32; 3] {
        let first = at.map(|v| (v - 0.5).floor());
        let (mut sum, mut total) = ([0.0; 3], 0.0);
        for step in [[0.0, 0.0], [1.0, 0.0], [0.0, 1.0], [1.0, 1.0]] {
            let middle = [first[0] + step[0] + 0.5, first[1] + step[1] + 0.5];
            let weight = (1.0 - (at[0] - middle[0]).abs()) * (1.0 - (at[1] - middle[1]).abs());
            if let Some(i) = self.texel(middle).filter(|i| self.known[*i]) {
                total += weight;
                (0..3).for_each(|c| sum[c] += weight * self.color[i][c]);
            }
        }
        sum.map(|s| s / total)
    }
}

/// Returns the change of colors around each texel; `None` if no known texels lie together.
fn tensor(color: &[[f32; 3]], size: [usize; 2], known: &[bool]) -> Option<Vec<[f32; 3]>> {
    let [width, height] = size;
    let within = |i: usize| {
        let (x, y) = (i % width, i / width);
        let inside = x > 0 && y > 0 && x + 1 < width && y + 1 < height;
        inside && [i, i - 1, i + 1, i - width, i + width].iter().all(|j| known[*j])
    };
    let has: Vec<bool> = (0..color.len()).map(within).collect();
    let change = |i: usize| {
        let mut sum = [0.0_f32; 3];
        for c in 0..3 {
            let (x, y) = (color[i + 1][c] - color[i - 1][c], color[i + width][c] - color[i - width][c]);
            (sum[0], sum[1], sum[2]) = (sum[0] + x * x, sum[1] + x * y, sum[2] + y * y);
        }
        sum
    };
    let mut all: Vec<[f32; 3]> = (0..color.len()).map(|i| if has[i] { change(i) } else { [0.0; 3] }).collect();
    let inside = || (0..color.len()).filter(|i| has[*i]);
    let sizes: Vec<f64> = inside().map(|i| f64::from(all[i][0] + all[i][2])).collect();
    if sizes.is_empty() {
        return None;
    }
    // Strong edges, as of a stain, do not outweigh the rest.
    let usual = (median(&sizes) as f32).max(f32::MIN_POSITIVE);
    inside().for_each(|i| all[i] = all[i].map(|v| v * usual / (usual + all[i][0] + all[i][2])));
    let mut around = blurred(&blurred(&all, size, &has), size, &has);
    let mean = [0, 1, 2].map(|c| inside().map(|i| around[i][c]).sum::<f32>() / sizes.len() as f32);
    let unknown: Vec<usize> = (0..color.len()).filter(|i| !has[*i]).collect();
    unknown.iter().for_each(|i| around[*i] = mean);
    film(&mut around, size, &has, &unknown);
    Some(around)
}

fn apart(a: [f32; 3], b: [f32; 3]) -> f32 {
    ((0..3).map(|c| (a[c] - b[c]).powi(2)).sum::<f32>() / 3.0).sqrt()
}
