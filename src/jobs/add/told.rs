//! The result of adding photos, in two short sentences.

use std::path::Path;

use super::AddedScene;
use crate::math::format::{count, decibel, things};

impl AddedScene {
    /// Returns the sentences; `before` is the folder of the scene that the photos were added to.
    pub(crate) fn told(&self, before: &Path) -> String {
        let mut told = format!("{} added", things(self.trained, "photo"));
        if self.held_out > 0 {
            told += &format!(", {} held out", self.held_out);
        }
        if let Some(first) = self.refused.first() {
            let name = first.photo.file_name().unwrap_or(first.photo.as_os_str()).to_string_lossy();
            told += &format!(", {} refused ({name}: {})", self.refused.len(), first.reason.trim_end_matches('.'));
        }
        told += &format!("; {} Gaussians now", count(self.gaussians as u64));
        if let Some(scores) = &self.held_out_scores {
            told += &format!(", held-out PSNR {}, {} before", decibel(scores.now), decibel(scores.before));
        }
        format!("{told}. The scene before is unchanged in {}.", before.display())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::jobs::add::{HeldOutScores, RefinedShare, RefusedPhoto};

    #[test]
    fn what_came_of_it_is_told_in_two_sentences() {
        let plain = AddedScene {
            out: "/scenes/desk-closer".into(),
            finished: true,
            trained: 1,
            held_out: 0,
            located: 0,
            refused: Vec::new(),
            refined: RefinedShare { gaussians: 4_000, frozen: 3_000 },
            gaussians: 5_300,
            unchanged: true,
            held_out_scores: None,
            new_identities: 0,
            steps: 300,
            secs: 9.0,
        };
        let before = Path::new("/scenes/desk");
        let end = "The scene before is unchanged in /scenes/desk.";
        assert_eq!(plain.told(before), format!("1 photo added; {} Gaussians now. {end}", count(5_300)));
        let refused = |name: &str| RefusedPhoto { photo: name.into(), reason: "it shows something else.".into() };
        let full = AddedScene {
            trained: 4,
            held_out: 1,
            refused: vec![refused("/new/cat.jpg"), refused("/new/dog.jpg")],
            held_out_scores: Some(HeldOutScores { photos: 3, before: 28.1, now: 28.3 }),
            ..plain
        };
        let told = full.told(before);
        for part in [
            "4 photos added, 1 held out, 2 refused (cat.jpg: it shows something else); ",
            " Gaussians now, held-out PSNR 28.30 dB, 28.10 dB before. The scene",
        ] {
            assert!(told.contains(part), "{part}: {told}");
        }
    }
}
