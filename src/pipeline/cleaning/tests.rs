//! Floaters before a wall that photos show.

use std::path::Path;

use glam::DVec3;
use image::{ImageBuffer, Rgb};
use strum::VariantArray;

use super::neighbors::SplatNeighbors;
use super::*;
use crate::math::sh::SH_C0;
use crate::pipeline::observer::Silent;
use crate::render::{Features, Renderer};

/// Adds a ball of Gaussians of one color around a place.
fn add(cloud: &mut GaussianCloud, at: [f32; 3], color: [f64; 3], n: usize) {
    for k in 0..n {
        let turn = k as f32 * 2.4;
        cloud.positions.push([at[0] + 0.02 * turn.cos(), at[1] + 0.02 * turn.sin(), at[2]]);
        cloud.log_scales.push([0.03_f32.ln(); 3]);
        cloud.quaternions.push([1.0, 0.0, 0.0, 0.0]);
        cloud.opacity_logits.push(3.0);
        cloud.sh.push(color.map(|c| ((c - 0.5) / SH_C0) as f32));
    }
}

/// A wall of 60 x 60 Gaussians at z = 0 whose color changes along it, and a ring that hangs before it.
fn scene() -> GaussianCloud {
    let mut cloud = GaussianCloud { sh_degree: 0, ..GaussianCloud::default() };
    for (x, y) in (0..60).flat_map(|x| (0..60).map(move |y| (x, y))) {
        let at = [0.05 * x as f32 - 1.5, 0.05 * y as f32 - 1.5, 0.0];
        add(&mut cloud, at, [0.2 + 0.01 * f64::from(x), 0.8 - 0.01 * f64::from(y), 0.4], 1);
    }
    add(&mut cloud, [0.3, 0.2, 0.6], [0.9, 0.1, 0.1], 8);
    cloud
}
const WALL: usize = 3600;
const RING: usize = 8;
/// A Gaussian in the middle of the wall.
const INNER: usize = 1830;

/// Writes photos of a cloud, one file each.
fn photos(of: &GaussianCloud, folder: &Path) -> Vec<CleanView> {
    let view = |k: usize| {
        let eye = DVec3::new(-1.5 + 0.5 * k as f64, 0.4 * (k % 3) as f64, 4.0);
        let camera = Camera::look_at(eye, DVec3::ZERO, DVec3::Y, 0.9, 200, 150).expect("a camera");
        let frame = Renderer::new().render(of, Features::NONE, &camera, &RenderSettings::default()).expect("a frame");
        let path = folder.join(format!("{k}.png"));
        let pixel = |x: u32, y: u32| Rgb([0, 1, 2].map(|c| (255.0 * frame.color[c][(y * 200 + x) as usize]) as u8));
        ImageBuffer::from_fn(200, 150, pixel).save(&path).expect("written");
        CleanView { camera: camera.clone(), photo: Some(Photo::new(format!("{k}.png"), path, camera)) }
    };
    (0..7).map(view).collect()
}

fn measured(cloud: &GaussianCloud, views: &[CleanView]) -> CloudMeasures {
    measure(cloud, views, &RenderSettings::default(), &mut Silent).expect("measured")
}

fn chosen(rule: &str, of: &CloudMeasures) -> Vec<usize> {
    let chosen = rule.parse::<CleanRule>().expect("a rule").choose(of).expect("known");
    (0..chosen.len()).filter(|i| chosen[*i]).collect()
}

#[test]
fn what_photos_do_not_show_in_the_air_is_a_floater_and_what_they_show_is_none() {
    let folder = tempfile::tempdir().expect("a folder");
    let mut cloud = scene();
    let views = photos(&cloud, folder.path());
    assert_eq!(chosen("floaters", &measured(&cloud, &views)), [0; 0], "the ring is in the photos");
    add(&mut cloud, [-0.5, 0.1, 1.0], [0.1, 0.2, 0.9], 5);
    add(&mut cloud, [0.6, -0.4, 1.5], [0.0, 0.0, 0.0], 3);
    let first = WALL + RING;
    let of = measured(&cloud, &views);
    assert_eq!(chosen("floaters", &of), (first..first + 8).collect::<Vec<_>>());
    let off = chosen("error>0.2", &of);
    // The wall's own edges are mixed with what is behind it.
    let (edges, floaters) = (off.iter().filter(|i| **i < WALL).count(), off.iter().filter(|i| **i >= first).count());
    assert!(edges < WALL / 20 && floaters >= 6, "{edges} {floaters}");
    // Without photos there is no evidence for the ring.
    let of = measured(&cloud, &[]);
    assert_eq!(chosen("floaters", &of), (WALL..first + 8).collect::<Vec<_>>());
    assert_eq!(chosen("piece<20", &of), (WALL..first + 8).collect::<Vec<_>>());
    let unknown = CleanRule::Unsupported.choose(&of);
    assert_eq!(unknown, Err(RuleError::NoPhotos("weight")));
}

#[test]
fn measures_are_those_of_each_gaussian() {
    let folder = tempfile::tempdir().expect("a folder");
    let mut cloud = scene();
    let views = photos(&cloud, folder.path());
    let first = cloud.len();
    // A needle, a ghost, a giant behind the wall, and one far from all.
    for at in [[0.0, 0.0, 0.3], [0.2, 0.0, 0.3], [0.0, 0.0, -9.0], [90.0, 0.0, 0.0]] {
        add(&mut cloud, at, [0.5; 3], 1);
    }
    cloud.log_scales[first] = [0.4_f32.ln(), 0.01_f32.ln(), 0.005_f32.ln()];
    cloud.opacity_logits[first + 1] = -6.0;
    cloud.log_scales[first + 2] = [3.0_f32.ln(); 3];
    let of = measured(&cloud, &views);
    let value = |measure, i: usize| f64::from(of.get(measure).expect("known")[i]);
    assert!((value(SplatMeasure::Elongation, first) - 40.0).abs() < 1e-3);
    assert!((value(SplatMeasure::Size, first + 2) - 3.0).abs() < 1e-5);
    assert!((value(SplatMeasure::Opacity, first + 1) - 1.0 / (1.0 + 6.0_f64.exp())).abs() < 1e-6);
    assert!((value(SplatMeasure::Spacing, INNER) - 1.0).abs() < 0.2 && value(SplatMeasure::Spacing, first + 3) > 500.0);
    assert_eq!(value(SplatMeasure::Photos, WALL + 1), 7.0, "all show the ring");
    assert_eq!(value(SplatMeasure::Photos, first + 3), 0.0);
    assert!(value(SplatMeasure::Weight, first + 3) == 0.0 && value(SplatMeasure::Weight, WALL + RING / 2) > 0.3);
    assert_eq!(chosen("needles", &of), [first]);
    assert_eq!(chosen("faint", &of), [first + 1]);
    assert!(chosen("oversized", &of).contains(&(first + 2)));
    assert!(chosen("unsupported", &of).contains(&(first + 3)));
    assert!(!chosen("unsupported", &of).contains(&INNER));
    assert_eq!(chosen("color=#e61a1a", &of), (WALL..WALL + RING).collect::<Vec<_>>(), "the ring is red");
    // Grown, a Gaussian takes its neighbors along; shrunk, it is alone again.
    let only = |i: usize| (0..cloud.len()).map(|k| k == i).collect::<Vec<bool>>();
    let near = SplatNeighbors::new(&cloud, &mut Silent).expect("found");
    let grown = near.grown(&only(INNER));
    let count = |of: &[bool]| of.iter().filter(|c| **c).count();
    assert!(count(&grown) == 9 && grown[INNER - 1] && grown[INNER + 60] && grown[INNER - 61]);
    assert_eq!((near.shrunk(&grown), count(&near.shrunk(&only(INNER)))), (only(INNER), 0));
    let left = of.without(&only(INNER - 1));
    assert_eq!(left.get(SplatMeasure::Size).map(<[f32]>::len), Some(cloud.len() - 1));
    // No Gaussian, and one alone.
    for n in [0, 1] {
        let few = cloud.select(&(0..n).collect::<Vec<_>>());
        let of = measured(&few, &views);
        assert!(SplatMeasure::VARIANTS.iter().all(|m| of.get(*m).is_some_and(|v| v.iter().all(|v| v.is_finite()))));
        assert_eq!(chosen("floaters", &of), [0; 0]);
    }
}

#[test]
fn rules_are_read_as_they_are_written() {
    for text in [
        "floaters",
        "faint",
        "needles",
        "oversized",
        "unsupported",
        "color=#3050c0",
        "size>0.5",
        "photos<2",
        "error>0.25",
    ] {
        assert_eq!(text.parse::<CleanRule>().expect("a rule").to_string(), text);
    }
    assert_eq!(" size > 0.5 ".parse(), Ok(CleanRule::Above(SplatMeasure::Size, 0.5)));
    for text in [
        "",
        "dust",
        "size",
        "size>",
        "size>big",
        "size>nan",
        "size>inf",
        ">1",
        "height>2",
        "size>1<2",
        "color=#12",
        "color=#gg0000",
    ] {
        assert_eq!(text.parse::<CleanRule>(), Err(RuleError::Unknown(text.into())));
    }
}
