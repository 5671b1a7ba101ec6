//! Glyphs that the window's own fonts lack, such as Chinese: from the system's fonts, which are listed when the first
//! such glyph is drawn.

use std::sync::{Arc, OnceLock};

use egui::epaint::text::{FallbackRequest, FontInsert, FontPriority, InsertFontFamily};
use egui::{Context, FontData};
use fontdb::{Database, FaceInfo, Style};

/// Adds the system's fonts as a fallback.
pub(super) fn install(ctx: &Context) {
    let faces = OnceLock::new();
    let font_for = move |request: &FallbackRequest<'_>| {
        let letter = request.cluster.chars().next()?;
        let (name, data) = find(faces.get_or_init(system_fonts), letter)?;
        let families = vec![InsertFontFamily { family: request.family.clone(), priority: FontPriority::Lowest }];
        Some(FontInsert { name, data, families })
    };
    ctx.add_font_provider(Arc::new(font_for));
}

fn system_fonts() -> Database {
    let mut fonts = Database::new();
    fonts.load_system_fonts();
    fonts
}

/// A font that has this glyph, upright and of medium weight if there is one.
fn find(fonts: &Database, letter: char) -> Option<(String, FontData)> {
    let mut faces: Vec<&FaceInfo> = fonts.faces().collect();
    faces.sort_by_key(|face| (face.style != Style::Normal, face.weight.0.abs_diff(400)));
    let has_letter = |data: &[u8], index| {
        let face = ttf_parser::Face::parse(data, index).ok()?;
        face.glyph_index(letter)?;
        Some(FontData { index, ..FontData::from_owned(data.to_vec()) })
    };
    faces.into_iter().find_map(|face| {
        let font = fonts.with_face_data(face.id, has_letter)??;
        Some((format!("{} of the system", face.post_script_name), font))
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_font_is_found_by_the_letters_that_it_has() {
        let mut fonts = Database::new();
        assert!(find(&fonts, 'a').is_none(), "there is none");
        let own = egui::FontDefinitions::default();
        let bytes: &[u8] = (*own.font_data["Ubuntu-Light"].font).as_ref();
        fonts.load_font_data(bytes.to_vec());
        let (_, font) = find(&fonts, 'a').expect("it has Latin letters");
        assert_eq!((*font.font).as_ref(), bytes);
        assert!(find(&fonts, '\u{6c34}').is_none(), "but no Chinese ones");
    }
}
