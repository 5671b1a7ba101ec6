//! Three things with parts, seen by four cameras, with masks and vectors as LangSplat's `language_features/` has them.

use std::path::{Path, PathBuf};

use glam::DVec3;

use super::*;
use crate::io::results::numpy::tests::npy;
use crate::math::vector::unit;
use crate::pipeline::observer::Silent;
use crate::pipeline::semantics::relevancy::deviate;
use crate::pipeline::semantics::view_map::ViewMap;
use crate::render::Renderer;
use crate::scene::{Camera, Identities, Level as Of, NO_IDENTITY};

const DIMENSION: usize = 512;
/// Identity of each column of six Gaussians: a doll with an eye, a pot with a lid, a cup.
const COLUMNS: [IdentityId; 5] = [1, 2, 3, 4, 5];

fn identities() -> Identities {
    let mut all = Identities::default();
    let doll = all.add(Of::Object, NO_IDENTITY, vec![]);
    all.add(Of::Part, doll, vec![]);
    let pot = all.add(Of::Object, NO_IDENTITY, vec![]);
    all.add(Of::Part, pot, vec![]);
    all.add(Of::Object, NO_IDENTITY, vec![]);
    all
}

fn truth() -> Vec<IdentityId> {
    COLUMNS.iter().flat_map(|id| [*id; 6]).collect()
}

fn cloud() -> GaussianCloud {
    let x = [-0.9, -0.6, -0.1, 0.2, 0.8];
    let place = |i: usize| [x[i / 6] + 0.02 * (i % 2) as f32, 0.12 * (i % 6) as f32 - 0.3, 0.0];
    let color = [[9.0, 0.0, 0.0], [9.0, 3.0, 0.0], [0.0, 9.0, 0.0], [0.0, 9.0, 4.0], [0.0, 0.0, 9.0]];
    GaussianCloud {
        sh: (0..30).map(|i| color[i / 6]).collect(),
        ..GaussianCloud::isotropic((0..30).map(place).collect(), -2.3, 5.0)
    }
}

fn photos() -> Vec<Photo> {
    let photo = |k: usize| {
        let eye = DVec3::new(0.4 * k as f64 - 0.6, 0.1 * k as f64, -3.0);
        let camera = Camera::look_at(eye, DVec3::ZERO, DVec3::NEG_Y, 0.8, 120, 80).expect("valid");
        Photo::new(format!("view_{k}.jpg"), PathBuf::new(), camera)
    };
    (0..4).map(photo).collect()
}

fn view(photo: &Photo) -> ViewMap {
    let settings = RenderSettings::default();
    ViewMap::render(&mut Renderer::new(), &cloud(), &truth(), &identities(), &photo.camera, &settings).expect("drawn")
}

/// Vector of what shows an identity in a photo.
fn vector(id: usize, photo: usize) -> Vec<f32> {
    let mut v = vec![0.0; DIMENSION];
    (v[id], v[100 + photo]) = (1.0, 0.3 * (photo + 1) as f32);
    unit(&v).expect("not zero")
}

/// Writes the files of all photos. Small masks: eye and lid; medium: pot; large: doll, cup. `turned` exchanges the
/// vectors of the first two masks.
fn write(folder: &Path, turned: bool) {
    for (p, photo) in photos().iter().enumerate() {
        let view = view(photo);
        // Numbers run on from level to level; identity of each mask, and its level.
        let masks: [(IdentityId, usize); 5] = [(2, 1), (4, 1), (3, 2), (1, 3), (5, 3)];
        let mut levels = vec![vec![-1.0_f32; view.identity.len()]; 4];
        for (number, (id, level)) in masks.iter().enumerate() {
            view.mask(&identities(), *id).pixels().for_each(|i| levels[*level][i] = number as f32);
        }
        let data: Vec<u8> = levels.concat().iter().flat_map(|v| v.to_le_bytes()).collect();
        let shape = [4, view.height_px, view.width_px];
        std::fs::write(folder.join(format!("view_{p}_s.npy")), npy("<f4", &shape, &data)).expect("written");
        let mut rows: Vec<Vec<f32>> = masks.iter().map(|(id, _)| vector(*id as usize, p)).collect();
        if turned {
            rows.swap(0, 1);
        }
        let data: Vec<u8> = rows.concat().iter().flat_map(|v| v.to_le_bytes()).collect();
        std::fs::write(folder.join(format!("view_{p}_f.npy")), npy("<f4", &[5, DIMENSION], &data)).expect("written");
    }
}

fn find(folder: &Path, encoder_of_masks: Option<&'static str>) -> SemanticMap {
    let mut segmenter = FileMasks(Labels::of_photos(folder, &photos()).expect("labels"));
    let models = SearchModels { segmenter: &mut segmenter, follower: None, encoder: None };
    let options = FindOptions { encoder_of_masks, ..FindOptions::default() };
    find_objects(&cloud(), &photos(), &RenderSettings::default(), models, &options, &mut Silent).expect("found").map
}

/// Number in `map` of the identity of the first Gaussian of a column.
fn number(map: &SemanticMap, column: usize) -> IdentityId {
    map.identity_of[6 * column]
}

#[test]
fn masks_with_vectors_become_identities_with_the_weighted_mean_of_these() {
    let folder = tempfile::tempdir().expect("folder");
    write(folder.path(), false);
    let map = find(folder.path(), Some("clip-vit-b16"));
    assert_eq!(map.identities.len(), 5);
    for column in 0..5 {
        let own = number(&map, column);
        assert_eq!(map.identity_of[6 * column..][..6], [own; 6], "column {column}");
        let identity = map.identities.get(own).expect("known");
        let whole = [None, Some(0), None, Some(2), None][column].map_or(NO_IDENTITY, |whole| number(&map, whole));
        assert_eq!(identity.parent, whole, "column {column}");
    }
    let language = map.language.as_ref().expect("embedded");
    assert!(language.is_valid(&map.identities) && language.encoder == "clip-vit-b16");
    // Each photo counts by the pixels of the identity in it.
    let mean = |id: usize| {
        let mut sum = vec![0.0_f64; DIMENSION];
        for (p, photo) in photos().iter().enumerate() {
            let pixels = view(photo).mask(&identities(), id as IdentityId).area() as f64;
            sum.iter_mut().zip(vector(id, p)).for_each(|(sum, v)| *sum += pixels * f64::from(v));
        }
        unit(&sum.iter().map(|v| *v as f32).collect::<Vec<_>>()).expect("not zero")
    };
    let far = |a: &[f32], b: &[f32]| a.iter().zip(b).map(|(a, b)| (a - b).abs()).fold(0.0, f32::max);
    for column in 0..5 {
        let features = &language.by_identity[number(&map, column) as usize - 1];
        let [raw] = features.raw.as_slice() else { panic!("column {column}: {} vectors", features.raw.len()) };
        assert!(far(raw, &mean(column + 1)) < 1e-5, "column {column}");
        assert!(far(raw, &mean((column + 1) % 5 + 1)) > 0.5, "the control");
        let whole = [None, Some(1), None, Some(3), None][column].map(mean);
        let expected = whole.map_or_else(|| raw.clone(), |whole| deviate(raw, &whole, PART_WEIGHT).expect("not zero"));
        assert!(far(&features.deviated[0], &expected) < 1e-5, "column {column}");
    }
    // Exchanged vectors: the eye looks like the lid.
    write(folder.path(), true);
    let turned = find(folder.path(), Some("clip-vit-b16"));
    let language = turned.language.as_ref().expect("embedded");
    let eye = &language.by_identity[number(&turned, 1) as usize - 1].raw[0];
    assert!(far(eye, &mean(2)) > 0.5 && eye[4] > eye[2], "exchanged");
    assert_eq!(find(folder.path(), None).language, None, "no embeddings unless they are asked for");
}
