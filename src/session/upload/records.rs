//! The records of an upload, rebuilt from the image: upper case, CR after each (a g3 takes nothing else), a four-byte
//! header address, whole words, no count records.

use std::ops::RangeInclusive;

use crate::image::Image;
use crate::image::srecord::{self, Kind, Record};

/// Most data bytes of a packed record: as many as an S3 record can have besides its address and its checksum.
pub(super) const LONGEST: usize = 250;
/// Characters of a data record besides its data: type, count, address, checksum, line end.
const AROUND: usize = 15;
/// Fewest data bytes of a packed record: as many as compilers write.
const SHORTEST: usize = 32;

/// Data bytes of a packed record for a loader that acknowledges each record. `late` is how long after a record its
/// acknowledgement comes, in characters of the line; `window` is how many characters may be on their way
/// unacknowledged. The records are as long as they can be without the line ever standing still: enough of them fill the
/// window that the first is acknowledged before the last has left.
pub(super) fn longest_acknowledged(window: usize, late: usize) -> usize {
    let records = window.div_ceil(window.saturating_sub(late).max(1)).max(2);
    let data = (window / records).saturating_sub(AROUND) / 2;
    (data / 2 * 2).clamp(SHORTEST, LONGEST)
}

/// One record ready to leave.
#[derive(Clone, Debug)]
pub(super) struct Outgoing {
    /// The text with its line end.
    pub(super) text: Vec<u8>,
    /// Addresses of the first and the last word of a data record; `None` for header and end.
    pub(super) words: Option<RangeInclusive<u32>>,
}

/// How many data bytes a record gets.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Size {
    /// As many as in the file.
    AsInFile,
    /// This many, as far as the image goes on without a gap.
    Packed(usize),
}

/// What ends a record. A g3 takes nothing else: an LF after the CR is an error, and with LF alone it waits for the CR
/// for ever, without a word (docs/loaders.md).
pub(super) const LINE_END: &[u8] = b"\r";

/// All records: header, data, end.
pub(super) fn build(image: &Image, size: Size, line_end: &[u8]) -> Vec<Outgoing> {
    let line = |write: &dyn Fn(&mut Vec<u8>)| {
        let mut text = Vec::new();
        write(&mut text);
        text.extend_from_slice(line_end);
        text
    };
    let header = header(image);
    let header = line(&|text| srecord::write_header(&header, text));
    let mut records = vec![Outgoing { text: header, words: None }];
    let mut push = |address: u32, data: &[u8]| {
        let last = address.saturating_add((data.len().div_ceil(2) as u32).saturating_sub(1));
        let mut data = data.to_vec();
        if data.len() % 2 == 1 {
            data.push(0xFF); // Half a word is filled up with what erased flash reads as.
        }
        let record = Record { kind: Kind::Data32, address, data: &data };
        records.push(Outgoing { text: line(&|text| record.write(text)), words: Some(address..=last) });
    };
    match size {
        Size::AsInFile => image.blocks.iter().for_each(|block| push(block.address, &block.data)),
        Size::Packed(bytes) => {
            for (address, data) in runs(image) {
                for (number, piece) in data.chunks(bytes).enumerate() {
                    push(address.wrapping_add((number * bytes / 2) as u32), piece);
                }
            }
        }
    }
    let end = Record { kind: Kind::Start32, address: image.entry, data: &[] };
    records.push(Outgoing { text: line(&|text| end.write(text)), words: None });
    records
}

/// Characters of these records, line ends included.
pub(super) fn characters(records: &[Outgoing]) -> usize {
    records.iter().map(|record| record.text.len()).sum()
}

/// The header's text: no more than fits a record, with dots for characters that would act on us when a loader echoes
/// them.
pub(super) fn header(image: &Image) -> Vec<u8> {
    let printable = |&byte: &u8| if matches!(byte, b' '..=b'~') { byte } else { b'.' };
    image.header.iter().take(srecord::LONGEST_HEADER).map(printable).collect()
}

/// Stretches of the image without a gap, in the file's order.
fn runs(image: &Image) -> Vec<(u32, Vec<u8>)> {
    let mut runs: Vec<(u32, Vec<u8>)> = Vec::new();
    for block in &image.blocks {
        match runs.last_mut() {
            Some((address, data))
                if data.len() % 2 == 0 && u64::from(*address) + data.len() as u64 / 2 == u64::from(block.address) =>
            {
                data.extend_from_slice(&block.data);
            }
            _ => runs.push((block.address, block.data.clone())),
        }
    }
    runs
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::image::{AddressUnit, Block, DefectId, check};

    fn image(blocks: &[(u32, usize)]) -> Image {
        let block = |&(address, length): &(u32, usize)| Block {
            address,
            data: (0..length).map(|at| (address as usize * 2 + at) as u8).collect(),
        };
        Image {
            header: b"\0\0it".to_vec(),
            blocks: blocks.iter().map(block).collect(),
            entry: 0,
            address_unit: AddressUnit::Word,
        }
    }

    fn words(records: &[Outgoing]) -> Vec<(u32, u8)> {
        let mut words = Vec::new();
        for (record, address) in records.iter().filter_map(|record| Some((record, *record.words.as_ref()?.start()))) {
            let text = std::str::from_utf8(&record.text).expect("ASCII").trim_end();
            let data = &text[12..text.len() - 2];
            for at in 0..data.len() / 4 {
                words.push((address + at as u32, u8::from_str_radix(&data[at * 4..at * 4 + 2], 16).expect("hex")));
            }
        }
        words
    }

    #[test]
    fn packed_records_hold_the_same_words_and_no_gap_is_filled() {
        let blocks: Vec<(u32, usize)> =
            (0..20).map(|number| (number * 16, 32)).chain([(0x400, 32), (0x410, 7)]).collect();
        let image = image(&blocks);
        let plain = words(&build(&image, Size::AsInFile, LINE_END));
        for bytes in [SHORTEST, 54, LONGEST] {
            let packed = build(&image, Size::Packed(bytes), LINE_END);
            assert_eq!(words(&packed), plain, "{bytes}");
            assert!(packed.iter().all(|record| record.text.len() <= AROUND + 2 * bytes));
        }
        assert_eq!(build(&image, Size::Packed(LONGEST), LINE_END).len(), 2 + 3 + 1, "header, end, 640 and 39 bytes");
    }

    #[test]
    fn half_a_word_is_filled_up_and_counts_as_one() {
        let mut image = image(&[(0, 3)]);
        image.blocks[0].data = vec![0x11, 0x22, 0x33];
        for size in [Size::AsInFile, Size::Packed(LONGEST)] {
            let records = build(&image, size, LINE_END);
            assert_eq!(records[1].text, b"S30900000000112233FF91\r");
            assert_eq!(records[1].words, Some(0..=1));
        }
        // What follows after half a word is a record of its own.
        let records = build(&self::image(&[(0, 3), (2, 4)]), Size::Packed(LONGEST), LINE_END);
        let words: Vec<_> = records.iter().filter_map(|record| record.words.clone()).collect();
        assert_eq!(words, [0..=1, 2..=3]);
    }

    #[test]
    fn a_header_says_nothing_that_would_act_on_us() {
        let mut image = image(&[(0, 4)]);
        image.header = b"\0\x07A \x13~\x7F!\xFF".to_vec();
        assert_eq!(header(&image), b"..A .~.!.");
        image.header = vec![b'x'; 300];
        assert_eq!(header(&image).len(), srecord::LONGEST_HEADER);
        assert_eq!(
            build(&image, Size::AsInFile, LINE_END)[0].text.len(),
            4 + 2 * 255 + 1,
            "as long as a record can be"
        );
    }

    #[test]
    fn as_many_characters_leave_as_the_check_of_the_file_has_said() {
        let files = [
            "S0110000000050524F4752414D264441544196\nS307000000001122C5\nS70500000000FA\n",
            "S0030000FC\nS307000000001122C5\nS70500000000FA\n",
            ":040000001122334452\n:040002005566778840\n:0400000500000000F7\n:00000001FF\n",
            ":040000001122334452\n:00000001FF\n",
        ];
        for file in files {
            let allow = [DefectId::HeaderForm, DefectId::MissingEntry];
            let report = check(file.as_bytes(), None, &[], None, &allow).expect("a slice");
            let image = report.image().expect("nothing else is wrong with it");
            let records = build(image.image(), Size::AsInFile, LINE_END);
            assert_eq!(report.facts.characters, characters(&records) as u64, "{file:?}");
        }
    }

    #[test]
    fn the_later_an_acknowledgement_the_shorter_the_records_and_the_line_never_stands_still() {
        for (late, data) in [(2, 116), (92, 116), (184, 116), (370, 54), (460, 32), (5_000, 32)] {
            assert_eq!(longest_acknowledged(500, late), data, "{late}");
        }
        for late in 0..=420 {
            let record = AROUND + 2 * longest_acknowledged(500, late);
            let on_their_way = 500 / record * record;
            assert!(
                on_their_way >= record + late || record == AROUND + 2 * SHORTEST || on_their_way + 8 >= record + late,
                "{late}"
            );
        }
    }
}
