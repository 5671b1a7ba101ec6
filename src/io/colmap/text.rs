//! COLMAP's text files: `#` starts a comment, one entry per line (images: two lines each).

use std::path::Path;
use std::str::{FromStr, SplitAsciiWhitespace};

use glam::DVec3;

use super::{Cameras, Image, distinct, lens, point};
use crate::io::IoError;
use crate::scene::SparsePoint;

struct Line<'a> {
    words: SplitAsciiWhitespace<'a>,
    number: usize,
    path: &'a Path,
}

impl<'a> Line<'a> {
    fn new(text: &'a str, number: usize, path: &'a Path) -> Self {
        Self { words: text.split_ascii_whitespace(), number, path }
    }

    fn bad(&self, reason: String) -> IoError {
        IoError::Syntax { path: self.path.into(), place: format!("line {}", self.number), reason }
    }

    fn word(&mut self, what: &str) -> Result<&'a str, IoError> {
        self.words.next().ok_or_else(|| self.bad(format!("{what} is missing")))
    }

    fn next<T: FromStr>(&mut self, what: &str) -> Result<T, IoError> {
        let word = self.word(what)?;
        word.parse().map_err(|_| {
            let shown: String = word.chars().take(30).collect();
            self.bad(format!("{what} = '{shown}' is no such number"))
        })
    }

    fn vector(&mut self, what: &str) -> Result<DVec3, IoError> {
        Ok(DVec3::new(self.next(what)?, self.next(what)?, self.next(what)?))
    }
}

/// Returns the lines that are neither empty nor comments.
fn lines<'a>(text: &'a str, path: &'a Path) -> impl Iterator<Item = Line<'a>> {
    let full = text.lines().enumerate().filter(|(_, l)| !l.trim().is_empty() && !l.starts_with('#'));
    full.map(move |(i, l)| Line::new(l, i + 1, path))
}

/// `cameras.txt`: `id model width height params...`.
pub(super) fn cameras(text: &str, path: &Path) -> Result<Cameras, IoError> {
    let mut cameras = Cameras::new();
    let mut ids = Vec::new();
    for mut l in lines(text, path) {
        let id = l.next("camera id")?;
        ids.push(u64::from(id));
        let model = l.word("model")?;
        let size = (l.next("width")?, l.next("height")?);
        let mut params = Vec::new();
        for word in l.words.by_ref() {
            match word.parse() {
                Ok(v) => params.push(v),
                Err(_) => return Err(l.bad("a parameter is not a number".into())),
            }
        }
        let found = match lens::by_name(model) {
            Ok(model) => lens::lens(model, size, &params, id, path)?,
            Err(unknown) => Err(unknown),
        };
        cameras.insert(id, found);
    }
    distinct(ids, "camera", path)?;
    Ok(cameras)
}

/// `images.txt`: `id qw qx qy qz tx ty tz camera name`, then a line of 2-D points, maybe empty.
pub(super) fn images(text: &str, path: &Path) -> Result<Vec<Image>, IoError> {
    let mut images = Vec::new();
    let mut ids = Vec::new();
    let mut rest = text.lines().enumerate();
    while let Some((i, line)) = rest.next() {
        if line.trim().is_empty() || line.starts_with('#') {
            continue;
        }
        let mut l = Line::new(line, i + 1, path);
        let number = l.next("image id")?;
        ids.push(u64::from(number));
        let mut quaternion = [0.0; 4];
        for v in &mut quaternion {
            *v = l.next("rotation")?;
        }
        let translation = l.vector("translation")?;
        let camera = l.next("camera id")?;
        // A name may hold blanks, so it is the rest of the line.
        let first = l.word("name")?;
        let name = line.get(first.as_ptr() as usize - line.as_ptr() as usize..).unwrap_or(first).trim_end();
        images.push(Image { number, name: name.into(), camera, quaternion, translation });
        if let Some((i, line)) = rest.next().filter(|(_, line)| !is_observations(line)) {
            let shown: String = line.chars().take(40).collect();
            return Err(Line::new(line, i + 1, path).bad(format!(
                "the 2-D points of photo '{name}' are expected here (x, y and point id each, or an empty line), not \
                 '{shown}'; images.txt has two lines for each photo"
            )));
        }
    }
    distinct(ids, "image", path)?;
    Ok(images)
}

/// Returns whether a line holds a photo's 2-D points: nothing, or `x y id` repeated.
fn is_observations(line: &str) -> bool {
    let words: Vec<&str> = line.split_ascii_whitespace().collect();
    let is_point =
        |p: &[&str]| p[0].parse::<f64>().is_ok() && p[1].parse::<f64>().is_ok() && p[2].parse::<i64>().is_ok();
    words.len() % 3 == 0 && words.chunks_exact(3).all(is_point)
}

/// `points3D.txt`: `id x y z r g b error track...`.
pub(super) fn points(text: &str, path: &Path) -> Result<Vec<SparsePoint>, IoError> {
    let mut points = Vec::new();
    let mut ids = Vec::new();
    for mut l in lines(text, path) {
        ids.push(l.next::<u64>("point id")?);
        let position = l.vector("position")?;
        let rgb = [l.next("red")?, l.next("green")?, l.next("blue")?];
        points.push(point(position, rgb, points.len(), path)?);
    }
    distinct(ids, "point", path)?;
    Ok(points)
}

/// Number of cameras in the text of a `cameras.txt`.
pub fn check_text_cameras(text: &str, path: &Path) -> Result<usize, IoError> {
    cameras(text, path).map(|c| c.len())
}

/// Number of photos in the text of an `images.txt`.
pub fn check_text_images(text: &str, path: &Path) -> Result<usize, IoError> {
    images(text, path).map(|i| i.len())
}

/// Number of points in the text of a `points3D.txt`.
pub fn check_text_points(text: &str, path: &Path) -> Result<usize, IoError> {
    points(text, path).map(|p| p.len())
}
