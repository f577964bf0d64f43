//! The receive ring: the interrupt puts characters in, the loader takes them out. Neither checks whether it is full.

use crate::device::RING;

/// Characters received and not yet read. One more than it holds overwrites the oldest, and is read in its place (public
/// sources: "character 551 overwrites"). How many are read after that is a guess: as many as it holds.
#[derive(Debug)]
pub struct Ring {
    slots: Box<[u8; RING]>,
    write: usize,
    read: usize,
    unread: usize,
}

impl Ring {
    /// An empty ring.
    pub fn new() -> Self {
        Ring { slots: Box::new([0; RING]), write: 0, read: 0, unread: 0 }
    }

    /// A character has come.
    pub fn push(&mut self, character: u8) {
        self.slots[self.write] = character;
        self.write = (self.write + 1) % RING;
        self.unread = (self.unread + 1).min(RING);
    }

    /// The next character.
    pub fn pop(&mut self) -> Option<u8> {
        self.unread = self.unread.checked_sub(1)?;
        let character = self.slots[self.read];
        self.read = (self.read + 1) % RING;
        Some(character)
    }

    /// Forgets what has not been read.
    pub fn clear(&mut self) {
        self.read = self.write;
        self.unread = 0;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_full_ring_gives_back_everything_and_one_more_takes_the_place_of_the_oldest() {
        let sent: Vec<u8> = (0..RING).map(|number| number as u8).collect();
        let mut ring = Ring::new();
        for round in 0..3 {
            sent.iter().for_each(|&character| ring.push(character));
            let read: Vec<u8> = std::iter::from_fn(|| ring.pop()).collect();
            assert_eq!(read, sent, "round {round}");
        }
        sent.iter().for_each(|&character| ring.push(character));
        ring.push(b'!');
        assert_eq!((ring.pop(), ring.pop()), (Some(b'!'), Some(1)));
        ring.clear();
        assert_eq!(ring.pop(), None);
        (0..100_000).for_each(|_| ring.push(b'x'));
        assert_eq!(std::iter::from_fn(|| ring.pop()).count(), RING, "a sender that is deaf fills it once");
    }
}
