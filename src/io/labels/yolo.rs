//! YOLO's segments: a text file per photo, a line per region: the number of its class and a polygon in fractions of the
//! photo's sides. Names are in `classes.txt`, `obj.names`, or the list `names` of a `.yaml` beside or above.

use std::collections::BTreeMap;
use std::path::Path;

use super::things::{is_background, is_ignored};
use super::{Passed, Region, Sheet, draw, entries};
use crate::io::{IoError, files};
use crate::scene::Mask;

/// Names of classes by their numbers.
pub(crate) type Names = BTreeMap<usize, String>;

/// Bytes at the start of a text file that decide whether it is one of segments.
const START_BYTES: u64 = 4096;
/// Largest distance of a corner from the photo, in fractions of its side.
const BEYOND: f64 = 0.5;
/// Largest list of names, bytes.
const NAMES_BYTES: u64 = 1 << 20;

/// Parses a line: its class and the numbers after it.
fn line(text: &str) -> Option<(usize, Vec<f64>)> {
    let mut words = text.split_ascii_whitespace();
    let class = words.next()?.parse().ok()?;
    let numbers = words.map(|w| w.parse().ok().filter(|v| (-BEYOND..=1.0 + BEYOND).contains(v)));
    numbers.collect::<Option<Vec<f64>>>().map(|numbers| (class, numbers)).filter(|(_, numbers)| numbers.len() >= 4)
}

/// Returns whether a text file is of this kind, by its first line, and has a polygon; boxes are counted.
pub(super) fn is_own(path: &Path, passed: &mut Passed) -> bool {
    let Ok(start) = files::read_start(path, START_BYTES) else { return false };
    let whole = (start.len() as u64) < START_BYTES;
    let text = String::from_utf8_lossy(&start);
    let Some(first) = text.lines().find(|l| !l.trim().is_empty()) else { return false };
    // A truncated line may end in half a number.
    let first = if whole || text.lines().count() > 1 { first } else { first.rsplit_once(' ').map_or("", |p| p.0) };
    if line(first).is_none() {
        return false;
    }
    let all = files::read_text(path).unwrap_or_default();
    let (polygons, boxes): (Vec<_>, Vec<_>) = all.lines().filter_map(line).partition(|(_, numbers)| numbers.len() >= 6);
    boxes.iter().for_each(|_| passed.add("boxes of YOLO's detection, which are no masks,", path));
    !polygons.is_empty()
}

/// Reads the regions of a label file.
pub(super) fn read(path: &Path, names: &Names, sheet: Sheet<'_>) -> Result<Vec<Region>, IoError> {
    let text = files::read_text(path)?;
    let [w, h] = sheet.size_px();
    sheet.check(path, (w, h), text.lines().count())?;
    let mut regions = Vec::new();
    for (i, text) in text.lines().enumerate().filter(|(_, text)| !text.trim().is_empty()) {
        let bad = || {
            let reason = "expected the number of a class and a polygon in shares of the photo's sides, 0 to 1";
            IoError::syntax(path, format!("line {}", i + 1), reason)
        };
        let (class, mut numbers) = line(text).ok_or_else(bad)?;
        if numbers.len() < 6 {
            continue;
        }
        // An additional number is the confidence of a network.
        numbers.truncate(numbers.len() / 2 * 2);
        let name = names.get(&class).cloned().unwrap_or_default();
        if is_background(&name) || is_ignored(&name) {
            continue;
        }
        let mut mask = Mask::empty(w as usize, h as usize);
        draw(&mut mask, numbers.chunks_exact(2).map(|p| [p[0] * f64::from(w), p[1] * f64::from(h)]));
        regions.push(Region { name, level: None, parent: None, mask });
    }
    Ok(regions)
}

/// Reads the class names in a folder; `None` if it has none.
pub(super) fn names_in(folder: &Path) -> Result<Option<Names>, IoError> {
    let read = |path: &Path| {
        let bytes = files::read(path, NAMES_BYTES)?;
        Ok(String::from_utf8_lossy(&bytes).into_owned())
    };
    for name in ["classes.txt", "obj.names"] {
        let path = folder.join(name);
        if path.is_file() {
            let list = read(&path)?;
            return Ok(Some(list.lines().map(|l| l.trim().to_owned()).enumerate().collect()));
        }
    }
    for name in entries(folder).iter().filter(|n| n.ends_with(".yaml") || n.ends_with(".yml")) {
        if let Some(names) = of_yaml(&read(&folder.join(name))?) {
            return Ok(Some(names));
        }
    }
    Ok(None)
}

/// Parses the list or table `names` of a YAML file, on one line or several.
fn of_yaml(text: &str) -> Option<Names> {
    let mut lines = text.lines().map(|l| l.split(" #").next().unwrap_or_default().trim_end());
    let first = lines.find_map(|l| l.strip_prefix("names:"))?.trim().to_owned();
    let bare = |name: &str| name.trim().trim_matches(['"', '\'']).trim().to_owned();
    let keyed = |(i, entry): (usize, &str)| match entry.split_once(':') {
        Some((key, name)) if bare(key).parse::<usize>().is_ok() => (bare(key).parse().unwrap_or(i), bare(name)),
        _ => (i, bare(entry)),
    };
    if first.starts_with(['[', '{']) {
        let all = std::iter::once(first.as_str()).chain(lines).collect::<Vec<_>>().join(" ");
        let end = all.find([']', '}'])?;
        return Some(all[1..end].split(',').filter(|e| !e.trim().is_empty()).enumerate().map(keyed).collect());
    }
    let entry = |l: &'_ str| -> Option<String> {
        let listed = l.trim_start().strip_prefix("- ").map(str::to_owned);
        listed.or_else(|| l.starts_with(' ').then(|| l.trim().to_owned()))
    };
    let list: Vec<String> = lines.filter(|l| !l.is_empty()).map_while(entry).collect();
    let names: Names = list.iter().map(String::as_str).enumerate().map(keyed).collect();
    (!names.is_empty()).then_some(names)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_are_read_from_every_form_of_yaml() {
        let expected: Names = [(0, "cup".into()), (1, "red plate".into())].into();
        for text in [
            "path: x\nnames: [cup, 'red plate']\n",
            "names: [\"cup\",\n  'red plate']\nnc: 2\n",
            "names:\n- cup\n- red plate\nnc: 2\n",
            "nc: 2\nnames:\n  0: cup  # of tea\n\n  1: \"red plate\"\ntrain: images\n",
            "names: {0: cup, 1: red plate}",
        ] {
            assert_eq!(of_yaml(text), Some(expected.clone()), "{text}");
        }
        assert_eq!(of_yaml("names:\n  3: cup\n"), Some([(3, "cup".into())].into()));
        for text in ["", "nc: 2", "names:\ntrain: x", "names: [cup"] {
            assert_eq!(of_yaml(text), None, "{text}");
        }
    }

    #[test]
    fn other_texts_are_told_apart() {
        for text in
            ["1 PINHOLE 84 63 68.2", "# 3D points", "1 0.5 0.5 0.1", "1.0 2.0 3.0 4.0 5.0", "12 640 480 3 4 5 6", ""]
        {
            assert!(line(text).is_none(), "{text}");
        }
        assert_eq!(line("3 0.1 0.2 0.3 0.4 0.5 1.0"), Some((3, vec![0.1, 0.2, 0.3, 0.4, 0.5, 1.0])));
    }
}
