//! Product quantization, as FAISS's `IndexIVFPQ` stores it: a coarse vector and a residual of many short pieces.

/// Bytes of a coarse number in a row.
pub(crate) const COARSE_BYTES: usize = 2;
/// Byte of rows that have no vector.
const NOTHING: u8 = 255;

/// Rows of numbers of entries.
#[derive(Clone, Debug, PartialEq)]
pub struct ProductCodes {
    /// Pieces of a vector.
    pieces: usize,
    /// Numbers of a piece.
    width: usize,
    /// `[coarse entries, pieces * width]`.
    coarse: Vec<f32>,
    /// `[pieces, 256, width]`.
    books: Vec<f32>,
    /// `[rows, COARSE_BYTES + pieces]`.
    rows: Vec<u8>,
}

impl ProductCodes {
    /// Creates rows of codes; `None` if the lengths do not fit, or a row has a coarse number that does not exist.
    pub(crate) fn new(pieces: usize, width: usize, coarse: Vec<f32>, books: Vec<f32>, rows: Vec<u8>) -> Option<Self> {
        let all = Self { pieces, width, coarse, books, rows };
        let dim = pieces.checked_mul(width).filter(|dim| *dim > 0)?;
        let stride = COARSE_BYTES + pieces;
        let fits = all.coarse.len().is_multiple_of(dim)
            && all.books.len() == dim * 256
            && all.rows.len().is_multiple_of(stride);
        let entries = all.coarse.len() / dim;
        let known = |row: &[u8]| is_nothing(row) || usize::from(u16::from_le_bytes([row[0], row[1]])) < entries;
        (fits && all.rows.chunks_exact(stride).all(known)).then_some(all)
    }

    /// Numbers of a vector.
    pub fn dim(&self) -> usize {
        self.pieces * self.width
    }

    /// Number of rows.
    pub fn len(&self) -> usize {
        self.rows.len() / (COARSE_BYTES + self.pieces)
    }

    /// Returns whether there are no rows.
    pub fn is_empty(&self) -> bool {
        self.rows.is_empty()
    }

    /// Copies numbers of vector `i` from number `from` on into `out`; zeros if the row has none.
    pub fn copy(&self, i: usize, from: usize, out: &mut [f32]) {
        let stride = COARSE_BYTES + self.pieces;
        let row = &self.rows[i * stride..(i + 1) * stride];
        if is_nothing(row) {
            out.fill(0.0);
            return;
        }
        let entry = usize::from(u16::from_le_bytes([row[0], row[1]]));
        let coarse = &self.coarse[entry * self.dim()..];
        for (k, out) in (from..).zip(out) {
            let (piece, at) = (k / self.width, k % self.width);
            let code = usize::from(row[COARSE_BYTES + piece]);
            *out = coarse[k] + self.books[(piece * 256 + code) * self.width + at];
        }
    }
}

fn is_nothing(row: &[u8]) -> bool {
    row.iter().all(|b| *b == NOTHING)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_vector_is_a_coarse_one_and_its_pieces() {
        // Two pieces of two numbers; entry c of piece p is (100 p + c, 0).
        let coarse = vec![0.0, 0.0, 0.0, 0.0, 0.5, 0.25, 0.125, 0.0625];
        let books = (0..2).flat_map(|p| (0..256).flat_map(move |c| [(100 * p + c) as f32, 0.0])).collect::<Vec<f32>>();
        let make = |rows: &[u8]| ProductCodes::new(2, 2, coarse.clone(), books.clone(), rows.to_vec());
        let codes = make(&[1, 0, 3, 7, 255, 255, 255, 255]).expect("fits");
        let mut out = [0.0; 4];
        codes.copy(0, 0, &mut out);
        assert_eq!(out, [3.5, 0.25, 107.125, 0.0625]);
        let mut part = [0.0; 2];
        codes.copy(0, 1, &mut part);
        assert_eq!(part, [0.25, 107.125]);
        codes.copy(1, 0, &mut out);
        assert_eq!((out, codes.len(), codes.dim()), ([0.0; 4], 2, 4));
        assert!(make(&[2, 0, 3, 7]).is_none(), "no such coarse entry");
        assert!(make(&[1, 0, 3]).is_none(), "no whole row");
    }
}
