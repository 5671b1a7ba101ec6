//! Render mode of Gaussians as stored in files.

use crate::scene::SplatRenderMode;

/// Start of the `.ply` comment with the mode, as written by Brush and programs that follow it.
const COMMENT: &str = "splatrendermode:";
/// Postshot's comment for the same: 0 or 1.
const ANTIALIASED: &str = "antialiased ";

/// Comment of a `.ply`, without the word `comment`; `None` for the usual mode.
pub(super) fn comment(mode: SplatRenderMode) -> Option<&'static str> {
    match mode {
        SplatRenderMode::Plain => None,
        SplatRenderMode::Mip => Some("SplatRenderMode: mip"),
        SplatRenderMode::Surfels => Some("SplatRenderMode: 2dgs"),
    }
}

/// Reads the mode from the comments of a `.ply`; the last one counts.
pub(super) fn of_comments(comments: &[&str]) -> SplatRenderMode {
    let told = |comment: &&str| {
        let comment = comment.to_lowercase();
        let value = comment.strip_prefix(COMMENT).or_else(|| comment.strip_prefix(ANTIALIASED))?;
        match value.trim() {
            "default" | "0" => Some(SplatRenderMode::Plain),
            "mip" | "1" => Some(SplatRenderMode::Mip),
            "2dgs" => Some(SplatRenderMode::Surfels),
            _ => None,
        }
    };
    comments.iter().rev().find_map(told).unwrap_or_default()
}

/// Value of `model` in a SOG's `meta.json`; `None` for the usual mode.
pub(super) fn sog_model(mode: SplatRenderMode) -> Option<&'static str> {
    match mode {
        SplatRenderMode::Plain => None,
        SplatRenderMode::Mip => Some("antialiased"),
        SplatRenderMode::Surfels => Some("2dgs"),
    }
}

pub(super) fn of_sog_model(model: &str) -> SplatRenderMode {
    match model {
        "antialiased" => SplatRenderMode::Mip,
        "2dgs" => SplatRenderMode::Surfels,
        _ => SplatRenderMode::Plain,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_written_is_read_and_others_comments_too() {
        use SplatRenderMode::{Mip, Plain, Surfels};
        for mode in [Plain, Mip, Surfels] {
            let comments: Vec<&str> = comment(mode).into_iter().collect();
            assert_eq!(of_comments(&comments), mode);
            assert_eq!(sog_model(mode).map_or(Plain, of_sog_model), mode);
        }
        for (comments, mode) in [
            (&["Exported from Brush", "SplatRenderMode: default"][..], Plain),
            (&["splatrendermode:  MIP"], Mip),
            (&["antialiased 1"], Mip),
            (&["SplatRenderMode: 2dgs", "antialiased 0"], Plain),
            (&["SplatRenderMode: mip", "SplatRenderMode: of tomorrow"], Mip),
        ] {
            assert_eq!(of_comments(comments), mode, "{comments:?}");
        }
    }
}
