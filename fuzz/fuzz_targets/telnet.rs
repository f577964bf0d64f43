//! Telnet and RFC 2217: the same in any chunks, data pass unchanged, replies are bounded, nothing is kept without bound.
#![no_main]

use axcon::telnet::{Awaited, Client, Decoder, Heard, LONGEST_SUBNEGOTIATION, Refusal, escape};
use axcon_fuzz::parameter;
use libfuzzer_sys::fuzz_target;

fn decode<'a>(chunks: impl Iterator<Item = &'a [u8]>) -> (Vec<u8>, Vec<Heard>) {
    let (mut decoder, mut data, mut heard) = (Decoder::default(), Vec::new(), Vec::new());
    chunks.for_each(|chunk| decoder.decode(chunk, &mut data, |item| heard.push(item)));
    (data, heard)
}

/// Data, replies, and what the client has come to.
type Talk = (Vec<u8>, Vec<u8>, Option<Awaited>, Option<Refusal>, bool);

fn talk<'a>(chunks: impl Iterator<Item = &'a [u8]>) -> Talk {
    let mut client = Client::new(115_200);
    let (mut data, mut replies) = (Vec::new(), Vec::new());
    replies.extend(client.poll_transmit().expect("requests"));
    for chunk in chunks {
        client.receive(chunk, &mut data);
        while let Some(reply) = client.poll_transmit() {
            replies.extend(reply);
        }
    }
    assert_eq!(client.is_ready(), client.awaited().is_none() && client.refusal().is_none());
    (data, replies, client.awaited(), client.refusal().cloned(), client.is_suspended())
}

fuzz_target!(|input: &[u8]| {
    let Some((size, bytes)) = parameter(input) else { return };
    let size = usize::from(size).max(1);
    let whole = decode(std::iter::once(bytes));
    assert_eq!(whole, decode(bytes.chunks(size)));
    let (data, heard) = whole;
    assert!(data.len() + heard.len() <= bytes.len());
    for item in &heard {
        if let Heard::Subnegotiation(content) = item {
            assert!(content.len() <= LONGEST_SUBNEGOTIATION);
        }
    }
    assert_eq!(decode(escape(bytes).chunks(size)), (bytes.to_vec(), Vec::new()));

    let whole = talk(std::iter::once(bytes));
    assert_eq!(whole, talk(bytes.chunks(size)));
    assert_eq!(whole.0, data, "the client and its decoder see the same data");
    // An answer of three bytes to each option, yes and no, on both sides, and the requests.
    assert!(whole.1.len() <= 256 * 2 * 2 * 3 + 100);
});
