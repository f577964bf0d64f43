//! Walks through the object dictionary: what counts as an entry, what ends a walk, and how the view is left.

use axcon::session::DictionaryReading;

use super::*;

type Script<'a> = &'a [(&'static str, u64, &'static str)];

/// A walk that is over.
struct Walk {
    outcome: Outcome,
    /// Milliseconds to the end.
    time: u64,
    /// Everything that was sent, with times.
    log: String,
    /// How many entries were told of, each time.
    told: Vec<usize>,
}

impl Walk {
    /// Through a unit of which nothing has been heard before.
    fn through(script: Script<'_>) -> Self {
        Walk::after("", script)
    }

    /// Through one that has said this before.
    fn after(said: &str, script: Script<'_>) -> Self {
        let mut alone = Alone::with(script);
        alone.session.handle_bytes(alone.now, said.as_bytes());
        alone.session.command(alone.now, Command::ReadDictionary).expect("it is free");
        let (mut told, mut ended) = (Vec::new(), None);
        while ended.is_none() {
            alone.step();
            while let Some(event) = alone.session.poll_event() {
                match event {
                    Event::EntriesRead(entries) => told.push(entries),
                    Event::Finished(outcome) => ended = Some(outcome),
                    _ => {}
                }
            }
        }
        Walk { outcome: ended.expect("it has ended"), time: at(alone.now), log: alone.log(), told }
    }

    fn reading(&self) -> &DictionaryReading {
        match &self.outcome {
            Outcome::DictionaryRead(reading) => reading,
            other => panic!("{other:?}: {}", self.log),
        }
    }

    /// The entries that were read, as printed.
    fn entries(&self) -> String {
        let entries = self.reading().entries.iter().map(|entry| format!("{} {}", entry.at, entry.text));
        entries.collect::<Vec<_>>().join(", ")
    }
}

/// A menu of three entries, which does not say whose it is.
const NAMELESS: &str = "V - View\r\nT - Toggle Stream\r\nL - Load\r\n";

#[test]
fn entries_without_line_ends_count_once_they_stand_still() {
    let walk = Walk::through(&[
        ("v", 5, "6126h:01 TC1 = 16.000"),
        ("~", 5, "\r\n6126h:02 TC2 = 17.000"),
        // Nothing more comes, and the menu shows that the view has been left.
        ("x", 5, MENU),
    ]);
    assert_eq!(walk.entries(), "6126:01 TC1 = 16.000, 6126:02 TC2 = 17.000");
    assert_eq!(walk.reading().end, WalkEnd::Stopped);
    // 1,200 for the beginning of an answer, and 400 in which it does not change.
    assert_eq!((walk.log.as_str(), walk.time), ("0:v 1600:~ 3200:~ 4400:~ 5600:~ 6800:x", 6_800 + 5 + 120));
    assert_eq!(walk.told, [1, 2, 2, 2]);
}

#[test]
fn half_an_entry_waits_for_its_rest_where_the_unit_ends_its_lines() {
    let walk = Walk::through(&[
        ("v", 5, "6126h:01 TC1 = 16.000\r\n"),
        ("~", 5, "6126h:02 TC2 = 17.000\r\n"),
        ("~", 5, "6126h:03 TC3 = 1"),
        ("", 3_000, "8.000\r\n"),
        // The rest of this one never comes.
        ("~", 5, "6126h:04 TC4 = 1"),
        ("x", 5, MENU),
    ]);
    assert_eq!(walk.entries(), "6126:01 TC1 = 16.000, 6126:02 TC2 = 17.000, 6126:03 TC3 = 18.000");
    assert_eq!(walk.log, "0:v 125:~ 250:~ 3370:~ 7370:~ 8570:~ 9770:x", "four seconds at most");
    assert_eq!(walk.told, [1, 2, 3, 3, 3]);
}

#[test]
fn what_was_taken_for_an_entry_is_taken_back_once_the_unit_is_seen_to_end_its_lines() {
    let walk = Walk::through(&[
        ("v", 5, "6126h:01 TC1 = 1"),
        ("~", 5, "6126h:02 TC2 = 17.000\r\n"),
        ("~", 5, "6126h:03 TC3 = 18.000\r\n"),
        ("x", 5, MENU),
    ]);
    assert_eq!(walk.entries(), "6126:02 TC2 = 17.000, 6126:03 TC3 = 18.000", "{}", walk.log);
    assert_eq!(walk.told[..3], [1, 2, 2], "the half, the second entry, and the third instead of the half");
}

#[test]
fn an_object_goes_on_after_a_prompt_that_is_known_and_not_after_what_may_be_half_a_line() {
    let entries = |prompt: &str| {
        let said = |lines: &str| -> &'static str { format!("\r\n{lines}\r\n{prompt}").leak() };
        let walk = Walk::through(&[
            ("v", 5, said("6110h Sensor Type\r\n  01h TC1 = 10")),
            ("~", 5, said("6126h Scaling Factor\r\n  01h TC1 = 16.000")),
            ("~", 5, said("  02h TC2 = 17.000")),
            ("x", 5, MENU),
        ]);
        walk.entries()
    };
    let before = "6110:01 TC1 = 10, 6126:01 TC1 = 16.000";
    assert_eq!(entries("Key: "), format!("{before}, 6126:02 TC2 = 17.000"));
    assert_eq!(entries("ok? "), before, "two letters are in any half of a line");
}

#[test]
fn a_walk_without_a_single_entry_is_given_up_after_three_answers() {
    let walk = Walk::through(&[
        ("v", 5, "one 1\r\n"),
        ("~", 5, "two 2\r\n"),
        ("~", 5, "three 3\r\n"),
        ("~", 5, "four 4\r\n"),
        ("x", 5, MENU),
    ]);
    assert!(matches!(walk.outcome, Outcome::NoAnswer { awaited: Awaited::Entry, .. }), "{:?}", walk.outcome);
    assert_eq!((walk.log.as_str(), walk.time), ("0:v 125:~ 250:~ 375:~ 500:x", 500 + 5 + 120));
}

#[test]
fn a_menu_of_three_entries_ends_a_walk_and_so_does_one_that_is_shown_twice() {
    let twice: &'static str = NAMELESS.repeat(2).leak();
    for menu in [NAMELESS, twice] {
        let walk = Walk::through(&[("v", 5, "6126h:01 TC1 = 16.000\r\n"), ("~", 5, menu)]);
        assert_eq!((walk.entries().as_str(), &walk.reading().end), ("6126:01 TC1 = 16.000", &WalkEnd::Whole));
        assert_eq!((walk.log.as_str(), walk.time), ("0:v 125:~", 125 + 5 + 120), "{menu:?}");
    }
}

#[test]
fn a_question_instead_of_the_view_is_left_and_gets_nothing_else() {
    let walk = Walk::through(&[("v", 5, "Password: "), ("m", 5, MENU)]);
    assert!(matches!(walk.outcome, Outcome::NoAnswer { awaited: Awaited::Dictionary, .. }), "{:?}", walk.outcome);
    assert_eq!((walk.log.as_str(), walk.time), ("0:v 65:~ 65:x 185:m", 185 + 5 + 120));
}

#[test]
fn a_walk_that_is_cancelled_gives_what_it_has_read_or_nothing() {
    let cancelled = |script: Script<'_>, after: &str| {
        let mut alone = Alone::with(script);
        alone.session.command(alone.now, Command::ReadDictionary).expect("it is free");
        alone.take_sent(Instant::ZERO);
        while !alone.log().ends_with(after) {
            alone.step();
            alone.take_sent(Instant::ZERO);
        }
        alone.session.command(alone.now, Command::Cancel).expect("always");
        let (outcome, time) = alone.end(Instant::ZERO);
        (outcome, alone.log(), time)
    };
    let (outcome, log, time) = cancelled(&[("x", 5, MENU)], ":v");
    assert_eq!((outcome, log.as_str(), time), (Outcome::Cancelled(Job::ReadDictionary), "0:v 0:x", 125));
    let (outcome, log, time) = cancelled(&[("v", 5, "6126h:01 TC1 = 16.000\r\n"), ("x", 5, MENU)], ":~");
    let Outcome::DictionaryRead(reading) = outcome else { panic!("{outcome:?}") };
    assert_eq!((reading.entries.len(), reading.end), (1, WalkEnd::Cancelled));
    assert_eq!((log.as_str(), time), ("0:v 125:~ 125:x", 250));
}

/// Every entry of a product, as a unit may show it that has no value for any.
fn lines_of(product: &str) -> Vec<String> {
    let product = Product::named(product).expect("it is known");
    product.dictionary.entries().map(|(at, _, _)| format!("{:04X}h:{:02X} = ----\r\n", at.index, at.sub)).collect()
}

#[test]
fn a_few_entries_that_are_missing_are_looked_for_in_a_second_walk_and_many_are_not() {
    let named = "AXTC4CO V1.1.0\r\n";
    let lines = lines_of("AXTC4CO");
    let all = lines.len();
    let (lost, rest) = lines.split_at(all / 20);
    let rest: &'static str = rest.concat().leak();
    // The line has lost the heading of this one: it does not belong to the object that came last the first time.
    let second: &'static str = format!("  01h TC1 = 77\r\n{}", lost.concat()).leak();
    let walk = Walk::after(named, &[("v", 5, rest), ("~", 5, NAMELESS), ("v", 5, second), ("~", 5, NAMELESS)]);
    assert_eq!((walk.log.as_str(), walk.time), ("0:v 125:~ 250:v 375:~", 500));
    let reading = walk.reading();
    assert_eq!((reading.entries.len(), &reading.end, reading.unrecognised_lines), (all, &WalkEnd::Whole, 1));
    let other = reading.entries.iter().find(|entry| entry.text != "= ----");
    assert!(other.is_none(), "{other:?}");
    assert_eq!(walk.told, [all - lost.len(), all]);
    // One that repaints for ever is pressed Enter three times more than the first time.
    let one = "1000h:00 = ----\r\n";
    let walk = Walk::after(
        named,
        &[
            ("v", 5, rest),
            ("~", 5, NAMELESS),
            ("v", 5, rest),
            ("~", 5, one),
            ("~", 5, one),
            ("~", 5, one),
            ("~", 5, one),
            ("x", 5, NAMELESS),
        ],
    );
    assert_eq!(walk.log, "0:v 125:~ 250:v 375:~ 500:~ 625:~ 750:~ 875:x");
    // Other software may lack as much as this.
    let half: &'static str = lines[..all / 2].concat().leak();
    let walk = Walk::after(named, &[("v", 5, half), ("~", 5, NAMELESS)]);
    assert_eq!((walk.log.as_str(), walk.reading().entries.len()), ("0:v 125:~", all / 2));
}
