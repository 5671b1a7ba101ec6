//! Folders that no result may be written to: those of any data set, also of one that the command does not read.

use super::*;

#[test]
fn results_are_not_put_among_the_files_of_a_data_set() {
    let folder = folder();
    let photos = first_version(folder.path());
    let at = |name: &str| folder.path().join(name).to_str().unwrap().to_owned();
    let (scene, others, path) = (at("scene"), folder.path().join("others"), at("path.json"));
    crate::cli_support::copy(&photos, &others);
    fmlgs(&["path", &scene, "--to-photo", "3", "--out", &path]).ok();
    let before = files_in(&others);
    let film = ["render", &scene, "--path", &path, "--size", "32x24", "--fps", "2", "--out"];
    for (line, place) in [
        (&film[..], "others/images"),
        (&film, "others/images/film"),
        (&["export", &scene, "--out"], "others/meta.json"),
        (&["render", &scene, "--out"], "others/images/view.png"),
        (&["demo", "--make", &at("demo.zip"), "--out"], "others"),
    ] {
        let refused = fmlgs(&[line, &[at(place).as_str()]].concat()).fails_with(2).stderr;
        let told = ["among the files of the data set", "others', which", "choose another folder", place];
        assert!(told.iter().all(|words| refused.contains(words)), "{line:?}: {refused}");
        assert!(files_in(&others) == before, "{line:?} {place} changed files");
    }
    // The control: other folders in it are as good as any.
    fmlgs(&["export", &scene, "--out", &at("others/results/splat.ply")]).ok();
    fmlgs(&[&film[..], &[at("others/film").as_str()]].concat()).ok();
    assert_eq!(fmlgs(&["info", others.to_str().unwrap(), "--json"]).ok().json()["photos"], 8);
}
