//! `fmlgs connect`: the window, or a line now and then, on what another computer serves.

use std::io::BufRead;
use std::path::PathBuf;
use std::sync::Arc;

use serde_json::json;

use super::progress::Console;
use super::{CliError, output};
use crate::jobs::export;
use crate::pipeline::observer::{Observer, Severity};
use crate::remote::{Address, Client, Followed, follow};

/// Longest address that is read from standard input, in bytes: beyond it is no address but an endless file.
const MAX_ADDRESS_BYTES: u64 = 16 << 10;

/// Look at what 'fmlgs serve' or 'fmlgs train --serve' shows on another computer
///
/// Opens the usual window on it: a training is seen as it goes, can be paused and canceled, and objects can be asked for
/// in any view, which this computer draws. If the connection is lost, the window keeps what it has and tries again.
#[derive(Debug, clap::Args)]
#[command(after_help = "Examples:\n  \
    ssh -L 7070:127.0.0.1:7070 user@host                         first, if the scene is on another computer\n  \
    fmlgs connect 'http://127.0.0.1:7070/#TOKEN'                 open the window; the server printed the address\n  \
    fmlgs connect - < address.txt                                the address does not show in a list of processes\n  \
    fmlgs connect 'http://…' --headless --save scene.ply         wait for the end of the training, keep the result")]
pub(crate) struct ConnectArgs {
    /// Address that the server printed, with the token after '#'; '-' reads it from standard input
    url: String,
    /// Print what happens instead of opening the window, until nothing runs there
    #[arg(long)]
    pub(crate) headless: bool,
    /// File for the Gaussians then (.ply): the same bytes as the file of a trained scene
    #[arg(long, value_name = "PLY", requires = "headless")]
    save: Option<PathBuf>,
    /// Print one JSON document at the end
    #[arg(long, requires = "headless")]
    json: bool,
}

impl ConnectArgs {
    /// The address for the window, which reads it again.
    pub(crate) fn url_for_window(&self) -> Result<String, CliError> {
        let url = self.address(std::io::stdin().lock())?;
        Address::parse(&url).map_err(CliError::Usage)?;
        Ok(url)
    }

    /// The address that was given, or the first line of `input`, which is read once.
    fn address(&self, input: impl BufRead) -> Result<String, CliError> {
        if self.url != "-" {
            return Ok(self.url.clone());
        }
        let mut line = Vec::new();
        input.take(MAX_ADDRESS_BYTES + 1).read_until(b'\n', &mut line)?;
        if line.len() as u64 > MAX_ADDRESS_BYTES {
            let text = format!("standard input holds no address: its first line has over {MAX_ADDRESS_BYTES} bytes");
            return Err(CliError::Usage(text));
        }
        let line = String::from_utf8(line);
        let line = line.map_err(|_| CliError::Usage("standard input holds no address: it is not UTF-8 text".into()))?;
        Ok(line.trim().to_owned())
    }
}

pub(crate) fn run(args: ConnectArgs, quiet: bool) -> Result<(), CliError> {
    let address = Address::parse(&args.address(std::io::stdin().lock())?).map_err(CliError::Usage)?;
    if let Some(save) = &args.save {
        export::check(save, &[".ply"], &[])?;
    }
    let mut console = Console::new(quiet);
    if address.is_open() {
        console.note(Severity::Warning, "the connection is not encrypted; others can read it, the token too".into());
    }
    let client = Arc::new(Client::new(address)?);
    let end = follow(&client, &mut console, args.save.as_deref())?;
    let (word, folder) = match &end {
        Followed::AtRest => ("at rest", None),
        Followed::Finished(folder) => ("finished", Some(folder)),
        Followed::Cancelled => ("cancelled", None),
        Followed::Failed(why) => return Err(CliError::failed(format!("the training failed there: {why}"))),
        Followed::Left => return Err(CliError::Cancelled("the server goes on".into())),
    };
    let canceled = end == Followed::Cancelled;
    if args.json {
        let saved = args.save.filter(|_| !canceled);
        output::print_json(&json!({ "end": word, "out": folder, "saved": saved }))?;
    } else {
        let there = folder.map(|folder| format!(", saved there in {folder}")).unwrap_or_default();
        output::print(&format!("{}: {word}{there}", client.address.host))?;
    }
    if canceled { Err(CliError::Cancelled("the training was canceled there".into())) } else { Ok(()) }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_address_is_the_first_line_of_what_is_read() {
        let args = |url: &str| ConnectArgs { url: url.into(), headless: true, save: None, json: false };
        let read = |input: &[u8]| args("-").address(input);
        assert_eq!(read(b"http://h:7/#ab \r\nmore\n").expect("a line"), "http://h:7/#ab");
        assert_eq!(args("http://given").address(&b"other"[..]).expect("given"), "http://given");
        let endless = std::io::BufReader::new(std::io::repeat(0));
        assert!(matches!(args("-").address(endless), Err(CliError::Usage(e)) if e.contains("over 16384 bytes")));
        assert!(matches!(read(b"\xff\n"), Err(CliError::Usage(e)) if e.contains("UTF-8")));
    }
}
