//! Facts that may be too close to call.

/// Answer to a question about a scene.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Clarity {
    Yes,
    No,
    /// Borderline: reasonable people differ.
    Unclear,
}

impl Clarity {
    /// Decides by two thresholds with a margin between them.
    pub(super) fn of(yes: bool, no: bool) -> Self {
        match (yes, no) {
            (true, false) => Self::Yes,
            (false, true) => Self::No,
            _ => Self::Unclear,
        }
    }

    /// Answer of two readings of one question, unclear where they differ.
    pub(super) fn agree(self, other: Self) -> Self {
        if self == other { self } else { Self::Unclear }
    }

    /// Answer to whether both hold.
    pub(super) fn and(self, other: Self) -> Self {
        match (self, other) {
            (Self::No, _) | (_, Self::No) => Self::No,
            (Self::Yes, Self::Yes) => Self::Yes,
            _ => Self::Unclear,
        }
    }

    /// Answer to the opposite question.
    pub(super) fn inverse(self) -> Self {
        match self {
            Self::Yes => Self::No,
            Self::No => Self::Yes,
            Self::Unclear => Self::Unclear,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::Clarity::{No, Unclear, Yes};
    use super::*;

    #[test]
    fn what_is_unclear_stays_unclear() {
        assert_eq!(
            [(true, false), (false, true), (false, false), (true, true)].map(|(y, n)| Clarity::of(y, n)),
            [Yes, No, Unclear, Unclear]
        );
        assert_eq!([Yes.agree(Yes), Yes.agree(No), No.agree(Unclear)], [Yes, Unclear, Unclear]);
        assert_eq!([Yes.and(Yes), Unclear.and(No), Unclear.and(Yes)], [Yes, No, Unclear]);
        assert_eq!([Yes.inverse(), No.inverse(), Unclear.inverse()], [No, Yes, Unclear]);
    }
}
