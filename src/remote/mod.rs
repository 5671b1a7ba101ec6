//! Remote viewing: a scene or a training on one computer, the window on another.
//!
//! The [`server`] answers requests over HTTP/1.1 and sends nothing by itself: the client pulls. Events of a training
//! go into a log of [`wire::WireEvent`]s, an allow-list of the worker's events. Only its latest Gaussians are kept, and
//! packed at the request of a client ([`hub`]). The training never waits for a client. On the client a [`link`] turns
//! the answers into events, from which the window updates its state.

mod address;
mod client;
mod edits;
mod follow;
mod http;
mod hub;
mod link;
mod observer;
mod photos;
mod seats;
pub(crate) mod serve;
mod server;
mod token;
mod wire;

pub(crate) use address::{Address, bind_address};
pub(crate) use client::Client;
pub(crate) use follow::{Followed, follow};
pub(crate) use link::{LinkStatus, LinkUpdate, ServerLink};
pub(crate) use server::{ServeOptions, Server};

use std::io;
use std::path::Path;

/// Returns the token of a server: the one in `file`, or a new one.
///
/// # Errors
/// If the file can be neither read nor made, or the system gives no random numbers.
pub(crate) fn token_of(file: Option<&Path>) -> io::Result<token::AccessToken> {
    file.map_or_else(token::AccessToken::random, token::AccessToken::kept)
}
