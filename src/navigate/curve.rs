//! A smooth way along straight legs: corners are rounded as far as occupied space allows, and its length is measured,
//! so that it can be followed at even speed.

use glam::DVec3;

use super::is_place;
use super::occupancy::OccupancyGrid;

/// Pieces that a rounded corner is measured in.
pub(crate) const PIECES: usize = 24;
/// Halvings of a corner's rounding before the corner is kept sharp.
const HALVINGS: u32 = 8;

/// A way with rounded corners.
#[derive(Clone, Debug)]
pub struct Curve {
    /// Points along it, and how far each is from the start.
    points: Vec<DVec3>,
    gone: Vec<f64>,
    /// Corners that had to stay (nearly) sharp.
    pub(crate) sharp: usize,
}

/// Legs without detours: drops every point that a straight line with this clearance can skip. First and last stay.
pub(crate) fn shortened(legs: &[DVec3], occupancy: &OccupancyGrid, clearance: f64) -> Vec<DVec3> {
    let legs: Vec<DVec3> = distinct(legs);
    let mut out: Vec<DVec3> = Vec::new();
    let mut at = 0;
    while at < legs.len() {
        out.push(legs[at]);
        if at + 1 == legs.len() {
            break;
        }
        // The farthest visible point, searched in growing, then in shrinking strides.
        let (mut best, mut stride) = (at + 1, 1);
        while best + stride < legs.len() && occupancy.is_free(legs[at], legs[best + stride], clearance) {
            best += stride;
            stride *= 2;
        }
        while stride > 0 {
            if best + stride < legs.len() && occupancy.is_free(legs[at], legs[best + stride], clearance) {
                best += stride;
            }
            stride /= 2;
        }
        at = best;
    }
    out
}

/// The points without those that repeat the one before, or are no places.
fn distinct(points: &[DVec3]) -> Vec<DVec3> {
    let mut out: Vec<DVec3> = points.iter().copied().filter(|p| is_place(*p)).collect();
    out.dedup_by(|a, b| a.distance(*b) <= 1e-12 * (1.0 + b.length()));
    out
}

impl Curve {
    /// Along `legs`, corners rounded where `clearance` can be kept. `None` for no point.
    pub fn new(legs: &[DVec3], occupancy: Option<&OccupancyGrid>, clearance: f64) -> Option<Self> {
        let legs = distinct(legs);
        let mut curve = Self { points: vec![*legs.first()?], gone: vec![0.0], sharp: 0 };
        for i in 1..legs.len() {
            let corner = legs[i];
            let Some(&next) = legs.get(i + 1) else {
                curve.push(corner);
                break;
            };
            let before = legs[i - 1];
            let reach = 0.5 * corner.distance(before).min(corner.distance(next));
            let directions = ((before - corner).try_normalize(), (next - corner).try_normalize());
            let (Some(back), Some(on)) = directions else { continue };
            let sides = [back, on];
            let mut rounding = reach;
            let mut bend = bend(corner, sides, rounding, PIECES);
            for _ in 0..HALVINGS {
                let free = |m: &OccupancyGrid| bend.windows(2).all(|w| m.is_free(w[0], w[1], clearance));
                if occupancy.is_none_or(free) {
                    break;
                }
                rounding *= 0.5;
                bend = self::bend(corner, sides, rounding, PIECES);
            }
            curve.sharp += usize::from(rounding < 0.01 * reach);
            bend.into_iter().for_each(|p| curve.push(p));
        }
        Some(curve)
    }

    fn push(&mut self, p: DVec3) {
        let last = self.points[self.points.len() - 1];
        let step = last.distance(p);
        if step > 0.0 {
            self.gone.push(self.length() + step);
            self.points.push(p);
        }
    }

    /// Its length, scene units.
    pub fn length(&self) -> f64 {
        self.gone[self.gone.len() - 1]
    }

    /// The point at this share of the way, 0 to 1.
    pub fn at(&self, share: f64) -> DVec3 {
        let wanted = share.clamp(0.0, 1.0) * self.length();
        let after = self.gone.partition_point(|g| *g <= wanted);
        if after == 0 {
            return self.points[0];
        }
        if after == self.points.len() {
            return self.points[after - 1];
        }
        let (a, b) = (self.gone[after - 1], self.gone[after]);
        self.points[after - 1].lerp(self.points[after], (wanted - a) / (b - a))
    }
}

/// A corner cut off by a parabola that touches both legs `rounding` before and after it.
/// `back` and `on` are unit vectors along them. In `pieces` straight pieces.
pub(crate) fn bend(corner: DVec3, [back, on]: [DVec3; 2], rounding: f64, pieces: usize) -> Vec<DVec3> {
    let (a, b) = (corner + back * rounding, corner + on * rounding);
    let at = |i: usize| {
        let u = i as f64 / pieces as f64;
        a.lerp(corner, u).lerp(corner.lerp(b, u), u)
    };
    (0..=pieces).map(at).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::navigate::testing::wall_with_hole;
    use crate::scene::GaussianCloud;

    #[test]
    fn corners_are_round_and_the_ends_stay() {
        let legs = [DVec3::ZERO, DVec3::X, DVec3::new(1.0, 1.0, 0.0)];
        let curve = Curve::new(&legs, None, 0.0).expect("points");
        assert_eq!((curve.at(0.0), curve.at(1.0)), (legs[0], legs[2]));
        assert!(curve.length() < 2.0 && curve.length() > 2.0_f64.sqrt());
        assert!(curve.at(0.5).distance(legs[1]) > 0.15, "the corner is cut");
        let step = |i: usize| curve.at((i + 1) as f64 / 400.0) - curve.at(i as f64 / 400.0);
        for i in 0..399 {
            assert!((step(i).length() - curve.length() / 400.0).abs() < 1e-4, "even speed");
            assert!(step(i).angle_between(step(i + 1)) < 0.09, "no kink at {i}");
        }
    }

    #[test]
    fn rounding_gives_way_to_occupancy() {
        // Around the rim of a hole: a wide bend would cut into the wall.
        let eyes = [DVec3::new(0.0, 0.0, -1.0), DVec3::new(0.0, 0.0, 1.0)];
        let occupancy = OccupancyGrid::of(&wall_with_hole(0.0, 0.4), &eyes, 0.05);
        let legs = [DVec3::new(1.2, 0.0, -0.3), DVec3::new(0.0, 0.0, 0.0), DVec3::new(1.2, 0.0, 0.3)];
        let clear = |clearance: f64| {
            let curve = Curve::new(&legs, Some(&occupancy), clearance).expect("points");
            (0..=500).map(|i| occupancy.clearance(curve.at(f64::from(i) / 500.0))).fold(f64::INFINITY, f64::min)
        };
        let wide = Curve::new(&legs, None, 0.0).expect("points");
        let least = (0..=500).map(|i| occupancy.clearance(wide.at(f64::from(i) / 500.0))).fold(f64::INFINITY, f64::min);
        assert!(least < 0.03, "the control: without looking it cuts into the wall, {least}");
        assert!(clear(0.05) >= 0.05, "{}", clear(0.05));
    }

    #[test]
    fn detours_are_left_out_where_one_sees_through() {
        let eyes = [DVec3::new(0.0, 0.0, -1.0), DVec3::new(0.0, 0.0, 1.0)];
        let empty = OccupancyGrid::of(&GaussianCloud::default(), &eyes, 0.1);
        let zigzag: Vec<DVec3> =
            (0..30).map(|i| DVec3::new(0.05 * f64::from(i % 2), 0.0, -0.9 + 0.06 * f64::from(i))).collect();
        assert_eq!(shortened(&zigzag, &empty, 0.0).len(), 2);
        let wall = OccupancyGrid::of(&wall_with_hole(0.0, 0.4), &eyes, 0.05);
        let through = [DVec3::new(1.0, 0.0, -0.6), DVec3::new(0.0, 0.0, 0.0), DVec3::new(1.0, 0.0, 0.6)];
        assert_eq!(shortened(&through, &wall, 0.1).len(), 3, "the wall is in the way");
    }

    #[test]
    fn one_point_none_and_repeated_ones() {
        assert!(Curve::new(&[], None, 0.0).is_none());
        assert!(Curve::new(&[DVec3::splat(f64::NAN)], None, 0.0).is_none());
        let one = Curve::new(&[DVec3::X, DVec3::X, DVec3::X], None, 0.0).expect("a point");
        assert_eq!((one.length(), one.at(0.3)), (0.0, DVec3::X));
        let back = Curve::new(&[DVec3::ZERO, DVec3::X, DVec3::ZERO], None, 0.0).expect("there and back");
        assert!(back.at(0.5).is_finite() && back.at(1.0) == DVec3::ZERO);
    }
}
