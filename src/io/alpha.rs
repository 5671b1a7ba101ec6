//! Use of the transparent pixels of photos: the surroundings of a thing that was cut out, or pixels of which nothing is
//! known.

use rayon::prelude::*;

use super::photo;
use crate::math::resize::nearest;
use crate::scene::{AlphaUse, Dataset};

/// Photos sampled for the decision.
const SAMPLE: usize = 12;
/// Cells along each side of the transparency grids that are compared.
const CELLS: usize = 32;
/// Alpha of 255 up to which a pixel is wholly transparent.
const CLEAR: u8 = 8;
/// Least share of clear pixels of photos of a thing that was cut out.
const CLEAR_SHARE: f64 = 0.1;
/// The same along the photos' edges.
const CLEAR_EDGE: f64 = 0.7;
/// Share of cells that differ between photos up to which they are transparent at the same places, as behind a lens.
const SAME: f64 = 0.02;

/// Transparency of a photo: shares of clear pixels in all and along the edges.
struct Transparency {
    share: f64,
    edge: f64,
    /// Clear cells, row-major.
    cells: Vec<bool>,
}

/// Samples some photos and sets the use of transparent pixels for the dataset. With a stated background they count as
/// empty. Photos that cannot be read are skipped here and reported by the loader.
pub(super) fn decide(dataset: &mut Dataset) {
    let photos = &dataset.photos;
    let step = photos.len().div_ceil(SAMPLE).max(1);
    let seen: Vec<Transparency> =
        photos.par_iter().step_by(step).filter_map(|p| of_alpha(&photo::alpha(&p.path).ok()??)).collect();
    if seen.is_empty() {
        return;
    }
    let stated = dataset.photos.iter().any(|p| p.background.is_some());
    dataset.use_alpha(if stated || is_cut_out(&seen) { AlphaUse::Empty } else { AlphaUse::Ignore });
}

/// Returns whether much of the photos is clear, the edges too, and not at the same places in all of them.
fn is_cut_out(seen: &[Transparency]) -> bool {
    let mean = |of: fn(&Transparency) -> f64| seen.iter().map(of).sum::<f64>() / seen.len() as f64;
    let differing = (0..CELLS * CELLS).filter(|&i| seen.iter().any(|s| s.cells[i] != seen[0].cells[i])).count();
    let moves = seen.len() == 1 || differing as f64 > SAME * (CELLS * CELLS) as f64;
    mean(|s| s.share) >= CLEAR_SHARE && mean(|s| s.edge) >= CLEAR_EDGE && moves
}

/// Measures the transparency; `None` for an opaque picture.
fn of_alpha((width, height, alpha): &(usize, usize, Vec<u8>)) -> Option<Transparency> {
    if alpha.iter().all(|a| *a == u8::MAX) {
        return None;
    }
    let (width, height) = (*width, *height);
    let share = |of: &mut dyn Iterator<Item = usize>| {
        let (clear, all) = of.fold((0, 0_usize), |(clear, all), i| (clear + usize::from(alpha[i] <= CLEAR), all + 1));
        clear as f64 / all.max(1) as f64
    };
    let edges = (0..width).chain(width * (height - 1)..width * height);
    let sides = (0..height).flat_map(|y| [y * width, (y + 1) * width - 1]);
    let cell = |i: usize| alpha[nearest(i / CELLS, height, CELLS) * width + nearest(i % CELLS, width, CELLS)] <= CLEAR;
    Some(Transparency {
        share: share(&mut (0..width * height)),
        edge: share(&mut edges.chain(sides)),
        cells: (0..CELLS * CELLS).map(cell).collect(),
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A picture that is opaque where `is`.
    fn picture(is: impl Fn(i32, i32) -> bool) -> Transparency {
        let alpha = (0..60 * 40).map(|i| if is(i % 60, i / 60) { 255 } else { 0 }).collect();
        of_alpha(&(60, 40, alpha)).expect("transparent somewhere")
    }

    fn disk(x: i32, y: i32, (cx, cy): (i32, i32), r: i32) -> bool {
        (x - cx).pow(2) + (y - cy).pow(2) < r * r
    }

    #[test]
    fn things_that_were_cut_out_are_told_from_lenses_and_holes() {
        let things: Vec<Transparency> =
            [(20, 15), (35, 22), (30, 12)].map(|c| picture(|x, y| disk(x, y, c, 12))).into_iter().collect();
        assert!(is_cut_out(&things));
        // The round picture of a lens is at the same place in every photo.
        let lens: Vec<Transparency> = (0..3).map(|_| picture(|x, y| disk(x, y, (30, 20), 20))).collect();
        assert!(!is_cut_out(&lens));
        // Persons removed from photos of a street.
        let holes: Vec<Transparency> =
            [(20, 15), (35, 22), (30, 12)].map(|c| picture(|x, y| !disk(x, y, c, 12))).into_iter().collect();
        assert!(!is_cut_out(&holes));
        assert!(of_alpha(&(2, 2, vec![255; 4])).is_none());
    }
}
