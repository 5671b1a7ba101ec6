//! Points drawn from a mask (the paper's `GenPrompt`): the first where it is thickest, the others far from its edge
//! and from earlier points. The middle of a mask may lie outside of it.

use crate::scene::Mask;

/// Most points.
const MOST: usize = 5;

/// Points inside a mask, px, each with `true`: the object is there. None of an empty mask.
pub(super) fn prompt_points(mask: &Mask) -> Vec<([f32; 2], bool)> {
    let width = mask.width_px();
    let depth = depths(mask);
    let thickest = depth.iter().copied().fold(0.0, f32::max);
    // Thin pieces are reached, ragged edges are not.
    let inner: Vec<usize> = mask.pixels().filter(|&i| depth[i] >= (0.3 * thickest).max(1.0)).collect();
    let far = |a: usize, b: usize| (a % width).abs_diff(b % width).pow(2) + (a / width).abs_diff(b / width).pow(2);
    let mut points: Vec<usize> = Vec::new();
    while points.len() < MOST {
        let room = |i: usize| {
            points.iter().map(|&p| (far(i, p) as f32).sqrt()).fold(f32::INFINITY, f32::min).min(depth[i] * 4.0)
        };
        let Some(&next) = inner.iter().max_by(|&&a, &&b| room(a).total_cmp(&room(b)).then(b.cmp(&a))) else { break };
        if !points.is_empty() && room(next) < thickest {
            break;
        }
        points.push(next);
    }
    points.into_iter().map(|i| ([(i % width) as f32 + 0.5, (i / width) as f32 + 0.5], true)).collect()
}

/// Distance of each pixel of a mask to the outside, px: chamfer distances with steps of 1 and 1.41.
fn depths(mask: &Mask) -> Vec<f32> {
    let (w, h) = (mask.width_px(), mask.height_px());
    let mut depth: Vec<f32> = (0..w * h).map(|i| if mask.contains(i) { f32::INFINITY } else { 0.0 }).collect();
    let diagonal = std::f32::consts::SQRT_2;
    for backward in [false, true] {
        for k in 0..w * h {
            let i = if backward { w * h - 1 - k } else { k };
            if depth[i] == 0.0 {
                continue;
            }
            let (x, y) = ((i % w) as isize, (i / w) as isize);
            let s = if backward { -1 } else { 1 };
            for (dx, dy, step) in [(-s, 0, 1.0), (0, -s, 1.0), (-s, -s, diagonal), (s, -s, diagonal)] {
                let (nx, ny) = (x + dx, y + dy);
                // The picture's edge cuts a mask off.
                let inside = nx >= 0 && ny >= 0 && nx < w as isize && ny < h as isize;
                let beside = if inside { depth[ny as usize * w + nx as usize] } else { 0.0 };
                depth[i] = depth[i].min(beside + step);
            }
        }
    }
    depth
}

#[cfg(test)]
mod tests {
    use super::*;

    fn points(w: usize, h: usize, is: impl Fn(usize, usize) -> bool + Sync) -> (Mask, Vec<[f32; 2]>) {
        let mask = Mask::from_fn(w, h, |i| is(i % w, i / w));
        let points = prompt_points(&mask);
        assert!(points.iter().all(|p| p.1));
        (mask, points.into_iter().map(|p| p.0).collect())
    }

    #[test]
    fn points_lie_inside_and_the_first_where_it_is_thickest() {
        let (_, disc) = points(61, 61, |x, y| (x as f32 - 30.0).hypot(y as f32 - 30.0) < 20.0);
        assert!((disc[0][0] - 30.5).abs() < 2.0 && (disc[0][1] - 30.5).abs() < 2.0, "{disc:?}");
        // The middle of a ring is outside of it.
        let ring = |x: usize, y: usize| (12.0..20.0).contains(&(x as f32 - 30.0).hypot(y as f32 - 30.0));
        let (mask, found) = points(61, 61, ring);
        assert!(found.len() >= 3, "{found:?}");
        assert!(found.iter().all(|[x, y]| mask.contains(*y as usize * 61 + *x as usize)), "{found:?}");
        let apart = |a: &[f32; 2], b: &[f32; 2]| (a[0] - b[0]).hypot(a[1] - b[1]);
        for (k, a) in found.iter().enumerate() {
            assert!(found[..k].iter().all(|b| apart(a, b) > 3.0), "{found:?}");
        }
        // Two pieces both get one.
        let (_, two) = points(80, 20, |x, _| !(15..=60).contains(&x));
        assert!(two.iter().any(|p| p[0] < 15.0) && two.iter().any(|p| p[0] > 60.0), "{two:?}");
        assert_eq!(points(5, 5, |x, y| (x, y) == (3, 1)).1, [[3.5, 1.5]]);
        assert!(points(5, 5, |_, _| false).1.is_empty());
    }
}
