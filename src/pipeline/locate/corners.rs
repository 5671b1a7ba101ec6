//! Corners of a picture: local maxima of the smaller eigenvalue of the structure tensor (Shi and Tomasi 1994), spread
//! evenly over the picture so that its high-contrast parts do not take them all.

use super::gray::GrayPlane;

/// Blur of the products of slopes, px.
const WINDOW_PX: f32 = 1.5;
/// Smallest eigenvalue of a corner: slopes of one gray level of 8 bits per px are noise.
const FLOOR: f32 = 1.0 / (255.0 * 255.0);
/// The picture is divided into so many columns and rows, each with its share of corners.
const GRID: usize = 8;
/// Border without corners, px: descriptors need surroundings.
const BORDER_PX: usize = 6;

/// Places of at most about `most` corners, px.
pub(super) fn corners([dx, dy]: &[GrayPlane; 2], most: usize) -> Vec<[f32; 2]> {
    let (w, h) = (dx.width, dx.height);
    if w <= 2 * BORDER_PX + 2 || h <= 2 * BORDER_PX + 2 {
        return Vec::new();
    }
    let product = |a: &GrayPlane, b: &GrayPlane| {
        let values = a.values.iter().zip(&b.values).map(|(a, b)| a * b).collect();
        GrayPlane { width: w, height: h, values }.blurred(WINDOW_PX).values
    };
    let (xx, xy, yy) = (product(dx, dx), product(dx, dy), product(dy, dy));
    let strength: Vec<f32> = (0..w * h)
        .map(|i| {
            let (middle, half) = ((xx[i] + yy[i]) * 0.5, (xx[i] - yy[i]) * 0.5);
            middle - half.hypot(xy[i])
        })
        .collect();
    let mut rooms: Vec<Vec<(f32, [f32; 2])>> = vec![Vec::new(); GRID * GRID];
    for y in BORDER_PX..h - BORDER_PX {
        for x in BORDER_PX..w - BORDER_PX {
            let at = y * w + x;
            let s = strength[at];
            let around = [at - w - 1, at - w, at - w + 1, at - 1, at + 1, at + w - 1, at + w, at + w + 1];
            if s <= FLOOR || around.iter().any(|&n| strength[n] > s || (strength[n] == s && n < at)) {
                continue;
            }
            // The top of the parabola through three neighbors.
            let top = |low: f32, high: f32| {
                let bend = low - 2.0 * s + high;
                if bend < 0.0 { (0.5 * (low - high) / bend).clamp(-0.5, 0.5) } else { 0.0 }
            };
            let place = [
                x as f32 + 0.5 + top(strength[at - 1], strength[at + 1]),
                y as f32 + 0.5 + top(strength[at - w], strength[at + w]),
            ];
            rooms[y * GRID / h * GRID + x * GRID / w].push((s, place));
        }
    }
    // Rooms with few corners leave their share to the others.
    let mut share = most.div_ceil(GRID * GRID);
    while rooms.iter().map(|r| r.len().min(share)).sum::<usize>() < most && rooms.iter().any(|r| r.len() > share) {
        share += share.div_ceil(4);
    }
    for room in &mut rooms {
        room.sort_by(|a, b| b.0.total_cmp(&a.0));
        room.truncate(share);
    }
    rooms.into_iter().flatten().map(|(_, place)| place).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_corners_of_a_square_are_found_and_its_edges_are_not() {
        let inside = |x: usize, y: usize| (20..44).contains(&x) && (16..40).contains(&y);
        let values = (0..64 * 56).map(|i| if inside(i % 64, i / 64) { 0.8 } else { 0.2 }).collect();
        let found = corners(&GrayPlane { width: 64, height: 56, values }.blurred(1.0).slopes(), 200);
        let corner = |x: f32, y: f32| found.iter().any(|p| (p[0] - x).hypot(p[1] - y) < 2.5);
        assert!(corner(20.0, 16.0) && corner(44.0, 16.0) && corner(20.0, 40.0) && corner(44.0, 40.0), "{found:?}");
        assert_eq!(found.len(), 4, "{found:?}");
        let flat = GrayPlane { width: 64, height: 56, values: vec![0.5; 64 * 56] };
        assert!(corners(&flat.slopes(), 200).is_empty());
    }
}
