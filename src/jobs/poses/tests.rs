//! Poses found by a program that behaves like COLMAP, and by none.

#![cfg(unix)]

mod growing;
mod video;

use std::os::unix::fs::PermissionsExt;

use super::front_door::{PoseRequest, find_in};
use super::maker::MakerPlaces;
use super::makers::choose;
use super::process::progress;
use super::*;
use crate::io::OpenError;
use crate::pipeline::observer::{Progress, Signal, Silent};

/// Behaves like COLMAP: records its arguments, prints COLMAP's lines, copies a reconstruction.
const SCRIPT: &str = r##"#!/bin/sh
echo "$@" >> "HERE/asked"
case "$1" in
help) echo "COLMAP 3.8 (without CUDA)" ;;
feature_extractor)
  [ "$2" = "-h" ] && { echo "  --SiftExtraction.use_gpu arg (=1)"; exit 0; }
  echo matches > "$3"; echo "Processed file [1/3]" >&2; echo "Processed file [3/3]" ;;
exhaustive_matcher) echo "Matching block [1/1, 1/1] in 0.1s"; MATCHING ;;
mapper)
  [ "$2" = "-h" ] && exit 0
  echo "=> Registered"; echo "Registering image #2 (3)"
  mkdir -p "$7/0" "$7/1"; echo few > "$7/0/images.bin"; cp "HERE"/of/program/* "$7/1" ;;
esac
"##;

struct Fake {
    guard: tempfile::TempDir,
    photos: Unposed,
}

impl Fake {
    /// Three photos, a reconstruction of them, and a program that finds it and runs `matching` on its way.
    fn new(matching: &str) -> Self {
        let guard = tempfile::tempdir().expect("folder");
        let here = guard.path();
        let (images, model) = (here.join("my photos"), here.join("of/program"));
        let mut all = fs::create_dir(&images).and_then(|()| fs::create_dir_all(&model));
        let mut poses = 3_u64.to_le_bytes().to_vec();
        for i in 0..3_u32 {
            let picture = image::RgbImage::from_pixel(8, 6, image::Rgb([40 * i as u8, 90, 200]));
            picture.save(images.join(format!("{i}.png"))).expect("saved");
            poses.extend((i + 1).to_le_bytes());
            poses.extend([1.0, 0.0, 0.0, 0.0, f64::from(i), 0.0, 2.0].iter().flat_map(|v: &f64| v.to_le_bytes()));
            poses.extend(1_u32.to_le_bytes());
            poses.extend(format!("{i}.png\0").as_bytes());
            poses.extend(0_u64.to_le_bytes());
        }
        let mut camera = 1_u64.to_le_bytes().to_vec();
        camera.extend([1_u32.to_le_bytes(), 2_u32.to_le_bytes()].concat());
        camera.extend([8_u64, 6].iter().flat_map(|v| v.to_le_bytes()));
        camera.extend([7.0, 4.0, 3.0, 0.0].iter().flat_map(|v: &f64| v.to_le_bytes()));
        for (name, bytes) in [("images.bin", poses), ("cameras.bin", camera), ("points3D.bin", vec![0; 8])] {
            all = all.and_then(|()| fs::write(model.join(name), bytes));
        }
        let script = SCRIPT.replace("HERE", &here.display().to_string()).replace("MATCHING", matching);
        let program = here.join("colmap");
        all = all.and_then(|()| fs::write(&program, script));
        all = all.and_then(|()| fs::set_permissions(&program, fs::Permissions::from_mode(0o755)));
        all.expect("prepared");
        let Err(OpenError::NoPoses(photos)) = crate::io::open(&images) else { panic!("they have no poses") };
        Self { guard, photos: *photos }
    }

    fn find(&self, observer: &mut dyn Observer) -> Result<PathBuf, JobError> {
        let here = self.guard.path();
        let request = PoseRequest { photos: self.photos.clone(), ..PoseRequest::default() };
        let places = MakerPlaces { path: here.into(), ..MakerPlaces::default() };
        Ok(find_in(&request, &places, &Folders { data: here.join("data") }, observer)?.out)
    }

    fn asked(&self) -> String {
        fs::read_to_string(self.guard.path().join("asked")).expect("it was asked")
    }
}

#[derive(Default)]
struct Watch {
    seen: Vec<Progress>,
    cancel: bool,
}

impl Observer for Watch {
    fn progress(&mut self, progress: Progress) {
        self.seen.push(progress);
    }
    fn signal(&self) -> Signal {
        let matching = self.seen.last().is_some_and(|p| p.stage == "Matching photos");
        if self.cancel && matching { Signal::Cancel } else { Signal::Continue }
    }
}

#[test]
fn photos_get_their_poses_in_a_folder_of_their_own() {
    let fake = Fake::new("true");
    let mut watch = Watch::default();
    let found = fake.find(&mut watch).expect("found");
    let dataset = crate::io::colmap::read(&found).expect("it opens");
    assert_eq!(dataset.photos.len(), 3, "the larger of two reconstructions");
    assert!(fs::read_dir(&fake.photos.images).expect("read").count() == 3, "nothing is written beside the photos");
    let (asked, seen) = (fake.asked(), watch.seen);
    for part in ["feature_extractor --database_path", "--SiftExtraction.use_gpu 0", "--ImageReader.single_camera 1"] {
        assert!(asked.contains(part), "'{part}' is missing in {asked}");
    }
    for stage in ["Finding features", "Matching photos"] {
        assert!(seen.iter().any(|p| p.stage == stage && p.done == 3 && p.total == 3), "{stage}: {seen:?}");
    }
    assert!(seen.iter().any(|p| p.stage == "Finding camera poses" && p.done == 1));
}

#[test]
fn a_program_that_fails_is_quoted() {
    let fake = Fake::new("echo 'out of memory' >&2; exit 3");
    let text = fake.find(&mut Silent).expect_err("it fails").to_string();
    for part in ["Matching photos", "colmap", "exit status: 3", "out of memory"] {
        assert!(text.contains(part), "'{part}' is missing in {text}");
    }
    assert!(!fake.asked().contains("\nmapper"), "nothing runs after that");
}

#[test]
fn what_is_canceled_ends_its_program() {
    let fake = Fake::new("echo $$ > \"HERE/pid\"; exec sleep 600".replace("HERE", "$(dirname \"$0\")").as_str());
    let mut watch = Watch { cancel: true, ..Watch::default() };
    let error = fake.find(&mut watch).expect_err("canceled");
    assert!(error.is_cancelled(), "{error}");
    if let Ok(pid) = fs::read_to_string(fake.guard.path().join("pid")) {
        assert!(!Path::new("/proc").join(pid.trim()).exists(), "{pid}");
    }
}

#[test]
fn lines_are_read_as_progress() {
    let mut registered = 0;
    let mut of = |line: &str| progress(line, 100, &mut registered);
    assert_eq!(of("I0101 features.cc:1] Processed file [25/100]"), Some(25));
    assert_eq!(of("Matching block [1/2, 1/2] in 3s"), Some(25));
    assert_eq!(of("Matching block [2/2, 2/2] in 3s"), Some(100));
    assert_eq!(of("Processing block [2/2, 2/2]"), Some(75));
    assert_eq!(of("Processing block [1/1, 1/1]"), Some(0));
    assert_eq!(of("Registering image #17 (3)"), Some(1));
    assert_eq!(of("Registering image #18 (num_reg_frames=4)"), Some(2));
    for other in ["Bundle adjustment report", "Processed file [x/y]", "Processed file [1/0]", "Matching block [1"] {
        assert_eq!(of(other), None, "{other}");
    }
}

#[test]
fn the_commands_can_be_copied_into_a_shell() {
    let photos = Unposed { folder: "/a b/it's".into(), images: "/a b/it's".into(), ..Unposed::default() };
    let lines = manual::commands(&photos);
    assert_eq!(lines[1], r"cp -r '/a b/it'\''s' '/a b/it'\''s-posed/images'");
    assert_eq!(lines.last().map(String::as_str), Some(r"fmlgs train '/a b/it'\''s-posed'"));
    let tidy = Unposed { folder: "/data/fox".into(), images: "/data/fox/images".into(), ..Unposed::default() };
    let lines = manual::commands(&tidy);
    assert_eq!(lines.len(), 5, "nothing is copied: {lines:?}");
    assert_eq!(
        lines[3],
        "colmap mapper --database_path /data/fox/database.db --image_path /data/fox/images --output_path /data/fox/sparse"
    );
    let nowhere = MakerPlaces { path: "/no/such/place".into(), ..MakerPlaces::default() };
    let missing = choose(Some(MakerKind::Colmap), &nowhere).err().map(|e| e.to_string()).unwrap_or_default();
    assert!(missing.contains("'colmap' is not found on the PATH"), "{missing}");
}

#[test]
fn finished_steps_are_not_done_again() {
    // Matching fails until it may go on.
    let fake = Fake::new("test -e \"$(dirname \"$0\")/go on\"");
    fake.find(&mut Silent).expect_err("it fails");
    let count = |word: &str| fake.asked().lines().filter(|l| l.starts_with(word) && !l.ends_with("-h")).count();
    assert_eq!((count("feature_extractor"), count("exhaustive_matcher"), count("mapper")), (1, 1, 0));
    fs::write(fake.guard.path().join("go on"), "").expect("written");
    let first = fake.find(&mut Silent).expect("found");
    assert_eq!((count("feature_extractor"), count("exhaustive_matcher"), count("mapper")), (1, 2, 1));
    assert_eq!(fake.find(&mut Silent).expect("known"), first);
    assert_eq!(count("mapper"), 1, "all is known");
    // Another photo: all is done anew.
    fs::copy(fake.photos.images.join("0.png"), fake.photos.images.join("1.png")).expect("copied");
    fake.find(&mut Silent).expect("found");
    assert_eq!((count("feature_extractor"), count("mapper")), (2, 2));
}

#[test]
fn somebodys_own_colmap_project_is_no_place_for_poses() {
    let fake = Fake::new("true");
    let here = fake.guard.path();
    let project = here.join("project");
    for name in ["images/mine.png", "sparse/0/images.bin", "database.db"] {
        let path = project.join(name);
        fs::create_dir_all(path.parent().expect("a folder")).and_then(|()| fs::write(path, "mine")).expect("written");
    }
    let places = MakerPlaces { path: here.into(), ..MakerPlaces::default() };
    let folders = Folders { data: here.join("data") };
    let request = PoseRequest { photos: fake.photos.clone(), out: Some(project.clone()), ..PoseRequest::default() };
    let text = find_in(&request, &places, &folders, &mut Silent).expect_err("refused").to_string();
    assert!(text.contains("holds something else"), "{text}");
    assert_eq!(fs::read(project.join("images/mine.png")).expect("there"), b"mine");
    // The control: a folder of the program's own, called like the photos.
    let own = usual_out(&fake.photos, &folders);
    assert_eq!(files::data_set_name(&own), files::data_set_name(&fake.photos.folder));
    find_in(&PoseRequest { out: None, ..request }, &places, &folders, &mut Silent).expect("found");
    assert!(own.join("sparse/0").is_dir());
}

#[test]
fn few_photos_are_mapped_one_by_one_and_globally_where_few_of_them_get_a_pose() {
    let with_mappers = |mappers: &str| {
        let fake = Fake::new("true");
        let program = fake.guard.path().join("colmap");
        let script = fs::read_to_string(&program).expect("read");
        let new = script.replace("COLMAP 3.8 (without CUDA)", "COLMAP 4.1 (with CUDA) global_mapper mapper");
        fs::write(&program, new.replace("mapper)\n", mappers)).expect("written");
        fake.find(&mut Silent).expect("found");
        fake.asked()
    };
    // Its incremental mapper finds no photo of three.
    let asked = with_mappers("mapper) [ \"$2\" = \"-h\" ] || mkdir -p \"$7/0\" ;;\nglobal_mapper)\n");
    let [global, mapper] = ["\nglobal_mapper --database_path", "\nmapper --database_path"].map(|w| asked.find(w));
    assert!(mapper.is_some() && mapper < global, "{asked}");
    assert!(!asked.contains("use_gpu"), "a GPU is used as it is");
    // The control: enough photos at once.
    let asked = with_mappers("mapper | global_mapper)\n");
    assert!(asked.contains("\nmapper --database_path") && !asked.contains("global_mapper"), "{asked}");
}

#[test]
fn lost_photos_are_told_with_the_reason_and_a_strangers_folder_is_left_alone() {
    let fake = Fake::new("true");
    // A fourth photo, of which the reconstruction knows nothing: plain, so there is nothing to see.
    fs::copy(fake.photos.images.join("0.png"), fake.photos.images.join("lost.png")).expect("copied");
    let Err(OpenError::NoPoses(photos)) = crate::io::open(&fake.photos.images) else { panic!("no poses") };
    let out = fake.guard.path().join("out");
    let request = PoseRequest { photos: *photos, out: Some(out.clone()), ..PoseRequest::default() };
    let places = MakerPlaces { path: fake.guard.path().into(), ..MakerPlaces::default() };
    let folders = Folders { data: fake.guard.path().join("data") };
    let find = |request: &PoseRequest| find_in(request, &places, &folders, &mut Silent);
    let found = find(&request).expect("found");
    assert_eq!((found.registered, found.photos, found.missing.len()), (3, 4, 1), "{found:?}");
    assert!(found.missing[0].photo == "lost.png" && found.missing[0].why.contains("almost nothing"), "{found:?}");
    assert!(found.summary().contains("3 of 4 photos have a pose"), "{}", found.summary());
    let full = fake.guard.path().join("full");
    fs::create_dir(&full).and_then(|()| fs::write(full.join("diary.txt"), "mine")).expect("prepared");
    for (out, part) in [(&full, "something else"), (&fake.photos.images, "the folder of the photos themselves")] {
        let refused = PoseRequest { out: Some(out.clone()), ..request.clone() };
        let text = find(&refused).expect_err("refused").to_string();
        assert!(text.contains(part), "{text}");
    }
    assert_eq!(fs::read_to_string(full.join("diary.txt")).expect("read"), "mine");
}
