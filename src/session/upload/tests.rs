use super::*;

#[test]
fn words_are_told_from_damage_and_digits() {
    for text in ["Erasing sector 5", "0x0400: done", "x1yz Vorg\u{e4}nge", "\u{1}\u{2}ready\u{3}"] {
        assert!(has_a_word(text), "{text:?}");
    }
    // Four letters at least, and not all of them digits of a record.
    for text in ["", "ok 12 go", "S3150000", "DEADBEEF cafe", "a1b2c3d4", "0123456789", "...."] {
        assert!(!has_a_word(text), "{text:?}");
    }
}

#[test]
fn only_an_application_shows_its_menu_its_first_start_rows_or_its_version() {
    use crate::wire::{Confidence, MenuKey, SoftwareName};
    let software = |version| {
        Message::Software(SoftwareName {
            product: Some("AXTC4CO".into()),
            version,
            confidence: Confidence::WithProduct,
        })
    };
    assert!(shows_application(&Message::MenuKey(MenuKey::View)));
    assert!(shows_application(&Message::FirstStart));
    assert!(shows_application(&software(Some(Version::new(1, 2, 0)))));
    // A loader names the product as well.
    assert!(!shows_application(&software(None)));
    assert!(!shows_application(&Message::Text) && !shows_application(&Message::Loader(LoaderText::Waiting)));
}
