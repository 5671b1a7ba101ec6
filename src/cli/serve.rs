//! `fmlgs serve`, and what it shares with `fmlgs train --serve`: a scene or a training for a window elsewhere.

use std::net::SocketAddr;
use std::path::PathBuf;
use std::time::Duration;

use super::{CliError, interrupt, output};
use crate::remote::{ServeOptions, Server, bind_address, serve, token_of};

/// Show a scene on this computer to a window on another
///
/// 'fmlgs connect' opens the window there. Only this computer can connect, so from another one come through SSH; the
/// command prints the line for that. Whoever connects has to know the token at the end of the address, which is another
/// one each time. Nothing is written for a client, unless --allow-edit is given.
#[derive(Debug, clap::Args)]
#[command(after_help = "Examples:\n  \
    fmlgs serve scene/                     on this computer; it prints the address with its token\n  \
    fmlgs serve scene/ 7071                at another port\n  \
    ssh -L 7070:127.0.0.1:7070 user@host   on the laptop, then the address that the server printed:\n  \
    fmlgs connect 'http://127.0.0.1:7070/#TOKEN'")]
pub(crate) struct ServeArgs {
    /// Trained scene or splat file
    scene: PathBuf,
    /// Address to listen at: an address, a port, or both
    #[arg(default_value = "127.0.0.1:7070", value_parser = bind_address)]
    address: SocketAddr,
    /// Clients may rename, merge and split objects and parts; that is stored with the scene
    #[arg(long)]
    allow_edit: bool,
    #[command(flatten)]
    access: AccessArgs,
}

/// Options of access: the addresses that may connect, and the token.
#[derive(Debug, Default, clap::Args)]
pub(crate) struct AccessArgs {
    /// Listen at an address that other computers reach, unencrypted: whoever reads it on the way learns the token
    #[arg(long)]
    bind_anywhere: bool,
    /// Name by which clients know this computer, where a proxy passes them on
    #[arg(long, value_name = "NAME")]
    host: Vec<String>,
    /// Keep the token in this file, so that it is the same after a restart; it is made if it is not there
    #[arg(long, value_name = "FILE")]
    token_file: Option<PathBuf>,
}

impl AccessArgs {
    /// Returns whether the token is new: only clients that are given it know it.
    pub(crate) fn has_new_token(&self) -> bool {
        self.token_file.is_none()
    }

    /// The options of a server at `bind`.
    pub(crate) fn options(&self, bind: SocketAddr, allow_edit: bool) -> Result<ServeOptions, CliError> {
        let token = token_of(self.token_file.as_deref()).map_err(|e| {
            let file = self.token_file.as_deref().map(|p| format!("--token-file {}: ", p.display()));
            CliError::failed(format!("{}{e}", file.unwrap_or_default()))
        })?;
        Ok(ServeOptions { bind, anywhere: self.bind_anywhere, hosts: self.host.clone(), allow_edit, token })
    }
}

/// Prints how to connect: the address unless `quiet` and not `needed`, the SSH command unless `quiet`. Warns of an
/// address that other computers can reach.
pub(crate) fn announce(server: &Server, quiet: bool, needed: bool) {
    let address = server.address();
    let port = address.port();
    if !address.ip().to_canonical().is_loopback() {
        output::warn(format!("others can reach {address}, and everybody on the way can read the token; SSH is safer"));
    }
    if !quiet || needed {
        output::note(&format!("Look at it:  fmlgs connect '{}'", server.url()));
    }
    if quiet {
        return;
    }
    output::note(&format!("From another computer, first:  ssh -L {port}:127.0.0.1:{port} {}", user_at_host()));
}

/// Name of this account for SSH, as far as that is known.
fn user_at_host() -> String {
    let user = std::env::var("USER").or_else(|_| std::env::var("USERNAME")).unwrap_or_else(|_| "user".into());
    format!("{user}@{}", sysinfo::System::host_name().unwrap_or_else(|_| "host".into()))
}

pub(crate) fn run(args: ServeArgs, quiet: bool) -> Result<(), CliError> {
    let (server, name) = serve::scene(&args.scene, args.access.options(args.address, args.allow_edit)?)?;
    output::print(&server.url())?;
    announce(&server, quiet, false);
    if !quiet {
        output::note(&format!("Serving {name}; Ctrl-C ends it"));
    }
    while !interrupt::flag().load(std::sync::atomic::Ordering::SeqCst) {
        std::thread::sleep(Duration::from_millis(100));
    }
    Ok(())
}
