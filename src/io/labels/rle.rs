//! COCO's run lengths of a mask: column by column from the top left, off and on in turn, starting with off; a list of
//! numbers or packed into a string.
//!
//! In the string a number is a run of characters from 48 on, five bits each with the lowest first,
//! 32 where more follow, 16 in the last for a negative number; from the fourth on it is the
//! difference to the number two before.

use std::collections::VecDeque;

use serde::{Deserialize, Serialize};

use crate::scene::Mask;

#[derive(Clone, Debug, Deserialize, Serialize)]
pub(crate) struct Rle {
    /// Height and width in px.
    pub(crate) size: [u32; 2],
    counts: Counts,
}

#[derive(Clone, Debug, Deserialize, Serialize)]
#[serde(untagged)]
enum Counts {
    Packed(String),
    Plain(Vec<u64>),
}

impl Rle {
    /// Makes the plain run lengths of a mask.
    pub(crate) fn of(mask: &Mask) -> Self {
        let (w, h) = (mask.width_px(), mask.height_px());
        let (mut counts, mut on, mut length) = (Vec::new(), false, 0);
        for i in 0..w * h {
            if mask.contains(i % h * w + i / h) != on {
                counts.push(length);
                (on, length) = (!on, 0);
            }
            length += 1;
        }
        counts.push(length);
        Self { size: [h as u32, w as u32], counts: Counts::Plain(counts) }
    }

    /// Width and height in px.
    pub(crate) fn size_px(&self) -> (u32, u32) {
        (self.size[1], self.size[0])
    }

    /// Decodes the mask; the error is the reason. Takes memory for `size`, which the caller has checked, and no more.
    pub(crate) fn mask(&self) -> Result<Mask, String> {
        let (w, h) = (self.size[1] as usize, self.size[0] as usize);
        let mut mask = Mask::empty(w, h);
        let mut at = 0_u64;
        let mut on = false;
        let mut run = |length: u64| {
            let end = at.saturating_add(length);
            if end > (w * h) as u64 {
                return Err(format!("its runs are longer than {w} x {h} px"));
            }
            if on {
                (at as usize..end as usize).for_each(|i| mask.insert(i % h * w + i / h));
            }
            (at, on) = (end, !on);
            Ok(())
        };
        match &self.counts {
            Counts::Plain(list) => list.iter().try_for_each(|&length| run(length))?,
            Counts::Packed(text) => unpack(text.as_bytes(), &mut run)?,
        }
        if at != (w * h) as u64 {
            return Err(format!("its runs cover {at} of {w} x {h} px"));
        }
        Ok(mask)
    }
}

/// Passes each number of a packed string to `run`.
fn unpack(text: &[u8], run: &mut dyn FnMut(u64) -> Result<(), String>) -> Result<(), String> {
    // The last two numbers, once there are three.
    let mut before: VecDeque<i64> = VecDeque::with_capacity(3);
    let mut numbers = 0_usize;
    let (mut value, mut bits) = (0_i64, 0_u32);
    for (i, &byte) in text.iter().enumerate() {
        let digit = byte.checked_sub(48).filter(|d| *d < 64);
        let Some(digit) = digit.filter(|_| bits <= 55) else {
            return Err(format!("character {i} of its counts is not one of a packed list"));
        };
        value |= i64::from(digit & 31) << bits;
        bits += 5;
        if digit & 32 != 0 {
            continue;
        }
        if digit & 16 != 0 {
            value |= -1_i64 << bits;
        }
        if numbers > 2 {
            value = value.saturating_add(before[before.len() - 2]);
        }
        run(u64::try_from(value).map_err(|_| format!("run {numbers} of its counts has length {value}"))?)?;
        before.push_back(value);
        if before.len() > 2 {
            before.pop_front();
        }
        numbers += 1;
        (value, bits) = (0, 0);
    }
    if bits > 0 { Err("its counts end inside a number".into()) } else { Ok(()) }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn parse(text: &str) -> Result<Mask, String> {
        serde_json::from_str::<Rle>(text).map_err(|e| e.to_string())?.mask()
    }

    /// Packs numbers like pycocotools.
    fn pack(counts: &[i64]) -> String {
        let mut out = String::new();
        for i in 0..counts.len() {
            let mut x = counts[i] - if i > 2 { counts[i - 2] } else { 0 };
            loop {
                let digit = (x & 31) as u8;
                x >>= 5;
                let more = if digit & 16 == 0 { x != 0 } else { x != -1 };
                out.push(char::from(48 + (digit | if more { 32 } else { 0 })));
                if !more {
                    break;
                }
            }
        }
        out
    }

    #[test]
    fn both_forms_give_the_same_columns() {
        // Rows 1 and 2 of column 1, and all of column 2, of a picture 4 wide and 3 high.
        let plain = parse(r#"{"size": [3, 4], "counts": [4, 5, 3]}"#).expect("plain");
        assert_eq!(plain.pixels().collect::<Vec<_>>(), [2, 5, 6, 9, 10]);
        assert_eq!((plain.width_px(), plain.height_px()), (4, 3));
        let packed = pack(&[4, 5, 3]);
        assert_eq!(parse(&format!(r#"{{"size": [3, 4], "counts": "{packed}"}}"#)).expect("packed"), plain);
        let long = [0, 5000, 3, 1, 4000, 70_000, 2, 100_000 - 79_006];
        let text = serde_json::json!({ "size": [200, 500], "counts": pack(&long) }).to_string();
        assert_eq!(parse(&text).expect("packed").area() as i64, long[1] + long[3] + long[5] + long[7]);
        assert!(parse(r#"{"size": [3, 4], "counts": [12]}"#).expect("empty").is_empty());
    }

    #[test]
    fn counts_that_do_not_fit_are_named() {
        for (counts, expected) in [
            ("[4, 5, 4]", "longer"),
            ("[4, 5]", "cover 9"),
            ("[]", "cover 0"),
            ("[18446744073709551615, 18446744073709551615]", "longer"),
            ("\"\"", "cover 0"),
            ("\"o\"", "inside a number"),
            ("\"oooooooooooooooooooo0\"", "character 12"),
            ("\"@\"", "length -16"),
            ("\" \"", "character 0"),
            ("\"\u{e9}\"", "character 0"),
            ("{}", "did not match"),
            ("[-1]", "did not match"),
        ] {
            let e = parse(&format!(r#"{{"size": [3, 4], "counts": {counts}}}"#)).expect_err(counts);
            assert!(e.contains(expected), "{counts}: {e}");
        }
    }
}
