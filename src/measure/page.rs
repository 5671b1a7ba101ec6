//! A report as one HTML page that needs nothing but itself, on a screen or printed: what was measured, where and how,
//! plots, tables, orders, defaults.

use htmlize::escape_all_quotes;

use super::document::{Measure, Point, Report, Sample, Stage};
use super::plot::{order_svg, svg};
use super::table::{self, html as html_table, range, title};
use crate::math::format::{number, seconds};

/// Looks of pages of results: light, for paper too.
pub(crate) const STYLE: &str = "body{font:15px/1.5 system-ui,sans-serif;color:#1b1b1f;background:#fff;max-width:1080px;\
margin:2em auto;padding:0 1em;color-scheme:light}h1{margin-bottom:0}h2{margin-top:2.2em;border-top:1px solid #ccc;padding-top:.6em}\
table{border-collapse:collapse;font-size:13px;margin:.6em 0}th,td{padding:.25em .7em;border-bottom:1px solid #ddd;\
text-align:right;vertical-align:top;font-variant-numeric:tabular-nums}th:first-child,td:first-child,th:nth-child(2),td:nth-child(2)\
{text-align:left}td:nth-child(n+3){white-space:nowrap}tr.front{background:#eef5e9}tr.default{font-weight:600}.no{color:#a40000;font-weight:600}\
td small{display:block;color:#555;font-weight:400;font-size:11px}\
p.small,dl,details{color:#555;font-size:13px}dt{float:left;clear:left;margin-right:.6em;font-weight:600}dd{margin:0 0 .1em 9em}\
.wide{overflow-x:auto}code{overflow-wrap:anywhere}svg{max-width:100%;height:auto}figure{margin:1em 0}.orders{display:flex;flex-wrap:wrap;gap:1em}\
.orders figure{max-width:430px;margin:0}figcaption{color:#555;font-size:13px}nav a{margin-right:1.2em}summary{cursor:pointer}\
@page{size:A4 landscape;margin:12mm}@media print{body{max-width:none;margin:0;padding:0;font-size:12px}nav{display:none}.wide{overflow:visible}\
h2,h3{break-after:avoid}h2{break-before:page}h2:first-of-type{break-before:auto}figure,tr,dl{break-inside:avoid}\
table{font-size:9.5px}td small{font-size:8px}th,td{padding:.15em .4em}td:nth-child(n+3){white-space:normal}\
tr.front{print-color-adjust:exact;-webkit-print-color-adjust:exact}}";

/// The page.
pub fn html(report: &Report) -> String {
    let title = format!("Error vs. run time: {}", report.scene);
    let mut out = format!(
        "<!DOCTYPE html>\n<html lang=\"en\"><head><meta charset=\"utf-8\"><meta name=\"viewport\" \
         content=\"width=device-width\"><title>{0}</title><style>{STYLE}</style></head><body>\n<h1>{0}</h1>\n{1}\n<nav>",
        escape_all_quotes(&title),
        about(report)
    );
    for stage in &report.stages {
        out += &format!("<a href=\"#{}\">{}</a>", stage.name.name(), stage.name.title());
    }
    out += "</nav>\n";
    report.stages.iter().for_each(|s| out += &section(report, s));
    if report.stages.is_empty() {
        out += "<p>No stage has been measured yet.</p>\n";
    }
    out + "</body></html>\n"
}

/// Paragraphs on the machine, the command, and reading the report.
fn about(report: &Report) -> String {
    let commands = report.commands.iter().map(|c| format!("<code>{}</code>", escape_all_quotes(c)));
    let commands = match report.commands.is_empty() {
        true => "not noted".to_owned(),
        false => commands.collect::<Vec<_>>().join("<br>"),
    };
    let rows = [
        ("machine", escape_all_quotes(report.computer.words()).into_owned()),
        ("program", format!("FMLGS {}", escape_all_quotes(&report.program))),
        ("command", commands),
    ];
    let rows: String = rows.iter().map(|(name, text)| format!("<dt>{name}</dt><dd>{text}</dd>")).collect();
    format!(
        "<dl>{rows}</dl>\n<p class=\"small\">Each stage of the program has knobs that trade accuracy for time. One is \
         turned at a time; the others stay at the default. Numbers are medians of the runs, with the least and the most \
         below them, or \u{201c}one run\u{201d}. In the plots every mark is a setting, its look is the knob, bars reach \
         from the least to the most, and zero has a band of its own, for the axes are logarithmic. On the front (*, gray \
         rings) is what no setting beats in time or error by more than repeats differ; times of single runs within 15 % \
         are the same. Times compare within this page only.</p>"
    )
}

fn section(report: &Report, stage: &Stage) -> String {
    let input: Vec<String> =
        stage.input.iter().map(|(k, v)| format!("{}: {}", escape_all_quotes(k), escape_all_quotes(v))).collect();
    let mut out = format!(
        "<h2 id=\"{}\">{}</h2>\n<p>Seconds of {}; {}.</p><p class=\"small\">{}; {}.",
        stage.name.name(),
        stage.name.title(),
        escape_all_quotes(&stage.secs_of),
        escape_all_quotes(&stage.reference),
        input.join("; "),
        stage.runs()
    );
    if let Some(far) = stage.stopped_at() {
        out += &format!(" <span class=\"no\">Stopped early: {far}.</span>");
    }
    out += "</p>\n";
    for text in &stage.left_out {
        out += &format!("<p class=\"no\">Left out: {}</p>\n", escape_all_quotes(text));
    }
    let mut figures = stage.measures.iter().filter_map(|m| Some(figure(m, &svg(report, stage, m)?)));
    // One plot is what is looked at first; the tables are nearer to it than the other plots.
    out += &figures.next().unwrap_or_default();
    out += &(table(stage) + &choices(stage) + &orders(stage));
    let others: String = figures.collect();
    match others.is_empty() {
        true => out,
        false => format!("{out}<h3>{}: the other measures</h3>\n{others}", stage.name.title()),
    }
}

fn figure(measure: &Measure, image: &str) -> String {
    let (name, meaning) = (escape_all_quotes(title(measure)), escape_all_quotes(&measure.meaning));
    format!("<figure>{image}<figcaption>{name}: {meaning}.</figcaption></figure>\n")
}

fn table(stage: &Stage) -> String {
    let head = ["knob", "setting", "runs", "time"].map(str::to_owned).into_iter();
    let head = head.chain(stage.measures.iter().map(title)).chain(["front".to_owned()]);
    let head: String = head.map(|name| format!("<th>{}</th>", escape_all_quotes(name))).collect();
    let front = stage.measures.first().map(|m| stage.front(m)).unwrap_or_default();
    let rows: String = stage.points.iter().enumerate().map(|(i, p)| row(stage, p, front.contains(&i))).collect();
    let meanings = stage
        .measures
        .iter()
        .map(|m| format!("<dt>{}</dt><dd>{}</dd>", escape_all_quotes(title(m)), escape_all_quotes(&m.meaning)));
    format!(
        "<div class=\"wide\"><table><thead><tr>{head}</tr></thead><tbody>\n{rows}</tbody></table></div>\n<p class=\"small\">*, green: on the front \
         of the first measure. Bold: the defaults. Below a setting: its fields of the settings.</p>\n<dl>{}</dl>\n",
        meanings.collect::<String>()
    )
}

fn row(stage: &Stage, p: &Point, is_on_front: bool) -> String {
    let class = match (is_on_front, p.default) {
        (true, true) => "front default",
        (true, false) => "front",
        (false, true) => "default",
        (false, false) => "",
    };
    let knobs = match p.knobs.is_empty() {
        true => String::new(),
        false => {
            let knobs = p.knobs.iter().map(|(name, value)| format!("{name} {value}")).collect::<Vec<_>>().join(", ");
            format!("<small>{}</small>", escape_all_quotes(knobs))
        }
    };
    let cell = |sample: &Sample, show: fn(f64) -> String| match sample.each.is_empty() {
        true => "<td></td>".to_owned(),
        false => format!("<td>{}<small>{}</small></td>", show(sample.median), range(sample, show)),
    };
    let values = stage.measures.iter().map(|m| p.values.get(&m.name).map_or("<td></td>".into(), |v| cell(v, number)));
    format!(
        "<tr class=\"{class}\"><td>{}</td><td>{}{knobs}</td><td>{}</td>{}{}<td>{}</td></tr>\n",
        escape_all_quotes(&p.method),
        escape_all_quotes(&p.setting),
        p.secs.each.len(),
        cell(&p.secs, seconds),
        values.collect::<String>(),
        if is_on_front { "*" } else { "" }
    )
}

fn choices(stage: &Stage) -> String {
    let choices = table::choices(stage);
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
            "<figure>{}<figcaption>{}: order {:.2} seen, {} expected (wide line): <span class=\"{class}\">{word}</span>. {}</figcaption></figure>\n",
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
    fn printed_it_reads_by_itself() {
        let page = html(&example());
        for said in
            ["one, 2 cores", "<code>fmlgs report example</code>", "each setting 3 times", "Seconds of one frame"]
        {
            assert!(page.contains(said), "{said}");
        }
        // Both measures are drawn, and what they mean is said, without a pointer over anything.
        assert_eq!(page.matches("<figure><svg").count(), 2 + 1);
        assert!(!page.contains("<details") && !page.contains(" title=\""));
        assert!(
            page.contains("<dd>root mean square</dd>") && page.contains("0.004000<small>0.003600 to 0.004400</small>")
        );
        let mut single = example();
        single.stages[0].points[1].secs = [11.2].into_iter().collect();
        assert!(html(&single).contains("11.20 s<small>one run</small>"));
        assert!(html(&single).contains("3 settings 3 times, 1 setting once"));
        // What was made before commands were noted is read and says so.
        let text = serde_json::to_string(&Report { commands: Vec::new(), ..example() }).expect("JSON");
        assert!(!text.contains("commands"));
        assert!(html(&serde_json::from_str(&text).expect("read")).contains("not noted"));
    }

    #[test]
    fn an_empty_report_says_so() {
        let empty = Report { stages: vec![], ..example() };
        assert!(html(&empty).contains("No stage has been measured yet"));
    }
}
