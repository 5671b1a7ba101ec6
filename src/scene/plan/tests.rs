//! Decisions by facts, each beside a scene that needs the part left out.

use std::collections::BTreeSet;

use glam::DVec3;
use strum::VariantArray;

use super::*;
use crate::math::format::bytes;
use crate::math::{sh, stats};
use crate::scene::{
    Camera, GaussianCloud, Identities, LanguageFeatures, Level, NO_IDENTITY, SemanticMap, ViewFeatures,
};

/// One Gaussian whose second and third bands have one coefficient each.
fn colored(band_one: f32, band_two: f32) -> GaussianCloud {
    let mut sh = vec![[0.0; 3]; 16];
    (sh[1], sh[5]) = ([band_one; 3], [band_two; 3]);
    GaussianCloud { sh_degree: 3, sh, ..blobs(1, 0.0) }
}

/// `n` round Gaussians along a line, of this log-scale.
fn blobs(n: usize, log_scale: f32) -> GaussianCloud {
    GaussianCloud::isotropic((0..n).map(|i| [0.2 * i as f32 - 0.1 * n as f32, 0.0, 0.0]).collect(), log_scale, 3.0)
}

fn camera(side_px: u32) -> Camera {
    Camera::look_at(DVec3::new(0.0, 0.0, -4.0), DVec3::ZERO, DVec3::NEG_Y, 0.8, side_px, side_px / 2).expect("valid")
}

fn limits() -> Limits {
    Limits { train_side_px: 500, object_side_px: 1_024, sh_degree: 3, holdout_every: 8 }
}

fn objects(with_part: bool, with_looks: bool) -> SemanticMap {
    let mut identities = Identities::default();
    let doll = identities.add(Level::Object, NO_IDENTITY, vec!["doll".into()]);
    if with_part {
        identities.add(Level::Part, doll, vec!["eye".into()]);
    }
    let looks = ViewFeatures { raw: vec![vec![0.5; 4]], deviated: vec![vec![0.5; 4]] };
    let of = vec![looks; identities.len()];
    let language = with_looks.then(|| LanguageFeatures { encoder: "demo".into(), dimension: 4, by_identity: of });
    SemanticMap { identities, language, ..SemanticMap::default() }
}

/// The plan of a scene with everything, of which `change` takes something away.
fn plan(change: impl FnOnce(SceneFacts) -> SceneFacts) -> ScenePlan {
    let cameras = vec![camera(1_000); 9];
    let facts = SceneFacts::of(Machine { max_gaussians: 1_234_567, cores: 2, ..Machine::default() }, limits());
    let facts = facts.with_photos(&cameras).with_cloud(&colored(0.2, 0.1), 3, &cameras);
    ScenePlan::new(change(facts.with_semantics(Some(&objects(true, true)))), &Overrides::default())
}

#[test]
fn bands_under_the_noise_floor_are_dropped_and_others_kept() {
    assert_eq!(visible_degree(&colored(0.2, 1e-4)), 1);
    assert_eq!(visible_degree(&colored(0.2, 0.05)), 2);
    assert_eq!((visible_degree(&colored(0.0, 1e-4)), used_degree(&colored(0.0, 1e-4))), (0, 2));
    assert_eq!(used_degree(&colored(0.1, 0.0)), 1);
}

#[test]
fn dropped_bands_change_no_color_by_half_a_step() {
    let worst = |c: &GaussianCloud, kept: u8| {
        let change = |i: u32| {
            let z = 1.0 - (2.0 * f64::from(i) + 1.0) / 500.0;
            let (phi, r) = (f64::from(i) * 2.4, (1.0 - z * z).sqrt());
            let b = sh::basis(3, [r * phi.cos(), r * phi.sin(), z]);
            (sh::coefficients(kept)..16).map(|k| b[k] * f64::from(c.sh[k][0])).sum::<f64>().abs()
        };
        stats::worst((0..500).map(change))
    };
    let faint = colored(0.2, 2.5e-3);
    assert_eq!(visible_degree(&faint), 1);
    assert!(worst(&faint, 1) < NOISE_FLOOR);
    let strong = colored(0.2, 0.05);
    assert!(worst(&strong, 1) > NOISE_FLOOR, "a band that is seen is missed");
}

#[test]
fn what_the_gaussians_resolve_follows_their_size_and_not_the_photos() {
    let side =
        |log_scale: f32, side_px: u32| resolved_side_px(&blobs(40, log_scale), &[camera(side_px)]).expect("a size");
    let coarse = side(-2.0, 1_600);
    // 0.135 units wide, 4 away, a focal length of 946 px: 32 px of the 1,600.
    assert!((48..=52).contains(&coarse), "{coarse}");
    assert!(side(-2.0, 3_200).abs_diff(coarse) <= 2, "photos twice as large show no more");
    assert_eq!(side(-8.0, 1_600), 1_600, "fine Gaussians need every pixel");
    // Faint ones draw no detail.
    let mut mixed = blobs(40, -2.0);
    for i in 0..20 {
        (mixed.log_scales[i], mixed.opacity_logits[i]) = ([-8.0; 3], -6.0);
    }
    assert!(resolved_side_px(&mixed, &[camera(1_600)]).expect("a size") < 400);
    assert_eq!(resolved_side_px(&blobs(3, 0.0), &[]), None);
}

#[test]
fn a_scene_that_needs_everything_has_everything() {
    let p = plan(|facts| facts);
    assert_eq!((p.sh_degree, p.parts, p.holdout_every), (2, true, 8));
    assert_eq!([p.maps, p.encoder], [When::Used; 2]);
    assert!(p.lines.iter().all(|l| !l.reason.is_empty() && !l.choice.is_empty()));
    let line = |item: &str| p.line(item).expect("a line");
    assert_eq!((line("photos").choice.as_str(), line("photos").saving.as_str()), ("500 x 250 px", "10 MB"));
    assert_eq!(line("gaussians").choice, "at most 1,234,567");
    assert_eq!(line("navigation").choice, "at the first flight");
    assert_eq!(p.lines.iter().map(|l| l.item).collect::<BTreeSet<_>>().len(), 16, "each is told once");
}

#[test]
fn without_semantics_nothing_is_kept_for_them() {
    let p = plan(|facts| facts.with_semantics(None));
    assert_eq!([p.maps, p.encoder], [When::Never; 2]);
    assert!(p.line("navigation").expect("said").choice == "off" && p.line("thumbnails").is_none());
    let all = ScenePlan::new(p.facts, &Overrides::everything());
    assert_eq!(all.maps, When::Never, "nobody can want maps of nothing");
    assert!(!all.line("feature-maps").expect("said").overridden);
}

#[test]
fn objects_without_parts_or_looks_have_no_level_and_no_encoder_for_them() {
    let p = plan(|facts| facts.with_semantics(Some(&objects(false, false))));
    assert_eq!((p.parts, p.encoder, p.maps), (false, When::Never, When::Used));
    let p = plan(|facts| facts.with_semantics(Some(&objects(false, true))));
    assert_eq!((p.parts, p.encoder), (false, When::Used));
}

#[test]
fn a_finished_splat_has_nothing_to_train_or_to_fly_between() {
    let p = plan(|facts| SceneFacts { photos: None, ..facts });
    assert_eq!(p.holdout_every, 0);
    assert_eq!(["navigation", "photos"].map(|i| p.line(i).expect("said").choice.as_str()), ["off", "none"]);
    assert!(["holdout", "objects", "gaussians"].iter().all(|i| p.line(i).is_none()));
}

#[test]
fn a_single_photo_is_trained_on() {
    let p = plan(|facts| facts.with_photos(&[camera(1_000)]));
    assert_eq!(p.holdout_every, 0);
    let dataset = |n: usize| {
        let photo = |i: usize| crate::scene::Photo::new(i.to_string(), "a", camera(64));
        crate::scene::Dataset { photos: (0..n).map(photo).collect(), ..crate::scene::Dataset::default() }
    };
    assert_eq!(dataset(1).split(8), (vec![0], vec![]));
    assert_eq!(dataset(2).split(8), (vec![1], vec![0]), "of two, one is held out");
}

#[test]
fn a_person_can_have_it_otherwise_and_is_told_what_it_costs() {
    let gpu =
        |facts: SceneFacts| SceneFacts { machine: Machine { gpu: Some("a GPU".into()), ..facts.machine }, ..facts };
    let auto = plan(gpu);
    let every = Overrides::from_iter(Item::VARIANTS.iter().map(|&item| PlanOverride { item, instead: true }));
    let all = ScenePlan::new(auto.facts.clone(), &every);
    assert_eq!([auto.maps, auto.encoder, all.maps, all.encoder], [When::Used, When::Used, When::Always, When::Always]);
    assert_eq!(((auto.on_cpu, auto.levels), (all.on_cpu, all.levels)), ((false, false), (true, true)));
    assert_eq!((auto.train_side_px, all.train_side_px), (500, 1_000));
    assert_eq!((auto.sh_degree, auto.object_side_px), (all.sh_degree, all.object_side_px), "nobody can choose these");
    let overridden = all.lines.iter().filter_map(|line| Some((line, line.overridable?)));
    assert_eq!(overridden.clone().count(), Item::VARIANTS.len());
    for (line, item) in overridden {
        assert_eq!((line.item, line.choice.as_str(), line.overridden), (item.id(), item.alternative(), true));
        let before = auto.line(line.item).expect("said");
        assert!(!before.overridden && before.saving == line.saving, "{item:?}");
        assert!(line.reason.starts_with("Set by the user. Automatic choice: "), "{item:?}");
    }
}

#[test]
fn other_settings_of_a_person_change_the_plan() {
    let p = plan(|facts| facts.with_limits(Limits { object_side_px: 200, ..limits() }, None));
    assert_eq!(p.object_side_px, 200, "less than what its Gaussians resolve");
}

#[test]
fn lines_say_what_is_left_out_and_how_much_that_is() {
    let p = plan(|facts| facts.with_cloud(&colored(0.2, 1e-4), 3, &[camera(4_000)]));
    let line = |p: &ScenePlan, item: &str| {
        let l = p.line(item).expect("said").clone();
        (l.choice, l.reason, l.saving)
    };
    // Three bands are stored, the third is zero, the second too faint: 9 - 4 coefficients of 12 bytes are read.
    let (choice, _, saving) = line(&p, "color");
    assert_eq!((choice.as_str(), saving), ("SH degree 1 of 3", format!("{} read for every frame", bytes(60))));
    // Only zero bands: they leave memory, 16 - 9 coefficients.
    let zero = plan(|facts| facts.with_cloud(&colored(0.2, 0.1), 3, &[camera(4_000)]));
    assert_eq!(line(&zero, "color").2, format!("{} of memory", bytes(84)));
    let training = plan(|facts| SceneFacts { cloud: None, ..facts });
    assert_eq!(line(&training, "color").2, "15 of 16 coefficients at the start");
    let all = ScenePlan::new(p.facts.clone(), &Overrides::everything());
    let (auto, wanted) = (line(&p, "photos").1, line(&all, "photos").1);
    assert!(auto.starts_with("Training is"), "{auto}");
    assert_eq!(wanted, format!("Set by the user. Automatic choice: {auto}"));
    let none = plan(|facts| facts.with_semantics(Some(&objects(false, false))));
    assert_eq!(line(&none, "parts").0, "off");
    assert_eq!(line(&none, "parts").2, "3 of 6 channels of blended codes");
    assert_eq!(line(&p, "parts").0, "on");
    assert_eq!(line(&p, "thumbnails").2, "2 renderings at opening");
    let lost = plan(|facts| SceneFacts { photos: None, ..facts });
    assert!(line(&lost, "navigation").1.contains("no reachable viewpoint"));
    // The narrower Gaussians resolve a share of the pixels; the rest is saved.
    let coarse = plan(|facts| facts.with_cloud(&blobs(40, -2.0), 3, &[camera(1_000)]));
    let share = 1.0 - (f64::from(coarse.object_side_px) / 1_000.0).powi(2);
    assert_eq!(line(&coarse, "objects").2, format!("{:.0} % of the pixels of every view", 100.0 * share));
    assert_eq!(
        [When::Never, When::Used, When::Always].map(|w| [w.now(false), w.now(true)]),
        [[false, false], [false, true], [true, true]]
    );
}

#[test]
fn levels_of_detail_are_for_more_gaussians_than_a_cpu_draws_in_time() {
    let of = |gaussians: usize, gpu: bool, overrides: &str| {
        let machine = Machine { gpu: gpu.then(|| "a GPU".into()), ..Machine::default() };
        let cloud = CloudFacts { gaussians, ..CloudFacts::default() };
        let facts = SceneFacts { cloud: Some(cloud), machine, limits: limits(), ..SceneFacts::default() };
        let overrides = overrides.split_whitespace().map(|o| o.parse().expect("an override")).collect();
        let plan = ScenePlan::new(facts, &overrides);
        let line = plan.line("levels").expect("a line").clone();
        (plan.levels, line)
    };
    let (levels, line) = of(99_999, false, "");
    assert!(!levels && line.choice == "off" && line.saving.contains("4 MB"), "{line:?}");
    let (levels, line) = of(100_000, false, "");
    assert!(levels && line.choice == "while the camera moves" && line.overridable.is_none(), "{line:?}");
    assert!(!of(100_000, true, "").0, "a GPU draws them");
    assert!(of(100_000, true, "backend=cpu").0, "but not where it is not to be used");
    assert!(of(10, false, "levels=always").0);
}
