//! The password: no `Debug`, no `Display`, one way out, wiped when dropped.

use zeroize::Zeroizing;

/// A password. It can be sent, and nothing else.
#[derive(Clone)]
pub struct Secret(Zeroizing<Vec<u8>>);

impl Secret {
    /// Takes a password as the user gave it. The unit's own rule is that case matters (AXTC4CO manual, section 4.1.5).
    pub fn new(password: Vec<u8>) -> Self {
        Secret(Zeroizing::new(password))
    }

    /// The way out: the bytes for the line.
    pub fn reveal(&self) -> &[u8] {
        &self.0
    }

    /// Whether there is nothing in it.
    pub fn is_empty(&self) -> bool {
        self.0.is_empty()
    }
}

impl std::fmt::Debug for Secret {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str("Secret(..)")
    }
}
