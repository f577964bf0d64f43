//! Uploads to a loader of which each answer is written by hand, to the microsecond: what leaves, when, and on what evidence.
//! The other end has no flash and no time of its own, so a wait that is too short or too long shows here, and so does a
//! record that leaves for a loader that has shown nothing.

use axcon::device::{Product, longest_erase};
use axcon::endpoint::Endpoint;
use axcon::session::{Command, Event, LoadReport, Outcome, Progress, Session, UnitNow, Verdict};
use axcon::time::{Duration, Instant, character_time};

use crate::support::bench::{BAUD, image_of, order};

const ON: &str = "\u{11}";
const OFF: &str = "\u{13}";
const WAITS: &str = "\r\nWaiting for application S-Record.\r\n";
/// Data of 20 records, the 17th of which begins the second page of 256 words.
const WORDS: u32 = 320;
/// Characters that a loader with a ring may have to keep at most.
const WINDOW: usize = 500;

/// What is said behind something that was sent: how many microseconds behind its last character, and what.
type Says = Vec<(u64, &'static str)>;

/// Something that was sent.
struct Piece {
    /// When it was let go, and when its last character has left.
    let_go: Instant,
    gone: Instant,
    text: String,
}

/// An upload that is over.
struct Upload {
    report: LoadReport,
    ended: Instant,
    /// What was sent from the first header on, its number behind the last header with it: 0 is the header.
    sent: Vec<(usize, Piece)>,
    /// What was sent before, how many milliseconds behind the password.
    keys: Vec<(u64, String)>,
    /// What was said behind the password.
    said: Vec<(Instant, &'static str)>,
    progress: Vec<(Instant, Progress)>,
}

impl Upload {
    /// Uploads to a unit of this product whose loader answers what is sent to it so; a record with its number.
    fn to(product: &str, loader: impl FnMut(usize, &str) -> Says) -> Self {
        Upload::entered(product, WORDS, &[(50_000, WAITS)], &[], loader)
    }

    /// The same, where this is said behind the password, and that behind a key before the first record.
    fn entered(
        product: &str,
        words: u32,
        behind_password: &[(u64, &'static str)],
        behind_key: &[(u64, &'static str)],
        mut loader: impl FnMut(usize, &str) -> Says,
    ) -> Self {
        let mut session = Session::new(BAUD);
        let (mut now, mut free) = (Instant::from_millis(1), Instant::ZERO);
        let mut says: Vec<(Instant, &'static str)> = Vec::new();
        let (mut password, mut keys) = (None, Vec::new());
        let menu: &'static str = match product {
            "AXTC4CO" => "AXTC4CO V1.1.0\r\nV - View\r\nD - Default\r\nT - Stream\r\nS - Diagnostics\r\nL - Load\r\n",
            _ => "AXRTD8CO V1.1.0\r\nV - View\r\nD - Default\r\nT - Stream\r\nS - Diagnostics\r\nL - Load\r\n",
        };
        let (mut sent, mut said, mut progress): (Vec<(usize, Piece)>, _, _) = (Vec::new(), Vec::new(), Vec::new());
        let load = Command::Load(Box::new(order(image_of(product, "1.2.0", words))));
        session.command(now, load).expect("it is free");
        let report = 'upload: loop {
            while let Some(piece) = session.poll_transmit() {
                free = free.max(now) + character_time(BAUD) * piece.bytes.len() as u32;
                let text = String::from_utf8(piece.bytes).expect("ASCII");
                let answer = match text.as_str() {
                    "\u{11}m" => vec![(3_000, menu)],
                    "l" => vec![(3_000, "Password: ")],
                    "AXIO-2010" => {
                        password = Some(free);
                        behind_password.to_vec()
                    }
                    _ if sent.is_empty() && !text.starts_with("S0") => match password {
                        // The Enter behind the password is no key.
                        Some(password) if now > password + Duration::from_millis(500) => {
                            keys.push((millis(now.since(password)), text));
                            behind_key.to_vec()
                        }
                        _ => Vec::new(),
                    },
                    _ => {
                        let number = match text.starts_with("S0") {
                            true => 0,
                            false => sent.last().map_or(0, |(number, _)| number + 1),
                        };
                        let answer = loader(number, &text);
                        sent.push((number, Piece { let_go: now, gone: free, text }));
                        answer
                    }
                };
                says.extend(answer.into_iter().map(|(late, text)| (free + Duration::from_micros(late), text)));
            }
            while let Some(event) = session.poll_event() {
                match event {
                    Event::Progress(at) => progress.push((now, at)),
                    Event::Finished(Outcome::Loaded(report)) => break 'upload *report,
                    _ => {}
                }
            }
            let next = says.iter().map(|(at, _)| *at).chain(session.poll_timeout()).min();
            now = next.expect("every wait has an end").max(now);
            match says.iter().position(|(at, _)| *at <= now) {
                Some(place) => {
                    let (at, text) = says.remove(place);
                    session.handle_bytes(now, text.as_bytes());
                    said.extend(password.map(|_| (at, text)));
                }
                None => session.handle_timeout(now),
            }
            assert!(now < Instant::from_millis(300_000), "an end");
        };
        Upload { keys, report, ended: now, sent, said, progress }
    }

    /// How often each was sent: header, data, end.
    fn counts(&self) -> [usize; 3] {
        ["S0", "S3", "S7"].map(|kind| self.sent.iter().filter(|(_, piece)| piece.text.starts_with(kind)).count())
    }

    /// What was sent besides records, as `CR` so many times or the text.
    fn others(&self) -> String {
        let others = self.sent.iter().map(|(_, piece)| piece.text.as_str()).filter(|text| !text.starts_with('S'));
        others.collect::<String>().escape_default().to_string()
    }

    /// The piece that was sent so many pieces behind the first header.
    fn piece(&self, place: usize) -> &Piece {
        &self.sent[place].1
    }

    /// Milliseconds from a moment to the end.
    fn end_behind(&self, moment: Instant) -> u64 {
        millis(self.ended.since(moment))
    }
}

fn millis(span: Duration) -> u64 {
    u64::try_from(span.as_nanos() / 1_000_000).expect("a short story")
}

/// The banner behind the end record.
fn started(product: &str) -> Says {
    vec![(40_000, if product == "AXTC4CO" { "\r\nAXTC4CO V1.2.0\r\n" } else { "\r\nAXRTD8CO V1.2.0\r\n" })]
}

/// A loader with a ring, as it should be: it stops its sender behind each record and lets it go on.
fn with_ring(number: usize, text: &str) -> Says {
    match number {
        0 => vec![(1_000, OFF), (2_000_000, ON)],
        _ if text.starts_with("S7") => started("AXRTD8CO"),
        _ => vec![(200, OFF), (1_500, ON)],
    }
}

/// A loader whose pages are half as large as assumed.
fn with_half_pages(number: usize, text: &str) -> Says {
    match number {
        _ if text.starts_with("S7") => started("AXTC4CO"),
        9.. if number % 8 == 1 => vec![(200, OFF), (30_000, ON)],
        _ => Vec::new(),
    }
}

/// A loader with pages, as it should be.
fn with_pages(number: usize, text: &str) -> Says {
    match number {
        17 => vec![(200, OFF), (30_000, ON)],
        _ if text.starts_with("S7") => started("AXTC4CO"),
        _ => Vec::new(),
    }
}

#[test]
fn to_a_ring_nothing_leaves_that_it_may_not_keep_and_the_end_not_before_all_is_taken() {
    // An adapter shows each acknowledgement when two more records have left.
    let upload = Upload::to("AXRTD8CO", |number, text| match number {
        0 => with_ring(number, text),
        _ if text.starts_with("S7") => with_ring(number, text),
        _ => vec![(16_000, OFF), (16_200, ON)],
    });
    assert_eq!((upload.report.verdict, upload.counts()), (Verdict::Done, [1, 20, 1]), "{:?}", upload.report);
    let taken_at: Vec<Instant> = upload.said.iter().filter(|(_, text)| *text == ON).map(|(at, _)| *at).collect();
    let taken = |moment: Instant| taken_at.iter().filter(|at| **at <= moment).count();
    let mut most = 0;
    for (place, (number, piece)) in upload.sent.iter().enumerate() {
        let before = taken(piece.let_go);
        let on_their_way: usize = upload.sent[before..=place].iter().map(|(_, piece)| piece.text.len()).sum();
        assert!(on_their_way <= WINDOW, "{number}: {on_their_way}");
        // Header and first data prove the loader, and behind the end nothing may be lost.
        let alone = *number <= 2 || piece.text.starts_with("S7");
        assert!(!alone || before == place, "{number} leaves when {before} are taken");
        most = most.max(place - before);
    }
    assert!(most >= 3, "the line does not stand still for an acknowledgement: {most}");
    // Of what was taken each progress is the truth.
    for (at, progress) in &upload.progress {
        let records = taken(*at).min(21);
        let characters: usize = upload.sent[..records].iter().map(|(_, piece)| piece.text.len()).sum();
        let is_over = progress.records == progress.records_total;
        assert!(is_over || (progress.records, progress.bytes) == (records, characters), "{records}: {progress:?}");
    }
    let moved = upload.progress.iter().map(|(_, at)| at.moved).max();
    let behind_the_first: usize = upload.sent[2..].iter().map(|(_, piece)| piece.text.len()).sum();
    assert_eq!(moved, Some(behind_the_first), "counted from the first data on");
}

#[test]
fn a_hold_without_end_is_given_up_in_its_time_and_told_of_each_second() {
    let erase = longest_erase(&Product::named("AXRTD8CO").expect("it is known").flash);
    for (held, limit) in [(0, erase + Duration::from_secs(4)), (5, Duration::from_secs(4))] {
        let mut stopped = false;
        let upload = Upload::to("AXRTD8CO", move |number, text| match number {
            _ if stopped => Vec::new(),
            _ if number == held => {
                stopped = true;
                vec![(1_000, OFF)]
            }
            _ => with_ring(number, text),
        });
        let report = &upload.report;
        assert_eq!((report.verdict, report.unit), (Verdict::Failed, UnitNow::Loader), "{report:?}");
        assert!(report.what.contains("(XOFF) and did not let us go on"), "{report:?}");
        let since = upload.said.iter().rfind(|(_, text)| *text == OFF).expect("a hold").0;
        // What it is now is waited for two seconds more.
        assert_eq!(upload.end_behind(since), millis(limit) + 2_000, "{held}");
        assert_eq!(upload.others(), "", "who has stopped us is sent nothing");
        let told: Vec<u64> = upload.progress.iter().filter_map(|(_, at)| at.held).map(millis).collect();
        let seconds: Vec<u64> = (0..=millis(limit) / 1_000 + 2).map(|second| second * 1_000).collect();
        assert!(told.ends_with(&seconds), "{told:?}");
    }
}

#[test]
fn an_acknowledgement_that_is_missing_makes_all_begin_again_once_and_never_for_nobody() {
    // It is there and says so, but one record is not acknowledged: the second time round it is.
    let mut round = 0;
    let upload = Upload::to("AXRTD8CO", move |number, text| {
        round += usize::from(number == 0);
        if round == 1 && number == 8 { vec![(300, "*")] } else { with_ring(number, text) }
    });
    let [headers, data, ends] = upload.counts();
    assert_eq!((upload.report.verdict, headers, ends), (Verdict::Done, 2, 1), "{:?}", upload.report);
    let again = upload.sent.iter().rposition(|(number, _)| *number == 0).expect("a header");
    // Which record it was nobody can say: it shows before the end record, which never leaves before all is taken.
    assert_eq!((data, again), (40, 21), "nothing is left out of the second time");
    let waited = millis(upload.piece(again).let_go.since(upload.piece(again - 1).gone));
    assert!((990..=1_000).contains(&waited), "{waited}");
    // The second time round each is awaited alone.
    for (place, (_, piece)) in upload.sent.iter().enumerate().skip(again + 1) {
        assert!(piece.let_go > upload.piece(place - 1).gone, "{place}");
    }
    // The second time it is missing as well.
    let upload = Upload::to("AXRTD8CO", |number, text| match number {
        8 => vec![(300, "*")],
        _ => with_ring(number, text),
    });
    let report = &upload.report;
    assert_eq!((report.verdict, report.unit), (Verdict::Failed, UnitNow::Loader), "{report:?}");
    assert!(report.what.contains("has not acknowledged a record"), "{report:?}");
    assert_eq!(upload.counts()[0], 2, "{report:?}");
    assert_eq!(upload.others(), "\\r".repeat(516), "it is brought out of the record it may be in");
    // Its power has gone, behind a last sign or without one: at most the header leaves for nobody.
    for (last, headers) in [(vec![(300, "*")], 2), (Vec::new(), 1)] {
        let mut silent = false;
        let upload = Upload::to("AXRTD8CO", move |number, text| match number {
            _ if silent => Vec::new(),
            8 => {
                silent = true;
                last.clone()
            }
            _ => with_ring(number, text),
        });
        let report = &upload.report;
        assert_eq!((report.verdict, report.unit), (Verdict::Failed, UnitNow::Loader), "{report:?}");
        assert!(report.what.contains("fallen silent"), "{report:?}");
        assert_eq!(upload.counts()[0], headers, "{report:?}");
        let last = upload.sent.iter().rfind(|(_, piece)| piece.text.starts_with('S')).expect("a record");
        assert!(headers == 1 || last.1.text.starts_with("S0"), "{}", last.1.text);
        let told = upload.progress.last().expect("progress").1;
        assert_eq!(
            (report.records > 8, told.records, told.again),
            (true, 8, false),
            "what was taken was taken: {told:?}"
        );
    }
}

#[test]
fn a_page_is_awaited_where_it_is_full_and_only_there() {
    let upload = Upload::to("AXTC4CO", with_pages);
    assert_eq!((upload.report.verdict, upload.counts()), (Verdict::Done, [1, 20, 1]), "{:?}", upload.report);
    assert_eq!(upload.report.remark, None);
    let gaps: Vec<u64> = upload.sent.windows(2).map(|two| millis(two[1].1.gone.since(two[0].1.gone))).collect();
    // Behind the header it could be a ring, behind the 17th data a page is written, behind the last data one may be.
    let waits: Vec<usize> = (0..gaps.len()).filter(|at| gaps[*at] > 10).collect();
    assert_eq!(waits, [0, 17, 20], "{gaps:?}");
    assert!((115..130).contains(&gaps[0]) && (30..45).contains(&gaps[17]), "{gaps:?}");
    // A loader that holds nobody at all, and says nothing: it is watched for, and then believed.
    let upload = Upload::to("AXTC4CO", |_, text| if text.starts_with("S7") { started("AXTC4CO") } else { Vec::new() });
    assert_eq!((upload.report.verdict, upload.counts()), (Verdict::Done, [1, 20, 1]), "{:?}", upload.report);
    let gap = millis(upload.piece(18).let_go.since(upload.piece(17).gone));
    assert!((1_490..=1_500).contains(&gap), "a sign of life is awaited: {gap}");
    // One that shows a mark is there, so its hold gets no more time than a late adapter needs.
    let upload = Upload::to("AXTC4CO", |number, text| match number {
        1..=20 => vec![(500, ".")],
        _ => with_pages(number, text),
    });
    assert_eq!(upload.report.verdict, Verdict::Done, "{:?}", upload.report);
    let gap = millis(upload.piece(18).let_go.since(upload.piece(17).gone));
    assert!((290..=300).contains(&gap), "{gap}");
    // It is believed, and what has left counts as taken.
    assert_eq!(upload.report.remark, None);
    let told = upload.progress.iter().rfind(|(at, _)| *at == upload.piece(18).let_go).expect("progress").1;
    assert_eq!(told.records, 18, "{told:?}");
}

#[test]
fn pages_of_another_size_are_known_after_two_holds_and_told() {
    let remark = "the loader keeps pages of 128 words, and not of 256 as assumed";
    // It has a place for the record that comes too early.
    let upload = Upload::entered("AXTC4CO", 768, &[(50_000, WAITS)], &[], with_half_pages);
    assert_eq!((upload.report.verdict, upload.counts()), (Verdict::Done, [1, 48, 1]), "{:?}", upload.report);
    assert_eq!(upload.report.remark.as_deref(), Some(remark));
    let gaps: Vec<u64> = upload.sent.windows(2).map(|two| millis(two[1].1.gone.since(two[0].1.gone))).collect();
    let waits: Vec<usize> = (0..gaps.len()).filter(|at| gaps[*at] > 10).collect();
    // The ninth record is held, and so is every record up to the second hold that one size alone explains.
    let expected: Vec<usize> = [0].into_iter().chain(10..=25).chain([33, 41, 48]).collect();
    assert_eq!(waits, expected, "{gaps:?}");
    // It has none, and says so in one of two ways.
    for error in ["Error # 0005\r\nRestarting.\r\n", "Error # 0001\r\nRestarting.\r\n"] {
        let mut round = 0;
        let upload = Upload::to("AXTC4CO", move |number, text| {
            round += usize::from(number == 0);
            match (round, number) {
                (1, 9) => vec![(200, OFF)],
                (1, 10) => vec![(500, error), (300_000, WAITS)],
                _ => with_half_pages(number, text),
            }
        });
        assert_eq!((upload.report.verdict, upload.counts()), (Verdict::Done, [2, 30, 1]), "{:?}", upload.report);
        assert_eq!(upload.report.remark, Some(format!("{remark}; everything was sent twice")), "{error:?}");
    }
}

#[test]
fn a_loader_of_which_nothing_is_heard_gets_1280_words_and_no_more() {
    let upload = Upload::entered("AXTC4CO", 2048, &[(50_000, WAITS)], &[], |_, _| Vec::new());
    let report = &upload.report;
    assert_eq!((report.verdict, report.unit), (Verdict::Failed, UnitNow::Unknown), "{report:?}");
    assert!(report.what.contains("fallen silent"), "{report:?}");
    assert_eq!(upload.counts(), [1, 1280 / 16, 0]);
}

#[test]
fn an_xon_that_the_line_doubles_acknowledges_one_record() {
    // Counted twice, it would stand for the eighth record, which is lost.
    let mut round = 0;
    let upload = Upload::to("AXRTD8CO", move |number, text| {
        round += usize::from(number == 0);
        match (round, number) {
            (1, 5) => vec![(200, OFF), (1_500, ON), (1_600, ON)],
            (1, 8) => vec![(300, "*")],
            _ => with_ring(number, text),
        }
    });
    assert_eq!((upload.report.verdict, upload.counts()), (Verdict::Done, [2, 40, 1]), "{:?}", upload.report);
}

#[test]
fn a_hold_after_the_header_that_does_not_come_again_leaves_nothing_of_the_first_pass_in_the_report() {
    let mut round = 0;
    let upload = Upload::to("AXTC4CO", move |number, text| {
        round += usize::from(number == 0);
        match (round, number) {
            (1, 0) => vec![(1_000, OFF), (5_000, ON)],
            _ if text.starts_with("S7") => started("AXTC4CO"),
            _ => Vec::new(),
        }
    });
    let report = &upload.report;
    assert_eq!((report.verdict, upload.counts()), (Verdict::Done, [2, 21, 1]), "{report:?}");
    let told = upload.progress.last().expect("progress").1;
    assert_eq!((report.records, told.records, told.again), (22, 22, true), "{report:?}, {told:?}");
}

#[test]
fn what_a_loader_has_begun_to_say_before_a_stage_is_not_said_in_it() {
    // Before the first record: it names itself.
    let says = [(50_000, WAITS), (120_000, "Bootloa"), (140_000, "der V2.0.0\r\n")];
    let upload = Upload::entered("AXTC4CO", WORDS, &says, &[], with_pages);
    assert_eq!(upload.report.verdict, Verdict::Done, "{:?}", upload.report);
    // Before the end record: half a version.
    let upload = Upload::to("AXTC4CO", |number, text| match number {
        20 => vec![(100_000, "V1.")],
        _ if text.starts_with("S7") => vec![(1_000, "2.0 AXTC4CO\r\n")],
        _ => with_pages(number, text),
    });
    let report = &upload.report;
    assert_eq!((report.verdict, report.unit), (Verdict::Failed, UnitNow::Unknown), "{report:?}");
    assert_eq!(report.what, "the file was sent, but the unit has not come back");
    // A mark for the last record has no line end, and the banner is on its line.
    let upload = Upload::to("AXTC4CO", |number, text| match number {
        20 => vec![(500, ".")],
        _ if text.starts_with("S7") => vec![(40_000, "AXTC4CO V1.2.0\r\n")],
        _ => with_pages(number, text),
    });
    assert_eq!(upload.report.verdict, Verdict::Done, "{:?}", upload.report);
    // Before a failure: the rest of the complaint that has ended the upload is not what runs now.
    let upload = Upload::to("AXTC4CO", |number, text| match number {
        5 => vec![(0, "\r\nErr 6, version"), (150_000, " 1.2.0\r\n")],
        _ => with_pages(number, text),
    });
    let report = &upload.report;
    assert_eq!((report.verdict, report.unit), (Verdict::Failed, UnitNow::Unknown), "{report:?}");
    assert_eq!(report.what, "the loader complains: \"Err 6, version\"");
}

#[test]
fn a_hold_before_the_header_does_not_show_which_loader_it_is() {
    let says = [(50_000, WAITS), (60_000, OFF), (300_000, "\u{11}\u{13}"), (320_000, ON)];
    let upload = Upload::entered("AXTC4CO", WORDS, &says, &[], with_pages);
    assert_eq!((upload.report.verdict, upload.counts()), (Verdict::Done, [1, 20, 1]), "{:?}", upload.report);
    let gap = millis(upload.piece(1).let_go.since(upload.piece(0).gone));
    assert!((115..130).contains(&gap), "data waits for a ring's acknowledgement: {gap}");
}

#[test]
fn a_silent_loader_that_speaks_while_it_is_brought_out_of_a_record_gets_no_more_enters() {
    let upload = Upload::to("AXRTD8CO", |number, text| match number {
        _ if text.starts_with("S7") => Vec::new(),
        _ if text.starts_with('\r') => vec![(1_000, "\r\nAXRTD8CO V1.2.0\r\n")],
        _ => with_ring(number, text),
    });
    assert_eq!(upload.report.verdict, Verdict::Done, "{:?}", upload.report);
    // Two pieces of 64 have left when the first one is answered.
    assert_eq!(upload.others(), "\\r".repeat(128));
}

#[test]
fn a_loader_whose_pages_are_known_gets_no_record_behind_a_page_it_says_nothing_of() {
    // The first page is written as believed; behind the second, where the power goes, one more record would be for nobody.
    let upload = Upload::entered("AXTC4CO", 3 * 256, &[(50_000, WAITS)], &[], |number, text| match number {
        17 => with_pages(number, text),
        _ => Vec::new(),
    });
    let report = &upload.report;
    assert_eq!((report.verdict, report.unit), (Verdict::Failed, UnitNow::Loader), "{report:?}");
    assert!(report.what.contains("fallen silent") && report.remark.is_none(), "{report:?}");
    assert_eq!((upload.counts(), report.records), ([1, 33, 0], 34), "{report:?}");
    let last = upload.sent.last().expect("a record").1.gone;
    assert!((3_500..3_510).contains(&upload.end_behind(last)), "{}", upload.end_behind(last));
}

#[test]
fn who_was_too_fast_goes_slower_once_and_another_error_ends_it() {
    let overrun = |error: &'static str| vec![(500, error), (300_000, WAITS)];
    let mut round = 0;
    let upload = Upload::to("AXTC4CO", move |number, text| {
        round += usize::from(number == 0);
        match (round, number) {
            (1, 9) => overrun("Error # 0005\r\nRestarting.\r\n"),
            _ => with_pages(number, text),
        }
    });
    assert_eq!(upload.report.verdict, Verdict::Done, "{:?}", upload.report);
    let again = upload.sent.iter().rposition(|(number, _)| *number == 0).expect("a header");
    // Nothing leaves for a loader that restarts before it asks, and then each record is watched.
    assert!(millis(upload.piece(again).let_go.since(upload.piece(again - 1).gone)) >= 300);
    assert!(upload.sent.len() - again == 22 && again < 14, "at most what had been let go: {again}");
    let gaps = upload.sent[again..again + 20].windows(2).map(|two| millis(two[1].1.gone.since(two[0].1.gone)));
    assert!(gaps.clone().all(|gap| gap > 25), "{:?}", gaps.collect::<Vec<_>>());
    for (error, rounds) in [("Error # 0005\r\nRestarting.\r\n", 2), ("Error # 0004\r\nRestarting.\r\n", 1)] {
        let upload = Upload::to("AXTC4CO", |number, text| match number {
            9 => overrun(error),
            _ => with_pages(number, text),
        });
        let report = &upload.report;
        assert_eq!((report.verdict, report.unit), (Verdict::Failed, UnitNow::Loader), "{report:?}");
        assert_eq!((upload.counts()[0], upload.counts()[2]), (rounds, 0), "{report:?}");
        assert!(report.what.contains("the loader reports error"), "{report:?}");
    }
}

#[test]
fn words_among_the_records_are_heard_out_and_many_of_them_are_no_loaders() {
    // A word without a line end keeps the next record back; digits and damage do not.
    for (says, waits) in [("Schreibe", true), ("1234", false), ("\u{1}\u{2}", false), ("ab", false)] {
        let upload = Upload::to("AXTC4CO", move |number, text| match number {
            5 => vec![(0, says)],
            _ => with_pages(number, text),
        });
        let gaps: Vec<u64> =
            upload.sent[4..9].windows(2).map(|two| millis(two[1].1.gone.since(two[0].1.gone))).collect();
        assert_eq!(gaps.iter().any(|gap| *gap >= 95), waits, "{says:?}: {gaps:?}");
        assert_eq!(upload.report.verdict, Verdict::Done, "{says:?}: {:?}", upload.report);
    }
    // A line behind each record is a menu that takes them for keys; one for each page is a loader's way.
    let lines = |every: usize| {
        Upload::to("AXTC4CO", move |number, text| match number {
            1..=16 | 18..=20 if number.is_multiple_of(every) => vec![(100, "Unbekannter Befehl\r\n")],
            _ => with_pages(number, text),
        })
    };
    let upload = lines(1);
    let report = &upload.report;
    assert_eq!((report.verdict, report.unit), (Verdict::Failed, UnitNow::Unknown), "{report:?}");
    assert_eq!((report.what.as_str(), upload.counts()), ("what answers does not talk as a loader does", [1, 4, 0]));
    assert_eq!(upload.others(), "\\r", "whatever it has opened is left");
    assert_eq!(lines(5).report.verdict, Verdict::Done);
    // Records that left before the first of them do not count for it.
    let upload = Upload::entered("AXTC4CO", 768, &[(50_000, WAITS)], &[], |number, text| match number {
        20.. if text.starts_with("S3") => vec![(100, "Unbekannter Befehl\r\n")],
        _ => with_pages(number, text),
    });
    let report = &upload.report;
    assert_eq!((report.verdict, upload.counts()), (Verdict::Failed, [1, 23, 0]), "{report:?}");
    // Those of a pass that was too fast do not count in the next one.
    let mut round = 0;
    let upload = Upload::to("AXTC4CO", move |number, text| {
        round += usize::from(number == 0);
        match (round, number) {
            (1, 6..=8) | (2, 6) => vec![(100, "Unbekannter Befehl\r\n")],
            (1, 9) => vec![(500, "Error # 0005\r\nRestarting.\r\n"), (300_000, WAITS)],
            _ => with_pages(number, text),
        }
    });
    assert_eq!((upload.report.verdict, upload.counts()[0]), (Verdict::Done, 2), "{:?}", upload.report);
}

#[test]
fn a_complaint_in_any_words_stops_the_sender_within_one_record_and_is_quoted() {
    for says in [
        "\r\nTransfer aborted: reason 6\r\n",
        "\r\n*** Fehler 6\r\n",
        "07%\rVerify error at line 6, please retry\r\n",
        "\r\nInvalid record\r\n",
        // Nothing says that its line will end.
        "\r\nBad record",
        "\r\nErr 6",
    ] {
        let upload = Upload::to("AXTC4CO", move |number, _| if number == 5 { vec![(0, says)] } else { Vec::new() });
        let report = &upload.report;
        assert_eq!((report.verdict, report.unit), (Verdict::Failed, UnitNow::Unknown), "{says:?}: {report:?}");
        assert!(upload.counts()[1] <= 6, "{says:?}: {:?}", upload.counts());
        let quoted = says.trim().trim_start_matches("07%\r");
        assert_eq!(report.heard, quoted);
        assert_eq!(report.what, format!("the loader complains: \"{quoted}\""));
    }
    // One that says behind it that it waits again is believed.
    let upload = Upload::to("AXTC4CO", move |number, _| match number {
        5 => vec![(0, "\r\nTransfer aborted: reason 6\r\n"), (200_000, WAITS)],
        _ => Vec::new(),
    });
    let report = &upload.report;
    assert_eq!((report.verdict, report.unit), (Verdict::Failed, UnitNow::Loader), "{report:?}");
    assert!(report.what.contains("reason 6") && upload.counts()[1] <= 6, "{report:?}");
    // Even if what it says comes in pieces that are not lines.
    let upload = Upload::to("AXTC4CO", move |number, _| match number {
        5 => vec![(0, "\r\nTransfer aborted: reason 6\r\nWaiting for application S-Re"), (10_000, "cord.\r\n")],
        _ => Vec::new(),
    });
    let report = &upload.report;
    assert_eq!((report.verdict, report.unit), (Verdict::Failed, UnitNow::Loader), "{report:?}");
}

#[test]
fn a_unit_that_starts_anew_in_the_middle_of_the_file_is_told_with_its_version_and_not_called_unchanged() {
    let banner: Says = vec![(0, "\r\nAXTC4CO V1.1.0\r\n"), (5_000, "V - View Object Dictionary\r\n")];
    let menu: Says = vec![(0, "V - View Object Dictionary\r\n"), (90_000, "\r\nAXTC4CO V1.1.0\r\n")];
    for says in [banner, menu] {
        let upload = Upload::to("AXTC4CO", |number, _| if number == 5 { says.clone() } else { Vec::new() });
        let report = &upload.report;
        assert_eq!((report.verdict, report.unit), (Verdict::Failed, UnitNow::Application), "{report:?}");
        assert_eq!(report.what, "the unit left its loader in the middle of the file; it runs AXTC4CO V1.1.0 now");
        assert_eq!(report.version_after.map(|version| version.to_string()).as_deref(), Some("1.1.0"));
        let advice = report.advice();
        assert!(advice.contains("is not known: send the file again") && !advice.contains("nothing"), "{advice}");
        assert!(upload.counts()[1] <= 6, "{:?}", upload.counts());
    }
}

#[test]
fn behind_its_prompt_a_loader_is_let_finish_and_what_is_none_gets_no_record() {
    let entered = |says: &[(u64, &'static str)]| Upload::entered("AXTC4CO", WORDS, says, &[], with_pages);
    // It goes on printing: the header leaves when it has been silent for a moment.
    let upload = entered(&[(50_000, WAITS), (100_000, "(c) 2004\r\n"), (170_000, "ok\r\n")]);
    let (last, _) = upload.said[2];
    assert_eq!(upload.report.verdict, Verdict::Done, "{:?}", upload.report);
    let silence = millis(upload.piece(0).let_go.since(last));
    assert!((80..=82).contains(&silence), "{silence}");
    // It does not stop, or is none any more.
    let chatter: Vec<(u64, &'static str)> = (2..100).map(|number| (number * 50_000, "and so on\r\n")).collect();
    let talks = [&[(50_000, WAITS)], &chatter[..]].concat();
    let menu = [(50_000, WAITS), (90_000, "V - View Object Dictionary\r\n")];
    let asks = [(50_000, WAITS), (70_000, "\r\nPassword: ")];
    let table = [
        (&talks[..], UnitNow::Unknown, "does not stop talking", 3_000),
        (&menu, UnitNow::Application, "left its loader before the file was sent", 40),
        (&asks, UnitNow::Application, "left its loader before the file was sent", 80),
    ];
    for (says, unit, what, behind) in table {
        let upload = entered(says);
        let report = &upload.report;
        assert_eq!((report.verdict, report.unit, report.records), (Verdict::UnitRefused, unit, 0), "{report:?}");
        assert!(report.what.contains(what) && upload.sent.is_empty(), "{report:?}");
        let prompted = upload.said[0].0;
        assert!((behind..behind + 60).contains(&upload.end_behind(prompted)), "{}", upload.end_behind(prompted));
    }
}

#[test]
fn what_answers_the_password_is_taken_for_what_it_is() {
    // It is believed at once; where the unit may ask once more, that is waited for and left.
    for (says, within) in
        [("\r\nWrong password\r\n", 660), ("\r\nPassword: ", 660), ("\r\nV - View Object Dictionary\r\n", 60)]
    {
        let upload = Upload::entered("AXTC4CO", WORDS, &[(50_000, says)], &[], with_pages);
        let report = &upload.report;
        assert_eq!((report.verdict, report.unit), (Verdict::UnitRefused, UnitNow::Application), "{says:?}: {report:?}");
        assert_eq!(report.what, "the unit did not accept the password", "{says:?}");
        assert!(upload.sent.is_empty(), "{says:?}: {report:?}");
        assert!(upload.end_behind(upload.said[0].0) <= within, "{says:?}");
    }
    // A loader that wants a key gets it when it asks, a second behind its header, or in the end unasked; one that wants
    // none is left alone.
    let asked: Says = vec![(600_000, "\r\nHit any key\r\n")];
    let header: Says = vec![(50_000, "\r\n56F83xx Serial Bootloader v2.0\r\n")];
    for (product, says, at) in [
        ("AXRTD8CO", &asked, Some(600)),
        ("AXRTD8CO", &header, Some(1_050)),
        ("AXRTD8CO", &Vec::new(), Some(3_000)),
        ("AXTC4CO", &asked, Some(600)),
        ("AXTC4CO", &header, None),
    ] {
        let loader = |number: usize, text: &str| {
            if product == "AXTC4CO" { with_pages(number, text) } else { with_ring(number, text) }
        };
        let upload = Upload::entered(product, WORDS, says, &[(20_000, WAITS)], loader);
        let first = upload.keys.first().map(|(at, _)| (at + 5) / 10 * 10).filter(|at| *at < 8_000);
        assert_eq!(first, at, "{product}, {says:?}: {:?}", upload.keys);
        assert!(at.is_none() || upload.keys == [(upload.keys[0].0, "\r".to_owned())], "{:?}", upload.keys);
        assert!(at.is_none() || upload.report.verdict == Verdict::Done, "{:?}", upload.report);
    }
}
