//! A slice with a position: little-endian reading that can neither run past the end nor
//! allocate for a count that the slice cannot hold.

use std::path::Path;

use super::IoError;

/// Reads little-endian values off the front of a slice.
#[derive(Clone, Copy)]
pub(crate) struct Reader<'a> {
    rest: &'a [u8],
    path: &'a Path,
}

impl<'a> Reader<'a> {
    /// A reader of `bytes`, which came from `path` (for errors).
    pub(crate) fn new(bytes: &'a [u8], path: &'a Path) -> Self {
        Self { rest: bytes, path }
    }

    /// Returns whether all bytes were read.
    pub(crate) fn is_at_end(&self) -> bool {
        self.rest.is_empty()
    }

    /// Takes the next `n` bytes; `place` describes them in errors.
    pub(crate) fn take(&mut self, n: usize, place: &str) -> Result<&'a [u8], IoError> {
        match self.rest.split_at_checked(n) {
            Some((head, tail)) => {
                self.rest = tail;
                Ok(head)
            }
            None => Err(self.truncated(n as u64, place)),
        }
    }

    pub(crate) fn array<const N: usize>(&mut self, place: &str) -> Result<[u8; N], IoError> {
        match self.rest.split_first_chunk::<N>() {
            Some((head, tail)) => {
                self.rest = tail;
                Ok(*head)
            }
            None => Err(self.truncated(N as u64, place)),
        }
    }

    pub(crate) fn u32(&mut self, place: &str) -> Result<u32, IoError> {
        self.array(place).map(u32::from_le_bytes)
    }

    pub(crate) fn u64(&mut self, place: &str) -> Result<u64, IoError> {
        self.array(place).map(u64::from_le_bytes)
    }

    pub(crate) fn f64(&mut self, place: &str) -> Result<f64, IoError> {
        self.array(place).map(f64::from_le_bytes)
    }

    /// Reads a 64-bit count of things that take at least `least_bytes` each; refused if the rest of the slice cannot
    /// hold them.
    pub(crate) fn count(&mut self, what: &str, least_bytes: usize) -> Result<usize, IoError> {
        let claimed = self.u64(what)?;
        let possible = (self.rest.len() / least_bytes.max(1)) as u64;
        if claimed > possible {
            return Err(IoError::Count { path: self.path.into(), what: what.into(), claimed, possible });
        }
        Ok(claimed as usize)
    }

    /// Takes the bytes up to the next zero byte, which is skipped.
    pub(crate) fn c_string(&mut self, place: &str) -> Result<&'a [u8], IoError> {
        match self.rest.iter().position(|&b| b == 0) {
            Some(end) => {
                let head = &self.rest[..end];
                self.rest = &self.rest[end + 1..];
                Ok(head)
            }
            None => Err(self.truncated(self.rest.len() as u64 + 1, place)),
        }
    }

    fn truncated(&self, need: u64, place: &str) -> IoError {
        IoError::Truncated { path: self.path.into(), place: place.into(), need, have: self.rest.len() as u64 }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn reads_up_to_the_end_and_not_past_it() {
        let path = Path::new("x.bin");
        let mut r = Reader::new(&[1, 0, 0, 0, b'a', 0, 7], path);
        assert_eq!(r.u32("id").expect("there"), 1);
        assert_eq!(r.c_string("name").expect("there"), b"a");
        assert!(matches!(r.u32("next"), Err(IoError::Truncated { need: 4, have: 1, .. })));
        assert_eq!(r.array("last").expect("there"), [7]);
        assert!(matches!(r.c_string("name"), Err(IoError::Truncated { .. })));
    }

    #[test]
    fn counts_are_held_against_what_is_left() {
        let bytes = (1_u64 << 60).to_le_bytes();
        let mut r = Reader::new(&bytes, Path::new("x.bin"));
        let e = r.count("points", 43).expect_err("too many");
        assert!(matches!(e, IoError::Count { claimed, possible: 0, .. } if claimed == 1 << 60));
    }
}
