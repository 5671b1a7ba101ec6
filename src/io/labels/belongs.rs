//! Assignment of labels to photos. Labels belong to exactly one photo, by the label file's own name, else by the name
//! that it gives; if several photos have that name, by their folders.

use std::collections::{BTreeSet, HashMap};
use std::path::PathBuf;

use super::stem;
use crate::io::IoError;

/// Names by which labels refer to their photo.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct LabelAddress {
    /// Label file.
    pub(crate) file: PathBuf,
    /// Possible names of the photo, the most reliable first, with the folders that are known.
    pub(crate) names: Vec<String>,
}

impl LabelAddress {
    /// Makes the address of a label file that may name its photo, in this folder.
    pub(super) fn of_file(file: PathBuf, folder: &str, name: &str) -> Self {
        let own = std::path::absolute(&file).unwrap_or_else(|_| file.clone()).to_string_lossy().into_owned();
        let given = if folder.is_empty() { name.to_owned() } else { format!("{folder}/{name}") };
        let names = if name.is_empty() { vec![own] } else { vec![own, given] };
        Self { file, names }
    }

    /// Name of the file for messages, and the photo that it names if that is another name.
    fn text(&self) -> String {
        let file = self.file.file_name().unwrap_or(self.file.as_os_str()).to_string_lossy();
        match self.names.last().map(|name| parts(name)) {
            Some((_, name)) if stem(name) != stem(&file) => format!("{file}, of '{name}'"),
            _ => file.into_owned(),
        }
    }
}

/// Splits a path of any system into its folders and the file name.
fn parts(path: &str) -> (Vec<&str>, &str) {
    let mut parts: Vec<&str> = path.split(['/', '\\']).filter(|part| !matches!(*part, "" | ".")).collect();
    let name = parts.pop().unwrap_or_default();
    (parts, name)
}

/// Returns whether a name ends like that of a picture.
fn is_picture(name: &str) -> bool {
    let ending = name.rsplit_once('.').map_or("", |(_, ending)| ending);
    ["png", "jpg", "jpeg", "webp", "tif", "tiff", "bmp"].iter().any(|known| ending.eq_ignore_ascii_case(known))
}

/// Number of folders that two paths have in common, from the file upward.
fn in_common(a: &[&str], b: &[&str]) -> usize {
    a.iter().rev().zip(b.iter().rev()).take_while(|(a, b)| a.eq_ignore_ascii_case(b)).count()
}

/// The labeled pictures of each photo, by its name.
pub(super) type PicturesOf = HashMap<String, Vec<usize>>;

/// The photos of a data set, by name.
pub(super) struct PhotoNames<'a> {
    names: Vec<&'a str>,
    /// Photos by their lowercase names without ending.
    by_stem: HashMap<String, Vec<usize>>,
    folders: BTreeSet<Vec<&'a str>>,
}

impl<'a> PhotoNames<'a> {
    pub(super) fn new(names: impl Iterator<Item = &'a str>) -> Self {
        let names: Vec<&str> = names.collect();
        let mut by_stem: HashMap<String, Vec<usize>> = HashMap::new();
        names.iter().enumerate().for_each(|(i, name)| by_stem.entry(stem(name).to_lowercase()).or_default().push(i));
        let folders = names.iter().map(|name| parts(name).0).collect();
        Self { names, by_stem, folders }
    }

    /// Finds the photo that labels belong to, by index; `None` if there is no such photo.
    ///
    /// # Errors
    /// If two photos match: both are named.
    pub(super) fn owner(&self, labels: &LabelAddress) -> Result<Option<usize>, IoError> {
        let known: Vec<Vec<&str>> = labels.names.iter().map(|name| parts(name).0).collect();
        let alike = |folder: &[&str]| known.iter().map(|k| in_common(k, folder)).max().unwrap_or(0);
        // In a data set with one folder per camera, labels in one camera's folder belong to no other camera.
        let best = self.folders.iter().map(|folder| alike(folder)).max().unwrap_or(0);
        for name in &labels.names {
            let called = stem(name);
            // "a.png.json" is of "a.png".
            let called = if is_picture(&called) { stem(&called) } else { called };
            let Some(all) = self.by_stem.get(&called.to_lowercase()) else { continue };
            let mut fit: Vec<usize> = all.iter().copied().filter(|i| alike(&parts(self.names[*i]).0) == best).collect();
            // Letter case and endings decide only if the names are otherwise equal.
            let files: Vec<&str> = labels.names.iter().map(|name| parts(name).1).collect();
            let surer: [&dyn Fn(&str) -> bool; 2] =
                [&|photo| stem(photo) == called, &|photo| files.contains(&parts(photo).1)];
            for is_surer in surer {
                if fit.len() > 1 && fit.iter().any(|i| is_surer(self.names[*i])) {
                    fit.retain(|i| is_surer(self.names[*i]));
                }
            }
            match fit[..] {
                [] => {}
                [one] => return Ok(Some(one)),
                [a, b, ..] => {
                    let reason = format!(
                        "the photos '{}' and '{}' are both called so, and it belongs to one; put it into a folder named \
                         like that of its photo",
                        self.names[a], self.names[b]
                    );
                    return Err(IoError::syntax(&labels.file, format!("photo '{called}'"), reason));
                }
            }
        }
        Ok(None)
    }
}

/// Assigns labels to photos, by name, with notes on labels that belong to no photo or were joined.
pub(super) fn bound(addresses: &[LabelAddress], photos: &PhotoNames<'_>) -> Result<(PicturesOf, Vec<String>), IoError> {
    let (mut of, mut unused) = (PicturesOf::new(), Vec::new());
    for (i, address) in addresses.iter().enumerate() {
        match photos.owner(address)? {
            Some(photo) => of.entry(photos.names[photo].to_owned()).or_default().push(i),
            None => unused.push(i),
        }
    }
    let mut notes = Vec::new();
    if let Some(first) = unused.first() {
        notes.push(format!(
            "{} of {} labeled pictures are none of the photos, and are not used (first: {})",
            unused.len(),
            addresses.len(),
            addresses[*first].text()
        ));
    }
    let mut joined: Vec<(&String, &Vec<usize>)> = of.iter().filter(|(_, labels)| labels.len() > 1).collect();
    joined.sort();
    if let Some((photo, labels)) = joined.first() {
        let files: Vec<String> = labels.iter().map(|i| addresses[*i].text()).collect();
        notes.push(format!(
            "{} of the photos have several label files, which are joined (first: {photo}, of {})",
            joined.len(),
            files.join(" and ")
        ));
    }
    Ok((of, notes))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn address(file: &str, folder: &str, name: &str) -> LabelAddress {
        LabelAddress::of_file(file.into(), folder, name)
    }

    fn owner(photos: &[&str], labels: &LabelAddress) -> Option<String> {
        let names = PhotoNames::new(photos.iter().copied());
        names.owner(labels).expect("one at most").map(|i| photos[i].to_owned())
    }

    #[test]
    fn labels_belong_to_one_photo() {
        let rig = ["cam0/frame00.png", "cam1/frame00.png", "cam1/frame01.png"];
        for (file, folder, name, expected) in [
            ("/l/frame00.json", "D:/set/images/cam0", "frame00.png", Some(0)),
            ("/l/frame00.json", "D:\\set\\images\\CAM1\\", "frame00.png", Some(1)),
            ("/l/cam1/frame00.json", "", "frame00.png", Some(1)),
            ("/l/frame00.json", "", "..\\images\\cam1\\frame00.png", Some(1)),
            ("/l/frame01.json", "", "", Some(2)),
            // The other camera has no such frame.
            ("/l/cam0/frame01.json", "", "", None),
            ("/l/frame02.json", "", "", None),
        ] {
            let found = owner(&rig, &address(file, folder, name));
            assert_eq!(found.as_deref(), expected.map(|i: usize| rig[i]), "{file} {folder} {name}");
        }
        let names = PhotoNames::new(rig.into_iter());
        let e = names.owner(&address("/l/frame00.json", "", "frame00.png")).expect_err("two").to_string();
        assert!(
            e.contains("cam0/frame00.png") && e.contains("cam1/frame00.png") && e.contains("/l/frame00.json"),
            "{e}"
        );
    }

    #[test]
    fn the_name_of_the_file_goes_before_the_name_in_it() {
        let photos = ["img_00.png", "img_03.png", "a.jpg", "A.jpg", "b.jpg", "b.png"];
        assert_eq!(owner(&photos, &address("/l/img_03.json", "", "DSC_0417.png")).as_deref(), Some("img_03.png"));
        assert_eq!(owner(&photos, &address("/l/second.json", "", "img_00.png")).as_deref(), Some("img_00.png"));
        assert_eq!(owner(&photos, &address("/l/IMG_00.json", "", "")).as_deref(), Some("img_00.png"));
        assert_eq!(owner(&photos, &address("/l/A.json", "", "")).as_deref(), Some("A.jpg"));
        assert_eq!(owner(&photos, &address("/l/img_00.png.json", "", "")).as_deref(), Some("img_00.png"));
        assert_eq!(owner(&photos, &address("/l/b.json", "", "b.png")).as_deref(), Some("b.png"));
        let names = PhotoNames::new(photos.into_iter());
        assert!(names.owner(&address("/l/b.json", "", "")).is_err());
    }

    #[test]
    fn what_is_not_used_and_what_is_joined_is_told() {
        let all =
            [address("/l/a.json", "", "a.png"), address("/l/b.json", "", "a.png"), address("/l/c.json", "", "d.png")];
        let (of, notes) = bound(&all, &PhotoNames::new(["a.png", "e.png"].into_iter())).expect("bound");
        assert_eq!(of["a.png"], [0, 1]);
        assert_eq!(
            notes,
            [
                "1 of 3 labeled pictures are none of the photos, and are not used (first: c.json, of 'd.png')",
                "1 of the photos have several label files, which are joined (first: a.png, of a.json and b.json, of 'a.png')",
            ]
        );
    }
}
