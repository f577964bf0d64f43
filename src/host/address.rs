//! A host and a port number, as they follow the scheme of a network link.

use std::fmt;
use std::net::Ipv6Addr;
use std::str::FromStr;

/// `HOST:PORT`: a name, an IPv4 address, or an IPv6 address in brackets.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Address {
    host: String,
    port: u16,
}

/// What is wrong with an address.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum AddressError {
    /// Nothing before the colon, or nothing at all.
    #[error("no host is named")]
    NoHost,
    /// No colon, or nothing after it.
    #[error("'{host}' has no port number after it")]
    NoPort {
        /// The host.
        host: String,
    },
    /// Anything but a number from 1 to 65535.
    #[error("'{port}' is not a port number (1 to 65535)")]
    BadPort {
        /// What was there.
        port: String,
    },
    /// A character that no name has.
    #[error("'{host}' is not a host name")]
    BadHost {
        /// What was there.
        host: String,
    },
    /// A user's name and password before the host.
    #[error("a user name ('{user}') and a password do not apply here: write HOST:PORT")]
    User {
        /// The name, not the password.
        user: String,
    },
    /// An IPv6 address whose last group could be a port.
    #[error("the IPv6 address in '{text}' has to be in brackets, e.g. [::1]:2000")]
    Bare {
        /// What was written.
        text: String,
    },
    /// Something in brackets that is not an IPv6 address, or no closing one.
    #[error("'{text}' is not an IPv6 address in brackets, e.g. [::1]:2000")]
    BadBrackets {
        /// What was written.
        text: String,
    },
}

impl Address {
    /// The host: a name or an address, without brackets.
    pub fn host(&self) -> &str {
        &self.host
    }

    /// The port number, not zero.
    pub fn port(&self) -> u16 {
        self.port
    }
}

impl FromStr for Address {
    type Err = AddressError;

    fn from_str(text: &str) -> Result<Self, AddressError> {
        let (host, port) = if let Some(rest) = text.strip_prefix('[') {
            let bad = || AddressError::BadBrackets { text: text.to_owned() };
            let (host, after) = rest.split_once(']').ok_or_else(bad)?;
            // Behind a percent sign: the interface of a link-local address.
            let address = host.split_once('%').map_or(host, |(address, _)| address);
            address.parse::<Ipv6Addr>().map_err(|_| bad())?;
            match after.strip_prefix(':') {
                Some(port) => (host, port),
                None if after.is_empty() => (host, ""),
                None => return Err(bad()),
            }
        } else {
            // Before the colons are counted: a name and a password may have one between them.
            if let Some((user, _)) = text.split_once('@').filter(|(user, _)| user.contains(':')) {
                return Err(AddressError::User { user: user.split(':').next().unwrap_or_default().to_owned() });
            }
            let (host, port) = text.split_once(':').unwrap_or((text, ""));
            if port.contains(':') {
                return Err(AddressError::Bare { text: text.to_owned() });
            }
            if host.is_empty() {
                return Err(AddressError::NoHost);
            }
            // Names of other scripts are the resolver's business; no name has these characters.
            if host.chars().any(|c| c.is_whitespace() || c.is_control() || "/\\@?#[]%,;'\"<>".contains(c)) {
                return Err(AddressError::BadHost { host: host.to_owned() });
            }
            (host, port)
        };
        if port.is_empty() {
            return Err(AddressError::NoPort { host: host.to_owned() });
        }
        // Digits only: the parser would take a sign.
        let number = port.bytes().all(|byte| byte.is_ascii_digit()).then(|| port.parse().ok()).flatten();
        match number {
            Some(number) if number != 0 => Ok(Address { host: host.to_owned(), port: number }),
            Some(_) | None => Err(AddressError::BadPort { port: port.to_owned() }),
        }
    }
}

impl fmt::Display for Address {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        if self.host.contains(':') {
            write!(f, "[{}]:{}", self.host, self.port)
        } else {
            write!(f, "{}:{}", self.host, self.port)
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn addresses_are_hosts_and_ports_and_are_written_as_they_are_read() {
        for (text, host, port) in [
            ("bench:2000", "bench", 2000),
            ("192.0.2.7:1", "192.0.2.7", 1),
            ("[::1]:65535", "::1", 65535),
            ("[fe80::1%eth0]:2000", "fe80::1%eth0", 2000),
            ("prüfstand.example:2000", "prüfstand.example", 2000),
        ] {
            let address: Address = text.parse().expect("an address");
            assert_eq!((address.host(), address.port()), (host, port));
            assert_eq!(address.to_string(), text);
        }
    }

    #[test]
    fn what_is_no_address_says_what_is_wrong() {
        for (text, complaint) in [
            ("", "no host is named"),
            (":2000", "no host is named"),
            ("bench", "'bench' has no port number after it"),
            ("bench:", "'bench' has no port number after it"),
            ("[::1]", "'::1' has no port number after it"),
            ("bench:0", "'0' is not a port number (1 to 65535)"),
            ("bench:65536", "'65536' is not a port number (1 to 65535)"),
            ("bench:+20", "'+20' is not a port number (1 to 65535)"),
            ("bench:2000/", "'2000/' is not a port number (1 to 65535)"),
            ("bench:telnet", "'telnet' is not a port number (1 to 65535)"),
            ("me@bench:2000", "'me@bench' is not a host name"),
            ("u:secret@bench:2", "a user name ('u') and a password do not apply here: write HOST:PORT"),
            ("a bench:2000", "'a bench' is not a host name"),
            ("::1:2000", "the IPv6 address in '::1:2000' has to be in brackets, e.g. [::1]:2000"),
            ("[bench]:2000", "'[bench]:2000' is not an IPv6 address in brackets, e.g. [::1]:2000"),
            ("[::1:2000", "'[::1:2000' is not an IPv6 address in brackets, e.g. [::1]:2000"),
            ("[::1]2000", "'[::1]2000' is not an IPv6 address in brackets, e.g. [::1]:2000"),
        ] {
            let error = text.parse::<Address>().expect_err(text);
            assert_eq!(error.to_string(), complaint, "{text}");
        }
    }
}
