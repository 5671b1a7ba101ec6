//! Scenes far from zero in files of single precision: positions near zero, and the shift of the origin.
//!
//! At UTM coordinates a float has steps of half a unit. So exports are written relative to a nearby point. It is
//! reported and, if the format has room, kept in the file; reading the file restores the scene.

use std::borrow::Cow;

use glam::DVec3;

use crate::scene::{Bounds, GaussianCloud};

/// Start of the `.ply` comment with the shift, to which x, y and z are relative.
const COMMENT: &str = "fmlgs shift ";
/// Steps of single precision that call for a shift, as a share of the scene's size.
const COARSE: f64 = 1e-5;

/// Returns the shift of a cloud if single precision would round its positions beyond a hundred-thousandth of its size.
/// Whole numbers, unless the cloud is small.
pub(super) fn of(cloud: &GaussianCloud) -> Option<DVec3> {
    let far = cloud.origin.abs().max_element() as f32;
    let step = f64::from(far.next_up() - far);
    let places = cloud.positions.iter().map(|p| DVec3::from_array(p.map(f64::from)));
    let radius = Bounds::robust(places)?.radius();
    let is_coarse = step > COARSE * radius && far > 0.0;
    is_coarse.then(|| if radius > 1.0 { cloud.origin.round() } else { cloud.origin })
}

/// Returns the cloud relative to the returned shift, if it needs one.
pub(super) fn near_zero(cloud: &GaussianCloud) -> (Cow<'_, GaussianCloud>, Option<DVec3>) {
    let Some(shift) = of(cloud) else { return (Cow::Borrowed(cloud), None) };
    let mut near = cloud.clone();
    let rest = cloud.origin - shift;
    near.positions.iter_mut().for_each(|p| *p = (DVec3::from_array(p.map(f64::from)) + rest).as_vec3().to_array());
    near.origin = DVec3::ZERO;
    (Cow::Owned(near), Some(shift))
}

/// Comment with the shift, without the word `comment`.
pub(super) fn comment(shift: DVec3) -> String {
    format!("{COMMENT}{}", text(shift))
}

/// The three numbers as text, which [`parsed`] reads back exactly.
pub(super) fn text(DVec3 { x, y, z }: DVec3) -> String {
    format!("{x} {y} {z}")
}

/// Finds the shift in the comments of a `.ply`; `Err` if a comment does not hold three numbers.
pub(super) fn of_comments(comments: &[&str]) -> Result<Option<DVec3>, String> {
    let Some(text) = comments.iter().find_map(|c| c.strip_prefix(COMMENT)) else { return Ok(None) };
    parsed(text).map(Some).ok_or_else(|| format!("the comment '{COMMENT}' does not hold three numbers"))
}

/// Parses three finite numbers.
pub(super) fn parsed(text: &str) -> Option<DVec3> {
    let numbers: Vec<f64> = text.split_ascii_whitespace().filter_map(|w| w.parse().ok()).collect();
    let place = DVec3::from_array(<[f64; 3]>::try_from(numbers).ok()?);
    place.is_finite().then_some(place)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::io::test_clouds;

    #[test]
    fn far_clouds_are_written_near_zero_and_put_back() {
        let origin = DVec3::new(456_789.25, 5_678_901.5, 312.0);
        let far = GaussianCloud { origin, ..test_clouds::random(500, 0) };
        let (near, shift) = near_zero(&far);
        let shift = shift.expect("far");
        assert!(shift == origin.round() && near.origin == DVec3::ZERO);
        let most = (0..far.len())
            .map(|i| (near.world_position(i) + shift - far.world_position(i)).length())
            .fold(0.0, f64::max);
        assert!(most < 1e-6, "{most}");
        assert_eq!(of_comments(&["x", &comment(shift)]), Ok(Some(shift)));
        assert!(of_comments(&["fmlgs shift 1 2"]).is_err() && of_comments(&["fmlgs shift 1 2 inf"]).is_err());
        let close = GaussianCloud { origin: DVec3::ONE, ..far.clone() };
        assert!(near_zero(&close) == (Cow::Borrowed(&close), None));
        let small =
            GaussianCloud { positions: far.positions.iter().map(|p| p.map(|v| v * 1e-3)).collect(), ..far.clone() };
        assert_eq!(of(&small), Some(origin), "half a unit is much for it");
    }
}
