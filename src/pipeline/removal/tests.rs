//! A box that stands on a table, removed.

use glam::{DVec2, DVec3};

use super::*;
use crate::math::sh::SH_C0;
use crate::math::srgb;
use crate::pipeline::observer::Silent;
use crate::render::{Features, Renderer};
use crate::scene::{Identities, Level, NO_IDENTITY};

const TABLE: IdentityId = 1;
const BOX: IdentityId = 2;

/// A table of 4 x 4 units at height 0 whose color rises along x, and a dark box of 0.8 units on it. Below the box
/// there is nothing, since no photo saw that area. Without the box the table is whole.
fn scene(is_bare: bool) -> (GaussianCloud, SemanticMap, Vec<Camera>) {
    let spacing = 0.04;
    let (mut places, mut colors, mut of) = (Vec::new(), Vec::new(), Vec::new());
    let steps =
        |from: f64, to: f64| (0..((to - from) / spacing) as usize).map(move |k| from + (k as f64 + 0.5) * spacing);
    for (x, z) in steps(-2.0, 2.0).flat_map(|x| steps(-2.0, 2.0).map(move |z| (x, z))) {
        if is_bare || x.abs() > 0.4 || z.abs() > 0.4 {
            places.push([x, 0.0, z]);
            colors.push([0.5 + 0.15 * x, 0.6, 0.4]);
            of.push(TABLE);
        }
    }
    for (a, b) in steps(-0.4, if is_bare { -0.4 } else { 0.4 }).flat_map(|a| steps(-0.4, 0.4).map(move |b| (a, b))) {
        let h = b + 0.4;
        for place in [[a, 0.8, b], [a, h, 0.4], [a, h, -0.4], [0.4, h, a], [-0.4, h, a]] {
            places.push(place);
            colors.push([0.1, 0.1, 0.4]);
            of.push(BOX);
        }
    }
    let positions = places.iter().map(|p| p.map(|v| v as f32)).collect();
    let mut cloud = GaussianCloud::isotropic(positions, (0.6 * spacing as f32).ln(), 3.0);
    cloud.sh = colors.iter().map(|c| c.map(|c| ((c - 0.5) / SH_C0) as f32)).collect();
    let mut identities = Identities::default();
    identities.add(Level::Object, NO_IDENTITY, vec!["table".into()]);
    identities.add(Level::Object, NO_IDENTITY, vec!["box".into()]);
    let margin = vec![1.0; of.len()];
    (cloud, SemanticMap::from_identities(identities, of, margin, vec![]), cameras(16, 0.0))
}

fn cameras(n: usize, shift: f64) -> Vec<Camera> {
    let at = |k: usize| {
        let angle = (k as f64 + shift) / n as f64 * std::f64::consts::TAU;
        let eye = DVec3::new(3.0 * angle.cos(), 2.0 + 0.5 * (k % 3) as f64, 3.0 * angle.sin());
        Camera::look_at(eye, DVec3::new(0.0, 0.2, 0.0), DVec3::Y, 0.7, 160, 120).expect("a camera")
    };
    (0..n).map(at).collect()
}

fn options(paint: Option<Paint>) -> RemovalOptions {
    RemovalOptions { ids: vec![BOX], halo: true, lift_shadow: false, paint, seed: 3 }
}

fn removed(paint: Option<Paint>) -> (SemanticMap, RemovalResult) {
    let (cloud, map, photos) = scene(false);
    let done =
        remove(&cloud, &map, &photos, &RenderSettings::default(), &options(paint), None, &mut Silent).expect("removed");
    (map, done)
}

/// Mean difference of color and depth from the bare table in the box's place, in views between the photos.
fn off(cloud: &GaussianCloud) -> (f64, f64) {
    let settings = RenderSettings { depth: true, ..RenderSettings::default() };
    let (mut color, mut depth, mut n) = (0.0, 0.0, 0.0);
    let table = scene(true).0;
    for camera in cameras(16, 0.5).iter().step_by(4) {
        let draw = |cloud| Renderer::new().render(cloud, Features::NONE, camera, &settings).expect("a frame");
        let (frame, truth) = (draw(cloud), draw(&table));
        for (x, z) in (-7..=7).flat_map(|x| (-7..=7).map(move |z| (f64::from(x) * 0.05, f64::from(z) * 0.05))) {
            let point = DVec3::new(x, 0.0, z);
            let DVec2 { x: px, y: py } = camera.project(point).expect("in front");
            let i = py as usize * frame.width_px + px as usize;
            color += (0..3).map(|c| f64::from((frame.color[c][i] - truth.color[c][i]).abs())).sum::<f64>() / 3.0;
            let far = f64::from(truth.median_depth[i]);
            depth += (f64::from(frame.median_depth[i]) - far).abs() / far;
            n += 1.0;
        }
    }
    (color / n, depth / n)
}

#[test]
fn what_a_box_hid_of_a_table_is_closed_with_its_color_and_depth() {
    let (_, open) = removed(None);
    let (color, depth) = off(&open.cloud);
    assert!(color > 0.2 && depth > 0.5, "there is no hole: {color} {depth}");
    for (paint, most) in [(Paint::Patches, 0.03), (Paint::Smooth, 0.03), (Paint::Telea, 0.05), (Paint::Nearest, 0.08)] {
        let (_, done) = removed(Some(paint));
        let (color, depth) = off(&done.cloud);
        assert!(color < most && depth < 0.01, "{paint:?}: {color} {depth}");
        let new = done.cloud.len() - done.kept.len();
        assert_eq!((new, done.report.surfaces.len()), (done.report.invented(), 1));
        // Below the box and nowhere else, and the table's.
        for i in done.kept.len()..done.cloud.len() {
            let at = done.cloud.world_position(i);
            assert!(at.x.abs() < 0.55 && at.z.abs() < 0.55 && at.y.abs() < 0.05, "{at}");
        }
        let count = |id| done.identity_of.iter().filter(|of| **of == id).count();
        assert_eq!((count(NO_IDENTITY), count(BOX)), (0, 0), "of {}", done.cloud.len());
        let flags = &done.cloud.extras.iter().find(|e| e.name == INVENTED).expect("flags").values;
        assert_eq!(flags.iter().filter(|v| **v == 1.0).count(), new);
        done.cloud.validate().expect("a valid cloud");
    }
}

#[test]
fn a_box_in_the_air_hides_nothing() {
    let (mut cloud, map, photos) = scene(false);
    // With a table below it that is whole.
    for (i, p) in cloud.positions.iter_mut().enumerate() {
        if map.identity_of[i] == BOX {
            p[1] += 1.0;
        }
    }
    let whole: Vec<usize> = (0..cloud.len()).filter(|i| map.identity_of[*i] == BOX).collect();
    let mut floor = cloud.select(&whole[..whole.len() / 5]);
    let mut at = (0..20).flat_map(|x| (0..20).map(move |z| [-0.38 + 0.04 * x as f32, 0.0, -0.38 + 0.04 * z as f32]));
    floor.positions.iter_mut().for_each(|p| *p = at.next().expect("as many"));
    let mut of = map.identity_of.clone();
    of.extend(vec![TABLE; floor.len()]);
    cloud.append(floor);
    let map = SemanticMap::from_identities(map.identities, of.clone(), vec![1.0; of.len()], vec![]);
    let done =
        remove(&cloud, &map, &photos, &RenderSettings::default(), &options(Some(Paint::Patches)), None, &mut Silent);
    assert_eq!(done.expect("removed").report.surfaces, []);
}

#[test]
fn what_makes_no_sense_is_refused_by_name() {
    let (cloud, map, photos) = scene(false);
    let settings = RenderSettings::default();
    let run = |map: &SemanticMap, photos: &[Camera], ids: Vec<IdentityId>, paint: Option<Paint>| {
        let options = RemovalOptions { ids, ..options(paint) };
        remove(&cloud, map, photos, &settings, &options, None, &mut Silent).map(|_| ())
    };
    let patches = Some(Paint::Patches);
    assert!(matches!(run(&map, &[], vec![BOX], patches), Err(RemovalError::Unseen(name)) if name == "box"));
    assert!(run(&map, &[], vec![BOX], None).is_ok());
    assert!(matches!(run(&map, &photos, vec![BOX, TABLE], None), Err(RemovalError::Everything(_))));
    let nobody = SemanticMap { identity_of: vec![TABLE; cloud.len()], ..map.clone() };
    assert!(matches!(run(&nobody, &photos, vec![BOX], patches), Err(RemovalError::Nothing(name)) if name == "box"));
}

#[test]
fn the_same_seed_gives_the_same_fill() {
    let (a, b) = (removed(Some(Paint::Patches)).1, removed(Some(Paint::Patches)).1);
    assert_eq!(a.cloud, b.cloud);
}

#[test]
fn a_table_that_is_removed_leaves_what_stood_on_it_and_no_surface() {
    let (cloud, map, photos) = scene(false);
    let options = RemovalOptions { ids: vec![TABLE], ..options(Some(Paint::Patches)) };
    let done = remove(&cloud, &map, &photos, &RenderSettings::default(), &options, None, &mut Silent).expect("removed");
    assert_eq!(done.report.surfaces, []);
    assert_eq!(done.kept.len(), map.members(BOX).len());
}

const STAIN: DVec3 = DVec3::new(-1.2, 0.0, 0.9);

/// Darkens the table where the box is between it and the sun, and in a round stain.
fn shaded(mut cloud: GaussianCloud, map: &SemanticMap) -> GaussianCloud {
    let sun = DVec3::new(0.5, 0.8, 0.3).normalize_or(DVec3::Y);
    for i in map.members(TABLE) {
        let at = cloud.world_position(i);
        let in_box = |t: f64| (at + sun * t).abs().cmple(DVec3::new(0.4, 0.8, 0.4)).all();
        if at.distance(STAIN) < 0.25 || (1..200).any(|k| in_box(0.01 * f64::from(k))) {
            cloud.sh[i] = cloud.sh[i].map(|v| {
                let dark = srgb::encode(0.5 * srgb::linear(0.5 + SH_C0 as f32 * v)).0;
                (dark - 0.5) / SH_C0 as f32
            });
        }
    }
    cloud
}

/// The largest and the mean change of the table's own colors against those without a shadow, in the shadow (or, with
/// `stain`, in the stain).
fn darker(lift_shadow: bool, stain: bool) -> (f32, usize) {
    let (bright, map, photos) = scene(false);
    let cloud = shaded(bright.clone(), &map);
    let options = RemovalOptions { lift_shadow, ..options(Some(Paint::Patches)) };
    let done = remove(&cloud, &map, &photos, &RenderSettings::default(), &options, None, &mut Silent).expect("removed");
    let of_it = |i: &usize| cloud.sh[*i] != bright.sh[*i] && (cloud.world_position(*i).distance(STAIN) < 0.25) == stain;
    let kept = done.kept.iter().enumerate().filter(|(_, i)| of_it(i) && map.identity_of[**i] == TABLE);
    let off: Vec<f32> = kept.map(|(k, i)| (bright.sh[*i][1] - done.cloud.sh[k][1]) * SH_C0 as f32).collect();
    (off.iter().sum::<f32>() / off.len() as f32, done.report.brightened)
}

#[test]
fn the_shadow_of_a_thing_goes_with_it_and_a_stain_stays() {
    let (kept, brightened) = darker(false, false);
    assert!(kept > 0.1 && brightened == 0, "there is no shadow: {kept}, {brightened}");
    let (lifted, brightened) = darker(true, false);
    assert!(lifted.abs() < 0.25 * kept && brightened > 100, "{lifted} of {kept} is left, {brightened}");
    assert!(darker(true, true).0 > 0.8 * darker(false, true).0, "the stain is gone");
}

#[test]
fn what_is_no_shadow_of_the_thing_is_not_lifted() {
    let (cloud, map, photos) = scene(false);
    let options = RemovalOptions { lift_shadow: true, ..options(Some(Paint::Smooth)) };
    let bare = remove(&cloud, &map, &photos, &RenderSettings::default(), &options, None, &mut Silent);
    assert_eq!(bare.expect("removed").report.brightened, 0);
}

#[test]
fn what_is_brighter_than_the_surface_is_not_made_brighter() {
    let (bright, map, photos) = scene(false);
    let mut cloud = shaded(bright.clone(), &map);
    let shade: Vec<usize> = map.members(TABLE).into_iter().filter(|i| cloud.sh[*i] != bright.sh[*i]).collect();
    let rest: Vec<usize> = shade.into_iter().step_by(40).collect();
    rest.iter().for_each(|i| cloud.sh[*i] = [1.7; 3]);
    let options = RemovalOptions { lift_shadow: true, ..options(Some(Paint::Patches)) };
    let done = remove(&cloud, &map, &photos, &RenderSettings::default(), &options, None, &mut Silent).expect("removed");
    let kept: Vec<usize> = (0..done.kept.len()).filter(|k| rest.contains(&done.kept[*k])).collect();
    assert!(kept.len() > 3 && done.report.brightened > 100, "{} {}", kept.len(), done.report.brightened);
    assert!(kept.iter().all(|k| done.cloud.sh[*k] == [1.7; 3]), "they are brighter");
}

#[test]
fn the_surface_is_drawn_anew_in_deep_shadow_and_is_not_called_invented() {
    let (bright, map, photos) = scene(false);
    let cloud = shaded(bright, &map);
    let run = |lift_shadow: bool| {
        let options = RemovalOptions { lift_shadow, ..options(Some(Paint::Patches)) };
        remove(&cloud, &map, &photos, &RenderSettings::default(), &options, None, &mut Silent).expect("removed")
    };
    assert_eq!(run(false).report.redrawn, 0);
    let done = run(true);
    let flags = invented_flags(&done.cloud).expect("flags");
    let new = done.kept.len()..done.cloud.len();
    let invented = new.clone().filter(|i| flags[*i] == 1.0).count();
    assert_eq!((invented, new.len()), (done.report.invented(), done.report.invented() + done.report.redrawn));
    let redrawn: Vec<usize> = new.filter(|i| flags[*i] == 0.0).collect();
    assert!(redrawn.len() > 100, "{}", redrawn.len());
    let off = |i: &usize| {
        let (at, rgb) = (done.cloud.world_position(*i), rebuild::shown(&done.cloud, *i));
        (rgb[0] - (0.5 + 0.15 * at.x as f32)).abs().max((rgb[1] - 0.6).abs())
    };
    let mean = redrawn.iter().map(off).sum::<f32>() / redrawn.len() as f32;
    assert!(mean < 0.05, "{mean} from the table's color");
}

#[test]
fn what_shows_through_from_below_goes_and_what_lies_deeper_stays() {
    let (mut cloud, mut map, photos) = scene(false);
    let places = [[0.0, -0.1, 0.1], [0.0, -0.8, 0.1], [1.3, -0.1, 0.1]];
    let mut blobs = GaussianCloud::isotropic(places.to_vec(), 0.08_f32.ln(), 3.0);
    blobs.sh = vec![[-1.5; 3]; places.len()];
    let first = cloud.len();
    cloud.append(blobs);
    let mut of = map.identity_of.clone();
    of.extend([TABLE; 3]);
    map = SemanticMap::from_identities(map.identities, of.clone(), vec![1.0; of.len()], vec![]);
    let settings = RenderSettings::default();
    let done = remove(&cloud, &map, &photos, &settings, &options(Some(Paint::Patches)), None, &mut Silent);
    let kept = done.expect("removed").kept;
    assert_eq!([0, 1, 2].map(|k| kept.contains(&(first + k))), [false, true, true]);
}
