//! Key of a chat model, which is sent in one header and nowhere else.

/// Replacement of the key in texts.
pub(crate) const BLANK: &str = "[key]";

/// Shortest key that is removed from texts, in bytes; a shorter one is not treated as a secret.
const SHORTEST: usize = 6;

/// Key that cannot be printed or stored.
#[derive(Clone)]
pub struct Secret(String);

impl Secret {
    /// Returns the key; `None` if it is empty or not valid in a header.
    pub fn new(key: &str) -> Option<Self> {
        let key = key.trim();
        let sound = !key.is_empty() && key.len() <= 4096 && key.bytes().all(|b| b.is_ascii_graphic());
        sound.then(|| Self(key.to_owned()))
    }

    pub(super) fn bearer(&self) -> String {
        format!("Bearer {}", self.0)
    }

    /// Length in bytes.
    pub(super) fn len(&self) -> usize {
        self.0.len()
    }

    /// Removes the key from a text, in any letter case: plain, percent-encoded and escaped as in JSON.
    pub(crate) fn redact(&self, text: &str) -> String {
        if self.0.len() < SHORTEST {
            return text.to_owned();
        }
        let percent = |b: u8| {
            if b.is_ascii_alphanumeric() || b"-._~".contains(&b) {
                (b as char).to_string()
            } else {
                format!("%{b:02X}")
            }
        };
        let encoded: String = self.0.bytes().map(percent).collect();
        let escaped = self.0.replace('\\', "\\\\").replace('"', "\\\"").replace('/', "\\/");
        let mut text = text.to_owned();
        for form in [self.0.as_str(), &encoded, &escaped] {
            text = without(&text, form);
        }
        text
    }
}

fn without(text: &str, key: &str) -> String {
    // ASCII letters keep their places when their case changes.
    let (low, wanted) = (text.to_ascii_lowercase(), key.to_ascii_lowercase());
    let mut left = String::with_capacity(text.len());
    let mut at = 0;
    while let Some(found) = low[at..].find(&wanted) {
        left.push_str(&text[at..at + found]);
        left.push_str(BLANK);
        at += found + wanted.len();
    }
    left.push_str(&text[at..]);
    left
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_key_is_found_in_every_form() {
        let key = Secret::new(" sk-Te/st+1234 ").expect("a key");
        for text in ["my sk-Te/st+1234!", "SK-TE/ST+1234", "q=sk-Te%2Fst%2B1234", r#""sk-Te\/st+1234""#] {
            let clean = key.redact(text);
            assert!(clean.contains(BLANK) && !clean.to_lowercase().contains("1234"), "{clean}");
        }
        assert_eq!(key.redact("nothing é here"), "nothing é here");
        assert_eq!(key.redact("sk-Te/st+1234sk-Te/st+1234"), "[key][key]");
        assert!(Secret::new("").is_none() && Secret::new("a\nb").is_none() && Secret::new("ké").is_none());
        assert_eq!(Secret::new("abc").expect("short").redact("abc"), "abc");
    }
}
