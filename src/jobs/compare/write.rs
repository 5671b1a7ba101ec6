//! Files of a comparison: `compare.json`, `compare.csv`, `compare.png`, and a page that loads nothing.

use std::fmt::Write as _;
use std::path::Path;

use htmlize::escape_all_quotes;
use image::{ColorType, RgbImage};

use super::cell::{ComparedCell, Comparison, RuledCell};
use crate::jobs::{JobError, export};
use crate::measure::page::STYLE;

/// Names of the files.
pub(super) const FILES: [&str; 4] = ["compare.json", "compare.csv", "compare.png", "compare.html"];

/// Folder of the arrays.
pub(super) const ARRAYS: &str = "relevancy";

/// Heads of the table of cells.
pub(crate) const HEAD: [&str; 11] = [
    "phrase",
    "view",
    "method",
    "IoU own",
    "IoU common",
    "hit",
    "own %",
    "common %",
    "encode ms",
    "blend ms",
    "decode ms",
];

/// Heads of the table of methods.
pub(crate) const METHOD_HEAD: [&str; 9] = [
    "method",
    "Gaussians",
    "IoU own",
    "IoU common",
    "localized own",
    "localized common",
    "encode ms",
    "blend ms",
    "decode ms",
];

impl ComparedCell {
    /// Its row of the table, as [`HEAD`] says.
    pub(crate) fn texts(&self) -> Vec<String> {
        let none = || "-".to_owned();
        let iou = |r: &Option<RuledCell>| r.as_ref().and_then(|r| r.iou).map_or_else(none, |v| format!("{v:.3}"));
        let share = |r: &Option<RuledCell>| r.as_ref().map_or_else(none, |r| format!("{:.1}", 100.0 * r.share));
        let hit = [&self.own, &self.common].into_iter().find_map(|r| r.as_ref()?.hit);
        let hit = hit.map_or_else(none, |hit| if hit { "yes" } else { "no" }.to_owned());
        let ms = |v: f64| if self.problem.is_some() { none() } else { format!("{v:.1}") };
        let texts = [self.phrase.clone(), self.view.clone(), self.method.clone()];
        let numbers = [iou(&self.own), iou(&self.common), hit, share(&self.own), share(&self.common)];
        let times = [self.ms.encode, self.ms.blend, self.ms.decode].map(ms);
        texts.into_iter().chain(numbers).chain(times).collect()
    }
}

impl Comparison {
    /// Cells of a row of the sheet: a phrase in a view, one for each method.
    pub(super) fn row(&self, k: usize) -> &[ComparedCell] {
        let n = self.methods.len();
        self.cells.get(k * n..(k + 1) * n).unwrap_or_default()
    }

    /// Rows of the table of methods, as [`METHOD_HEAD`] says.
    pub(crate) fn method_rows(&self) -> Vec<Vec<String>> {
        let none = || "-".to_owned();
        let share = |v: Option<f64>| v.map_or_else(none, |v| format!("{v:.3}"));
        let rows = self.methods.iter().map(|m| {
            let scores = [m.own_miou, m.common_miou, m.own_localization, m.common_localization].map(share);
            let times = [m.ms.encode, m.ms.blend, m.ms.decode].map(|v| format!("{v:.1}"));
            let names = [m.method.clone(), m.gaussians.to_string()];
            names.into_iter().chain(scores).chain(times).collect()
        });
        rows.collect()
    }

    /// Says which rule gave which number, a sentence for each method and one for the common rule.
    pub(crate) fn rules(&self) -> Vec<String> {
        let own = |m: &super::cell::ComparedMethod| {
            format!("{}, own rule: {}", m.method, m.own_rule.unwrap_or("none; only the common one is measured"))
        };
        let common = self.cells.iter().find_map(|c| Some(c.common.as_ref()?.rule));
        self.methods.iter().map(own).chain(common.map(|rule| format!("common rule: {rule}"))).collect()
    }

    /// Table for spreadsheets.
    pub(super) fn csv(&self) -> String {
        // Some spreadsheets take text that begins so for a formula.
        let text = |text: &str| {
            let text = if text.starts_with(['=', '+', '-', '@']) { format!("'{text}") } else { text.to_owned() };
            format!("\"{}\"", text.replace('"', "\"\""))
        };
        let mut all = String::from(
            "phrase,view,method,problem,largest_relevancy,own_rule,own_level,own_area_px,own_iou,own_hit,common_rule,\
             common_level,common_area_px,common_iou,common_hit,encode_ms,blend_ms,decode_ms\n",
        );
        let ruled = |r: &Option<RuledCell>| {
            r.as_ref().map_or_else(
                || ",,,,".to_owned(),
                |r| {
                    let (iou, hit) = (r.iou.map(|v| format!("{v:.6}")), r.hit.map(|h| u8::from(h).to_string()));
                    let [iou, hit] = [iou, hit].map(Option::unwrap_or_default);
                    format!("{},{},{},{iou},{hit}", text(r.rule), r.level, r.area_px)
                },
            )
        };
        for c in &self.cells {
            let names = [&*c.phrase, &c.view, &c.method, c.problem.as_deref().unwrap_or_default()].map(text).join(",");
            let most = c.most.map_or_else(String::new, |v| format!("{v:.6}"));
            let (own, common) = (ruled(&c.own), ruled(&c.common));
            // Writing to a text cannot fail.
            let _ =
                writeln!(all, "{names},{most},{own},{common},{:.3},{:.3},{:.3}", c.ms.encode, c.ms.blend, c.ms.decode);
        }
        all
    }

    /// The page, with the sheet in it.
    pub(super) fn html(&self, sheet: &[u8]) -> String {
        let names: Vec<&str> = self.methods.iter().map(|m| &*m.method).collect();
        let title = escape_all_quotes(names.join(", ")).into_owned();
        let mut out = format!(
            "<!DOCTYPE html>\n<html lang=\"en\"><head><meta charset=\"utf-8\"><meta name=\"viewport\" \
             content=\"width=device-width\"><meta http-equiv=\"Content-Security-Policy\" content=\"default-src 'none'; \
             style-src 'unsafe-inline'; img-src data:\"><title>{title}</title><style>{STYLE}img{{max-width:100%}}</style>\
             </head><body>\n<h1>{title}</h1>\n"
        );
        let table = |head: &[&str], rows: Vec<Vec<String>>| {
            let head: String = head.iter().map(|h| format!("<th>{}</th>", escape_all_quotes(*h))).collect();
            let cell = |c: &String| format!("<td>{}</td>", escape_all_quotes(c));
            let row = |r: Vec<String>| format!("<tr>{}</tr>\n", r.iter().map(cell).collect::<String>());
            let rows: String = rows.into_iter().map(row).collect();
            format!("<div class=\"wide\"><table><tr>{head}</tr>\n{rows}</table></div>\n")
        };
        out += &table(&METHOD_HEAD, self.method_rows());
        for text in self.rules().iter().chain(&self.notes) {
            out += &format!("<p class=\"small\">{}</p>\n", escape_all_quotes(text));
        }
        out += &format!(
            "<p class=\"small\">FMLGS {}. Times are medians of {} runs and compare on this computer only.</p>\n",
            escape_all_quotes(self.program),
            self.repeats
        );
        let alt = "A row for each phrase and view: the view, then each method's relevancy with its mask outlined";
        out += &format!("<img alt=\"{alt}\" src=\"data:image/png;base64,{}\">\n", base64::encode(sheet));
        out += "<h2>All answers</h2>\n";
        out += &table(&HEAD, self.cells.iter().map(ComparedCell::texts).collect());
        for c in &self.cells {
            if let Some(problem) = &c.problem {
                let text = format!("{}, {}, {}: {problem}", c.phrase, c.view, c.method);
                out += &format!("<p class=\"no\">{}</p>\n", escape_all_quotes(&text));
            }
        }
        out + "</body></html>\n"
    }
}

/// Refuses a folder that holds results already, or that belongs to what is compared.
///
/// # Errors
/// If a file would be replaced, or the folder holds inputs.
pub(super) fn check(folder: &Path, reads: &[&Path]) -> Result<(), JobError> {
    export::check_folder(folder, reads)?;
    match FILES.iter().chain([&ARRAYS]).map(|name| folder.join(name)).find(|file| file.exists()) {
        Some(file) => Err(JobError::Output(format!("'{}' is there already; give another --out", file.display()))),
        None => Ok(()),
    }
}

/// Writes all files.
///
/// # Errors
/// If one cannot be written.
pub(super) fn write(folder: &Path, comparison: &Comparison, sheet: &RgbImage) -> Result<(), JobError> {
    let mut png = Vec::new();
    let size = [sheet.width(), sheet.height()];
    export::encode_png(&mut png, sheet.as_raw(), size, ColorType::Rgb8).map_err(image_failed)?;
    let [json, csv, picture, page] = FILES.map(|name| folder.join(name));
    export::text(&csv, &comparison.csv())?;
    export::bytes(&picture, &png)?;
    export::text(&page, &comparison.html(&png))?;
    Ok(export::json(&json, comparison)?)
}

fn image_failed(e: std::io::Error) -> JobError {
    JobError::Output(format!("the sheet cannot be written as a picture: {e}"))
}
