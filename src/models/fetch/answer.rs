//! Parses headers of an HTTP response: the address of a redirect, and the range of the content.

use url::Url;

/// Resolves the `location` of a redirect from `url`; `None` if the scheme is not http or https.
pub(super) fn elsewhere(url: &str, location: &str) -> Option<String> {
    let to = Url::parse(url).ok()?.join(location).ok()?;
    matches!(to.scheme(), "http" | "https").then(|| to.into())
}

/// Start and total of "bytes 5-9/10".
pub(super) fn content_range(value: &str) -> Option<(u64, Option<u64>)> {
    let (range, total) = value.strip_prefix("bytes ")?.split_once('/')?;
    Some((range.split_once('-')?.0.parse().ok()?, total.parse().ok()))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_servers_are_elsewhere() {
        let from = |location: &str| elsewhere("https://a.example:8/models/m.onnx?x=1", location);
        for (location, meant) in [
            ("https://b.example/m", "https://b.example/m"),
            ("HTTP://b.example/m?at=1:2", "http://b.example/m?at=1:2"),
            ("//b.example/m", "https://b.example/m"),
            ("/other/m", "https://a.example:8/other/m"),
            ("other/m", "https://a.example:8/models/other/m"),
            ("./m2?a=b", "https://a.example:8/models/m2?a=b"),
            ("../m", "https://a.example:8/m"),
            ("../../../m", "https://a.example:8/m"),
        ] {
            assert_eq!(from(location).as_deref(), Some(meant), "{location}");
        }
        for location in ["file:///etc/passwd", "FILE:/etc/passwd", "gopher://b.example/m", "data:,x", "b.example:80/m"]
        {
            assert_eq!(from(location), None, "{location}");
        }
        assert_eq!(elsewhere("http://a.example", "m").as_deref(), Some("http://a.example/m"));
    }

    #[test]
    fn ranges_of_content() {
        assert_eq!(content_range("bytes 5-9/10"), Some((5, Some(10))));
        assert_eq!(content_range("bytes 5-9/*"), Some((5, None)));
        for bad in ["", "bytes", "bytes x-9/10", "items 5-9/10"] {
            assert_eq!(content_range(bad), None, "{bad}");
        }
    }
}
