//! Whether a sound image is right for the unit it is about to be sent to.
//!
//! A file is checked before the unit is known: for the product it names, or for any. The unit's own flash, its loader,
//! and the software that runs in it are known later, and decide.

use super::defect::DefectId;
use super::report::{AddressRange, CheckedImage};
use super::whole::Judged;
use super::{AddressUnit, Block, Outside, Target};
use crate::version::Version;

/// Why an image should not be sent to a unit.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Misfit {
    /// Its name, by which it can be allowed.
    pub id: DefectId,
    /// What is wrong, in words.
    pub message: String,
}

/// The unit's software, as far as it is known.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Software {
    /// It runs now.
    Runs(Version),
    /// It ran before an upload that has not ended well.
    Ran(Version),
}

impl CheckedImage {
    /// Reasons not to send this image to a unit of this kind, each kind of reason once. `software`: what the unit runs,
    /// if known. What was allowed when the file was checked does not count.
    pub fn misfits(&self, unit: &Target, software: Option<Software>) -> Vec<Misfit> {
        let mut misfits: Vec<Misfit> = Vec::new();
        let mut note = |id: DefectId, message: &dyn Fn() -> String| {
            if !self.overridden().contains(&id) && misfits.iter().all(|misfit| misfit.id != id) {
                misfits.push(Misfit { id, message: message() });
            }
        };
        let product = &unit.product;
        if let Some(identity) = self.identity() {
            let is_known_stranger = self.overridden().contains(&DefectId::UnknownProduct);
            if !identity.is_for(product) && !is_known_stranger {
                note(DefectId::WrongProduct, &|| {
                    format!("the image is for {}, the unit is an {product}", identity.product)
                });
            }
            let newer = software.map(|software| match software {
                Software::Runs(version) => (version, "runs"),
                Software::Ran(version) => (version, "ran before"),
            });
            if let Some((newer, runs)) = newer.filter(|&(newer, _)| identity.version < newer) {
                note(DefectId::Downgrade, &|| {
                    format!("the image is V{}, older than the V{newer} that the unit {runs}", identity.version)
                });
            }
        }
        let image = self.image();
        if image.address_unit != unit.flash.address_unit {
            note(DefectId::AddressUnit, &|| {
                let (seen, wanted) = match image.address_unit {
                    AddressUnit::Byte => ("bytes", "words"),
                    AddressUnit::Word => ("words", "bytes"),
                };
                format!("the image's addresses count {seen}, the {product}'s count {wanted}")
            });
            return misfits;
        }
        // Loaders that fold write page by page, and leave words for which there is no data as they are.
        if let Some(gap) = self.gap().filter(|_| unit.outside == Outside::Folds) {
            note(DefectId::Gap, &|| {
                format!(
                    "no record writes 0x{:04X} to 0x{:04X}, where the {product}'s loader leaves what was there; the \
                     program's CRC is right only if that is erased flash",
                    gap.start,
                    gap.end - 1
                )
            });
        }
        let judged = Judged::of(unit);
        let end = unit.flash.end();
        for block in &image.blocks {
            let start = u64::from(block.address);
            let range = AddressRange { start, end: start + image.address_unit.addresses(block.data.len()) };
            let is_boot = unit.boot.is_some_and(|boot| range.start < boot.end && boot.start < range.end);
            let id = if judged.is_data_memory(block.address) {
                DefectId::DataMemory
            } else if range.end <= end {
                continue;
            } else if is_boot {
                DefectId::BootFlash
            } else {
                DefectId::OutOfRange
            };
            note(id, &|| {
                let first = if range.start < end { end } else { range.start };
                format!("address 0x{first:X} is outside the {product}'s program flash; {}", judged.fate(first, end))
            });
        }
        misfits
    }

    /// The first words that no record writes, but that the identity block's CRC covers, as erased flash.
    fn gap(&self) -> Option<AddressRange> {
        let (identity, image) = (self.identity()?, self.image());
        let program = u64::from(identity.program_words) * 2 / u64::from(image.address_unit.bytes());
        let ends = |block: &Block| u64::from(block.address) + image.address_unit.addresses(block.data.len());
        let mut spans: Vec<(u64, u64)> =
            image.blocks.iter().map(|block| (u64::from(block.address), ends(block))).collect();
        spans.sort_unstable();
        let mut next = 0;
        for (start, end) in spans.into_iter().chain([(program, program)]) {
            if start > next && next < program {
                return Some(AddressRange { start: next, end: start.min(program) });
            }
            next = next.max(end);
        }
        None
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::image::{FlashMap, check, make};

    /// A unit with this much flash, followed by its boot flash.
    fn unit(product: &str, program_words: u32, outside: Outside) -> Target {
        let start = u64::from(program_words) * 2;
        Target {
            product: product.into(),
            flash: FlashMap { address_unit: AddressUnit::Word, program_words, page_words: 256 },
            file_name: format!("{product}_V{{version}}.elf.S"),
            boot: Some(AddressRange { start, end: start + 0x1000 }),
            outside,
        }
    }

    fn small() -> Target {
        unit("AXSMALL", 0x1_0000, Outside::Folds)
    }

    fn large() -> Target {
        unit("AXLARGE", 0x4_0000, Outside::Refuses)
    }

    fn image(target: &Target, words: u32, allow: &[DefectId]) -> CheckedImage {
        let recipe = make::Recipe { target, version: Version::new(1, 2, 0), words, flaw: None };
        let file = make::make(&recipe).expect("an image");
        let report = check(file.as_slice(), None, &[small(), large()], Some("AXSMALL"), allow).expect("a slice");
        report.image().unwrap_or_else(|| panic!("{:?}", report.defects))
    }

    fn ids(misfits: &[Misfit]) -> Vec<&'static str> {
        misfits.iter().map(|misfit| misfit.id.name()).collect()
    }

    const OTHER: &[DefectId] = &[DefectId::WrongProduct];

    #[test]
    fn an_image_whose_addresses_count_something_else_is_one_misfit_and_no_more() {
        let bytes = {
            let mut bytes = small();
            bytes.flash.address_unit = AddressUnit::Byte;
            bytes
        };
        let recipe = make::Recipe { target: &bytes, version: Version::new(1, 2, 0), words: 600, flaw: None };
        let file = make::make(&recipe).expect("an image");
        let counted =
            check(file.as_slice(), None, std::slice::from_ref(&bytes), Some("AXSMALL"), &[]).expect("a slice");
        let counted = counted.image().expect("sound for such a unit");
        assert_eq!(counted.misfits(&bytes, None), []);
        let misfits = counted.misfits(&small(), None);
        assert_eq!(ids(&misfits), ["address-unit"]);
        assert_eq!(misfits[0].message, "the image's addresses count bytes, the AXSMALL's count words");
        let misfits = image(&small(), 600, &[]).misfits(&bytes, None);
        assert_eq!(misfits[0].message, "the image's addresses count words, the AXSMALL's count bytes");
    }

    #[test]
    fn an_image_fits_its_own_product_and_not_a_smaller_flash() {
        assert_eq!(image(&small(), 600, &[]).misfits(&small(), None), []);
        assert_eq!(ids(&image(&small(), 600, &[]).misfits(&large(), None)), ["wrong-product"]);
        let large_one = image(&large(), 0x1_2000, OTHER);
        assert_eq!(
            ids(&large_one.misfits(&small(), None)),
            ["out-of-range"],
            "the other product was allowed, this not"
        );
        assert_eq!(large_one.misfits(&large(), None), []);
    }

    #[test]
    fn what_the_loader_would_do_is_said_of_the_loader_the_unit_has() {
        let image = image(&large(), 0x2_0010, OTHER);
        let said = |outside, id| {
            let misfits = image.misfits(&unit("AXSMALL", 0x1_0000, outside), None);
            misfits.into_iter().find(|misfit| misfit.id == id).map(|misfit| misfit.message)
        };
        let of = |address: &str, fate: &str| {
            Some(format!("address {address} is outside the AXSMALL's program flash; the loader {fate}"))
        };
        assert_eq!(
            said(Outside::Folds, DefectId::OutOfRange),
            of("0x10000", "folds that to 0x0000 over the program, silently")
        );
        assert_eq!(
            said(Outside::Folds, DefectId::BootFlash),
            of("0x20000", "folds that to 0x0000 over the program, silently")
        );
        assert_eq!(
            said(Outside::Refuses, DefectId::OutOfRange),
            of("0x10000", "stops there, with the old program erased")
        );
    }

    #[test]
    fn a_gap_that_the_checksum_covers_wants_a_loader_that_erases_it() {
        let file = |flaw| {
            let recipe = make::Recipe { target: &small(), version: Version::new(1, 2, 0), words: 600, flaw };
            let file = make::make(&recipe).expect("an image");
            check(file.as_slice(), None, &[small()], Some("AXSMALL"), &[]).expect("a slice").image().expect("sound")
        };
        let gap = file(Some(DefectId::Gap));
        let misfits = gap.misfits(&small(), None);
        assert_eq!(ids(&misfits), ["gap"]);
        assert!(misfits[0].message.starts_with("no record writes 0x00D0 to 0x00DF, where the AXSMALL's loader"));
        assert_eq!(gap.misfits(&unit("AXSMALL", 0x1_0000, Outside::Refuses), None), [], "it erases everything first");
        assert_eq!(file(None).misfits(&small(), None), []);
    }

    #[test]
    fn a_gap_anywhere_in_the_program_counts_and_none_after_it() {
        let recipe = make::Recipe { target: &small(), version: Version::new(1, 2, 0), words: 600, flaw: None };
        let file = String::from_utf8(make::make(&recipe).expect("an image")).expect("text");
        let lines: Vec<&str> = file.split_inclusive('\n').collect();
        // Header, 16 words a record, terminator: the record of words 0x240 to 0x24F.
        let gapped = [&lines[..37], &lines[38..]].concat().concat();
        let allow = [DefectId::IdentityCrc];
        let report = check(gapped.as_bytes(), None, &[small()], Some("AXSMALL"), &allow).expect("a slice");
        let gapped = report.image().unwrap_or_else(|| panic!("{:?}", report.defects));
        assert_eq!(gapped.gap(), Some(AddressRange { start: 0x240, end: 0x250 }));
    }

    #[test]
    fn a_program_may_fill_the_flash() {
        assert_eq!(image(&small(), 0x1_0000, &[]).misfits(&small(), None), []);
    }

    #[test]
    fn software_older_than_what_runs_is_reported() {
        let image = image(&small(), 600, &[]);
        for (major, minor, patch, expected) in
            [(1, 1, 9, &[][..]), (1, 2, 0, &[]), (1, 2, 1, &["downgrade"]), (2, 0, 0, &["downgrade"])]
        {
            let runs = Version::new(major, minor, patch);
            for software in [Software::Runs(runs), Software::Ran(runs)] {
                assert_eq!(ids(&image.misfits(&small(), Some(software))), expected, "{software:?}");
            }
        }
        let before = image.misfits(&small(), Some(Software::Ran(Version::new(1, 2, 1))));
        assert_eq!(before[0].message, "the image is V1.2.0, older than the V1.2.1 that the unit ran before");
    }
}
