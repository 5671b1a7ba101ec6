//! Outlines of a mask as polygons, from which [`Mask::add_polygon`] restores the same pixels.
//!
//! One polygon for each piece of pixels connected along sides. It enters and leaves a hole along one row of corners,
//! with no pixel between, so that a single polygon describes the holes too.

use crate::scene::Mask;

/// Vertical border between pixels inside and outside: x, from y to y. It goes down on a piece's right, up on its left.
type Side = [i32; 3];

/// Closed paths along borders, and their position in the mask.
struct Borders {
    /// Corners per row.
    width: usize,
    /// Directions that leave each corner: east, south, west, north.
    ways: Vec<u8>,
    /// Left and top of the corner grid in the mask.
    origin: [i32; 2],
}

impl Borders {
    fn new(mask: &Mask) -> Option<Self> {
        let b = mask.bounds()?;
        let width = b.x.len() + 1;
        let mut ways = vec![0_u8; width * (b.y.len() + 1)];
        let inside = |x: usize, y: usize| b.contains(x, y) && mask.contains(y * mask.width_px() + x);
        for i in mask.pixels() {
            let (x, y) = (i % mask.width_px(), i / mask.width_px());
            let at = (y - b.y.start) * width + x - b.x.start;
            // Clockwise around the pixel.
            let sides = [
                (y > 0 && inside(x, y - 1), at, 1),
                (inside(x + 1, y), at + 1, 2),
                (inside(x, y + 1), at + width + 1, 4),
                (x > 0 && inside(x - 1, y), at + width, 8),
            ];
            sides.into_iter().filter(|(goes_on, ..)| !goes_on).for_each(|(_, corner, way)| ways[corner] |= way);
        }
        Some(Self { width, ways, origin: [b.x.start as i32, b.y.start as i32] })
    }

    /// Removes the closed path that starts eastward at a corner, and returns its vertical sides.
    fn around(&mut self, start: usize) -> Vec<Side> {
        let (mut sides, mut at, mut way) = (Vec::<Side>::new(), start, 0);
        loop {
            self.ways[at] &= !(1 << way);
            let [x, y] = [at % self.width, at / self.width].map(|v| v as i32);
            let [x, y] = [x + self.origin[0], y + self.origin[1]];
            at = match way {
                0 => at + 1,
                1 => at + self.width,
                2 => at - 1,
                _ => at - self.width,
            };
            if way % 2 == 1 {
                let to = y + if way == 1 { 1 } else { -1 };
                match sides.last_mut().filter(|last| last[0] == x && last[2] == y) {
                    Some(last) => last[2] = to,
                    None => sides.push([x, y, to]),
                }
            }
            // Right turn first if two directions are left: pixels that touch at a corner are two pieces.
            let mut next = [1, 0, 3].map(|turn| (way + turn) % 4).into_iter();
            match next.find(|way| self.ways[at] >> way & 1 == 1 || (at, *way) == (start, 0)) {
                Some(next) if (at, next) != (start, 0) => way = next,
                _ => return sides,
            }
        }
    }
}

/// Twice the enclosed area: positive for an outline, negative for a hole.
fn area(sides: &[Side]) -> i64 {
    sides.iter().map(|[x, from, to]| i64::from(*x) * i64::from(to - from)).sum()
}

/// Converts corners to pixel columns: one to the left on the right side of a piece.
fn vertices(sides: &[Side]) -> Vec<[i32; 2]> {
    let column = |[x, from, to]: &Side| x - i32::from(to > from);
    sides.iter().flat_map(|side| [[column(side), side[1]], [column(side), side[2]]]).collect()
}

/// Returns the polygons of a mask, with their holes.
pub(crate) fn polygons(mask: &Mask) -> Vec<Vec<[i32; 2]>> {
    let Some(mut borders) = Borders::new(mask) else { return Vec::new() };
    let (mut outlines, mut holes) = (Vec::new(), Vec::new());
    for corner in 0..borders.ways.len() {
        while borders.ways[corner] & 1 == 1 {
            let sides = borders.around(corner);
            if area(&sides) > 0 { outlines.push(sides) } else { holes.push(sides) }
        }
    }
    // The smallest outline around a hole is that of the piece with the hole.
    outlines.sort_by_key(|sides| area(sides));
    let is_around = |sides: &[Side], [x, y]: [i32; 2]| {
        let left = sides.iter().filter(|[at, from, to]| *at <= x && (*from.min(to)..*from.max(to)).contains(&y));
        left.count() % 2 == 1
    };
    let mut found: Vec<Vec<[i32; 2]>> = outlines.iter().map(|sides| vertices(sides)).collect();
    for hole in holes {
        let Some([x, from, to]) = hole.first().copied() else { continue };
        // The pixel beside it that is inside.
        let beside = [if to > from { x - 1 } else { x }, from.min(to)];
        let at = outlines.iter().position(|outline| is_around(outline, beside));
        at.into_iter().for_each(|at| cut(&mut found[at], &vertices(&hole)));
    }
    // In a piece one pixel wide, both sides are the same column.
    found.iter_mut().for_each(Vec::dedup);
    found
}

/// Connects a hole to the outline around it, there and back along one row.
fn cut(outline: &mut Vec<[i32; 2]>, hole: &[[i32; 2]]) {
    let Some(&entry) = hole.first() else { return };
    let crosses = |i: &usize| {
        let (a, b) = (outline[*i], outline[(*i + 1) % outline.len()]);
        a[0] == b[0] && (a[1].min(b[1])..=a[1].max(b[1])).contains(&entry[1])
    };
    let Some(at) = (0..outline.len()).find(crosses) else { return };
    let door = [outline[at][0], entry[1]];
    let way = [door].into_iter().chain(hole.iter().copied()).chain([entry, door]);
    outline.splice(at + 1..at + 1, way.collect::<Vec<_>>());
}

#[cfg(test)]
mod tests {
    use rand::{RngExt, SeedableRng};
    use rand_pcg::Pcg32;

    use super::*;

    fn drawn(rows: &[&str]) -> Mask {
        let width = rows[0].len();
        Mask::from_fn(width, rows.len(), |i| rows[i / width].as_bytes()[i % width] == b'#')
    }

    fn again(mask: &Mask, polygons: &[Vec<[i32; 2]>]) -> Mask {
        let mut all = Mask::empty(mask.width_px(), mask.height_px());
        polygons.iter().for_each(|p| all.add_polygon(&p.iter().map(|v| v.map(f64::from)).collect::<Vec<_>>()));
        all
    }

    #[test]
    fn pieces_holes_and_islands_in_holes_survive() {
        for (rows, pieces) in [
            (&["....", "...."][..], 0),
            (&["#"], 1),
            (&["##.#", "##.."], 2),
            (&["#.", ".#"], 2),
            (&["###", "#.#", "###"], 1),
            (&["#####", "#...#", "#.#.#", "#...#", "#####"], 2),
            (&["######", "#.##.#", "######", "#.#..#", "##.###"], 1),
            (&["#.#", "###", "#.#"], 1),
        ] {
            let mask = drawn(rows);
            let polygons = polygons(&mask);
            assert_eq!((polygons.len(), again(&mask, &polygons)), (pieces, mask), "{rows:?}");
        }
    }

    #[test]
    fn random_masks_are_the_same_again() {
        let mut rng = Pcg32::seed_from_u64(4);
        for round in 0..200 {
            let (w, h) = (rng.random_range(1..24), rng.random_range(1..24));
            let share = rng.random_range(0.05..0.95);
            let pixels: Vec<bool> = (0..w * h).map(|_| rng.random_range(0.0..1.0) < share).collect();
            let mask = Mask::from_fn(w, h, |i| pixels[i]);
            let polygons = polygons(&mask);
            assert_eq!(again(&mask, &polygons), mask, "round {round}");
            // Control: without one of the polygons, pixels are missing.
            assert!(polygons.is_empty() || again(&mask, &polygons[1..]) != mask);
        }
    }
}
