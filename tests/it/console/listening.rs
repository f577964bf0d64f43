//! What the console makes of what it has not asked for: pages that a hand has switched on, and recordings of all that.

use axcon::record::{Direction, Entry};

use super::*;

/// S typed by hand on the terminal screen, and then another screen.
fn by_hand(desk: &mut Desk, keys: &str) {
    desk.keys("3");
    for key in keys.chars() {
        match key {
            '\r' => desk.press(KeyCode::Enter),
            key => desk.keys(&key.to_string()),
        };
        desk.run(Duration::from_millis(200));
    }
    desk.key(KeyCode::Char(']'), KeyModifiers::CONTROL).keys("7");
}

/// What a line of the overview says.
fn overview(desk: &mut Desk, label: &str) -> String {
    desk.keys("2");
    let picture = desk.drawn();
    let line = picture.lines().find(|line| line.contains(label)).expect("the line");
    line.split(label).nth(1).expect("what it says").trim().to_owned()
}

#[test]
fn pages_that_a_hand_has_switched_on_are_shown_and_s_stops_them() {
    let mut desk = Desk::new();
    by_hand(&mut desk, "s");
    desk.run(Duration::from_millis(4_300));
    let shown = desk.picture();
    assert!(shown.contains("page 5") && shown.contains("running, S stops them"), "{shown}");
    assert!(shown.contains("Supply Voltage"), "{shown}");
    by_hand(&mut desk, "tp1000\r");
    desk.run(Duration::from_secs(30));
    let shown = desk.picture();
    assert!(shown.contains("running, S stops them") && !shown.contains("RS-232 stream"), "{shown}");
    assert_eq!(overview(&mut desk, "Other text"), "none");
    desk.sent.clear();
    desk.keys("7s");
    desk.wait_for("The diagnostics are off.");
    assert_eq!(desk.sent, b"s", "once");
    assert!(desk.picture().contains(", stopped"), "{}", desk.picture());
    let page = |desk: &Desk| desk.drawn().lines().find(|line| line.contains("page ")).map(str::to_owned);
    let before = page(&desk);
    desk.run(Duration::from_secs(5));
    assert_eq!(page(&desk), before, "no more come");
    // Asked for by the key of the screen they are the job's.
    desk.keys("s");
    desk.wait_for("S stops");
}

#[test]
fn s_ends_pages_that_a_hand_has_switched_on_from_any_screen() {
    let mut desk = Desk::new();
    by_hand(&mut desk, "s");
    desk.run(Duration::from_secs(3)).keys("2").sent.clear();
    desk.keys("s");
    desk.wait_for("The diagnostics are off.");
    assert_eq!(desk.sent, b"s");
}

#[test]
fn pages_that_another_console_has_left_on_are_shown_and_stopped() {
    let mut desk = Desk::new();
    desk.keys("s");
    desk.wait_for("page 2");
    desk.started_again().keys("7");
    assert!(desk.picture().contains("running, S stops them"), "{}", desk.picture());
    desk.keys("s");
    desk.wait_for("The diagnostics are off.");
}

#[test]
fn pages_that_go_on_after_a_lost_link_are_shown_as_running() {
    let mut desk = Desk::on_cable();
    desk.keys("s");
    desk.wait_for("page 3");
    desk.pull();
    let lost = desk.picture();
    assert!(lost.contains("The link was lost, reading the diagnostics.") && lost.contains(", link lost"), "{lost}");
    desk.plug_in();
    assert!(desk.picture().contains("running, S stops them"), "{}", desk.picture());
    desk.keys("s");
    desk.wait_for("The diagnostics are off.");
}

#[test]
fn pages_of_a_unit_that_has_restarted_after_a_lost_link_are_stopped() {
    let mut desk = Desk::on_cable();
    desk.keys("s");
    desk.wait_for("page 3");
    desk.pull();
    let now = desk.now;
    desk.unit.unit_mut().power_off(now);
    desk.run(Duration::from_secs(1));
    let now = desk.now;
    desk.unit.unit_mut().power_on(now);
    desk.run(Duration::from_secs(5)).plug_in();
    assert!(desk.picture().contains(", stopped"), "{}", desk.picture());
    desk.keys("s");
    desk.wait_for("S stops");
}

/// A console that plays what another one has recorded, with its remarks, up to `after` the last byte.
fn replayed(record: &[Entry], marks: &[(Instant, &str)], after: Duration) -> Desk {
    let mut desk = Desk::new();
    desk.app = console(EMULATED);
    desk.now = Instant::ZERO;
    let mut effects = desk.app.start();
    effects.retain(|effect| !matches!(effect, Effect::OpenLink(_)));
    desk.perform(effects);
    desk.input(Input::LinkOpened(LinkInfo {
        link: "replay:talk.cast".into(),
        baud: BAUD,
        kind: LinkKind::Recording,
        noted: None,
        recording: None,
        start_of_day: Duration::ZERO,
        start_millis: 0,
    }));
    let end = record.last().map_or(Instant::ZERO, |entry| entry.at) + after;
    let bytes = record.iter().map(|entry| {
        let input = match entry.direction {
            Direction::ToUnit => Input::Sent(entry.bytes.clone()),
            Direction::FromUnit => Input::Bytes(entry.bytes.clone()),
        };
        (entry.at, input)
    });
    let mut inputs: Vec<_> = bytes.chain(marks.iter().map(|(at, text)| (*at, Input::Mark((*text).into())))).collect();
    inputs.sort_by_key(|(at, _)| *at);
    inputs.push((end, Input::RecordingOver(None)));
    for (at, input) in inputs {
        while let Some(due) = desk.app.poll_timeout().filter(|due| *due <= at) {
            desk.now = due.max(desk.now);
            desk.input(Input::Timeout);
        }
        desk.now = at;
        desk.input(input);
    }
    desk
}

fn recorded(desk: &Desk) -> Vec<Entry> {
    desk.app.record().entries().cloned().collect()
}

#[test]
fn a_recording_of_a_reading_that_was_broken_off_shows_it_as_such_with_its_own_time() {
    let mut desk = Desk::on_cable();
    desk.run(Duration::from_secs(20)).keys("v").press(KeyCode::Enter).run(Duration::from_secs(1));
    let lost = desk.now;
    desk.pull();
    let record = recorded(&desk);
    let mut replay = replayed(&record, &[(lost, "link lost")], Duration::from_secs(600));
    replay.keys("5");
    let shown = replay.picture();
    assert!(shown.contains("incomplete: ") && shown.contains("00:00:31"), "{shown}");
    replay.press(KeyCode::End);
    let shown = replay.picture();
    assert!(shown.contains("not read: the reading was not completed"), "{shown}");
    assert!(!shown.contains("not shown by the unit"), "{shown}");
    // Without the remark it ends with the recording, and is of the same time.
    let mut replay = replayed(&record, &[], Duration::from_secs(600));
    replay.keys("5");
    let shown = replay.picture();
    assert!(shown.contains("incomplete: ") && shown.contains("00:00:31"), "{shown}");
}

#[test]
fn a_recording_shows_pages_that_a_hand_has_switched_on_and_no_dialogue_as_one() {
    let mut desk = Desk::new();
    by_hand(&mut desk, "s");
    desk.run(Duration::from_secs(3));
    by_hand(&mut desk, "tp1000\r");
    desk.run(Duration::from_millis(100));
    let mut replay = replayed(&recorded(&desk), &[], Duration::from_secs(1));
    replay.keys("7");
    let shown = replay.picture();
    assert!(shown.contains("Supply Voltage") && !shown.contains("RS-232 stream"), "{shown}");
    assert_eq!(overview(&mut replay, "Other text"), "none");
}

#[test]
fn a_recording_of_a_lost_link_does_not_say_that_the_stream_is_off() {
    let mut desk = Desk::on_cable();
    desk.keys("t500").press(KeyCode::Enter);
    desk.wait_for("every 500 ms");
    desk.run(Duration::from_secs(3));
    let lost = desk.now;
    desk.pull();
    let mut replay = replayed(&recorded(&desk), &[(lost, "link lost")], Duration::from_secs(60));
    assert_eq!(overview(&mut replay, "Stream      "), "no row so far");
}
