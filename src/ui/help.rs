//! Help that works offline: the guide, what is new, and the version with its license, in a dialog.

use egui::text::LayoutJob;
use egui::{Align, FontId, Label, Layout, RichText, ScrollArea, TextFormat, TextStyle, Ui};

use super::theme;

/// A page of help.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum HelpPage {
    Guide,
    News,
    About,
}

impl HelpPage {
    fn title(self) -> &'static str {
        match self {
            Self::Guide => "Guide",
            Self::News => "What is new",
            Self::About => "About FMLGS",
        }
    }

    /// Its text, as Markdown.
    fn text(self) -> String {
        match self {
            Self::Guide => include_str!("../../docs/guide.md").to_owned(),
            Self::News => include_str!("../../CHANGELOG.md").to_owned(),
            Self::About => format!(
                "FMLGS {}\n\nLicense: {}, whichever you choose.\n\n{}\n\n## License MIT\n\n{}",
                env!("CARGO_PKG_VERSION"),
                env!("CARGO_PKG_LICENSE"),
                env!("CARGO_PKG_DESCRIPTION"),
                include_str!("../../LICENSE-MIT"),
            ),
        }
    }
}

/// Draws the open page; closes it at the user's wish.
pub(crate) fn show(ctx: &egui::Context, open: &mut Option<HelpPage>) {
    let Some(page) = *open else { return };
    let response = theme::dialog("help").show(ctx, |ui| {
        ui.set_width((ctx.content_rect().width() - 80.0).min(720.0));
        ui.heading(page.title());
        ui.add_space(6.0);
        let height = (ctx.content_rect().height() - 170.0).max(160.0);
        let scrolled = ScrollArea::vertical().id_salt(page.title()).max_height(height).min_scrolled_height(height);
        scrolled.auto_shrink([false, true]).show(ui, |ui| blocks(&page.text()).iter().for_each(|b| block(ui, b)));
        ui.add_space(8.0);
        ui.with_layout(Layout::right_to_left(Align::Center), |ui| ui.button("Close").clicked()).inner
    });
    if response.inner || response.should_close() {
        *open = None;
    }
}

/// Piece of a page.
#[derive(Debug, PartialEq)]
enum HelpBlock {
    Heading(String),
    Paragraph(String),
    Item(String),
    /// A row of a table, without its bars, or a line of code.
    Verbatim(String),
}

/// Splits Markdown into the pieces that are drawn; lines of one paragraph are joined.
fn blocks(text: &str) -> Vec<HelpBlock> {
    let (mut all, mut is_code, mut goes_on) = (Vec::new(), false, false);
    for line in text.lines() {
        let plain = line.trim();
        if plain.starts_with("```") {
            (is_code, goes_on) = (!is_code, false);
        } else if is_code {
            all.push(HelpBlock::Verbatim(line.to_owned()));
        } else if plain.is_empty() || plain.starts_with("![") {
            goes_on = false;
        } else if plain.starts_with('#') {
            all.push(HelpBlock::Heading(plain.trim_start_matches('#').trim().to_owned()));
            goes_on = false;
        } else if let Some(row) = plain.strip_prefix('|') {
            // The line under a table's head has no letters.
            if row.contains(char::is_alphanumeric) {
                all.push(HelpBlock::Verbatim(row.trim_end_matches('|').replace('|', "  \u{b7} ").trim().to_owned()));
            }
            goes_on = false;
        } else if let Some(item) = plain.strip_prefix("- ").or(plain.strip_prefix("* ")) {
            all.push(HelpBlock::Item(item.to_owned()));
            goes_on = true;
        } else {
            match all.last_mut() {
                Some(HelpBlock::Paragraph(text) | HelpBlock::Item(text)) if goes_on => {
                    text.push(' ');
                    text.push_str(plain);
                }
                _ => all.push(HelpBlock::Paragraph(plain.to_owned())),
            }
            goes_on = true;
        }
    }
    all
}

fn block(ui: &mut Ui, block: &HelpBlock) {
    match block {
        HelpBlock::Heading(text) => {
            ui.add_space(8.0);
            ui.label(RichText::new(text).strong().size(15.5));
        }
        HelpBlock::Paragraph(text) => drop(ui.add(Label::new(inline(ui, text)).wrap())),
        HelpBlock::Item(text) => {
            ui.horizontal_top(|ui| {
                ui.label("\u{2022}");
                ui.add(Label::new(inline(ui, text)).wrap());
            });
        }
        HelpBlock::Verbatim(text) => drop(ui.add(Label::new(inline(ui, text)).wrap())),
    }
}

/// Lays out code, emphasis and links of a paragraph: of a link, its words.
fn inline(ui: &Ui, text: &str) -> LayoutJob {
    let (body, code) = (TextStyle::Body.resolve(ui.style()), TextStyle::Monospace.resolve(ui.style()));
    let format = |font: &FontId, color| TextFormat::simple(font.clone(), color);
    let mut job = LayoutJob::default();
    for (n, part) in text.split('`').enumerate() {
        if n % 2 == 1 {
            job.append(part, 0.0, format(&code, theme::accent()));
            continue;
        }
        for (k, part) in without_links(part).replace("**", "*").split('*').enumerate() {
            let color = if k % 2 == 1 { ui.visuals().strong_text_color() } else { theme::text() };
            job.append(part, 0.0, format(&body, color));
        }
    }
    job
}

/// The text with the words of its links in place of them.
fn without_links(text: &str) -> String {
    let (mut out, mut rest) = (String::new(), text);
    while let Some((before, words, after)) = rest.split_once('[').and_then(|(before, tail)| {
        let (words, target) = tail.split_once("](")?;
        Some((before, words, target.split_once(')')?.1))
    }) {
        out.push_str(before);
        out.push_str(words);
        rest = after;
    }
    out + rest
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_page_has_text() {
        for page in [HelpPage::Guide, HelpPage::News, HelpPage::About] {
            assert!(blocks(&page.text()).len() > 3, "{page:?}");
        }
        assert!(HelpPage::About.text().contains(env!("CARGO_PKG_VERSION")));
        assert!(HelpPage::About.text().contains("Permission is hereby granted"));
    }

    #[test]
    fn marks_are_read_and_lines_are_joined() {
        let text = "# Head\n\nOne\ntwo.\n\n- a\n  b\n- c\n\n| k | v |\n|---|---|\n| 1 | 2 |\n\n```\nfmlgs demo\n```\n";
        let expected = [
            HelpBlock::Heading("Head".into()),
            HelpBlock::Paragraph("One two.".into()),
            HelpBlock::Item("a b".into()),
            HelpBlock::Item("c".into()),
            HelpBlock::Verbatim("k   \u{b7}  v".into()),
            HelpBlock::Verbatim("1   \u{b7}  2".into()),
            HelpBlock::Verbatim("fmlgs demo".into()),
        ];
        assert_eq!(blocks(text), expected);
        assert_eq!(without_links("see [the guide](guide.md#x) or [this"), "see the guide or [this");
    }
}
