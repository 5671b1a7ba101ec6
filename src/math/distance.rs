//! Exact distances on a grid: from every voxel to the nearest that is marked, one axis after another
//! (Felzenszwalb and Huttenlocher, "Distance transforms of sampled functions", 2012).

use rayon::prelude::*;

/// Squared distance from each voxel's center to that of the nearest marked one, in voxels, x fastest.
/// Without any marked voxel, the squared diagonal of the grid.
pub(crate) fn squared_distances(marked: &[bool], size: [usize; 3]) -> Vec<f32> {
    let [nx, ny, nz] = size;
    let farthest = size.iter().map(|n| (n * n) as f32).sum::<f32>();
    let mut d: Vec<f32> = marked.iter().map(|m| if *m { 0.0 } else { farthest }).collect();
    if d.is_empty() {
        return d;
    }
    d.par_chunks_mut(nx).for_each_init(|| Line::new(nx), |line, row| line.transform(row));
    d.par_chunks_mut(nx * ny).for_each_init(
        || (Line::new(ny), vec![0.0; ny]),
        |(line, column), slab| {
            for x in 0..nx {
                (0..ny).for_each(|y| column[y] = slab[y * nx + x]);
                line.transform(column);
                (0..ny).for_each(|y| slab[y * nx + x] = column[y]);
            }
        },
    );
    // Along z, rows of x are brought together, so that threads write to memory of their own.
    let mut turned = vec![0.0; d.len()];
    turned.par_chunks_mut(nz * nx).enumerate().for_each_init(
        || (Line::new(nz), vec![0.0; nz]),
        |(line, column), (y, out)| {
            for x in 0..nx {
                (0..nz).for_each(|z| column[z] = d[(z * ny + y) * nx + x]);
                line.transform(column);
                (0..nz).for_each(|z| out[z * nx + x] = column[z]);
            }
        },
    );
    d.par_chunks_mut(nx).enumerate().for_each(|(row, out)| {
        let (z, y) = (row / ny, row % ny);
        out.copy_from_slice(&turned[(y * nz + z) * nx..][..nx]);
    });
    d
}

/// Lower envelope of the parabolas over one line.
struct Line {
    at: Vec<usize>,
    /// Start of each parabola's part of the line.
    from: Vec<f32>,
    out: Vec<f32>,
}

impl Line {
    fn new(n: usize) -> Self {
        Self { at: vec![0; n], from: vec![0.0; n + 1], out: vec![0.0; n] }
    }

    fn transform(&mut self, f: &mut [f32]) {
        let n = f.len();
        let Self { at, from, out } = self;
        let square = |i: usize| (i * i) as f32;
        let mut last = 0;
        at[0] = 0;
        (from[0], from[1]) = (f32::NEG_INFINITY, f32::INFINITY);
        for q in 1..n {
            let meet = |p: usize| ((f[q] + square(q)) - (f[p] + square(p))) / (2 * (q - p)) as f32;
            let mut s = meet(at[last]);
            while s <= from[last] && last > 0 {
                last -= 1;
                s = meet(at[last]);
            }
            last += 1;
            at[last] = q;
            (from[last], from[last + 1]) = (s, f32::INFINITY);
        }
        let mut k = 0;
        for (q, out) in out.iter_mut().enumerate() {
            while from[k + 1] < q as f32 {
                k += 1;
            }
            *out = square(q.abs_diff(at[k])) + f[at[k]];
        }
        f.copy_from_slice(&out[..n]);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn distances_are_those_of_brute_force() {
        let size = [7, 5, 6];
        let mut state = 1_u32;
        for round in 0..20 {
            let marked: Vec<bool> = (0..size.iter().product())
                .map(|_| {
                    state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
                    state >> 27 < round % 6
                })
                .collect();
            let place = |i: usize| [i % size[0], i / size[0] % size[1], i / (size[0] * size[1])];
            let apart = |a: usize, b: usize| {
                place(a).iter().zip(place(b)).map(|(p, q)| p.abs_diff(q).pow(2)).sum::<usize>() as f32
            };
            let farthest = size.iter().map(|n| (n * n) as f32).sum::<f32>();
            let got = squared_distances(&marked, size);
            for (i, d) in got.iter().enumerate() {
                let all = (0..marked.len()).filter(|j| marked[*j]).map(|j| apart(i, j));
                assert_eq!(*d, all.fold(farthest, f32::min), "{i} of round {round}");
            }
        }
        assert!(squared_distances(&[], [0, 0, 0]).is_empty());
    }
}
