//! Painting by fast marching (Telea: "An image inpainting technique based on the fast marching method", 2004), the
//! baseline: colors go inward from the rim, nearest texels first, along their slopes there.

use std::cmp::Reverse;
use std::collections::BinaryHeap;

use crate::math::grid::neighbors;

/// Radius around a texel that it is painted from, texels.
const RADIUS: i64 = 5;

pub(super) fn fill(color: &mut [[f32; 3]], size: [usize; 2], known: &[bool], hole: &[bool]) {
    let far = |i: usize| if known[i] { 0.0 } else { f32::INFINITY };
    let mut march = March { size, far: (0..known.len()).map(far).collect(), done: known.to_vec() };
    let mut next = BinaryHeap::new();
    let reach = |march: &mut March, next: &mut BinaryHeap<_>, from: usize| {
        for j in neighbors(from, size[0], known.len()).filter(|j| hole[*j] && !known[*j]) {
            let far = march.arrival(j);
            if !march.done[j] && far < march.far[j] {
                march.far[j] = far;
                // Non-negative floats order like their bits.
                next.push(Reverse((far.to_bits(), j)));
            }
        }
    };
    (0..known.len()).filter(|i| known[*i]).for_each(|i| reach(&mut march, &mut next, i));
    while let Some(Reverse((_, i))) = next.pop() {
        if !march.done[i] {
            color[i] = march.painted(color, i);
            march.done[i] = true;
            reach(&mut march, &mut next, i);
        }
    }
}

struct March {
    size: [usize; 2],
    /// Arrival time of the front at each texel.
    far: Vec<f32>,
    done: Vec<bool>,
}

impl March {
    /// Returns the texel at this offset, if it is inside and done.
    fn beside(&self, i: usize, dx: i64, dy: i64) -> Option<usize> {
        let [w, h] = self.size.map(|s| s as i64);
        let (x, y) = (i as i64 % w + dx, i as i64 / w + dy);
        let j = (0..w).contains(&x) && (0..h).contains(&y);
        j.then(|| (y * w + x) as usize).filter(|j| self.done[*j])
    }

    /// Arrival time of the front, by the done texels on either axis.
    fn arrival(&self, i: usize) -> f32 {
        let first = |a: (i64, i64), b: (i64, i64)| {
            let far = |(dx, dy)| self.beside(i, dx, dy).map_or(f32::INFINITY, |j| self.far[j]);
            far(a).min(far(b))
        };
        let (a, b) = (first((-1, 0), (1, 0)), first((0, -1), (0, 1)));
        match (a - b).abs() < 1.0 {
            true => 0.5 * (a + b + (2.0 - (a - b).powi(2)).sqrt()),
            false => 1.0 + a.min(b),
        }
    }

    /// Change per texel along both axes, over the done texels.
    fn slope(&self, i: usize, of: impl Fn(usize) -> f32) -> [f32; 2] {
        let here = of(i);
        [(1, 0), (0, 1)].map(|(dx, dy)| match (self.beside(i, -dx, -dy), self.beside(i, dx, dy)) {
            (Some(a), Some(b)) => 0.5 * (of(b) - of(a)),
            (Some(a), None) => here - of(a),
            (None, Some(b)) => of(b) - here,
            (None, None) => 0.0,
        })
    }

    fn painted(&self, color: &[[f32; 3]], i: usize) -> [f32; 3] {
        let front = self.slope(i, |j| self.far[j]);
        let (mut sum, mut total) = ([0.0; 3], 0.0);
        for (dx, dy) in (-RADIUS..=RADIUS).flat_map(|dy| (-RADIUS..=RADIUS).map(move |dx| (dx, dy))) {
            let square = (dx * dx + dy * dy) as f32;
            let Some(j) = self.beside(i, dx, dy).filter(|_| square <= (RADIUS * RADIUS) as f32) else { continue };
            // From there to here.
            let to = [-dx as f32, -dy as f32];
            let along = ((to[0] * front[0] + to[1] * front[1]).abs() / square.sqrt()).max(1e-6);
            let weight = along / square / (1.0 + (self.far[j] - self.far[i]).abs());
            for (c, sum) in sum.iter_mut().enumerate() {
                let slope = self.slope(j, |k| color[k][c]);
                *sum += weight * (color[j][c] + slope[0] * to[0] + slope[1] * to[1]);
            }
            total += weight;
        }
        if total > 0.0 { sum.map(|s| (s / total).clamp(0.0, 1.0)) } else { [0.5; 3] }
    }
}
