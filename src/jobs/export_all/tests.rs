//! Exports are read back unchanged, and files of others are never replaced.

use std::collections::BTreeMap;
use std::path::Path;

use glam::DVec3;

use super::folder::{ExportFolder, LIST};
use super::*;
use crate::io::IoError;
use crate::io::labels::Labels;
use crate::io::labels::rle::Rle;
use crate::io::splat_format::SplatFormat;
use crate::pipeline::observer::Silent;
use crate::pipeline::observer::testing::StopsAfter;
use crate::scene::{Identities, IdentityId, Level, Mask, NO_IDENTITY, Photo};

const SIZE: [u32; 2] = [96, 72];

/// A ring of blobs around another one, two mugs of one name with a handle each, a part of a part, and a hidden one.
fn request(folder: &Path, masks: &[MaskFormat]) -> ExportAllRequest {
    let mut all = Identities::default();
    let mut add = |whole: IdentityId, name: &str| {
        let level = if whole == NO_IDENTITY { Level::Object } else { Level::Part };
        all.add(level, whole, if name.is_empty() { vec![] } else { vec![name.into()] })
    };
    let ring = add(NO_IDENTITY, "ring of the \"hob\" / ..");
    let pan = add(NO_IDENTITY, "");
    let mugs = [add(NO_IDENTITY, "mug"), add(NO_IDENTITY, "mug")];
    let handles = mugs.map(|mug| add(mug, "handle"));
    let rivet = add(handles[0], "rivet");
    add(NO_IDENTITY, "ghost");
    let (mut positions, mut of) = (Vec::new(), Vec::new());
    let mut blob = |at: [f32; 2], id: IdentityId| {
        positions.push([at[0], at[1], 0.0]);
        of.push(id);
    };
    for k in 0..24 {
        let angle = k as f32 / 24.0 * std::f32::consts::TAU;
        blob([-0.5 + 0.35 * angle.cos(), 0.35 * angle.sin()], ring);
    }
    blob([-0.5, 0.0], pan);
    for (k, x) in [0.2, 0.75].into_iter().enumerate() {
        blob([x, 0.2], mugs[k]);
        blob([x, 0.0], mugs[k]);
        blob([x + 0.2, 0.1], handles[k]);
        // A second piece of it.
        blob([x, -0.45], handles[k]);
    }
    blob([0.2, -0.25], rivet);
    let n = of.len();
    let cloud = GaussianCloud {
        positions,
        log_scales: vec![[-2.9; 3]; n],
        quaternions: vec![[1.0, 0.0, 0.0, 0.0]; n],
        opacity_logits: vec![6.0; n],
        sh: vec![[1.0; 3]; n],
        ..GaussianCloud::default()
    };
    let map = SemanticMap::from_identities(all, of, vec![1.0; n], vec![]);
    let eye = |x: f64| {
        let to = DVec3::new(x, 0.0, 0.0);
        Camera::look_at(DVec3::new(x, 0.0, -3.0), to, DVec3::NEG_Y, 0.7, SIZE[0], SIZE[1]).expect("valid")
    };
    ExportAllRequest {
        cloud: Arc::new(cloud),
        map: Arc::new(map),
        settings: RenderSettings::default(),
        views: vec![("images/a b.jpg".into(), eye(0.0)), ("images/0002.png".into(), eye(0.4))],
        format: SplatFormat::Ply,
        masks: masks.to_vec(),
        folder: folder.to_owned(),
    }
}

/// The masks of a view by full names.
fn truth(request: &ExportAllRequest, camera: &Camera) -> BTreeMap<String, Mask> {
    let ExportAllRequest { cloud, map, settings, .. } = request;
    let all = &map.identities;
    let view = ViewMap::render(&mut Renderer::new(), cloud, &map.identity_of, all, camera, settings).expect("draws");
    let masks = all.iter().map(|(id, _)| (all.full_name(id), view.mask(all, id)));
    masks.filter(|(_, mask)| !mask.is_empty()).collect()
}

fn files(folder: &Path) -> Vec<String> {
    let list: serde_json::Value = crate::io::files::read_json(&folder.join(LIST)).expect("a list");
    list["files"].as_object().expect("files").keys().cloned().collect()
}

#[test]
fn masks_are_read_back_as_they_were() {
    let folder = tempfile::tempdir().expect("folder");
    let request = request(folder.path(), &MaskFormat::ALL);
    let done = run(&request, &mut Silent).expect("written");
    assert_eq!((done.written, done.left_out, done.photos), (7, 1, 2));
    let coco: serde_json::Value = crate::io::files::read_json(&folder.path().join("coco.json")).expect("JSON");
    for (name, camera) in &request.views {
        let truth = truth(&request, camera);
        assert!(truth.len() == 7 && truth["#2"].area() > 4, "{:?}", truth.keys());
        let photo = Photo::new(name.clone(), name.clone(), camera.clone());
        for format in ["isat", "ids", "coco.json"] {
            let labels = Labels::open(&folder.path().join(format)).expect("labels");
            assert!(labels.has(&photo));
            let regions = labels.of(&photo, 1_000).expect("regions");
            let full = |at: usize| {
                let line =
                    std::iter::successors(Some(at), |at| regions[*at].parent).map(|at| regions[at].name.as_str());
                line.collect::<Vec<_>>().join(" \u{b7} ")
            };
            // Pictures distinguish things of one name by the numbers in their list.
            let is_told = |name: &str| format != "ids" || !name.contains("mug");
            let told: BTreeMap<String, Mask> = (0..regions.len())
                .map(|at| (full(at), regions[at].mask.clone()))
                .filter(|(name, _)| is_told(name))
                .collect();
            let expected: BTreeMap<String, Mask> =
                truth.clone().into_iter().filter(|(name, _)| is_told(name)).collect();
            assert_eq!(told.keys().collect::<Vec<_>>(), expected.keys().collect::<Vec<_>>(), "{format}");
            assert!(told.iter().all(|(name, mask)| mask.iou(&expected[name]) == 1.0), "{format}");
            let mut areas: Vec<usize> = regions.iter().map(|r| r.mask.area()).collect();
            let mut true_areas: Vec<usize> = truth.values().map(Mask::area).collect();
            areas.sort_unstable();
            true_areas.sort_unstable();
            assert_eq!(areas, true_areas, "{format}");
        }
        let image =
            coco["images"].as_array().expect("list").iter().find(|i| i["file_name"] == **name).expect("the photo");
        let of = coco["annotations"].as_array().expect("list").iter().filter(|a| a["image_id"] == image["id"]);
        let mut found = 0;
        for annotation in of {
            let category =
                coco["categories"].as_array().expect("list").iter().find(|c| c["id"] == annotation["category_id"]);
            let rle: Rle = serde_json::from_value(annotation["segmentation"].clone()).expect("run lengths");
            let mask = rle.mask().expect("fits");
            assert_eq!(mask.iou(&truth[category.expect("a category")["name"].as_str().expect("a name")]), 1.0);
            found += 1;
        }
        assert_eq!(found, truth.len());
    }
    let levels =
        coco["categories"].as_array().expect("list").iter().map(|c| c["supercategory"].as_str().expect("a level"));
    assert_eq!(levels.filter(|level| *level == "part").count(), 3);
    // Gaussians: a whole with its pieces, in files with names of their own.
    let cloud = crate::io::splat_ply::read(&folder.path().join("gaussians/3-mug-3.ply")).expect("a splat");
    assert_eq!(cloud.len(), 5);
    let names = files(folder.path());
    assert!(
        names.contains(&"gaussians/1-ring-of-the-hob.ply".to_owned())
            && names.contains(&"gaussians/2-2.ply".to_owned()),
        "{names:?}"
    );
    assert!(names.iter().all(|name| folder.path().join(name).is_file()));
}

#[test]
fn only_what_an_export_has_written_is_replaced() {
    let folder = tempfile::tempdir().expect("folder");
    let refused =
        |masks: &[MaskFormat]| run(&request(folder.path(), masks), &mut Silent).expect_err("refused").to_string();
    std::fs::write(folder.path().join("thesis.txt"), "work").expect("written");
    assert!(refused(&[]).contains("has not written"));
    std::fs::remove_file(folder.path().join("thesis.txt")).expect("removed");
    let mut first = request(folder.path(), &MaskFormat::ALL);
    run(&first, &mut Silent).expect("written");
    let before = files(folder.path());
    // Again, with other names and fewer masks: remains of the first are removed.
    let map = Arc::make_mut(&mut first.map);
    map.identities.rename(8, "spook");
    map.identities.rename(3, "cup");
    first.masks = vec![MaskFormat::Isat];
    std::fs::write(folder.path().join("thesis.txt"), "work").expect("written");
    run(&first, &mut Silent).expect("written");
    let after = files(folder.path());
    assert!(after.contains(&"gaussians/3-cup.ply".to_owned()) && after.len() < before.len());
    let gone: Vec<&String> = before.iter().filter(|f| !after.contains(f)).collect();
    assert!(gone.iter().all(|f| !folder.path().join(f).exists()) && gone.len() > 5, "{gone:?}");
    assert_eq!(std::fs::read_to_string(folder.path().join("thesis.txt")).expect("there"), "work");
    // Corrected files, or others in a place to be written, stop it before anything is written.
    let labels = folder.path().join("isat/0002.json");
    let corrected = std::fs::read_to_string(&labels).expect("there").replace("spook", "ghost") + " ";
    std::fs::write(&labels, &corrected).expect("written");
    assert!(refused(&[MaskFormat::Isat]).contains("has been changed since"));
    assert_eq!(std::fs::read_to_string(&labels).expect("there"), corrected);
    std::fs::remove_file(&labels).expect("removed");
    std::fs::write(folder.path().join("coco.json"), "mine").expect("written");
    assert!(refused(&[MaskFormat::Coco]).contains("was not exported"));
    assert_eq!(std::fs::read_to_string(folder.path().join("coco.json")).expect("there"), "mine");
    // Two photos of one stem would share their files.
    let mut twins = request(&folder.path().join("twins"), &[MaskFormat::Isat]);
    twins.views[1].0 = "other/A B.png".into();
    assert!(run(&twins, &mut Silent).expect_err("refused").to_string().contains("'other/A B.png'"));
    assert!(!folder.path().join("twins").exists());
}

#[test]
fn a_canceled_export_can_be_made_again() {
    let folder = tempfile::tempdir().expect("folder");
    let request = request(folder.path(), &[MaskFormat::Ids]);
    let stopped = run(&request, &mut StopsAfter::new(4));
    assert!(matches!(stopped, Err(JobError::Interrupted(_))), "{stopped:?}");
    assert!(files(folder.path()).len() < 7 && !files(folder.path()).is_empty());
    assert_eq!(run(&request, &mut Silent).expect("written").written, 7);
}

#[test]
fn an_export_that_was_killed_can_be_made_again() {
    let folder = tempfile::tempdir().expect("folder");
    let root = folder.path().join("out");
    let text = |text: &'static str| {
        move |path: &Path| {
            std::fs::write(path, text).expect("written");
            Ok(())
        }
    };
    let begin = || {
        let mut export = ExportFolder::open(&root).expect("open");
        export.write("a.txt", text("one")).expect("a");
        export.write("in/b.txt", text("two")).expect("b");
        export
    };
    // A process that is killed drops nothing.
    let killed = |mut export: ExportFolder| {
        let cut = export.write("c.txt", |path| {
            text("three")(path)?;
            Err(IoError::NotAFile { path: path.into() })
        });
        assert!(cut.is_err(), "between the file and the word that it is there");
        std::mem::forget(export);
        // The system would free the lock.
        std::fs::remove_file(root.join(".fmlgs.lock")).expect("lock");
    };
    killed(begin());
    killed(begin());
    let mut again = begin();
    again.write("c.txt", text("3")).expect("what was cut short is ours");
    again.close(true).expect("closed");
    assert_eq!(files(&root), ["a.txt", "c.txt", "in/b.txt"]);
    // Remains of an earlier run that this one does not write are removed.
    let mut less = ExportFolder::open(&root).expect("open");
    less.write("a.txt", text("one")).expect("a");
    killed(less);
    let mut less = ExportFolder::open(&root).expect("open");
    less.write("a.txt", text("one")).expect("a");
    less.close(true).expect("closed");
    assert_eq!(files(&root), ["a.txt"]);
    assert!(!root.join("c.txt").exists() && !root.join("in/b.txt").exists());
    // The controls: files of others and changed files stay.
    std::fs::write(root.join("d.txt"), "mine").expect("written");
    let mut export = begin();
    assert!(export.write("d.txt", text("theirs")).is_err());
    killed(export);
    std::fs::write(root.join("a.txt"), "changed").expect("written");
    assert!(ExportFolder::open(&root).is_err());
}
