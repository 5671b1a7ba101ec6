//! The few elements of SVG that plots are made of.

use htmlize::escape_all_quotes;

use super::look::{KnobLook, MarkShape};

/// A stroke: color, width, opacity.
#[derive(Clone, Copy, Debug)]
pub(crate) struct SvgStroke(pub(crate) [u8; 3], pub(crate) f64, pub(crate) f64);

/// The end of a text that is at its place.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Anchor {
    Start,
    Middle,
    End,
}

pub(crate) const BLACK: [u8; 3] = [0; 3];

/// An image that is being drawn, from back to front.
pub(crate) struct Svg {
    size: [f64; 2],
    body: String,
}

impl Svg {
    /// A white one.
    pub(crate) fn new(size: [f64; 2]) -> Self {
        let mut svg = Self { size, body: String::new() };
        svg.area([0.0; 2], size, [255; 3], 1.0);
        svg
    }

    /// The whole of it; `title` is for who cannot see it.
    pub(crate) fn finish(self, title: &str) -> String {
        let [w, h] = self.size;
        format!(
            "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"{w}\" height=\"{h}\" viewBox=\"0 0 {w} {h}\" role=\"img\" \
             font-family=\"system-ui,'Helvetica Neue',Arial,sans-serif\">\n<title>{}</title>\n{}</svg>\n",
            escape_all_quotes(title),
            self.body
        )
    }

    pub(crate) fn area(&mut self, [x, y]: [f64; 2], [w, h]: [f64; 2], color: [u8; 3], opacity: f64) {
        self.body += &format!(
            "<rect x=\"{x:.1}\" y=\"{y:.1}\" width=\"{w:.1}\" height=\"{h:.1}\" fill=\"{}\" fill-opacity=\"{opacity}\"/>\n",
            hex(color)
        );
    }

    pub(crate) fn line(&mut self, points: &[[f64; 2]], SvgStroke(color, width, opacity): SvgStroke) {
        let all: Vec<String> = points.iter().map(|[x, y]| format!("{x:.1},{y:.1}")).collect();
        self.body += &format!(
            "<polyline points=\"{}\" fill=\"none\" stroke=\"{}\" stroke-width=\"{width}\" stroke-opacity=\"{opacity}\" \
             stroke-linejoin=\"round\" stroke-linecap=\"round\"/>\n",
            all.join(" "),
            hex(color)
        );
    }

    /// A mark, with a rim that sets it off from what lies under it.
    pub(crate) fn mark(&mut self, look: KnobLook, [x, y]: [f64; 2], radius: f64) {
        let how = format!("fill=\"{}\" stroke=\"#fff\" stroke-width=\"0.8\"", hex(look.color));
        self.body += &match look.shape {
            MarkShape::Circle => format!("<circle class=\"mark\" cx=\"{x:.1}\" cy=\"{y:.1}\" r=\"{radius}\" {how}/>\n"),
            shape => {
                let corner = |c: &[f64; 2]| format!("{:.1},{:.1}", x + radius * c[0], y + radius * c[1]);
                let corners: Vec<String> = shape.corners().iter().map(corner).collect();
                format!("<polygon class=\"mark\" points=\"{}\" {how}/>\n", corners.join(" "))
            }
        };
    }

    /// A pale ring of this radius around a place.
    pub(crate) fn halo(&mut self, [x, y]: [f64; 2], radius: f64, SvgStroke(color, width, opacity): SvgStroke) {
        self.body += &format!(
            "<circle cx=\"{x:.1}\" cy=\"{y:.1}\" r=\"{radius}\" fill=\"none\" stroke=\"{}\" stroke-width=\"{width}\" \
             stroke-opacity=\"{opacity}\"/>\n",
            hex(color)
        );
    }

    /// A line of text, its baseline at a place.
    pub(crate) fn text(&mut self, at: [f64; 2], anchor: Anchor, size: f64, color: [u8; 3], text: &str) {
        self.write(at, anchor, size, color, text, "");
    }

    /// The same with a white rim, over lines.
    pub(crate) fn label(&mut self, at: [f64; 2], size: f64, color: [u8; 3], text: &str) {
        let rim = " stroke=\"#fff\" stroke-width=\"2.5\" stroke-linejoin=\"round\" paint-order=\"stroke\"";
        self.write(at, Anchor::Start, size, color, text, rim);
    }

    /// The same from below upward.
    pub(crate) fn text_upward(&mut self, at: [f64; 2], size: f64, text: &str) {
        let turn = format!(" transform=\"rotate(-90 {:.1} {:.1})\"", at[0], at[1]);
        self.write(at, Anchor::Middle, size, BLACK, text, &turn);
    }

    fn write(&mut self, [x, y]: [f64; 2], anchor: Anchor, size: f64, color: [u8; 3], text: &str, more: &str) {
        let anchor = match anchor {
            Anchor::Start => "start",
            Anchor::Middle => "middle",
            Anchor::End => "end",
        };
        self.body += &format!(
            "<text x=\"{x:.1}\" y=\"{y:.1}\" text-anchor=\"{anchor}\" font-size=\"{size}\" fill=\"{}\"{more}>{}</text>\n",
            hex(color),
            escape_all_quotes(text)
        );
    }
}

fn hex([r, g, b]: [u8; 3]) -> String {
    format!("#{r:02x}{g:02x}{b:02x}")
}

/// About how wide a text is: fonts differ, so rather too wide.
pub(crate) fn width(text: &str, size: f64) -> f64 {
    0.57 * size * text.chars().count() as f64
}

/// A text in lines of at most this width.
pub(crate) fn lines(text: &str, size: f64, most: f64) -> Vec<String> {
    let mut all: Vec<String> = Vec::new();
    for word in text.split_whitespace() {
        match all.last_mut() {
            Some(line) if width(line, size) + width(word, size) + size < most => *line += &format!(" {word}"),
            _ => all.push(word.to_owned()),
        }
    }
    all
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn texts_are_escaped_and_broken_into_lines() {
        let mut svg = Svg::new([10.0, 20.0]);
        svg.text([1.0, 2.0], Anchor::End, 11.0, [255, 0, 16], "a < \"b\"");
        let image = svg.finish("<&>");
        assert!(image.contains("a &lt; &quot;b&quot;</text>") && image.contains("<title>&lt;&amp;&gt;</title>"));
        assert!(image.contains("viewBox=\"0 0 10 20\"") && image.contains("fill=\"#ff0010\""));
        assert_eq!(lines("one two three", 10.0, 60.0), ["one two", "three"]);
        assert!(lines("", 10.0, 60.0).is_empty());
    }
}
