//! Addresses of a server: `http://127.0.0.1:7070/#TOKEN` for a client, and the socket address to listen at.

use std::net::{IpAddr, Ipv4Addr, SocketAddr};

use ureq::http::Uri;

use super::token::AccessToken;
use crate::io::http::is_loopback;

/// Default port.
pub(crate) const PORT: u16 = 7070;

/// Address of a server, with its access token.
#[derive(Clone, Debug)]
pub(crate) struct Address {
    /// Base URL without a slash at the end: `http://127.0.0.1:7070`.
    pub(crate) base: String,
    /// Host and port for display: `127.0.0.1:7070`.
    pub(crate) host: String,
    pub(crate) token: AccessToken,
}

impl Address {
    /// Parses an address as printed by the server.
    ///
    /// # Errors
    /// If it is not valid, in words for the user.
    pub(crate) fn parse(text: &str) -> Result<Self, String> {
        let (place, token) = text.trim().split_once('#').ok_or(
            "the part after '#' is missing: copy the whole address that the server printed, and put it in quotes",
        )?;
        let token =
            AccessToken::parse(token).ok_or("the part after '#' is not the 64 digits that the server printed")?;
        let uri: Uri = place.parse().map_err(|_| format!("'{place}' is no address such as http://127.0.0.1:7070/"))?;
        let (Some(scheme), Some(authority)) = (uri.scheme_str(), uri.authority()) else {
            return Err(format!("'{place}' does not begin with http:// or https://"));
        };
        if !["http", "https"].contains(&scheme) || authority.as_str().contains('@') {
            return Err(format!("'{place}' is no address such as http://127.0.0.1:7070/"));
        }
        let path = uri.path().trim_end_matches('/');
        Ok(Self { base: format!("{scheme}://{authority}{path}"), host: authority.to_string(), token })
    }

    /// Returns whether the connection is not encrypted, so that others on the network can read it, the token included.
    pub(crate) fn is_open(&self) -> bool {
        let host = self.base.parse::<Uri>().ok().and_then(|uri| uri.host().map(str::to_owned));
        !self.base.starts_with("https") && !host.is_some_and(|host| is_loopback(&host))
    }
}

/// Parses the address to listen at: an IP address, a port, or both.
///
/// # Errors
/// If it is not valid, in words for the user.
pub(crate) fn bind_address(text: &str) -> Result<SocketAddr, String> {
    let port = text.parse().map(|port| SocketAddr::from((Ipv4Addr::LOCALHOST, port)));
    let address = || text.parse::<IpAddr>().map(|ip| SocketAddr::from((ip, PORT)));
    let local = || text.replace("localhost:", "127.0.0.1:").parse();
    port.or_else(|_| address()).or_else(|_| local()).map_err(|_| {
        format!(
            "'{text}' is no address to listen at, such as 127.0.0.1:{PORT} or {PORT} (put what is trained before it)"
        )
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn addresses_are_read_as_they_are_printed() {
        let token = "0123456789abcdef".repeat(4);
        let read = |place: &str| Address::parse(&format!("{place}#{token}"));
        let address = read("http://127.0.0.1:7070/").expect("an address");
        assert_eq!((&*address.base, &*address.host), ("http://127.0.0.1:7070", "127.0.0.1:7070"));
        assert!(address.token.is(&token) && !address.is_open());
        assert!(!read("https://lab.example/scene/").expect("a proxy").is_open());
        assert!(read("http://lab.example:7070").expect("unprotected").is_open());
        for bad in ["", "127.0.0.1:7070/", "ftp://127.0.0.1/", "http://user@127.0.0.1/", "http://", "/scene"] {
            assert!(read(bad).is_err(), "{bad}");
        }
        assert!(Address::parse("http://127.0.0.1:7070/").is_err_and(|e| e.contains("quotes")));
        assert!(Address::parse("http://127.0.0.1:7070/#12").is_err());
    }

    #[test]
    fn where_to_listen_is_a_port_an_address_or_both() {
        let at = |text: &str| bind_address(text).map(|a| a.to_string());
        assert_eq!(at("7071"), Ok("127.0.0.1:7071".into()));
        assert_eq!(at("localhost:1"), Ok("127.0.0.1:1".into()));
        assert_eq!(at("0.0.0.0"), Ok("0.0.0.0:7070".into()));
        assert_eq!(at("[::1]:9"), Ok("[::1]:9".into()));
        for bad in ["photos/", "", "99999", "lab.example:7070"] {
            assert!(at(bad).is_err(), "{bad}");
        }
    }
}
