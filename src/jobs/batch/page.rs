//! The page of merged results: means over seeds and scenes, then every unit. It needs no other file.

use htmlize::escape_all_quotes;

use super::merge::{MergedResults, MergedRow};
use super::state::UnitResult;
use crate::math::format;
use crate::measure::page::STYLE;

pub(super) fn html(merged: &MergedResults) -> String {
    let MergedResults { rows, units, failed, unfinished, program, .. } = merged;
    let mut out = format!(
        "<!DOCTYPE html>\n<html lang=\"en\"><head><meta charset=\"utf-8\"><meta name=\"viewport\" \
         content=\"width=device-width\"><title>Results of a batch</title><style>{STYLE}</style></head><body>\n\
         <h1>Results of a batch</h1>\n<p class=\"small\">FMLGS {}. {} done, {} failed, {} unfinished. Means and standard \
         deviations are over seeds, in rows over scenes over the scenes' means. Times compare on one machine only.</p>\n",
        escape_all_quotes(*program),
        format::things(units.len(), "unit"),
        failed.len(),
        unfinished.len()
    );
    out += &table(&MergedRow::HEAD, rows.iter().map(|r| (r.scene.is_none(), r.cells().to_vec())));
    out += "<h2>Units</h2>\n";
    let head = ["scene", "settings", "seed", "PSNR dB", "SSIM", "Gaussians", "training s", "mean IoU", "machine"];
    out += &table(&head, units.iter().map(|u| (false, cells(u))));
    let missing = failed.iter().map(|f| (f.asked.name(), &*f.error));
    let missing = missing.chain(unfinished.iter().map(|name| (name.clone(), "unfinished")));
    for (name, why) in missing {
        out += &format!("<p class=\"no\">{}: {}</p>\n", escape_all_quotes(&name), escape_all_quotes(why));
    }
    out + "</body></html>\n"
}

fn cells(unit: &UnitResult) -> Vec<String> {
    let number = |value: Option<f64>, digits: usize| value.map_or_else(|| "-".to_owned(), |v| format!("{v:.digits$}"));
    vec![
        unit.asked.scene.clone(),
        unit.asked.setting.clone(),
        unit.asked.seed.to_string(),
        number(unit.psnr(), 2),
        number(unit.ssim(), 4),
        format::count(unit.gaussians as u64),
        format!("{:.1}", unit.secs.training),
        number(unit.miou(), 4),
        unit.computer.words(),
    ]
}

/// Returns a table of rows, each with whether it is highlighted.
fn table(head: &[&str], rows: impl Iterator<Item = (bool, Vec<String>)>) -> String {
    let cell = |tag: &str, text: &str| format!("<{tag}>{}</{tag}>", escape_all_quotes(text));
    let head: String = head.iter().map(|text| cell("th", text)).collect();
    let row = |(stands_out, cells): (bool, Vec<String>)| {
        let class = if stands_out { " class=\"default\"" } else { "" };
        let cells: String = cells.iter().map(|text| cell("td", text)).collect();
        format!("<tr{class}>{cells}</tr>\n")
    };
    let rows: String = rows.map(row).collect();
    format!("<table><thead><tr>{head}</tr></thead><tbody>\n{rows}</tbody></table>\n")
}
