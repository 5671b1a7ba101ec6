//! Lengths, angles and areas of points in space.

use glam::{DMat3, DVec2, DVec3};

use super::eigen;

/// Distances below this share of the points' size count as none.
const NOTHING: f64 = 1e-9;

/// Reason why points have no length, angle or area.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[allow(missing_docs, reason = "each text says what its variant is")]
pub enum GeometryFault {
    #[error("more points are needed")]
    TooFew,
    #[error("a coordinate is not finite")]
    NotFinite,
    #[error("two neighboring points coincide")]
    SamePoints,
    #[error("the points lie on a line")]
    OnALine,
    #[error("the outline crosses itself")]
    Crossing,
}

/// Area of a polygon in the plane that fits its corners best.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PolygonFit {
    /// Area in that plane.
    pub(crate) area: f64,
    /// Unit normal of the plane.
    pub(crate) normal: DVec3,
    /// Root mean square of the corners' distances from the plane.
    pub(crate) rms: f64,
    /// Largest of these distances.
    pub(crate) farthest: f64,
}

/// Length of a line through points.
pub(crate) fn length(points: &[DVec3]) -> Result<f64, GeometryFault> {
    check(points, 2, false)?;
    Ok(points.windows(2).map(|pair| pair[0].distance(pair[1])).sum())
}

/// Angle at `vertex` between the directions to `a` and `b`, in radians. Directions that are equal make 0, opposite ones
/// half a turn.
pub(crate) fn angle([a, vertex, b]: [DVec3; 3]) -> Result<f64, GeometryFault> {
    check(&[a, vertex, b], 3, false)?;
    let [a, b] = [a, b].map(|end| (end - vertex).normalize_or_zero());
    // Exact near 0 and half a turn, where an arc cosine is not.
    Ok(2.0 * (a - b).length().atan2((a + b).length()))
}

/// Area of the polygon with these corners in order.
pub(crate) fn polygon(corners: &[DVec3]) -> Result<PolygonFit, GeometryFault> {
    let size = check(corners, 3, true)?;
    let n = corners.len() as f64;
    let middle = corners.iter().sum::<DVec3>() / n;
    let from_middle: Vec<DVec3> = corners.iter().map(|p| *p - middle).collect();
    let spread = from_middle.iter().fold(DMat3::ZERO, |sum, v| {
        let v = *v / size;
        sum + DMat3::from_cols(v * v.x, v * v.y, v * v.z)
    });
    let (values, axes) = eigen::axes(&spread);
    if !(values.y > NOTHING * values.x) {
        return Err(GeometryFault::OnALine);
    }
    let flat: Vec<DVec2> =
        from_middle.iter().map(|v| DVec2::new(v.dot(axes.x_axis), v.dot(axes.y_axis)) / size).collect();
    if crosses_itself(&flat) {
        return Err(GeometryFault::Crossing);
    }
    let doubled: f64 = around(&flat).map(|[a, b]| a.perp_dot(b)).sum();
    let off: Vec<f64> = from_middle.iter().map(|v| v.dot(axes.z_axis).abs()).collect();
    Ok(PolygonFit {
        area: 0.5 * doubled.abs() * size * size,
        normal: axes.z_axis,
        rms: (off.iter().map(|d| d * d).sum::<f64>() / n).sqrt(),
        farthest: off.iter().copied().fold(0.0, f64::max),
    })
}

/// Checks the points of a line, or of a `closed` outline. Returns their size.
fn check(points: &[DVec3], least: usize, closed: bool) -> Result<f64, GeometryFault> {
    if points.len() < least {
        return Err(GeometryFault::TooFew);
    }
    let origin = points[0];
    let size = points.iter().map(|p| p.distance(origin)).fold(0.0, |a: f64, b| if b.is_nan() { b } else { a.max(b) });
    if !size.is_finite() || !points.iter().all(|p| p.is_finite()) {
        return Err(GeometryFault::NotFinite);
    }
    let mut pairs = points.windows(2).map(|pair| pair[0].distance(pair[1]));
    let closing = closed.then(|| points[points.len() - 1].distance(origin));
    if pairs.by_ref().chain(closing).any(|distance| !(distance > NOTHING * size)) {
        return Err(GeometryFault::SamePoints);
    }
    Ok(size)
}

/// Edges of a closed outline.
fn around(corners: &[DVec2]) -> impl Iterator<Item = [DVec2; 2]> + Clone + '_ {
    corners.iter().zip(corners.iter().cycle().skip(1)).map(|(a, b)| [*a, *b])
}

/// True if two edges that do not follow each other meet.
fn crosses_itself(corners: &[DVec2]) -> bool {
    let n = corners.len();
    let edges: Vec<[DVec2; 2]> = around(corners).collect();
    // Twice the area of a triangle; 0 for a point on the edge, whatever rounding has left.
    let side = |[a, b]: [DVec2; 2], p: DVec2| {
        let area = (b - a).perp_dot(p - a);
        if area.abs() < NOTHING { 0.0 } else { area }
    };
    let meet = |e: [DVec2; 2], f: [DVec2; 2]| {
        let (c, d) = (side(e, f[0]), side(e, f[1]));
        let (a, b) = (side(f, e[0]), side(f, e[1]));
        // On one line, edges meet where their intervals do.
        if [a, b, c, d] == [0.0; 4] {
            let along = e[1] - e[0];
            let (low, high) = (f[0].dot(along).min(f[1].dot(along)), f[0].dot(along).max(f[1].dot(along)));
            return low <= e[1].dot(along) && high >= e[0].dot(along);
        }
        a * b <= 0.0 && c * d <= 0.0
    };
    let apart = |i: usize, k: usize| k > i + 1 && !(i == 0 && k == n - 1);
    (0..n).any(|i| (0..n).any(|k| apart(i, k) && meet(edges[i], edges[k])))
}

#[cfg(test)]
mod tests {
    use std::f64::consts::{FRAC_PI_2, PI};

    use glam::DQuat;

    use super::*;

    /// Points of a plane, turned and moved in space.
    fn placed(flat: &[[f64; 2]]) -> Vec<DVec3> {
        let turn = DQuat::from_axis_angle(DVec3::new(1.0, -2.0, 0.5).normalize_or_zero(), 1.1);
        flat.iter().map(|[x, y]| turn * DVec3::new(*x, *y, 0.0) + DVec3::new(100.0, -7.0, 3.0)).collect()
    }

    const SQUARE: [[f64; 2]; 4] = [[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]];

    #[test]
    fn a_unit_square_anywhere_in_space_has_area_one_and_is_planar() {
        let fit = polygon(&placed(&SQUARE)).expect("a polygon");
        assert!((fit.area - 1.0).abs() < 1e-9 && fit.farthest < 1e-9 && fit.rms < 1e-9, "{fit:?}");
        let mut backward = placed(&SQUARE);
        backward.reverse();
        assert!((polygon(&backward).expect("a polygon").area - 1.0).abs() < 1e-9, "in either direction");
        // An L of three unit squares, which is not convex.
        let l = [[0.0, 0.0], [2.0, 0.0], [2.0, 1.0], [1.0, 1.0], [1.0, 2.0], [0.0, 2.0]];
        assert!((polygon(&placed(&l)).expect("a polygon").area - 3.0).abs() < 1e-9);
        let triangle = polygon(&placed(&SQUARE[..3])).expect("a triangle");
        assert!((triangle.area - 0.5).abs() < 1e-9 && triangle.farthest < 1e-9, "three points are planar");
        // Control: a tenth larger is a fifth more area.
        let larger: Vec<DVec3> = placed(&SQUARE).iter().map(|p| *p * 1.1).collect();
        assert!((polygon(&larger).expect("a polygon").area - 1.21).abs() < 1e-9);
    }

    #[test]
    fn corners_off_the_plane_are_reported_with_their_distance() {
        let lifted: Vec<DVec3> = SQUARE
            .iter()
            .enumerate()
            .map(|(i, [x, y])| DVec3::new(*x, *y, if i % 2 == 0 { 0.01 } else { -0.01 }))
            .collect();
        let fit = polygon(&lifted).expect("a polygon");
        assert!((fit.rms - 0.01).abs() < 1e-6 && (fit.farthest - 0.01).abs() < 1e-6, "{fit:?}");
        assert!((fit.area - 1.0).abs() < 1e-6 && fit.normal.z.abs() > 0.999);
    }

    #[test]
    fn a_right_angle_is_ninety_degrees_and_a_straight_one_a_half_turn() {
        let [a, b, c, _] = [0, 1, 2, 3].map(|i| placed(&SQUARE)[i]);
        assert!((angle([a, b, c]).expect("an angle") - FRAC_PI_2).abs() < 1e-12);
        assert!((angle([b, a, c]).expect("an angle") - FRAC_PI_2 / 2.0).abs() < 1e-12, "control: half of it");
        let line = placed(&[[0.0, 0.0], [1.0, 0.0], [3.0, 0.0]]);
        assert!((angle([line[0], line[1], line[2]]).expect("straight") - PI).abs() < 1e-9);
        assert!(angle([line[1], line[0], line[2]]).expect("no turn").abs() < 1e-9);
        assert_eq!(angle([a, a, c]), Err(GeometryFault::SamePoints));
    }

    #[test]
    fn a_line_of_equal_points_of_one_point_or_of_no_numbers_has_no_length() {
        assert!((length(&placed(&SQUARE)).expect("a length") - 3.0).abs() < 1e-9, "not closed");
        assert_eq!(length(&[DVec3::ONE]), Err(GeometryFault::TooFew));
        assert_eq!(length(&[DVec3::ONE, DVec3::ONE]), Err(GeometryFault::SamePoints));
        assert_eq!(length(&[DVec3::X, DVec3::Y, DVec3::Y]), Err(GeometryFault::SamePoints));
        assert_eq!(length(&[DVec3::X, DVec3::NAN]), Err(GeometryFault::NotFinite));
        assert_eq!(length(&[DVec3::X, DVec3::splat(f64::MAX)]), Err(GeometryFault::NotFinite), "too far");
        // A point that is met again later is fine.
        assert_eq!(length(&[DVec3::ZERO, DVec3::X, DVec3::ZERO]), Ok(2.0));
    }

    #[test]
    fn outlines_on_a_line_or_across_themselves_are_refused() {
        let line = placed(&[[0.0, 0.0], [1.0, 0.0], [3.0, 0.0]]);
        assert_eq!(polygon(&line), Err(GeometryFault::OnALine));
        let bow_tie = placed(&[[0.0, 0.0], [1.0, 1.0], [1.0, 0.0], [0.0, 1.0]]);
        assert_eq!(polygon(&bow_tie), Err(GeometryFault::Crossing));
        let touching = placed(&[[0.0, 0.0], [2.0, 0.0], [2.0, 2.0], [1.0, 0.0], [0.0, 2.0]]);
        assert_eq!(polygon(&touching), Err(GeometryFault::Crossing), "a corner on another edge");
        let twice = placed(&[SQUARE[0], SQUARE[1], SQUARE[1], SQUARE[2]]);
        assert_eq!(polygon(&twice), Err(GeometryFault::SamePoints));
        let closed = placed(&[SQUARE[0], SQUARE[1], SQUARE[2], SQUARE[0]]);
        assert_eq!(polygon(&closed), Err(GeometryFault::SamePoints), "the last edge has no length");
        assert_eq!(polygon(&placed(&SQUARE[..2])), Err(GeometryFault::TooFew));
        // Control: a dent that does not reach the other side.
        let dent = placed(&[[0.0, 0.0], [2.0, 0.0], [2.0, 2.0], [1.0, 0.1], [0.0, 2.0]]);
        assert!(polygon(&dent).is_ok());
    }
}
