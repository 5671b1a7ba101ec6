//! Codes of Gaussians blended into a view: the sum of `alpha * transmittance * code`, over nothing.

use rayon::prelude::*;

use super::ForeignError;
use super::cosines::{BLOCK, CosineHead, Directions};
use super::pieces::{self, PIECE, PieceCosines};
use crate::io::results::{EmbeddedLevel, FeatureRows, LevelCodes};
use crate::render::{Features, MAX_CHANNELS, RenderSettings, Renderer};
use crate::scene::{Camera, GaussianCloud};

/// Channels of one pass.
const PASS: usize = MAX_CHANNELS - 4;
/// Gaussians per thread.
const GAUSSIANS_PER_TASK: usize = 1 << 10;
/// Number that LangSplat adds to the length that it divides by.
const TINY: f32 = 1e-9;

/// Blended numbers of a view, a plane for each.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct BlendedCodes {
    /// Width in px.
    pub width_px: usize,
    /// Height in px.
    pub height_px: usize,
    /// Accumulated opacity of the pixels, row-major.
    pub alpha: Vec<f32>,
    /// A plane for each number of a code.
    pub planes: Vec<Vec<f32>>,
}

/// Numbers of Gaussians to be blended.
#[derive(Clone, Copy)]
pub(crate) struct BlendSource<'a> {
    /// Numbers of each Gaussian.
    pub(crate) dim: usize,
    /// Copies those of a Gaussian, from a number on.
    pub(crate) copy: &'a (dyn Fn(usize, usize, &mut [f32]) + Sync),
}

/// Factor of a code: one, or that which gives it unit length.
pub(crate) fn factor(level: &EmbeddedLevel, code: &[f32]) -> f32 {
    if level.is_unit { 1.0 / (code.iter().map(|v| v * v).sum::<f32>().sqrt() + TINY) } else { 1.0 }
}

/// Factors of the codes of all Gaussians.
fn factors(level: &EmbeddedLevel) -> Vec<f32> {
    let codes = &level.codes;
    if !level.is_unit {
        return vec![1.0; codes.len()];
    }
    let dim = codes.dim();
    let one = |own: &mut Vec<f32>, i: usize| {
        codes.copy(i, 0, own);
        factor(level, own)
    };
    (0..codes.len()).into_par_iter().with_min_len(GAUSSIANS_PER_TASK).map_init(|| vec![0.0; dim], one).collect()
}

/// Copies numbers of codes times a factor.
pub(crate) fn scaled(codes: &LevelCodes, factors: &[f32], i: usize, from: usize, out: &mut [f32]) {
    codes.copy(i, from, out);
    out.iter_mut().for_each(|v| *v *= factors[i]);
}

/// Renders the numbers of a pass and hands each group's planes to `each`, with the number of its first plane.
fn passes(
    renderer: &mut Renderer,
    cloud: &GaussianCloud,
    source: BlendSource<'_>,
    camera: &Camera,
    mut each: impl FnMut(usize, Vec<Vec<f32>>),
) -> Result<Vec<f32>, ForeignError> {
    let settings = RenderSettings { sh_degree: 0, ..RenderSettings::of_mode(cloud.render_mode) };
    let mut alpha = Vec::new();
    for from in (0..source.dim).step_by(PASS) {
        let channels = PASS.min(source.dim - from);
        let mut values = vec![0.0; cloud.len() * channels];
        let rows = values.par_chunks_exact_mut(channels).enumerate().with_min_len(GAUSSIANS_PER_TASK);
        rows.for_each(|(i, row)| (source.copy)(i, from, row));
        let frame = renderer.render(cloud, Features { channels, values: &values }, camera, &settings)?;
        alpha = frame.alpha;
        each(from, frame.features);
    }
    Ok(alpha)
}

/// Blends numbers of Gaussians.
pub(crate) fn blend(
    renderer: &mut Renderer,
    cloud: &GaussianCloud,
    source: BlendSource<'_>,
    camera: &Camera,
) -> Result<BlendedCodes, ForeignError> {
    let mut planes = Vec::with_capacity(source.dim);
    let alpha = passes(renderer, cloud, source, camera, |_, group| planes.extend(group))?;
    Ok(BlendedCodes { width_px: camera.width_px as usize, height_px: camera.height_px as usize, alpha, planes })
}

/// Blends rows.
pub(crate) fn blend_rows(
    renderer: &mut Renderer,
    cloud: &GaussianCloud,
    rows: &FeatureRows,
    camera: &Camera,
) -> Result<BlendedCodes, ForeignError> {
    let copy = |i: usize, from: usize, out: &mut [f32]| rows.copy(i, from, out);
    blend(renderer, cloud, BlendSource { dim: rows.dim(), copy: &copy }, camera)
}

/// Blends the codes of a level.
pub(crate) fn blend_level(
    renderer: &mut Renderer,
    cloud: &GaussianCloud,
    level: &EmbeddedLevel,
    camera: &Camera,
) -> Result<BlendedCodes, ForeignError> {
    let factors = factors(level);
    let copy = |i: usize, from: usize, out: &mut [f32]| scaled(&level.codes, &factors, i, from, out);
    blend(renderer, cloud, BlendSource { dim: level.codes.dim(), copy: &copy }, camera)
}

/// Cosines of the pixels of a view with phrases, for embeddings that are too wide to be kept blended: they are summed
/// group by group.
pub(crate) fn wide_cosines(
    renderer: &mut Renderer,
    cloud: &GaussianCloud,
    level: &EmbeddedLevel,
    camera: &Camera,
    phrases: &[&[f32]],
) -> Result<Vec<Vec<f32>>, ForeignError> {
    let factors = factors(level);
    let copy = |i: usize, from: usize, out: &mut [f32]| scaled(&level.codes, &factors, i, from, out);
    let pixels = camera.width_px as usize * camera.height_px as usize;
    let mut sums = vec![vec![0.0_f32; pixels]; phrases.len()];
    let mut squares = vec![0.0_f32; pixels];
    passes(renderer, cloud, BlendSource { dim: level.codes.dim(), copy: &copy }, camera, |from, group| {
        for (c, plane) in group.iter().enumerate() {
            squares.par_iter_mut().zip(plane).for_each(|(s, v)| *s += v * v);
            for (sum, phrase) in sums.iter_mut().zip(phrases) {
                let weight = phrase[from + c];
                sum.par_iter_mut().zip(plane).for_each(|(s, v)| *s += weight * v);
            }
        }
    })?;
    for sum in &mut sums {
        let divide = |(s, square): (&mut f32, &f32)| *s = if *square > 1e-20 { *s / square.sqrt() } else { 0.0 };
        sum.par_iter_mut().zip(&squares).for_each(divide);
    }
    Ok(sums)
}

/// Cosines of blended codes with phrases. Only pixels that a Gaussian reaches are decoded; the others have the cosines of
/// the code of zeros.
pub(crate) struct BlendedCosines<'a> {
    head: &'a CosineHead,
    blended: &'a BlendedCodes,
    directions: Directions,
    /// Of the code of zeros, for each phrase.
    of_nothing: Vec<f32>,
}

impl<'a> BlendedCosines<'a> {
    pub(crate) fn new(head: &'a CosineHead, blended: &'a BlendedCodes, directions: Directions) -> Self {
        let mut block = vec![0.0; directions.len() * BLOCK];
        head.cosines(&vec![0.0; blended.planes.len() * BLOCK], &directions, &mut block);
        let of_nothing = block.chunks_exact(BLOCK).map(|of_phrase| of_phrase[0]).collect();
        Self { head, blended, directions, of_nothing }
    }

    /// Cosines of the code of zeros with each phrase.
    pub(crate) fn of_nothing(&self) -> &[f32] {
        &self.of_nothing
    }
}

impl PieceCosines for BlendedCosines<'_> {
    fn pixels(&self) -> usize {
        self.blended.alpha.len()
    }

    fn phrases(&self) -> usize {
        self.directions.len()
    }

    fn alpha(&self) -> Option<&[f32]> {
        Some(&self.blended.alpha)
    }

    fn of_piece(&self, piece: usize, out: &mut [f32]) {
        out.chunks_exact_mut(PIECE).zip(&self.of_nothing).for_each(|(plane, v)| plane.fill(*v));
        let alpha = pieces::part(&self.blended.alpha, piece);
        let reached: Vec<usize> = (0..alpha.len()).filter(|k| alpha[*k] != 0.0).collect();
        let mut codes = vec![0.0; self.blended.planes.len() * BLOCK];
        let mut found = vec![0.0; self.directions.len() * BLOCK];
        for block in reached.chunks(BLOCK) {
            for (codes, plane) in codes.chunks_exact_mut(BLOCK).zip(&self.blended.planes) {
                let plane = pieces::part(plane, piece);
                codes.iter_mut().zip(block).for_each(|(code, k)| *code = plane[*k]);
            }
            self.head.cosines(&codes, &self.directions, &mut found);
            for (plane, found) in out.chunks_exact_mut(PIECE).zip(found.chunks_exact(BLOCK)) {
                block.iter().zip(found).for_each(|(k, v)| plane[*k] = *v);
            }
        }
    }
}

/// Cosines of single Gaussians with phrases.
pub(crate) fn gaussian_cosines(head: &CosineHead, level: &EmbeddedLevel, directions: &Directions) -> Vec<Vec<f32>> {
    let (codes, factors) = (&level.codes, factors(level));
    let (count, dim) = (codes.len(), codes.dim());
    let one = |own: &mut (Vec<f32>, Vec<f32>), b: usize| -> Vec<f32> {
        let (row, block) = own;
        block.fill(0.0);
        for (k, i) in (b * BLOCK..count.min((b + 1) * BLOCK)).enumerate() {
            scaled(codes, &factors, i, 0, row);
            row.iter().enumerate().for_each(|(c, v)| block[c * BLOCK + k] = *v);
        }
        let mut out = vec![0.0; directions.len() * BLOCK];
        head.cosines(block, directions, &mut out);
        out
    };
    let blocks = (0..count.div_ceil(BLOCK)).into_par_iter().with_min_len(8);
    let found: Vec<Vec<f32>> = blocks.map_init(|| (vec![0.0; dim], vec![0.0; dim * BLOCK]), one).collect();
    let of = |v: usize| {
        let mut all: Vec<f32> = found.iter().flat_map(|out| out[v * BLOCK..(v + 1) * BLOCK].iter().copied()).collect();
        all.truncate(count);
        all
    };
    (0..directions.len()).map(of).collect()
}
