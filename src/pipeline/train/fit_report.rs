//! Report of what training learned of its photos: drift of the poses, spread of the exposures; and their place in the
//! scene's description.

use super::TrainView;
use super::photo_fits::PhotoFits;
use super::pose_offset::{MOVE_DEVIATION, PoseOffset, TURN_DEVIATION};
use super::poses::PoseRefiner;
use crate::io::trained::SceneInfo;
use crate::math::stats::median;
use crate::pipeline::observer::{Observer, Severity};
use crate::scene::{PhotoExposure, PhotoFit};

/// A pose counts as an outlier beyond this multiple of the median move and of the expected error.
const FAR: f64 = 3.0;
/// Most outliers that are named.
const NAMED: usize = 5;

/// Move in percent of the scene's radius, and turn in degrees.
fn drift(offset: &PoseOffset, extent: f64) -> [f64; 2] {
    [100.0 * offset.along.length() / extent, offset.turn.length().to_degrees()]
}

/// Stores refined poses and exposures in the description of the scene.
pub(super) fn store(fits: &PhotoFits, views: &[TrainView], info: &mut SceneInfo) {
    if !fits.is_on() {
        return;
    }
    info.photo_fits.clear();
    for (i, view) in views.iter().enumerate() {
        let poses = fits.poses.as_ref();
        let own = info.cameras.iter_mut().find(|c| !c.held_out && c.name == view.name);
        if let (Some(poses), Some(own)) = (poses, own) {
            own.camera = poses.camera(i, &own.camera);
        }
        info.photo_fits.push(PhotoFit {
            name: view.name.clone(),
            moved: poses.map(|p| drift(&p.offsets[i], p.extent)),
            exposure: fits.exposures.as_ref().map(|e| e.of(i)),
        });
    }
}

/// Tells how far poses moved and how far exposures are apart.
pub(super) fn tell(fits: &PhotoFits, views: &[TrainView], observer: &mut dyn Observer) {
    if let Some(poses) = fits.poses.as_ref().filter(|_| !views.is_empty()) {
        let (text, outliers) = of_poses(poses, views);
        observer.note(Severity::Info, text);
        if let Some(outliers) = outliers {
            observer.note(Severity::Warning, outliers);
        }
    }
    if let Some(exposures) = fits.exposures.as_ref().filter(|_| !views.is_empty()) {
        observer.note(Severity::Info, of_exposures(&exposures.exposures, views));
    }
}

/// The drift, and the photos that moved far.
fn of_poses(poses: &PoseRefiner, views: &[TrainView]) -> (String, Option<String>) {
    let all: Vec<[f64; 2]> = poses.offsets.iter().map(|o| drift(o, poses.extent)).collect();
    let of = |k: usize| all.iter().map(|d| d[k]).collect::<Vec<_>>();
    let most = |k: usize| {
        let at = (0..all.len()).max_by(|a, b| all[*a][k].total_cmp(&all[*b][k])).unwrap_or_default();
        (all[at][k], &views[at].name)
    };
    let [(moved, by), (turned, about)] = [most(0), most(1)];
    let text = format!(
        "Refined poses moved by {:.2} % of the scene's radius (median; most {moved:.2} %, {by}) and turned by {:.2}\u{b0} \
         (most {turned:.2}\u{b0}, {about})",
        median(&of(0)),
        median(&of(1)),
    );
    let usual = [median(&of(0)).max(100.0 * MOVE_DEVIATION), median(&of(1)).max(TURN_DEVIATION.to_degrees())];
    let times = |d: &[f64; 2]| (d[0] / usual[0]).max(d[1] / usual[1]);
    let mut far: Vec<usize> = (0..all.len()).filter(|i| times(&all[*i]) > FAR).collect();
    far.sort_by(|a, b| times(&all[*b]).total_cmp(&times(&all[*a])));
    let named: Vec<String> = far
        .iter()
        .take(NAMED)
        .map(|&i| format!("{} ({:.1} %, {:.1}\u{b0})", views[i].name, all[i][0], all[i][1]))
        .collect();
    let more = if far.len() > NAMED { ", ..." } else { "" };
    let outliers = (!far.is_empty()).then(|| {
        format!(
            "{} of {} poses moved far more than the others and may be wrong altogether: {}{more}. Look at these photos, \
             or leave them out",
            far.len(),
            all.len(),
            named.join(", ")
        )
    });
    (text, outliers)
}

fn of_exposures(exposures: &[PhotoExposure], views: &[TrainView]) -> String {
    let mean = |e: &PhotoExposure| e.gain.iter().sum::<f64>() / 3.0;
    let order = |a: &usize, b: &usize| mean(&exposures[*a]).total_cmp(&mean(&exposures[*b]));
    let [least, most] =
        [(0..exposures.len()).min_by(order), (0..exposures.len()).max_by(order)].map(Option::unwrap_or_default);
    let tint = |e: &PhotoExposure| {
        let [low, high] = [f64::min, f64::max].map(|pick| e.gain.into_iter().reduce(pick).unwrap_or(1.0));
        high / low
    };
    format!(
        "Exposures: gains from {:.2} ({}) to {:.2} ({}), channels of a photo apart by a factor of {:.2} (median)",
        mean(&exposures[least]),
        views[least].name,
        mean(&exposures[most]),
        views[most].name,
        median(&exposures.iter().map(tint).collect::<Vec<_>>())
    )
}

#[cfg(test)]
mod tests {
    use glam::DVec3;

    use super::*;
    use crate::pipeline::train::TrainConfig;
    use crate::scene::{Camera, PhotoPixels};

    fn views() -> Vec<TrainView> {
        let view = |k: usize| {
            let eye = DVec3::new((k as f64).cos(), (k as f64).sin(), 1.0) * 2.0;
            let camera = Camera::look_at(eye, DVec3::ZERO, DVec3::Z, 0.8, 8, 6).expect("valid");
            let pixels = PhotoPixels { width_px: 8, height_px: 6, rgb: vec![[9; 3]; 48], coverage: None, alpha: None };
            TrainView { name: format!("{k}.png"), camera, pixels }
        };
        (0..6).map(view).collect()
    }

    #[test]
    fn drift_is_told_and_only_far_photos_are_named() {
        let views = views();
        let config = TrainConfig { refine_poses: true, exposure: true, ..TrainConfig::default() };
        let mut fits = PhotoFits::new(&config, &views, &[true; 6], (0, 2.0));
        let told = |fits: &PhotoFits| of_poses(fits.poses.as_ref().expect("on"), &views);
        assert_eq!(told(&fits).1, None);
        let offset = |along: f64| PoseOffset { along: DVec3::X * along, turn: DVec3::Y * 0.001 };
        let own = &mut fits.poses.as_mut().expect("on").offsets;
        *own = vec![offset(0.02), offset(0.01), offset(0.03), offset(0.3), offset(0.02), offset(0.02)];
        let (text, far) = told(&fits);
        assert!(text.contains("moved by 1.00 %") && text.contains("most 15.00 %, 3.png"), "{text}");
        let far = far.expect("one");
        assert!(far.contains("1 of 6") && far.contains("3.png (15.0 %, 0.1\u{b0})") && !far.contains("2.png"), "{far}");
        let mut info = SceneInfo::default();
        store(&fits, &views, &mut info);
        assert_eq!(info.photo_fits[3].moved.map(|m| m[0].round()), Some(15.0));
        assert_eq!(info.photo_fits[3].exposure, Some(PhotoExposure::default()));
        // The control: a run that learns nothing of its photos stores nothing.
        let mut info = SceneInfo::default();
        store(&PhotoFits::default(), &views, &mut info);
        assert_eq!(info, SceneInfo::default());
    }
}
