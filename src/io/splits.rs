//! Training and held-out photos of a data set, if lists of names state them.

use std::collections::HashMap;
use std::path::Path;

use serde::Deserialize;

use super::photo_list::{ListedPhoto, PhotoFinder, fold, some_of};
use super::{IoError, files, photo};

/// Lists of photo names, each with the name of its file.
#[derive(Clone, Debug, Default)]
pub(super) struct Splits {
    pub(super) train: Vec<(String, Vec<String>)>,
    pub(super) held_out: Vec<(String, Vec<String>)>,
}

/// Names of lists beside a COLMAP reconstruction: as 3D Gaussian Splatting, NerfBaselines and others write them.
const TRAIN: [&str; 2] = ["train.txt", "train_list.txt"];
const HELD_OUT: [&str; 4] = ["test.txt", "test_list.txt", "val.txt", "val_list.txt"];
/// ScanNet++'s list of both.
const BOTH: &str = "train_test_lists.json";

#[derive(Deserialize)]
struct TrainTest {
    train: Vec<String>,
    test: Vec<String>,
}

impl Splits {
    /// Reads the lists in the first of these folders that has one.
    pub(super) fn beside(folders: &[&Path]) -> Result<Self, IoError> {
        let mut splits = Self::default();
        for folder in folders {
            let lists = |names: &[&str]| -> Result<Vec<(String, Vec<String>)>, IoError> {
                let there = names.iter().filter(|name| folder.join(name).is_file());
                let read = |name: &&str| Ok(((*name).to_owned(), lines(&files::read_text(&folder.join(name))?)));
                there.map(read).collect()
            };
            (splits.train, splits.held_out) = (lists(&TRAIN)?, lists(&HELD_OUT)?);
            if folder.join(BOTH).is_file() {
                let both: TrainTest = files::read_json(&folder.join(BOTH))?;
                splits.train.push((BOTH.into(), both.train));
                splits.held_out.push((BOTH.into(), both.test));
            }
            if !(splits.train.is_empty() && splits.held_out.is_empty()) {
                break;
            }
        }
        Ok(splits)
    }

    /// Marks held-out photos. If there is a list of training photos, photos in no list are left out.
    pub(super) fn apply(&self, listed: &mut Vec<ListedPhoto>, finder: &PhotoFinder<'_>, warnings: &mut Vec<String>) {
        let keys = Keys::of(listed, finder);
        let mut chosen = |lists: &[(String, Vec<String>)]| {
            let mut marked = vec![false; listed.len()];
            for (list, names) in lists.iter().filter(|(_, names)| !names.is_empty()) {
                let unknown: Vec<String> = names
                    .iter()
                    .filter(|name| {
                        let place = keys.find(&finder.key(name));
                        place.map(|place| marked[place] = true).is_none()
                    })
                    .cloned()
                    .collect();
                if !unknown.is_empty() {
                    let (n, all) = (unknown.len(), names.len());
                    warnings.push(format!("{n} of {all} names in {list} are of no photo: {}", some_of(&unknown, ", ")));
                }
            }
            marked
        };
        let (train, held_out) = (chosen(&self.train), chosen(&self.held_out));
        let named = |which: &dyn Fn(usize) -> bool| -> Vec<String> {
            (0..listed.len()).filter(|i| which(*i)).map(|i| listed[i].entry.clone()).collect()
        };
        let both = named(&|i| train[i] && held_out[i]);
        if !both.is_empty() {
            warnings.push(format!(
                "{} photos are listed to be trained on and to be held out, and are trained on: {}",
                both.len(),
                some_of(&both, ", ")
            ));
        }
        // A list without a matching name is of other photos.
        let is_whole = !train.contains(&true);
        let neither = named(&|i| !is_whole && !train[i] && !held_out[i]);
        if !neither.is_empty() {
            warnings.push(format!(
                "{} of {} photos are in none of the lists of photos to train on and to hold out, and were left out: {}",
                neither.len(),
                listed.len(),
                some_of(&neither, ", ")
            ));
        }
        let mut place = 0..;
        listed.retain_mut(|l| {
            let i = place.next().unwrap_or_default();
            l.test_split = held_out[i] && !train[i];
            is_whole || train[i] || held_out[i]
        });
    }
}

/// Photos by their names.
struct Keys {
    whole: HashMap<String, usize>,
    /// Photos by the last part of the name, without ending; `None` if several share it.
    ends: HashMap<String, Option<usize>>,
}

impl Keys {
    fn of(listed: &[ListedPhoto], finder: &PhotoFinder<'_>) -> Self {
        let (mut whole, mut ends) = (HashMap::new(), HashMap::new());
        for (i, l) in listed.iter().enumerate() {
            let key = finder.key(&l.entry);
            ends.entry(end(&key)).and_modify(|place| *place = None).or_insert(Some(i));
            whole.insert(fold(&key), i);
        }
        Self { whole, ends }
    }

    /// Finds the photo of a name: an exact match, or the only photo with that file name.
    fn find(&self, key: &str) -> Option<usize> {
        self.whole.get(&fold(key)).copied().or_else(|| self.ends.get(&end(key)).copied().flatten())
    }
}

fn end(key: &str) -> String {
    let file = key.rsplit('/').next().unwrap_or(key);
    fold(photo::stem(file).unwrap_or(file))
}

fn lines(text: &str) -> Vec<String> {
    text.lines().map(str::trim).filter(|line| !line.is_empty() && !line.starts_with('#')).map(str::to_owned).collect()
}
