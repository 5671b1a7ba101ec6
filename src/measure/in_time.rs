//! Time limit as a signal to stop: the preparation of a measurement ends by it as by Ctrl-C.

use std::time::{Duration, Instant};

use crate::pipeline::observer::{Observer, Signal};

/// Observer that passes the signal to stop on, sends it itself after a time limit, and reports nothing.
pub(crate) struct InTime<'a> {
    of: &'a mut dyn Observer,
    /// `None` for no limit.
    until: Option<Instant>,
}

impl<'a> InTime<'a> {
    /// Limit of `secs` from now on.
    pub(crate) fn new(of: &'a mut dyn Observer, secs: f64) -> Self {
        let until = Duration::try_from_secs_f64(secs).ok().and_then(|time| Instant::now().checked_add(time));
        Self { of, until }
    }
}

impl Observer for InTime<'_> {
    fn signal(&self) -> Signal {
        match self.until {
            Some(until) if Instant::now() >= until => Signal::Cancel,
            _ => self.of.signal(),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::pipeline::observer::Silent;
    use crate::pipeline::observer::testing::StopsAfter;

    #[test]
    fn it_stops_in_time_and_where_somebody_asks_for_it() {
        assert!(InTime::new(&mut Silent, 0.0).proceed().is_err());
        assert!(InTime::new(&mut Silent, f64::INFINITY).proceed().is_ok());
        assert!(InTime::new(&mut Silent, 1e9).proceed().is_ok());
        assert!(InTime::new(&mut StopsAfter::new(0), f64::INFINITY).proceed().is_err());
    }
}
