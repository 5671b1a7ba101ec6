//! Limit of the number of connections. An authenticated connection keeps its seat. Of the others, the oldest is closed
//! to make room for a new one: a client sends its token at once, a stalling attacker does not.

use std::collections::{BTreeMap, BTreeSet};
use std::net::{Shutdown, TcpStream};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

/// Maximum number of connections, and of those without authentication.
const ALL: usize = 32;
const UNKNOWN: usize = 24;

/// Seats of a server.
#[derive(Default)]
pub(super) struct Seats(Mutex<Taken>);

#[derive(Default)]
struct Taken {
    last: u64,
    /// Connections without authentication, by number: the oldest first.
    unknown: BTreeMap<u64, TcpStream>,
    known: BTreeSet<u64>,
}

/// Seat of one connection, free again once dropped.
pub(super) struct Seat {
    of: Arc<Seats>,
    number: u64,
}

impl Seats {
    /// Takes a seat for a new connection. If there are too many, the oldest one without authentication is closed;
    /// `None` if all are authenticated.
    pub(super) fn take(self: &Arc<Self>, stream: &TcpStream) -> Option<Seat> {
        let own = stream.try_clone().ok()?;
        let mut taken = self.taken();
        if taken.unknown.len() >= UNKNOWN || taken.unknown.len() + taken.known.len() >= ALL {
            let (_, earliest) = taken.unknown.pop_first()?;
            // The thread of that connection reads the end of the stream; an error means that it has ended already.
            let _ = earliest.shutdown(Shutdown::Both);
        }
        taken.last += 1;
        let number = taken.last;
        taken.unknown.insert(number, own);
        Some(Seat { of: Arc::clone(self), number })
    }

    // The data behind the lock stays consistent after a panic: it is changed by single calls.
    fn taken(&self) -> MutexGuard<'_, Taken> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl Seat {
    /// Marks the connection as authenticated.
    pub(super) fn keep(&self) {
        let mut taken = self.of.taken();
        if taken.unknown.remove(&self.number).is_some() {
            taken.known.insert(self.number);
        }
    }
}

impl Drop for Seat {
    fn drop(&mut self) {
        let mut taken = self.of.taken();
        taken.unknown.remove(&self.number);
        taken.known.remove(&self.number);
    }
}

#[cfg(test)]
mod tests {
    use std::io::{ErrorKind, Read};
    use std::net::TcpListener;
    use std::time::Duration;

    use super::*;

    /// Returns both ends of a connection: the client's and the server's.
    fn connect(listener: &TcpListener) -> (TcpStream, TcpStream) {
        let client = TcpStream::connect(listener.local_addr().expect("bound")).expect("connected");
        client.set_nonblocking(true).expect("set");
        (client, listener.accept().expect("accepted").0)
    }

    /// Returns whether the server has sent nothing and the connection is open.
    fn is_open(mut client: &TcpStream) -> bool {
        client.read(&mut [0]).is_err_and(|e| e.kind() == ErrorKind::WouldBlock)
    }

    /// Waits for the end of a connection.
    fn ends(mut client: &TcpStream) -> bool {
        client.set_nonblocking(false).expect("set");
        client.set_read_timeout(Some(Duration::from_secs(60))).expect("set");
        client.read(&mut [0]).is_ok_and(|n| n == 0)
    }

    #[test]
    fn who_shows_no_token_makes_room_and_who_has_shown_it_stays() {
        let listener = TcpListener::bind("127.0.0.1:0").expect("a port");
        let seats = Arc::<Seats>::default();
        let mut there: Vec<(TcpStream, TcpStream, Seat)> = Vec::new();
        let come = |there: &mut Vec<(TcpStream, TcpStream, Seat)>| {
            let (client, server) = connect(&listener);
            let seat = seats.take(&server);
            let has_one = seat.is_some();
            there.extend(seat.map(|seat| (client, server, seat)));
            has_one
        };
        (0..UNKNOWN).for_each(|_| assert!(come(&mut there)));
        assert!(there.iter().all(|(client, ..)| is_open(client)), "there is room for all of them");
        // The first is authenticated: a further connection closes the second.
        there[0].2.keep();
        assert!(come(&mut there) && there.iter().all(|(client, ..)| is_open(client)));
        assert!(come(&mut there) && ends(&there[1].0));
        drop(there.remove(1));
        assert!(there.iter().all(|(client, ..)| is_open(client)), "and no other");
        // All seats are authenticated: there is none for a further connection until one ends.
        there.iter().for_each(|(.., seat)| seat.keep());
        while there.len() < ALL {
            assert!(come(&mut there));
            there.last().expect("it has come").2.keep();
        }
        assert!(!come(&mut there));
        there.pop();
        assert!(come(&mut there));
        assert!(there.iter().all(|(client, ..)| is_open(client)));
        // A closed connection that authenticates afterwards has no seat.
        let gone = there.len() - 1;
        assert!(come(&mut there) && ends(&there[gone].0));
        there[gone].2.keep();
        assert_eq!(seats.taken().known.len(), ALL - 1);
    }
}
