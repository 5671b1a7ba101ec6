//! Kept views: the splats that weigh in a view, by tile and front to back. A later pass over their weights needs no
//! cloud, and leaves out all that is hidden.
//!
//! Weights themselves are not kept: a Gaussian has one at each of its pixels, 4 bytes and more each. Its splat, 60 bytes
//! at most, gives them eight at a time.

use std::sync::atomic::AtomicU64;

use super::bin::Tiles;
use super::chunk::{CHUNK, Chunk};
use super::contributions::ContributionSink;
use super::project::Splat;
use super::rasterizer::{CpuRasterizer, FrameInfo, SplatLists};
use super::sort;
use super::splat::Splats;
use crate::math::lanes::{Lane, Lanes, Plain};
use crate::render::TILE_PX;

const NONE: u32 = u32::MAX;

/// The splats of a view that weigh in its pixels: 44 bytes each and 12 or 16 of values that drawing would need, 8 bytes
/// for each of their tiles, and 4 for each tile.
#[derive(Debug)]
pub(crate) struct KeptView {
    lists: SplatLists<f32>,
    info: FrameInfo<f32, Splats<f32>>,
}

/// Gaussians that weigh in a row of tiles: those of each tile together, front to back.
#[derive(Debug, Default)]
pub(super) struct TileNotes {
    gaussians: Vec<u32>,
    /// The end of each tile's Gaussians, up to the last tile that has any.
    ends: Vec<usize>,
}

impl TileNotes {
    #[inline(always)]
    fn note(&mut self, gaussian: u32, column: usize) {
        if self.ends.len() > column && self.gaussians.last() == Some(&gaussian) {
            return;
        }
        self.ends.resize(column + 1, self.gaussians.len());
        self.gaussians.push(gaussian);
        self.ends[column] = self.gaussians.len();
    }
}

/// Hands weights on, and notes whose they are.
pub(super) struct NotingSink<'a, S> {
    sink: &'a mut S,
    pub(super) notes: TileNotes,
}

impl<'a, S> NotingSink<'a, S> {
    pub(super) fn new(sink: &'a mut S) -> Self {
        Self { sink, notes: TileNotes::default() }
    }
}

impl<S: ContributionSink<f32>> ContributionSink<f32> for NotingSink<'_, S> {
    fn add(&mut self, gaussian: u32, x: usize, y: usize, weights: &Lane<f32>) {
        self.add_lanes(Plain, gaussian, x, y, *weights);
    }

    #[inline(always)]
    fn add_lanes<L: Lanes<f32>>(&mut self, l: L, gaussian: u32, x: usize, y: usize, weights: L::V) {
        self.notes.note(gaussian, x / TILE_PX);
        self.sink.add_lanes(l, gaussian, x, y, weights);
    }
}

impl KeptView {
    /// Keeps the last frame of a rasterizer, of which `notes` tell by row of tiles whose weights there are. `None`
    /// without a frame, and of a cut, in which several splats stand for one Gaussian.
    pub(super) fn of(rasterizer: &CpuRasterizer<f32, Splats<f32>>, notes: &[TileNotes]) -> Option<Self> {
        let (lists, info) = rasterizer.last().filter(|_| rasterizer.cut.is_none())?;
        let grid = lists.tiles.grid;
        if notes.len() != grid[1] {
            return None;
        }
        let mut place_of = vec![NONE; info.gaussians];
        notes.iter().flat_map(|n| &n.gaussians).for_each(|g| place_of[*g as usize] = 0);
        let mut parts: Vec<Chunk<f32>> = Vec::new();
        for part in &lists.parts {
            for (splat, values) in part.splats.iter().zip(part.values.chunks_exact(info.channels)) {
                let place = &mut place_of[splat.gaussian as usize];
                if *place != NONE {
                    let (chunk, i) = put(&mut parts, splat, values);
                    *place = sort::place(chunk, i);
                }
            }
        }
        let mut tiles = Tiles { grid, first: Vec::with_capacity(grid[0] * grid[1] + 1), ..Tiles::default() };
        tiles.entries.reserve_exact(notes.iter().map(|n| n.gaussians.len()).sum());
        for row in notes {
            let before = tiles.entries.len() as u32;
            for column in 0..grid[0] {
                let begin = column.checked_sub(1).map_or(0, |c| row.end(c));
                tiles.first.push(before + begin as u32);
            }
            let places = row.gaussians.iter().map(|g| AtomicU64::new(sort::key(0, place_of[*g as usize])));
            tiles.entries.extend(places);
        }
        tiles.first.push(tiles.entries.len() as u32);
        Some(Self { lists: SplatLists { parts, tiles, ..SplatLists::default() }, info: info.clone() })
    }

    /// Hands the weight of every Gaussian at every pixel to `sinks`, one for each row of tiles.
    pub(crate) fn give<S: ContributionSink<f32>>(&self, sinks: &mut [S]) {
        self.lists.weigh(&self.info, sinks);
    }

    /// Width and height, px.
    pub(crate) fn size_px(&self) -> [usize; 2] {
        self.info.view.size
    }

    /// Memory that it takes.
    pub(crate) fn bytes(&self) -> usize {
        let SplatLists { parts, tiles, .. } = &self.lists;
        let part =
            |p: &Chunk<f32>| p.splats.capacity() * size_of::<Splat<f32>>() + p.values.capacity() * size_of::<f32>();
        size_of_val(&*tiles.entries) + size_of_val(&*tiles.first) + parts.iter().map(part).sum::<usize>()
    }
}

impl TileNotes {
    /// The end of a tile's Gaussians.
    fn end(&self, column: usize) -> usize {
        self.ends.get(column).copied().unwrap_or(self.gaussians.len())
    }
}

/// Puts a splat behind the others; returns its part and its place there.
fn put(parts: &mut Vec<Chunk<f32>>, splat: &Splat<f32>, values: &[f32]) -> (usize, usize) {
    if parts.last().is_none_or(|part| part.splats.len() == CHUNK) {
        let (splats, values) = (Vec::with_capacity(CHUNK), Vec::with_capacity(CHUNK * values.len()));
        parts.push(Chunk { splats, values, degenerate: 0 });
    }
    let chunk = parts.len() - 1;
    let part = &mut parts[chunk];
    part.splats.push(*splat);
    part.values.extend_from_slice(values);
    (chunk, part.splats.len() - 1)
}
