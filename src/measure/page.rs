//! A report as one HTML page that needs nothing but itself: plots, fronts, tables, orders, defaults.

use htmlize::escape_all_quotes;

use super::document::{Report, Stage};
use super::plot::{order_svg, svg};
use super::table::{html as html_table, title};
use crate::math::format::{number, seconds};

/// How pages of results look.
pub(crate) const STYLE: &str = "body{font:15px/1.5 system-ui,sans-serif;color:#1b1b1f;background:#fff;max-width:1080px;\
margin:2em auto;padding:0 1em}h1{margin-bottom:0}h2{margin-top:2.2em;border-top:1px solid #ccc;padding-top:.6em}\
table{border-collapse:collapse;font-size:13px;margin:.6em 0}th,td{padding:.25em .7em;border-bottom:1px solid #ddd;\
text-align:right;font-variant-numeric:tabular-nums}th:first-child,td:first-child,th:nth-child(2),td:nth-child(2)\
{text-align:left}td:nth-child(n+3){white-space:nowrap}tr.front{background:#eef5e9}tr.default{font-weight:600}.no{color:#a40000;font-weight:600}\
p.small,details{color:#555;font-size:13px}svg{max-width:100%;height:auto}.orders{display:flex;flex-wrap:wrap;gap:1em}\
nav a{margin-right:1.2em}summary{cursor:pointer}";

/// The page.
pub fn html(report: &Report) -> String {
    let title = format!("Error vs. run time: {}", report.scene);
    let mut out = format!(
        "<!DOCTYPE html>\n<html lang=\"en\"><head><meta charset=\"utf-8\"><meta name=\"viewport\" \
         content=\"width=device-width\"><title>{0}</title><style>{STYLE}</style></head><body>\n<h1>{0}</h1>\n\
         <p class=\"small\">FMLGS {1}. Measured on: {2}. Times are medians; compare them within a page only.</p>\n<nav>",
        escape_all_quotes(&title),
        escape_all_quotes(&report.program),
        escape_all_quotes(report.computer.words())
    );
    for stage in &report.stages {
        out += &format!("<a href=\"#{}\">{}</a>", stage.name.name(), stage.name.title());
    }
    out += "</nav>\n";
    report.stages.iter().for_each(|s| out += &section(s));
    if report.stages.is_empty() {
        out += "<p>No stage has been measured yet.</p>\n";
    }
    out + "</body></html>\n"
}

fn section(stage: &Stage) -> String {
    let input: Vec<String> =
        stage.input.iter().map(|(k, v)| format!("{}: {}", escape_all_quotes(k), escape_all_quotes(v))).collect();
    let mut out = format!(
        "<h2 id=\"{}\">{}</h2>\n<p>Seconds of {}; {}.</p><p class=\"small\">{}; {} repeats.",
        stage.name.name(),
        stage.name.title(),
        escape_all_quotes(&stage.secs_of),
        escape_all_quotes(&stage.reference),
        input.join("; "),
        stage.seeds.len()
    );
    if !stage.complete() {
        out +=
            &format!(" <span class=\"no\">Stopped early: {} of {} settings.</span>", stage.points.len(), stage.planned);
    }
    out += "</p>\n";
    for text in &stage.left_out {
        out += &format!("<p class=\"no\">Left out: {}</p>\n", escape_all_quotes(text));
    }
    for (i, measure) in stage.measures.iter().enumerate() {
        let Ok(image) = svg(stage, measure) else { continue };
        // The first is shown, the others on request.
        out += &match i {
            0 => image,
            _ => format!(
                "<details><summary>{}: {}</summary>{image}</details>\n",
                escape_all_quotes(title(measure)),
                escape_all_quotes(&measure.meaning)
            ),
        };
    }
    out + &table(stage) + &choices(stage) + &orders(stage)
}

fn table(stage: &Stage) -> String {
    let head: Vec<String> = stage
        .measures
        .iter()
        .map(|m| format!("<th title=\"{}\">{}</th>", escape_all_quotes(&m.meaning), escape_all_quotes(title(m))))
        .collect();
    let mut out =
        format!("<table><thead><tr><th>knob</th><th>setting</th><th>time</th>{}</tr></thead><tbody>\n", head.concat());
    let front = stage.measures.first().map(|m| stage.front(m)).unwrap_or_default();
    for (i, p) in stage.points.iter().enumerate() {
        let class = match (front.contains(&i), p.default) {
            (true, true) => "front default",
            (true, false) => "front",
            (false, true) => "default",
            (false, false) => "",
        };
        let knobs = serde_json::to_string(&p.knobs).unwrap_or_default();
        let spread = format!("{} to {}", seconds(p.secs.least), seconds(p.secs.most));
        out += &format!(
            "<tr class=\"{class}\"><td>{}</td><td title=\"{}\">{}</td><td title=\"{spread}\">{}</td>",
            escape_all_quotes(&p.method),
            escape_all_quotes(&knobs),
            escape_all_quotes(&p.setting),
            seconds(p.secs.median)
        );
        for m in &stage.measures {
            out += &match p.values.get(&m.name) {
                Some(v) => {
                    format!("<td title=\"{} to {}\">{}</td>", number(v.least), number(v.most), number(v.median))
                }
                None => "<td></td>".into(),
            };
        }
        out += "</tr>\n";
    }
    out + "</tbody></table>\n<p class=\"small\">Green: on the Pareto front of the first measure. Bold: the defaults. \
           Hover for the spread of repeats and the exact settings.</p>\n"
}

fn choices(stage: &Stage) -> String {
    let choices = stage.choice_table();
    if choices.len() < 2 {
        return String::new();
    }
    let rule = escape_all_quotes(stage.rule.words());
    format!("<p>By the rule \u{201c}{rule}\u{201d}:</p>\n{}", html_table(&choices))
}

fn orders(stage: &Stage) -> String {
    if stage.orders.is_empty() {
        return String::new();
    }
    let mut out = String::from("<h3>Convergence</h3><div class=\"orders\">\n");
    for o in &stage.orders {
        let (class, word) = if o.agrees { ("", "agrees") } else { ("no", "does not agree") };
        out += &format!(
            "<figure>{}<figcaption>{}: order {:.2} seen, {} expected: <span class=\"{class}\">{word}</span>. {}</figcaption></figure>\n",
            order_svg(o).unwrap_or_default(),
            escape_all_quotes(&o.what),
            o.observed,
            o.expected,
            escape_all_quotes(&o.meaning)
        );
    }
    out + "</div>\n"
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::measure::tests::example;

    #[test]
    fn the_page_is_whole_and_needs_nothing_else() {
        let page = html(&example());
        assert!(page.contains("1/255 &lt;&amp;&gt; &quot;quoted&quot;") && page.ends_with("</body></html>\n"));
        assert_eq!(page.matches("<tr class=").count(), 4);
        // Nothing is loaded from elsewhere; the names of XML namespaces are no addresses.
        let addresses = page.replace("http://www.w3.org/2000/svg", "");
        assert!(!addresses.contains("http") && !page.contains("<script"), "it loads something");
    }

    #[test]
    fn an_empty_report_says_so() {
        let empty = Report { stages: vec![], ..example() };
        assert!(html(&empty).contains("No stage has been measured yet"));
    }
}
