//! From a picture to objects and their parts.

use std::collections::BTreeMap;

use rayon::prelude::*;

use super::basins::{OUTSIDE, basins};
use super::edges::{ImagePlanes, strength};
use super::lab::{lab, planes};
use super::tree::{Border, Piece, Tree, grow};
use crate::scene::Mask;

/// A picture to be segmented.
#[derive(Clone, Copy, Debug)]
pub struct Picture<'a> {
    /// Width in px.
    pub width: usize,
    /// sRGB, row-major.
    pub rgb: &'a [[u8; 3]],
    /// Coverage of each pixel; pixels with 0 show nothing.
    pub coverage: Option<&'a [u8]>,
    /// End of a surface at each pixel, 0 to 1, if the shape of the scene is known.
    pub ends: Option<&'a [f32]>,
}

#[derive(Clone, Debug, PartialEq)]
pub(crate) struct RegionOptions {
    /// Unlikeness from which pieces are different objects, in steps of Lab color between pieces of a thousandth of
    /// the whole.
    pub(crate) object_step: f64,
    /// The same between the parts of an object, with the object as the whole.
    pub(crate) part_step: f64,
    /// Least number of pixels of an object and of a part.
    pub(crate) least_px: [usize; 2],
    /// Largest share of the picture for an object; larger regions are background.
    pub(crate) most_share: f64,
}

impl Default for RegionOptions {
    fn default() -> Self {
        Self { object_step: 26.0, part_step: 18.0, least_px: [200, 60], most_share: 0.5 }
    }
}

/// Difference of edge strength that separates basins, Lab steps.
const BASIN_STEP: f32 = 0.3;
/// Weight of the edge along the border in unlikeness; the rest is the difference of the means.
const EDGE: f64 = 0.2;
/// Power of the smaller piece's size: larger values keep large pieces apart longer.
const SIZE_POWER: f64 = 0.25;
/// Factor of the unlikeness of two neighbors on one unbroken surface, and steps added for an end of the surface
/// between them.
const UNBROKEN: f64 = 0.3;
const END: f64 = 3.0;

/// An object and the regions inside it, before filtering.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Candidate {
    pub(crate) mask: Mask,
    /// Regions of its own tile.
    pub(crate) pieces: Vec<Mask>,
}

/// Objects of the picture and their pieces.
pub(crate) fn segment(picture: &Picture<'_>, options: &RegionOptions) -> Vec<Candidate> {
    let mosaic = Mosaic::of(picture);
    let area: f64 = mosaic.pieces.iter().map(|p| p.area).sum();
    let known = picture.ends.is_some();
    let everything: Vec<u32> = (0..mosaic.pieces.len() as u32).collect();
    let objects = mosaic.grow(&everything, known);
    let large = |tree: &Tree, node: u32, least: usize| tree.nodes[node as usize].area >= least as f64;
    let mut kept = objects.cut(options.object_step);
    kept.retain(|&n| large(&objects, n, options.least_px[0]));
    kept.retain(|&n| objects.nodes[n as usize].area <= options.most_share * area);
    let candidate = |node: u32| {
        let leaves = objects.leaves_of(node);
        let inner = mosaic.grow(&leaves, false);
        let mut pieces = inner.cut(options.part_step);
        pieces.retain(|&n| large(&inner, n, options.least_px[1]));
        let of = |n: u32| mosaic.mask(inner.leaves_of(n).into_iter().map(|l| leaves[l as usize]));
        Candidate { mask: mosaic.mask(leaves.iter().copied()), pieces: pieces.into_iter().map(of).collect() }
    };
    kept.into_par_iter().map(candidate).collect()
}

/// Unlikeness of two neighbors, in steps of Lab color between pieces of area `unit`; with the `shape` of the scene or
/// by their colors alone.
pub(crate) fn unlike(a: &Piece, b: &Piece, border: &Border, shape: bool, unit: f64) -> f64 {
    let apart = a.sums.iter().zip(&b.sums).map(|(p, q)| (p / a.area - q / b.area).powi(2)).sum::<f64>().sqrt();
    let step = EDGE * border.strength / border.length + (1.0 - EDGE) * apart;
    let ends = border.ends / border.length;
    let step = if shape { step * (UNBROKEN + (1.0 - UNBROKEN) * ends) + END * ends } else { step };
    step * (a.area.min(b.area) / unit).powf(SIZE_POWER)
}

struct Mosaic {
    size: (usize, usize),
    pieces: Vec<Piece>,
    borders: BTreeMap<(u32, u32), Border>,
    /// Pixels of each piece.
    pixels: Vec<Vec<u32>>,
}

impl Mosaic {
    fn of(picture: &Picture<'_>) -> Self {
        let (n, width) = (picture.rgb.len(), picture.width.max(1));
        let channels = planes(&lab(picture.rgb));
        let strength = strength(&ImagePlanes { width, channels: &channels });
        let domain: Vec<bool> = (0..n).map(|i| picture.coverage.is_none_or(|c| c[i] > 0)).collect();
        // The end of a surface is an edge, whatever the colors.
        let end = |i: usize| picture.ends.map_or(0.0, |e| e[i]);
        let walls: Vec<f32> = (0..n).map(|i| strength[i] + 10.0 * end(i)).collect();
        let (label, count) = basins(&walls, &domain, width, BASIN_STEP);
        let mut pieces = vec![Piece { area: 0.0, sums: vec![0.0; 3] }; count as usize];
        let mut pixels = vec![Vec::new(); count as usize];
        let mut borders: BTreeMap<(u32, u32), Border> = BTreeMap::new();
        for i in 0..n {
            if label[i] == OUTSIDE {
                continue;
            }
            let piece = &mut pieces[label[i] as usize];
            piece.area += 1.0;
            piece.sums.iter_mut().zip(&channels).for_each(|(s, c)| *s += f64::from(c[i]));
            pixels[label[i] as usize].push(i as u32);
            for j in [(i % width + 1 < width).then_some(i + 1), Some(i + width)].into_iter().flatten() {
                if j < n && label[j] != label[i] && label[j] != OUTSIDE {
                    let between = Border {
                        length: 1.0,
                        strength: f64::from(strength[i].max(strength[j])),
                        ends: f64::from(end(i).max(end(j))),
                    };
                    borders.entry((label[i].min(label[j]), label[i].max(label[j]))).or_default().add(&between);
                }
            }
        }
        Self { size: (width, n / width), pieces, borders, pixels }
    }

    /// Grows the tree of some of the pieces; its leaves are numbered as listed.
    fn grow(&self, leaves: &[u32], shape: bool) -> Tree {
        let mut place = vec![u32::MAX; self.pieces.len()];
        leaves.iter().enumerate().for_each(|(at, &l)| place[l as usize] = at as u32);
        let inner = |(&(a, b), border): (&(u32, u32), &Border)| {
            let (a, b) = (place[a as usize], place[b as usize]);
            (a != u32::MAX && b != u32::MAX).then_some(((a.min(b), a.max(b)), *border))
        };
        let pieces: Vec<Piece> = leaves.iter().map(|&l| self.pieces[l as usize].clone()).collect();
        let unit = pieces.iter().map(|p| p.area).sum::<f64>() / 1000.0;
        let unlike = move |a: &Piece, b: &Piece, border: &Border| unlike(a, b, border, shape, unit);
        grow(pieces, self.borders.iter().filter_map(inner).collect(), &unlike)
    }

    fn mask(&self, leaves: impl Iterator<Item = u32>) -> Mask {
        let mut mask = Mask::empty(self.size.0, self.size.1);
        leaves.for_each(|l| self.pixels[l as usize].iter().for_each(|&i| mask.insert(i as usize)));
        mask
    }
}
