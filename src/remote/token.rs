//! Access token of a server: 32 random bytes, as 64 hexadecimal digits.

use std::fs::{self, File};
use std::io::{self, Read, Write};
use std::path::Path;

use rand::TryRng;
use rand::rngs::SysRng;
use subtle::ConstantTimeEq;

use crate::io::files::hex;

const BYTES: usize = 32;
/// Largest token file, in bytes.
const MOST_BYTES: u64 = 4 << 10;

/// Secret token. Its `Debug` does not show it.
#[derive(Clone)]
pub(crate) struct AccessToken([u8; BYTES]);

impl std::fmt::Debug for AccessToken {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str("AccessToken")
    }
}

impl AccessToken {
    /// Returns a new token from the system's source of random numbers.
    pub(crate) fn random() -> io::Result<Self> {
        let mut bytes = [0; BYTES];
        SysRng.try_fill_bytes(&mut bytes).map_err(io::Error::other)?;
        Ok(Self(bytes))
    }

    /// Reads the token in the file at `path`. If there is no file, makes one with a new token, which only its owner can
    /// read.
    pub(crate) fn kept(path: &Path) -> io::Result<Self> {
        match read(path) {
            Ok(text) => Self::parse(text.trim())
                .ok_or_else(|| io::Error::new(io::ErrorKind::InvalidData, "it does not hold 64 hexadecimal digits")),
            Err(e) if e.kind() == io::ErrorKind::NotFound => {
                let token = Self::random()?;
                let mut options = File::options();
                options.write(true).create_new(true);
                #[cfg(unix)]
                std::os::unix::fs::OpenOptionsExt::mode(&mut options, 0o600);
                writeln!(options.open(path)?, "{}", token.text())?;
                Ok(token)
            }
            Err(e) => Err(e),
        }
    }

    /// Parses a token from its digits.
    pub(crate) fn parse(text: &str) -> Option<Self> {
        let digits = text.as_bytes();
        let mut bytes = [0; BYTES];
        if digits.len() != 2 * BYTES || !digits.iter().all(u8::is_ascii_hexdigit) {
            return None;
        }
        for (i, byte) in bytes.iter_mut().enumerate() {
            *byte = u8::from_str_radix(text.get(2 * i..2 * i + 2)?, 16).ok()?;
        }
        Some(Self(bytes))
    }

    /// Digits of the token.
    pub(crate) fn text(&self) -> String {
        hex(&self.0)
    }

    /// Returns whether these are the digits of this token, in constant time.
    pub(crate) fn is(&self, text: &str) -> bool {
        Self::parse(text).is_some_and(|other| self.0.ct_eq(&other.0).into())
    }
}

/// Reads a token file, which must be a short regular file with access for its owner only.
fn read(path: &Path) -> io::Result<String> {
    let bad = |why: &str| Err(io::Error::new(io::ErrorKind::InvalidData, why));
    // Checked before it is opened: a pipe would block the program.
    let about = fs::metadata(path)?;
    if !about.is_file() || about.len() > MOST_BYTES {
        return bad("it is no file of 64 hexadecimal digits");
    }
    #[cfg(unix)]
    if std::os::unix::fs::PermissionsExt::mode(&about.permissions()) & 0o077 != 0 {
        return bad("others than its owner may read or write it: 'chmod 600' it, or name a file that is not there yet");
    }
    let mut text = String::new();
    File::open(path)?.take(MOST_BYTES).read_to_string(&mut text)?;
    Ok(text)
}

/// Returns a unique random name for a run or a client.
pub(crate) fn random_name() -> io::Result<String> {
    AccessToken::random().map(|token| hex(&token.0[..8]))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_the_whole_token_is_it() {
        let token = AccessToken::random().expect("random numbers");
        let text = token.text();
        assert!(text.len() == 64 && token.is(&text) && token.is(&text.to_uppercase()));
        let other = AccessToken::random().expect("random numbers");
        assert!(!token.is(&other.text()) && !token.is("") && !token.is(&text[..63]) && !token.is(&format!("{text}0")));
        assert!(!token.is(&"é".repeat(32)) && !token.is(&format!("+{}", &text[1..])));
        assert!(!format!("{token:?}").contains(&text));
    }

    #[test]
    fn a_token_is_kept_for_the_next_run() {
        let folder = tempfile::tempdir().expect("folder");
        let path = folder.path().join("token");
        let made = AccessToken::kept(&path).expect("made");
        assert!(AccessToken::kept(&path).expect("read").is(&made.text()));
        #[cfg(unix)]
        assert_eq!(
            std::os::unix::fs::PermissionsExt::mode(&fs::metadata(&path).expect("file").permissions()) & 0o77,
            0
        );
        fs::write(&path, "abc").expect("write");
        assert!(AccessToken::kept(&path).is_err(), "what is in a file is not replaced");
        let long = folder.path().join("long");
        fs::write(&long, "0".repeat(5_000)).expect("write");
        assert!(AccessToken::kept(&long).is_err());
        #[cfg(unix)]
        {
            use std::os::unix::fs::PermissionsExt;
            fs::write(&path, made.text()).expect("write");
            for (mode, is_taken) in [(0o600, true), (0o400, true), (0o666, false), (0o640, false), (0o604, false)] {
                fs::set_permissions(&path, fs::Permissions::from_mode(mode)).expect("mode");
                assert_eq!(AccessToken::kept(&path).is_ok(), is_taken, "{mode:o}");
            }
            let told = AccessToken::kept(Path::new("/dev/zero")).expect_err("no end");
            assert!(told.to_string().contains("no file of 64"), "{told}");
        }
    }
}
