//! One seeded generator, so that a seed means the same for ever.
//!
//! SplitMix64 (Steele, Lea, Flood, 2014): a counter and a mixing function. Not for secrets. It is our own, and not a
//! crate's, because a seed printed by a failing simulation must replay the same run after any update.

/// A stream of pseudo-random numbers that depends on nothing but its seed.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Rng {
    counter: u64,
}

impl Rng {
    /// The stream that belongs to `seed`.
    pub const fn new(seed: u64) -> Self {
        Rng { counter: seed }
    }

    /// An independent stream for one named part, so that a draw more in one part does not move the others.
    pub fn fork(&self, part: &str) -> Self {
        let mut forked = self.clone();
        for byte in part.bytes() {
            forked.counter ^= u64::from(byte);
            forked.counter = forked.next_u64();
        }
        forked
    }

    /// The next 64 bits.
    pub fn next_u64(&mut self) -> u64 {
        self.counter = self.counter.wrapping_add(0x9E37_79B9_7F4A_7C15);
        let mut mixed = self.counter;
        mixed = (mixed ^ (mixed >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
        mixed = (mixed ^ (mixed >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
        mixed ^ (mixed >> 31)
    }

    /// A whole number from 0 to `limit - 1`.
    ///
    /// # Panics
    /// If `limit` is 0.
    pub fn below(&mut self, limit: u64) -> u64 {
        assert!(limit > 0, "a draw needs at least one possible outcome");
        // The bias of a 64-bit remainder is below 2^-32 for every limit this program uses.
        self.next_u64() % limit
    }

    /// A number in 0.0..1.0.
    pub fn unit(&mut self) -> f64 {
        (self.next_u64() >> 11) as f64 / (1u64 << 53) as f64
    }

    /// True in `percent` of a hundred draws.
    pub fn chance(&mut self, percent: u64) -> bool {
        self.below(100) < percent
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_seed_means_the_same_for_ever() {
        let mut rng = Rng::new(1);
        assert_eq!(
            [rng.next_u64(), rng.next_u64()],
            [0x910A_2DEC_8902_5CC1, 0xBEEB_8DA1_658E_EC67],
            "reference output of SplitMix64 for seed 1"
        );
    }

    #[test]
    fn forks_do_not_disturb_each_other() {
        let rng = Rng::new(7);
        assert_eq!(rng.fork("noise"), rng.fork("noise"));
        assert_ne!(rng.fork("noise"), rng.fork("wording"));
    }
}
