//! Colors of things made of a few Gaussians.

use super::ColorVerdict::{No, Partly, Yes};
use super::*;
use crate::math::srgb::encode;
use crate::scene::{Identities, Level, NO_IDENTITY};

const RED: [f64; 3] = [0.8, 0.1, 0.1];
const BLUE: [f64; 3] = [0.1, 0.1, 0.8];
const WHITE: [f64; 3] = [0.9; 3];
const BLACK: [f64; 3] = [0.08; 3];

fn cloud_of(colors: &[[f64; 3]]) -> GaussianCloud {
    let n = colors.len();
    GaussianCloud {
        positions: vec![[0.0; 3]; n],
        log_scales: vec![[-3.0; 3]; n],
        quaternions: vec![[1.0, 0.0, 0.0, 0.0]; n],
        opacity_logits: vec![4.0; n],
        sh: colors.iter().map(|rgb| rgb.map(|c| ((c - 0.5) / SH_C0) as f32)).collect(),
        ..GaussianCloud::default()
    }
}

/// Returns the colors of one object.
fn seen(colors: &[[f64; 3]]) -> SeenColors {
    seen_in(&cloud_of(colors))
}

fn seen_in(cloud: &GaussianCloud) -> SeenColors {
    let n = cloud.len();
    SeenColors::of(cloud, &SemanticMap::from_identities(Identities::objects(1), vec![1; n], vec![1.0; n], vec![]))
}

fn verdict(seen: &SeenColors, word: &str) -> ColorVerdict {
    seen.judge(1, row(word).expect("a color")).expect("Gaussians")
}

/// Returns the terms by which an object can be called.
fn terms(colors: &[[f64; 3]]) -> Vec<&'static str> {
    let seen = seen(colors);
    (0..COLORS.len()).filter(|row| seen.has(1, *row) == Some(true)).map(|row| COLORS[row][0]).collect()
}

/// Returns a color in less and less light.
fn shades(linear: [f32; 3]) -> Vec<[f64; 3]> {
    (1..=10).map(|light| linear.map(|c| f64::from(encode(c * light as f32 / 10.0).0))).collect()
}

#[test]
fn a_thing_has_the_colors_of_its_gaussians_and_pieces() {
    let mut all = Identities::default();
    let mug = all.add(Level::Object, NO_IDENTITY, vec![]);
    let handle = all.add(Level::Part, mug, vec![]);
    let lamp = all.add(Level::Object, NO_IDENTITY, vec![]);
    let mut cloud = cloud_of(&[RED, RED, RED, BLUE, [1.0; 3], BLUE]);
    // The last one cannot be seen.
    cloud.opacity_logits[5] = -30.0;
    let map = SemanticMap::from_identities(all, vec![mug, mug, mug, handle, lamp, lamp], vec![1.0; 6], vec![]);
    let seen = SeenColors::of(&cloud, &map);
    let has = |id, word: &str| seen.has(id, row(word).expect("a color"));
    assert_eq!((has(mug, "red"), has(mug, "green")), (Some(true), Some(false)));
    assert_eq!(has(mug, "blue"), None, "a quarter is a matter of opinion");
    assert_eq!((has(handle, "red"), has(handle, "blue")), (Some(false), Some(true)));
    assert_eq!((has(lamp, "white"), has(lamp, "blue"), has(9, "red")), (Some(true), Some(false), None));
    let share = seen.share(mug, row("crimson").expect("a color")).expect("Gaussians");
    assert!((share - 0.75).abs() < 1e-6, "{share}");
    assert_eq!((seen.share(mug, COLORS.len()), seen.judge(mug, 99)), (None, None), "no such row");
    let unknown = SeenColors::default();
    assert_eq!((unknown.has(0, 0), unknown.share(1, 0), unknown.lightness(1)), (None, None, None));
    assert_eq!(unknown.judge_tone(1, ColorTone::Dark, None), None);
}

#[test]
fn a_white_mug_with_a_red_handle_is_white_and_a_black_and_white_camera_both() {
    let mug = seen(&[&[WHITE; 8][..], &[RED; 2]].concat());
    assert_eq!(["white", "red", "blue"].map(|word| verdict(&mug, word)), [Yes, Partly, No]);
    let camera = seen(&[BLACK, WHITE]);
    assert_eq!(["black", "white", "red"].map(|word| verdict(&camera, word)), [Yes, Yes, No]);
    let dotted = seen(&[&[WHITE; 19][..], &[RED]].concat());
    assert_eq!(verdict(&dotted, "red"), No, "one Gaussian of twenty");
}

#[test]
fn stripes_have_no_color_between_them() {
    assert_eq!(terms(&[RED, BLUE, RED, BLUE]), ["blue", "red"]);
    assert_eq!(terms(&[BLACK, WHITE]), ["black", "white"], "and not gray");
    let mixed = terms(&[[0.45, 0.1, 0.45]]);
    assert_eq!(mixed, ["purple"], "the control: their mean");
}

#[test]
fn a_thing_in_the_shade_keeps_its_color() {
    assert_eq!(terms(&shades([0.6, 0.02, 0.02])), ["red"]);
    assert_eq!(terms(&shades([0.02, 0.09, 0.5])), ["blue"]);
    assert_eq!(terms(&shades([0.85, 0.25, 0.01])), ["orange"], "dim orange alone would be brown");
    // A brown table is neither orange nor red, however it is lit.
    assert_eq!(terms(&shades([0.4, 0.18, 0.07])), ["brown"]);
    assert_eq!(terms(&[[0.545, 0.27, 0.075]; 3]), ["brown"], "the control: all of it is dim");
}

#[test]
fn dark_and_light_are_told_by_color() {
    let (navy, sky) = (seen(&[[0.05, 0.1, 0.3]]), seen(&[[0.6, 0.75, 0.95]]));
    let blue = row("blue");
    for (seen, dark, light) in [(&navy, Yes, No), (&sky, No, Yes)] {
        let tones = [ColorTone::Dark, ColorTone::Light];
        assert_eq!(tones.map(|tone| seen.judge_tone(1, tone, blue)), [Some(dark), Some(light)]);
        assert_eq!(tones.map(|tone| seen.judge_tone(1, tone, None)), [Some(dark), Some(light)]);
        assert_eq!(seen.judge_tone(1, ColorTone::Dark, row("red")), Some(No), "it is not red");
    }
    // A dark yellow is lighter than a light brown.
    let mustard = seen(&[[0.6, 0.48, 0.1]]);
    assert_eq!(mustard.judge_tone(1, ColorTone::Dark, row("yellow")), Some(Yes));
    assert_eq!(mustard.judge_tone(1, ColorTone::Dark, None), Some(No));
    let lightness = |rgb| seen(&[rgb]).lightness(1).expect("a Gaussian");
    assert!((lightness([1.0; 3]) - 1.0).abs() < 1e-6 && lightness([0.0; 3]) < 1e-6);
    // The mean of black and white is in the middle.
    assert!((seen(&[[0.0; 3], [1.0; 3]]).lightness(1).expect("Gaussians") - 0.5).abs() < 1e-6);
    assert_eq!(seen(&[[0.3; 3]]).judge_tone(1, ColorTone::Light, row("gray")), Some(No));
}

#[test]
fn many_vivid_hues_are_colorful() {
    let (green, yellow) = ([0.1, 0.6, 0.1], [0.9, 0.8, 0.1]);
    let colorful = |colors: &[[f64; 3]]| seen(colors).judge_tone(1, ColorTone::Colorful, None);
    assert_eq!(colorful(&[RED, green, BLUE, yellow]), Some(Yes));
    assert_eq!(colorful(&[RED, RED]), Some(No), "one vivid hue");
    assert_eq!(colorful(&[BLACK, WHITE]), Some(No));
    assert_eq!(colorful(&[[0.5, 0.48, 0.5], [0.48, 0.5, 0.48]]), Some(No), "nearly gray");
}

#[test]
fn numbers_stay_finite_whatever_the_cloud_holds() {
    let wild = [f32::NAN, f32::INFINITY, f32::NEG_INFINITY, f32::MAX, f32::MIN, -1e9];
    for value in wild {
        let mut cloud = cloud_of(&[RED; 5]);
        cloud.sh[0] = [value; 3];
        cloud.sh[1] = [0.0, value, 0.0];
        cloud.log_scales[2] = [value; 3];
        cloud.opacity_logits[3] = value;
        let seen = seen_in(&cloud);
        let shares: Vec<f64> = (0..COLORS.len()).map(|row| seen.share(1, row).expect("a sound Gaussian")).collect();
        assert!(shares.iter().all(|share| (0.0..=1.0).contains(share)), "{value}: {shares:?}");
        assert!(seen.lightness(1).is_some_and(|l| (0.0..=1.0).contains(&l)), "{value}");
    }
    let broken = GaussianCloud { sh: vec![[f32::NAN; 3]], ..cloud_of(&[RED]) };
    assert_eq!((seen_in(&broken).share(1, 0), seen_in(&broken).lightness(1)), (None, None));
}
