//! Text repair as in ftfy, which OpenCLIP applies before its tokenizer: characters read in the wrong encoding, curly
//! quotes, wide letters, ligatures and control characters.

use unicode_normalization::UnicodeNormalization;

/// Repairs a text. The only wrong encoding that is recognized is UTF-8 read as Windows-1252.
pub(super) fn repaired(text: &str) -> String {
    let mut text = text.to_owned();
    // A text may have gone through the wrong encoding more than once.
    while let Some(better) = decoded(&text) {
        text = better;
    }
    let text: String = text.chars().map(|c| windows_1252(c).unwrap_or(c)).collect();
    let text = text.replace("\r\n", "\n");
    let kept = text.chars().filter(|c| !is_control(*c));
    kept.flat_map(|c| plain(c).chars().collect::<Vec<char>>()).nfc().collect()
}

/// Restores every character whose UTF-8 was read as Windows-1252; `None` if there is none.
fn decoded(text: &str) -> Option<String> {
    let chars: Vec<char> = text.chars().collect();
    let mut better = String::with_capacity(text.len());
    let mut at = 0;
    while at < chars.len() {
        match sequence(&chars[at..]) {
            Some((c, n)) => {
                better.push(c);
                at += n;
            }
            None => {
                better.push(chars[at]);
                at += 1;
            }
        }
    }
    (better != text).then_some(better)
}

/// Decodes the character whose UTF-8 bytes are the first characters, and returns their number.
fn sequence(chars: &[char]) -> Option<(char, usize)> {
    let first = byte(*chars.first()?)?;
    // Of two-byte sequences, only those that are unlikely to be intended; a capital before a quote is likely.
    let n = match first {
        0xc2 | 0xc3 => 2,
        0xe0..=0xef => 3,
        0xf0..=0xf4 => 4,
        _ => return None,
    };
    let bytes = chars.get(..n)?.iter().map(|c| byte(*c)).collect::<Option<Vec<u8>>>()?;
    Some((std::str::from_utf8(&bytes).ok()?.chars().next()?, n))
}

/// Characters of Windows-1252 from 0x80 on; undefined bytes stand for themselves.
const HIGH: [char; 32] = [
    '€', '\u{81}', '‚', 'ƒ', '„', '…', '†', '‡', 'ˆ', '‰', 'Š', '‹', 'Œ', '\u{8d}', 'Ž', '\u{8f}', '\u{90}', '‘', '’',
    '“', '”', '•', '–', '—', '˜', '™', 'š', '›', 'œ', '\u{9d}', 'ž', 'Ÿ',
];

/// Decodes a control character from 0x80 on as a byte of Windows-1252.
fn windows_1252(c: char) -> Option<char> {
    HIGH.get((c as usize).checked_sub(0x80)?).copied()
}

/// Byte of a character in Windows-1252.
fn byte(c: char) -> Option<u8> {
    match HIGH.iter().position(|h| *h == c) {
        Some(at) => u8::try_from(0x80 + at).ok(),
        None => u8::try_from(c as u32).ok(),
    }
}

/// Returns whether a control character is to be removed.
fn is_control(c: char) -> bool {
    matches!(c, '\0'..='\u{8}' | '\u{b}' | '\u{e}'..='\u{1f}' | '\u{7f}' | '\u{206a}'..='\u{206f}' | '\u{feff}' | '\u{fff9}'..='\u{fffc}')
}

/// Plain form of a character.
fn plain(c: char) -> String {
    match c {
        '\u{2bc}' | '\u{2018}'..='\u{201b}' => "'".into(),
        '\u{201c}'..='\u{201f}' => "\"".into(),
        '\r' | '\u{2028}' | '\u{2029}' => "\n".into(),
        // Ligatures and letters of other widths.
        'Ĳ' | 'ĳ' | 'ŉ' | 'Ǆ'..='ǌ' | 'Ǳ'..='ǳ' | '\u{fb00}'..='\u{fb06}' | '\u{ff01}'..='\u{ffee}' | '\u{3000}' => {
            std::iter::once(c).nfkc().collect()
        }
        _ => c.into(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_was_read_in_the_wrong_encoding_is_mended_and_what_was_meant_stays() {
        for (wrong, right) in [("dÃ©jÃ\u{a0} vu", "déjà vu"), ("ÃƒÂ©", "é"), ("donâ€™t", "don't"), ("ðŸ˜€", "😀")]
        {
            assert_eq!(repaired(wrong), right);
        }
        for meant in ["CAFÉ'S", "Ã la carte", "naïve", "10 µm ± 2", "Ångström", "ÄÖÜ", ""] {
            assert_eq!(repaired(meant), meant);
        }
        // A capital before a curly quote would be a character of two bytes.
        assert_eq!(repaired("CAFÉ’S"), "CAFÉ'S");
    }
}
