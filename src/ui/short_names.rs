//! Names and paths where there is little room: cut only as far as needed, and still told apart.

use std::path::{Component, Path, PathBuf};

use egui::{Color32, FontId, Ui};

use crate::scene::text;

/// A text on one line, cut in the middle so that it is at most `width` points wide.
pub(super) fn fitted(ui: &Ui, full: &str, font: &FontId, width: f32) -> String {
    let fits =
        |shown: &str| ui.painter().layout_no_wrap(shown.to_owned(), font.clone(), Color32::WHITE).size().x <= width;
    longest(full, &fits)
}

/// The text with as many letters as fit.
fn longest(full: &str, fits: &dyn Fn(&str) -> bool) -> String {
    let whole = text::line(full).into_owned();
    // A text of any length is measured in part only.
    let (mut least, mut most) = (1, whole.chars().count().min(400));
    if most == whole.chars().count() && fits(&whole) {
        return whole;
    }
    while least < most {
        let middle = (least + most).div_ceil(2);
        if fits(&text::elided(&whole, middle)) { least = middle } else { most = middle - 1 }
    }
    text::elided(&whole, least)
}

/// The path, cut to about `most` letters. If others look alike then, it is shown by the folder that tells it from them.
pub(super) fn short_path(path: &Path, others: &[PathBuf], most: usize) -> String {
    let cut = |path: &Path| text::elided(&path.to_string_lossy(), most);
    let own = cut(path);
    let parts = |path: &Path| -> Vec<String> {
        let name = |c: Component<'_>| c.as_os_str().to_string_lossy().into_owned();
        path.components().rev().map(name).collect()
    };
    let mine = parts(path);
    // The places from the end at which alike paths differ.
    let alike = others.iter().filter(|other| *other != path && cut(other) == own).map(|other| parts(other));
    let differs = |other: &Vec<String>| (0..mine.len()).find(|at| other.get(*at) != mine.get(*at));
    let mut told: Vec<usize> = alike.filter_map(|other| differs(&other)).collect();
    told.sort_unstable();
    told.dedup();
    if told.is_empty() {
        return own;
    }
    let (mut shown, mut after) = (String::new(), mine.len());
    for at in told.into_iter().rev().chain([0]).filter(|at| *at < mine.len()) {
        if at == after {
            continue;
        }
        let between = if at + 1 == after { "/" } else { "\u{2026}/" };
        shown += if shown.is_empty() || between == "/" { between } else { "/\u{2026}/" };
        shown += &text::line(&mine[at]);
        after = at;
    }
    shown
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_name_is_cut_only_where_it_does_not_fit() {
        let fits = |most: usize| move |shown: &str| shown.chars().count() <= most;
        assert_eq!(longest("kitchen-counter", &fits(15)), "kitchen-counter");
        assert_eq!(longest("kitchen-counter", &fits(9)), "kitc\u{2026}nter");
        assert_eq!(longest("kitchen", &fits(0)), "\u{2026}");
        assert_eq!(longest(&"x".repeat(10_000), &fits(9)).chars().count(), 9);
    }

    #[test]
    fn paths_that_look_alike_are_told_apart() {
        let long = |run: &str| PathBuf::from(format!("/home/researcher/experiments/of-this-year/{run}/results/scene"));
        let all = [long("run-a-with-a-long-name"), long("run-b-with-a-long-name"), "/data/mug".into()];
        let shown: Vec<String> = all.iter().map(|path| short_path(path, &all, 24)).collect();
        assert_eq!(shown[0], "\u{2026}/run-a-with-a-long-name/\u{2026}/scene");
        assert_eq!(shown[1], "\u{2026}/run-b-with-a-long-name/\u{2026}/scene");
        assert_eq!(shown[2], "/data/mug");
        // Control: alone, the path is cut in its middle.
        assert_eq!(short_path(&all[0], &all[..1], 24), text::elided(&all[0].to_string_lossy(), 24));
        let near = ["/home/researcher/somewhere/a/mug", "/home/researcher/somewhere/a/cup"].map(PathBuf::from);
        assert_eq!(short_path(&near[0], &near, 8), "/ho\u{2026}/mug", "their ends tell them apart");
        let last = ["/some/where/x-mug", "/some/here/x-mug"].map(PathBuf::from);
        assert_eq!(short_path(&last[0], &last, 10), "\u{2026}/where/x-mug");
    }
}
