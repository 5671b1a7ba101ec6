//! Train there, look here: a scene or a training on one computer, the window on another.
//!
//! The [`server`] answers over HTTP/1.1 what it is asked for and sends nothing by itself: the client pulls. What a
//! training tells goes into a log of [`wire::WireEvent`]s, an allow-list of the worker's events; its Gaussians go into
//! a place for the latest, from which they are packed only when somebody asks ([`hub`]). Nothing of this waits for a
//! watcher. On the other side a [`link`] turns what comes into events that the window's state is a fold over.

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
pub(crate) use link::{LinkStatus, ServerLink};
pub(crate) use server::{ServeOptions, Server};

use std::io;
use std::path::Path;

/// The secret of a server: the one in this file, or a new one.
///
/// # Errors
/// If the file can neither be read nor made, or the system gives no random numbers.
pub(crate) fn token_of(file: Option<&Path>) -> io::Result<token::AccessToken> {
    file.map_or_else(token::AccessToken::random, token::AccessToken::kept)
}
