//! Maps of the classes and clusters of samples.

use super::{ForeignError, identities};
use crate::io::results::tests::{expected, sample};
use crate::scene::{Level, NO_IDENTITY};

#[test]
fn classes_and_clusters_become_a_semantic_map() {
    let map = |path: &str| identities::semantic_map(&sample(path), identities::USUAL_SCALE);
    let grouping = map("gaussian_grouping").expect("classes");
    // Classes 7, 3 and 200; class 0 is nothing.
    let names: Vec<String> = grouping.identities.iter().map(|(id, _)| grouping.identities.name(id)).collect();
    assert_eq!(names, ["class 3", "class 7", "class 200"]);
    let wanted = expected("gaussian_grouping/expected/classes_gaussians.npy");
    for (id, class) in grouping.identity_of.iter().zip(&wanted) {
        let name = if *class == 0.0 { "nothing".to_owned() } else { format!("class {class}") };
        assert_eq!(grouping.identities.name(*id), name);
    }
    assert!(grouping.margin.iter().all(|m| (0.0..=1.0).contains(m)) && grouping.language.is_none());
    let clusters = map("opengaussian").expect("clusters");
    let language = clusters.language.as_ref().expect("embeddings");
    assert!(language.is_valid(&clusters.identities) && language.encoder == "clip-vit-b16");
    assert!(language.by_identity[0].raw.is_empty(), "seen three times");
    assert_eq!(clusters.identities.len(), 12);
    let thgs = map("thgs").expect("clusters");
    assert_eq!((thgs.identities.count(Level::Object), thgs.identities.count(Level::Part)), (4, 8));
    assert!(thgs.language.as_ref().is_some_and(|l| l.is_valid(&thgs.identities)));
    assert_eq!(thgs.identity_of[9], NO_IDENTITY);
    assert!(thgs.identities.iter().filter(|(_, i)| i.level == Level::Part).all(|(_, i)| i.parent != NO_IDENTITY));
    let laga = map("laga").expect("clusters");
    // Each half of its two large clusters is a part.
    assert_eq!((laga.identities.count(Level::Object), laga.identities.count(Level::Part)), (2, 4));
    let language = laga.language.as_ref().expect("embeddings");
    assert!(language.is_valid(&laga.identities));
    let counts: Vec<usize> = language.by_identity.iter().map(|of| of.raw.len()).collect();
    assert_eq!(counts, [1, 2, 1, 2, 1, 2], "embeddings without a weight are none");
    let saga = map("saga").expect("objects");
    assert_eq!(saga.identity_of.len(), 32);
    assert!(matches!(map("langsplat/output"), Err(ForeignError::NoIdentities("LangSplat"))));
}
