//! Where a policy server is.

use std::str::FromStr;

use tungstenite::http::Uri;

/// A server's address: `ws://HOST:PORT`, perhaps with a path.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Address {
    uri: Uri,
    host: String,
    port: u16,
}

/// A text that is no address of a policy server.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error(
    "{text:?} is no address of a policy server: {problem}; give ws://HOST:PORT (openpi's port is 8000)"
)]
pub struct AddressError {
    text: String,
    problem: String,
}

impl Address {
    /// As `ws://HOST:PORT/PATH`.
    #[must_use]
    pub const fn uri(&self) -> &Uri {
        &self.uri
    }

    /// The name or number of the machine; an IPv6 address without brackets.
    #[must_use]
    pub fn host(&self) -> &str {
        &self.host
    }

    /// The TCP port.
    #[must_use]
    pub const fn port(&self) -> u16 {
        self.port
    }
}

impl std::fmt::Display for Address {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "{}", self.uri)
    }
}

impl FromStr for Address {
    type Err = AddressError;

    fn from_str(text: &str) -> Result<Self, AddressError> {
        let refuse = |problem: &str| AddressError {
            text: text.to_owned(),
            problem: problem.to_owned(),
        };
        let uri: Uri = text.parse().map_err(|error| refuse(&format!("{error}")))?;
        match uri.scheme_str() {
            Some("ws") => {}
            Some("wss") => {
                return Err(refuse(
                    "wss is not spoken here; lead the connection through a tunnel",
                ));
            }
            _ => return Err(refuse("it does not begin with ws://")),
        }
        if uri.authority().is_some_and(|a| a.as_str().contains('@')) {
            return Err(refuse("it holds a user; a key goes into its own setting"));
        }
        let host = uri.host().unwrap_or_default();
        let host = host.trim_start_matches('[').trim_end_matches(']');
        if host.is_empty() {
            return Err(refuse("it names no host"));
        }
        let (host, port) = (host.to_owned(), uri.port_u16());
        let port = port.filter(|port| *port > 0);
        let port = port.ok_or_else(|| refuse("it names no port"))?;
        Ok(Self { uri, host, port })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn host_and_port_are_read() {
        let address: Address = "ws://robot.example:8000/pi".parse().unwrap();
        assert_eq!((address.host(), address.port()), ("robot.example", 8000));
        let address: Address = "ws://[::1]:81".parse().unwrap();
        assert_eq!((address.host(), address.port()), ("::1", 81));
    }

    #[test]
    fn what_is_wrong_is_named() {
        for (text, says) in [
            ("localhost:8000", "ws://"),
            ("http://localhost:8000", "ws://"),
            ("wss://localhost:8000", "tunnel"),
            ("ws://localhost", "no port"),
            ("ws://localhost:0", "no port"),
            ("ws://key@localhost:8000", "its own setting"),
            ("ws://", "ws://HOST:PORT"),
            ("", "ws://HOST:PORT"),
        ] {
            let error = text.parse::<Address>().unwrap_err().to_string();
            assert!(error.contains(says), "{text}: {error}");
        }
    }
}
