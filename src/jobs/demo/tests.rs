//! The shipped demo matches its recipe, the recipe is reproducible, and the queries are answered.

use std::path::PathBuf;

use super::*;
use crate::pipeline::observer::Silent;
use crate::pipeline::semantics::query::query_engine::QueryEngine;
use crate::pipeline::semantics::query::recipe::QueryConfig;
use crate::pipeline::semantics::view_map::ViewMap;
use crate::scene::{LevelFilter, SemanticMap};

/// The recipe with a fraction of its photos, pixels and steps.
fn small(seed: u64) -> DemoRecipe {
    let full = DemoRecipe::shipped();
    let photos =
        SynthOptions { views: 8, held_out: 2, width_px: 80, height_px: 60, samples: 1, points: 1_500, ..full.photos };
    let training = TrainConfig { steps: 40, max_side_px: 80, seed, ..full.training };
    DemoRecipe { photos, training, max_seeds: 2, home: 3, ..full }
}

/// Runs the recipe in `work`, from nothing but the photos there.
fn made(recipe: &DemoRecipe, work: &Path) -> Vec<u8> {
    let _ = std::fs::remove_dir_all(work.join("scene"));
    make(recipe, work, &mut Silent).expect("made").0
}

fn opened() -> (tempfile::TempDir, PathBuf, Scene) {
    let data = tempfile::tempdir().expect("folder");
    let folder = unpacked(&Folders { data: data.path().into() }, &mut Silent).expect("unpacked");
    let scene = open::scene(&folder.join("scene")).expect("opened");
    (data, folder, scene)
}

#[test]
fn the_recipe_always_makes_the_same() {
    let work = tempfile::tempdir().expect("folder");
    let one = made(&small(0), work.path());
    assert!(one == made(&small(0), work.path()), "byte for byte");
    assert!(one != made(&small(1), work.path()), "and another seed another");
}

#[test]
fn the_record_is_of_the_photos_that_ship() {
    let work = tempfile::tempdir().expect("folder");
    let (bytes, record) = make(&small(0), work.path(), &mut Silent).expect("made");
    let folder = work.path().join("unpacked");
    bundle::unpack(&bytes, &folder).expect("unpacked");
    let psnr = |photos: &Path| {
        let scene = open::scene(&folder.join("scene")).expect("opened");
        let job = PhotoComparison::new(&scene, photos, EvaluateOptions::default()).expect("photos");
        evaluate::photometric(&job, &mut Silent).expect("measured").psnr
    };
    let shipped = psnr(&folder.join("photos"));
    assert!((shipped - record.psnr).abs() < 1e-6, "{shipped} {}", record.psnr);
    // The control: the photos before they became JPEG give another number.
    let rendered = psnr(&work.path().join("photos"));
    assert!((rendered - record.psnr).abs() > 1e-3, "{rendered} {}", record.psnr);
}

#[test]
fn what_ships_was_made_by_the_recipe_and_is_whole() {
    let record: DemoRecord =
        serde_json::from_slice(&bundle::read(BUNDLE, RECORD, Path::new(NAME)).expect("read")).expect("parsed");
    let remedy = "make it anew: fmlgs demo --make assets/demo/demo.zip";
    assert_eq!((&record.recipe, record.scene), (&DemoRecipe::shipped(), demo::fingerprint()), "{remedy}");
    let sum = include_str!("../../../assets/demo/demo.sha256");
    assert_eq!(sum.split_whitespace().next(), Some(digest(BUNDLE).as_str()), "{remedy}");
    assert!(BUNDLE.len() < 6_000_000, "{} bytes", BUNDLE.len());
    assert!(record.psnr > 27.0 && record.object_miou > 0.85 && record.part_miou > 0.7, "{record:?}");
    let picture = image::load_from_memory(&picture().expect("a picture")).expect("decoded");
    assert_eq!([picture.width(), picture.height()], PICTURE_PX);
}

#[test]
fn what_ships_is_as_good_as_its_record_says() {
    let (_data, folder, scene) = opened();
    let record: DemoRecord = files::read_json(&folder.join(RECORD)).expect("read");
    assert_eq!((scene.cloud.len(), scene.name.as_str()), (record.gaussians, "Demo"));
    let mut map = scene.semantics().expect("objects");
    let mut job = PhotoComparison::new(&scene, &folder.join("photos"), EvaluateOptions::default()).expect("photos");
    assert_eq!(job.views.len(), 8);
    let quality = evaluate::photometric(&job, &mut Silent).expect("measured");
    // The same on every machine but for the last bits, which differ between processors.
    assert!((quality.psnr - record.psnr).abs() < 5e-3, "{} {}", quality.psnr, record.psnr);
    assert!((quality.ssim - record.ssim).abs() < 5e-4, "{} {}", quality.ssim, record.ssim);
    let info = trained::load_info(&folder.join("scene")).expect("read");
    assert_eq!(info.history.evaluations.last().map(|e| e.psnr), Some(record.psnr), "the history says the same");
    // Two of the eight views are a sample.
    job.views.truncate(2);
    let asked = |map: &SemanticMap| demo_questions::ask(map, &folder.join("photos"), &job, None).expect("asked");
    let found = asked(&map);
    assert!(found.object_miou > 0.75 && found.part_miou > 0.5, "{found:?}");
    let verdicts: Vec<&str> = found.asked.iter().map(|a| a.verdict).collect();
    assert_eq!(verdicts[5..], ["not found"; 2], "neither giraffe nor elephant");
    assert!(verdicts[..5].iter().all(|v| *v != "not found"), "{verdicts:?}");
    // The control: everything belongs to something else.
    let count = map.identities.len() as u32;
    map.identity_of.iter_mut().for_each(|id| *id = (*id + count / 2) % count + 1);
    let wrong = asked(&map);
    assert!(wrong.object_miou < 0.3 && wrong.part_miou < 0.3, "{wrong:?}");
}

#[test]
fn the_first_question_is_answered_by_buttons_that_are_seen() {
    let (_data, folder, scene) = opened();
    let map = scene.semantics().expect("objects");
    let photos = open::dataset(&folder.join("photos")).expect("photos");
    let camera = photos.photos[DemoRecipe::shipped().home].camera.limited_to(400);
    let mut renderer = Renderer::new();
    let view =
        ViewMap::render(&mut renderer, &scene.cloud, &map.identity_of, &map.identities, &camera, &scene.settings);
    let view = view.expect("drawn");
    let mut engine = QueryEngine::new(map.language.as_ref(), QueryConfig::default()).expect("an engine");
    let answered = engine.ask(&map, QUESTION, LevelFilter::Auto).expect("asked").expect("words");
    let names: Vec<String> = answered.chosen(1).iter().map(|id| map.identities.full_name(*id)).collect();
    assert!(!names.is_empty(), "{QUESTION}");
    assert!(names.iter().all(|n| n.contains("button") && n.ends_with(" · red controller")), "{names:?}");
    let seen = answered.mask(&view, None, &map.identities, 1).area();
    assert!(seen >= 20, "{seen} px are seen from where it opens");
}

/// Collects notes.
#[derive(Default)]
struct Notes(Vec<String>);

impl Observer for Notes {
    fn note(&mut self, _: crate::pipeline::observer::Severity, text: String) {
        self.0.push(text);
    }
}

#[test]
fn it_is_unpacked_once_and_a_users_copy_is_kept() {
    let data = tempfile::tempdir().expect("folder");
    let folders = Folders { data: data.path().into() };
    let mut notes = Notes::default();
    let folder = unpacked(&folders, &mut notes).expect("unpacked");
    let own = folder.join("scene/own.txt");
    std::fs::write(&own, "mine").expect("written");
    assert_eq!(unpacked(&folders, &mut notes).expect("again"), folder);
    assert_eq!(std::fs::read(&own).expect("kept"), b"mine");
    assert!(notes.0.is_empty(), "{:?}", notes.0);
}

#[test]
fn what_is_damaged_is_unpacked_again_and_what_was_there_is_kept() {
    let data = tempfile::tempdir().expect("folder");
    let folders = Folders { data: data.path().into() };
    let folder = unpacked(&folders, &mut Silent).expect("unpacked");
    let at = |name: &str| folder.join("scene").join(name);
    let cut = |path: &Path| {
        let bytes = std::fs::read(path).expect("read");
        std::fs::write(path, &bytes[..bytes.len() / 2]).expect("written");
    };
    let strange = |path: &Path| {
        let text = std::fs::read_to_string(path).expect("read").replacen('{', "{ \"state\": \"another\",", 1);
        std::fs::write(path, text).expect("written");
    };
    type Damage<'a> = (&'a str, &'a dyn Fn(&Path));
    let remove = |path: &Path| std::fs::remove_file(path).expect("removed");
    let damages: [Damage<'_>; 6] = [
        ("scene.json", &remove),
        ("scene.json", &cut),
        ("scene.json", &strange),
        ("point_cloud.ply", &remove),
        ("point_cloud.ply", &cut),
        ("semantic_map.safetensors", &remove),
    ];
    for (k, (name, damage)) in damages.into_iter().enumerate() {
        std::fs::write(at("own.txt"), format!("mine {k}")).expect("written");
        damage(&at(name));
        let mut notes = Notes::default();
        assert_eq!(unpacked(&folders, &mut notes).expect("unpacked again"), folder);
        let aside = folder.with_added_extension(format!("damaged-{}", k + 1));
        assert!(notes.0.len() == 1 && notes.0[0].contains(&aside.display().to_string()), "{name}: {:?}", notes.0);
        let scene = open::scene(&folder.join("scene")).expect("sound");
        assert!(scene.semantics().is_ok() && !at("own.txt").exists(), "{name}");
        assert_eq!(std::fs::read_to_string(aside.join("scene/own.txt")).expect("kept"), format!("mine {k}"));
    }
    // Photos are put back, and nothing of the scene changes.
    let photos = open::dataset(&folder.join("photos")).expect("photos");
    std::fs::write(at("own.txt"), "mine").expect("written");
    cut(&photos.photos[0].path);
    remove(&photos.photos[1].path);
    let mut notes = Notes::default();
    unpacked(&folders, &mut notes).expect("mended");
    assert!(notes.0.len() == 1 && notes.0[0].starts_with("2 damaged or missing files"), "{:?}", notes.0);
    assert!(at("own.txt").exists() && photos.photos[..2].iter().all(|p| image::open(&p.path).is_ok()));
    notes.0.clear();
    unpacked(&folders, &mut notes).expect("sound");
    assert!(notes.0.is_empty());
}
