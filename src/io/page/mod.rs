//! A scene as one HTML page that opens in any browser without a server and loads nothing from outside.
//!
//! `assets/page` has its text, style and scripts; the renderer is the PlayCanvas engine, made into one file by
//! `tools/page`, and the language of questions is this program's, built as WebAssembly there. Names and titles enter as
//! escaped text or as JSON that no tag can end, and only scripts with a listed checksum run.

pub(crate) mod packed;

use std::io::Write;
use std::path::Path;

use flate2::Compression;
use flate2::write::GzEncoder;
use htmlize::escape_all_quotes;
use serde::Serialize;
use sha2::{Digest, Sha256};

use super::{IoError, atomic};
use crate::scene::IdentityId;

const TEMPLATE: &str = include_str!("../../../assets/page/page.html");
const STYLE: &str = include_str!("../../../assets/page/page.css");
const RENDERER: &[u8] = include_bytes!("../../../assets/page/renderer.js");
const LANGUAGE: &[u8] = include_bytes!("../../../assets/page/language.wasm");
/// Licenses of the renderer, and of the word list in the language.
const LICENSES: &str = concat!(
    include_str!("../../../assets/page/renderer.LICENSE.txt"),
    "\n\n",
    include_str!("../../../assets/lexicon.LICENSE.txt")
);
/// Scripts, joined into one in this order.
const SCRIPTS: [&str; 9] = [
    include_str!("../../../assets/page/decode.js"),
    include_str!("../../../assets/page/pose.js"),
    include_str!("../../../assets/page/draw.js"),
    include_str!("../../../assets/page/pick.js"),
    include_str!("../../../assets/page/orbit.js"),
    include_str!("../../../assets/page/list.js"),
    include_str!("../../../assets/page/ask.js"),
    include_str!("../../../assets/page/flight.js"),
    include_str!("../../../assets/page/page.js"),
];

/// An object or part on a page. Places are relative to the page's origin.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub(crate) struct PageIdentity {
    pub(crate) id: IdentityId,
    /// Whole that it is a part of; 0 for objects.
    pub(crate) parent: IdentityId,
    /// Name among the parts of its whole; `full` includes the names of its wholes.
    pub(crate) name: String,
    pub(crate) full: String,
    /// Number of Gaussians, its parts included.
    pub(crate) count: usize,
    /// RGB.
    pub(crate) color: [u8; 3],
    pub(crate) center: [f64; 3],
    pub(crate) radius: f64,
    /// Unit vector of the direction from which it is seen best, if there are photos.
    pub(crate) from: Option<[f64; 3]>,
}

/// A camera on a page.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub(crate) struct PageView {
    pub(crate) center: [f64; 3],
    /// Rotation as `[x, y, z, w]`: its axes are right, down and forward.
    pub(crate) rotation: [f64; 4],
    /// Vertical field of view, radians.
    pub(crate) fov: f64,
    /// Width by height.
    pub(crate) aspect: f64,
}

/// A camera path on a page.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub(crate) struct PagePath {
    pub(crate) name: String,
    pub(crate) seconds: f64,
    /// Poses at even times: center, rotation `[x, y, z, w]` and vertical field of view in radians, 8 numbers each.
    pub(crate) frames: Vec<f32>,
}

/// Scene data that the scripts of a page read as JSON.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub(crate) struct PageScene {
    /// Objects and parts; wholes come before their parts.
    pub(crate) identities: Vec<PageIdentity>,
    /// World position of the page's origin, scene units.
    pub(crate) origin: [f64; 3],
    pub(crate) view: PageView,
    /// Unit vector.
    pub(crate) up: [f64; 3],
    /// Point that the view orbits around; `distance` is the camera's distance from it.
    pub(crate) focus: [f64; 3],
    pub(crate) distance: f64,
    /// Color behind the Gaussians, 0 to 1.
    pub(crate) background: [f32; 3],
    /// True if Mip-Splatting's filter is on.
    pub(crate) antialias: bool,
    pub(crate) paths: Vec<PagePath>,
}

/// Data by which a page answers questions, besides the language.
#[derive(Clone, Debug)]
pub(crate) struct PageQuestions {
    /// Names, colors and shapes, as JSON.
    pub(crate) scene: Vec<u8>,
    /// Words that people write, with spaces between them.
    pub(crate) words: String,
}

/// Contents of a page besides its scripts.
#[derive(Clone, Debug)]
pub(crate) struct Page {
    pub(crate) title: String,
    /// A line about the scene.
    pub(crate) facts: String,
    /// Year, month and day.
    pub(crate) date: String,
    pub(crate) scene: PageScene,
    /// Gaussians as written by [`packed::encode`].
    pub(crate) gaussians: Vec<u8>,
    /// Identities as written by [`packed::identities`].
    pub(crate) identities: Vec<u8>,
    /// Data for questions, if there are things to ask for.
    pub(crate) asked: Option<PageQuestions>,
}

impl Page {
    /// Writes the page atomically.
    ///
    /// # Errors
    /// [`IoError::Write`].
    pub(crate) fn write(&self, path: &Path) -> Result<(), IoError> {
        atomic::write(path, |out| out.write_all(self.html()?.as_bytes()))
    }

    /// Returns the text of the page.
    pub(crate) fn html(&self) -> std::io::Result<String> {
        let script = format!("(() => {{\n'use strict';\n{}}})();\n", SCRIPTS.join("\n"));
        // A scene without objects is not asked.
        let [asked, language, words] = match &self.asked {
            Some(asked) => [&asked.scene[..], LANGUAGE, asked.words.as_bytes()].map(packed_text),
            None => [(); 3].map(|()| Ok(String::new())),
        };
        let fields = [
            ("policy", policy(&script, self.asked.is_some())),
            ("version", env!("CARGO_PKG_VERSION").to_owned()),
            ("title", escape_all_quotes(&self.title).into_owned()),
            ("facts", escape_all_quotes(&self.facts).into_owned()),
            ("date", escape_all_quotes(&self.date).into_owned()),
            ("style", STYLE.to_owned()),
            ("license", escape_all_quotes(LICENSES).into_owned()),
            // Without `<` the text cannot end the element.
            ("scene", serde_json::to_string(&self.scene)?.replace('<', "\\u003c")),
            ("gaussians", packed_text(&self.gaussians)?),
            ("identities", packed_text(&self.identities)?),
            ("renderer", packed_text(RENDERER)?),
            ("asked", asked?),
            ("language", language?),
            ("dictionary", words?),
            ("script", script),
        ];
        Ok(filled(TEMPLATE, &fields))
    }
}

/// Content security policy: allows the page's own script and style and the data that they make, and no connection.
/// WebAssembly is allowed if the page `answers` questions.
fn policy(script: &str, answers: bool) -> String {
    let wasm = if answers { " 'wasm-unsafe-eval'" } else { "" };
    let sum = |text: &str| format!("'sha256-{}'", base64::encode(Sha256::digest(text.as_bytes())));
    format!(
        "default-src 'none'; script-src {}{wasm} blob:; worker-src blob:; style-src {}; img-src data:; base-uri 'none'; \
         form-action 'none'",
        sum(script),
        sum(STYLE)
    )
}

/// Bytes as base64 of gzip.
fn packed_text(bytes: &[u8]) -> std::io::Result<String> {
    let mut gzip = GzEncoder::new(Vec::new(), Compression::best());
    gzip.write_all(bytes)?;
    Ok(base64::encode(gzip.finish()?))
}

/// Returns `template` with each `{{name}}` replaced; inserted text is not searched again.
fn filled(template: &str, fields: &[(&str, String)]) -> String {
    let mut pieces = template.split("{{");
    let mut out = pieces.next().unwrap_or_default().to_owned();
    for piece in pieces {
        let (name, after) = piece.split_once("}}").unwrap_or((piece, ""));
        out.extend(fields.iter().find(|(n, _)| *n == name).map(|(_, text)| text.as_str()));
        out.push_str(after);
    }
    out
}

#[cfg(test)]
mod tests;
