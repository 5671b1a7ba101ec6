//! Train there, look here: a scene or a training on one computer, the window on another.
//!
//! The [`server`] answers over HTTP/1.1 what it is asked for and sends nothing by itself: the client pulls. What a
//! training tells goes into a log of [`wire::WireEvent`]s, an allow-list of the worker's events; its Gaussians go into
//! a place for the latest, from which they are packed only when somebody asks ([`hub`]). Nothing of this waits for a
//! watcher. On the other side a [`link`] turns what comes into events that the window's state is a fold over.

mod address;
pub(crate) mod client;
mod edits;
mod hub;
mod http;
pub(crate) mod link;
mod observer;
pub(crate) mod server;
mod token;
pub(crate) mod wire;

pub(crate) use address::{Address, bind_address};
pub(crate) use client::Client;
pub(crate) use link::{Link, LinkStatus};
pub(crate) use server::{ServeOptions, Server};
