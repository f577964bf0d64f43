//! Serial ports behind a telnet connection: the part that is only bytes.
//!
//! Telnet is RFC 854, its negotiation RFC 855 and 1143, eight-bit data RFC 856, the remote serial port RFC 2217. Nothing
//! here has a socket or a clock: bytes in, and the unit's bytes, replies and the state of the negotiation out. How
//! long to wait for the server, and what to tell the user, is up to the owner (`host::socket`).

mod com_port;
mod decoder;
mod options;

pub use com_port::{Awaited, Client, Refusal};
pub use decoder::{Decoder, Heard, LONGEST_SUBNEGOTIATION};

/// The byte that begins every command, "interpret as command". As data it is sent twice.
const IAC: u8 = 255;
/// Begins a subnegotiation, which ends with IAC SE.
const SB: u8 = 250;
const SE: u8 = 240;

/// The part of a line rate by which a port may miss it: 2 %, half of what 8N1 forgives in all.
const BAUD_TOLERANCE: u32 = 50;

/// Whether a port that was asked for a line rate runs at it, or close enough, when it says that it is set to another one:
/// some drivers and servers report the rate their divider really gives. The same for ports of this machine and remote ones.
pub(crate) fn rate_is_close(asked: u32, set: u32) -> bool {
    set.abs_diff(asked) <= asked / BAUD_TOLERANCE
}

/// The bytes that make `data` arrive as it is.
pub fn escape(data: &[u8]) -> Vec<u8> {
    let mut escaped = Vec::with_capacity(data.len());
    for &byte in data {
        if byte == IAC {
            escaped.push(IAC);
        }
        escaped.push(byte);
    }
    escaped
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    fn bytes() -> impl Strategy<Value = Vec<u8>> {
        // Commands are rare among all bytes and interesting.
        let byte = prop_oneof![4 => any::<u8>(), 3 => Just(IAC), 3 => 240..=255u8, 1 => Just(44u8), 1 => Just(0u8)];
        proptest::collection::vec(byte, 0..600)
    }

    fn decode<'a>(pieces: impl Iterator<Item = &'a [u8]>) -> (Vec<u8>, Vec<Heard>) {
        let (mut decoder, mut data, mut heard) = (Decoder::default(), Vec::new(), Vec::new());
        for piece in pieces {
            decoder.decode(piece, &mut data, |item| heard.push(item));
        }
        (data, heard)
    }

    #[test]
    fn a_rate_is_close_that_a_divider_gives_and_no_other() {
        for set in [115_200, 115_384, 112_896, 117_504] {
            assert!(rate_is_close(115_200, set), "{set}");
        }
        for set in [0, 9_600, 112_895, 117_505, u32::MAX] {
            assert!(!rate_is_close(115_200, set), "{set}");
        }
    }

    proptest! {
        #[test]
        fn any_chunking_gives_the_same_data_and_commands(bytes in bytes(), size in 1..40usize) {
            prop_assert_eq!(decode(bytes.chunks(size)), decode(std::iter::once(&bytes[..])));
        }

        #[test]
        fn all_data_passes_unchanged(bytes in bytes(), size in 1..40usize) {
            let (data, heard) = decode(escape(&bytes).chunks(size));
            prop_assert_eq!(data, bytes);
            prop_assert_eq!(heard, vec![]);
        }

        #[test]
        fn any_nonsense_is_taken_and_replies_are_bounded(bytes in bytes(), rounds in 1..30usize) {
            let mut client = Client::new(115_200);
            let mut replied = 0;
            for _ in 0..rounds {
                client.receive(&bytes, &mut Vec::new());
                while let Some(reply) = client.poll_transmit() {
                    replied += reply.len();
                }
            }
            // An answer of three bytes to each option, yes and no, on both sides, and the requests.
            prop_assert!(replied <= 256 * 2 * 2 * 3 + 100, "{} bytes", replied);
        }

        #[test]
        fn two_clients_that_talk_to_each_other_fall_silent(baud in 1..4_000_000u32) {
            let (mut one, mut other) = (Client::new(baud), Client::new(115_200));
            for _ in 0..50 {
                while let Some(bytes) = one.poll_transmit() {
                    other.receive(&bytes, &mut Vec::new());
                }
                while let Some(bytes) = other.poll_transmit() {
                    one.receive(&bytes, &mut Vec::new());
                }
            }
            prop_assert!(one.poll_transmit().is_none() && !one.is_ready());
        }
    }
}
