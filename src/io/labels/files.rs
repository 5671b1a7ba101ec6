//! Label files in a folder and its subfolders, recognized by their content.

use std::collections::HashMap;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use serde_json::Value;

use super::belongs::LabelAddress;
use super::coco::CocoFile;
use super::masklets::Masklets;
use super::yolo::Names;
use super::{Passed, Region, Sheet, isat, labelme, yolo};
use crate::io::{IoError, files};

/// Deepest level of subfolders searched.
const DEEPEST: usize = 3;
/// Levels, from a label file's folder upward, searched for class names.
const NAMES_ABOVE: usize = 3;

/// The labels of one picture.
pub struct LabelFile {
    pub(super) address: LabelAddress,
    form: Form,
}

enum Form {
    Isat,
    LabelMe,
    /// A file, and the picture's index in it.
    Coco(Arc<CocoFile>, usize),
    Yolo(Arc<Names>),
}

impl LabelFile {
    pub(super) fn regions(&self, sheet: Sheet<'_>) -> Result<Vec<Region>, IoError> {
        let path = &self.address.file;
        match &self.form {
            Form::Isat => isat::read(path, sheet),
            Form::LabelMe => labelme::read(path, sheet),
            Form::Coco(file, picture) => file.regions(*picture, path, sheet),
            Form::Yolo(names) => yolo::read(path, names, sheet),
        }
    }
}

/// Label files that were found.
#[derive(Default)]
pub(super) struct FoundLabels {
    pub(super) files: Vec<LabelFile>,
    pub(super) video: Option<(PathBuf, Masklets)>,
    pub(super) passed: Passed,
}

/// Finds the label files in a folder, or reads the single file `path`.
pub(super) fn find(path: &Path) -> Result<FoundLabels, IoError> {
    let mut candidates = Vec::new();
    match std::fs::read_dir(path) {
        Ok(_) => walk(path, 0, &mut candidates),
        Err(_) if is(path, "json") || is(path, "txt") => candidates.push(path.to_owned()),
        Err(cause) => return Err(IoError::Read { path: path.into(), cause }),
    }
    let mut found = FoundLabels::default();
    let mut names: HashMap<PathBuf, Arc<Names>> = HashMap::new();
    for file in candidates {
        if is(&file, "json") {
            found.json(file)?;
        } else if yolo::is_own(&file, &mut found.passed) {
            let folder = files::folder_of(&file).to_owned();
            if !names.contains_key(&folder) {
                names.insert(folder.clone(), Arc::new(names_for(&folder)?));
            }
            let names = Arc::clone(&names[&folder]);
            if names.is_empty() {
                let what = "label files of YOLO's have no names of classes by them (classes.txt, data.yaml): what they show \
                            is nameless";
                found.passed.report(what, &file);
            }
            found.files.push(LabelFile { address: LabelAddress::of_file(file, "", ""), form: Form::Yolo(names) });
        }
    }
    Ok(found)
}

fn is(path: &Path, ending: &str) -> bool {
    path.extension().is_some_and(|e| e.eq_ignore_ascii_case(ending))
}

/// Lists possible label files in a folder, then those in its subfolders; hidden ones are skipped.
fn walk(folder: &Path, depth: usize, found: &mut Vec<PathBuf>) {
    let names = super::entries(folder);
    let visible = names.iter().filter(|name| !name.starts_with('.')).map(|name| folder.join(name));
    let (folders, files): (Vec<PathBuf>, Vec<PathBuf>) = visible.partition(|path| path.is_dir());
    found.extend(files.into_iter().filter(|path| is(path, "json") || is(path, "txt")));
    if depth < DEEPEST {
        folders.iter().for_each(|folder| walk(folder, depth + 1, found));
    }
}

/// Reads the class names nearest above a label file.
fn names_for(folder: &Path) -> Result<Names, IoError> {
    let whole = std::path::absolute(folder).unwrap_or_else(|_| folder.to_owned());
    for above in whole.ancestors().take(NAMES_ABOVE) {
        if let Some(names) = yolo::names_in(above)? {
            return Ok(names);
        }
    }
    Ok(Names::new())
}

impl FoundLabels {
    /// Adds the labels of a JSON file, if it has any.
    fn json(&mut self, file: PathBuf) -> Result<(), IoError> {
        let value: Value = files::read_json(&file)?;
        if let Some((folder, name)) = isat::photo_of(&value) {
            self.files.push(LabelFile { address: LabelAddress::of_file(file, folder, name), form: Form::Isat });
        } else if let Some(name) = labelme::photo_of(&value, &file, &mut self.passed) {
            self.files.push(LabelFile { address: LabelAddress::of_file(file, "", name), form: Form::LabelMe });
        } else if value["masklet"].is_array() {
            let Some(masklets) = Masklets::parse(value, &file)? else { return Ok(()) };
            if let Some((other, _)) = &self.video {
                let reason = format!("{} holds masklets too; name one of the two files", other.display());
                return Err(IoError::Syntax { path: file, place: "masklet".into(), reason });
            }
            self.video = Some((file, masklets));
        } else if let Some(coco) = CocoFile::parse(value, &file, &mut self.passed)? {
            let coco = Arc::new(coco);
            for (i, name) in coco.labeled() {
                let address = LabelAddress { file: file.clone(), names: vec![name.to_owned()] };
                self.files.push(LabelFile { address, form: Form::Coco(Arc::clone(&coco), i) });
            }
        }
        Ok(())
    }
}
