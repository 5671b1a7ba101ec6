//! Messages about broken models and incomplete folders.

use super::*;

#[test]
fn a_broken_model_is_told() {
    let folder = tempfile::tempdir().expect("folder");
    let all = entries().expect("the list");
    let listed = all.iter().find(|e| e.role == ModelRole::Encoder && !e.built_in).expect("an encoder");
    let told = |folder: &Path| {
        let mut told = Vec::new();
        let usable = usable_of(&all, ModelRole::Encoder, folder, &mut |text| told.push(text));
        assert_eq!(usable, ["demo"]);
        told
    };
    assert!(told(folder.path()).is_empty(), "what is not here is no trouble");
    for name in listed.files() {
        fs::write(folder.path().join(name), "{").expect("written");
    }
    let told = told(folder.path());
    assert!(told.len() == 1 && told[0].contains(&listed.id) && told[0].contains("broken"), "{told:?}");
}

#[test]
fn a_folder_without_its_files_is_named_with_what_is_missing() {
    let (folder, brought) = (tempfile::tempdir().expect("folder"), tempfile::tempdir().expect("folder"));
    let all = entries().expect("the list");
    let entry = all.iter().find(|e| e.checkpoint.is_some() && e.files().len() > 2).expect("one with several files");
    let told = || entry.add(folder.path(), brought.path()).expect_err("incomplete").to_string();
    let (place, fetch) = (brought.path().display().to_string(), format!("'fmlgs models fetch {}'", entry.id));
    let said = told();
    assert!(said.starts_with(&format!("{place} lacks {}", entry.files().join(", "))), "{said}");
    assert!(said.contains(&fetch), "{said}");
    // Present files are not reported as missing; with all files present, the error is another one.
    fs::write(brought.path().join(&entry.description), "{}").expect("written");
    let said = told();
    assert!(said.starts_with(&format!("{place} lacks {}", entry.files()[1..].join(", "))), "{said}");
    entry.files().iter().for_each(|name| fs::write(brought.path().join(name), "{}").expect("written"));
    assert!(!told().contains("lacks"));
    assert!(matches!(entry.state(folder.path()), ModelState::Missing(_)), "nothing was taken over");
    // A model without an address is exported, not fetched.
    let alone = ModelEntry { url: None, checkpoint: None, ..entry.clone() };
    let said = alone.add(folder.path(), folder.path()).expect_err("incomplete").to_string();
    assert!(said.contains(&format!("tools/export/{}", alone.export)) && !said.contains(&fetch), "{said}");
}
