//! Whole-file rules (to be written).

use super::{Identity, Image};

/// An image without errors.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct CheckedImage {
    image: Image,
    identity: Identity,
}

impl CheckedImage {
    /// The records.
    pub fn image(&self) -> &Image {
        &self.image
    }

    /// What the image says it is.
    pub fn identity(&self) -> Option<&Identity> {
        Some(&self.identity)
    }
}
