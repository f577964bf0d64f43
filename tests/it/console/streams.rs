//! The stream on its screen: switched on, charted, marked, written to a file.

use super::*;

#[test]
fn a_stream_is_charted_held_marked_and_recorded_to_a_file() {
    let mut desk = Desk::new();
    desk.keys("6t200").press(KeyCode::Enter);
    desk.wait_for("every 200 ms");
    desk.run(Duration::from_secs(30)).press(KeyCode::Down);
    assert!(desk.picture().contains("Curve of TC1") && desk.picture().contains("1 minute, 0:"));
    desk.keys("e").key(KeyCode::Char('u'), KeyModifiers::CONTROL).keys("rows.csv").press(KeyCode::Enter);
    desk.run(Duration::from_secs(10)).keys("k");
    assert_eq!(desk.marks, ["mark 1"]);
    let told = desk.picture();
    assert!(told.contains("Mark 1 is set at ") && told.contains(", in chart and file."), "{told}");
    desk.press(KeyCode::Left).press(KeyCode::Left);
    let held = desk.picture();
    assert!(held.contains("held, End follows again"), "{held}");
    let chart =
        |picture: &str| picture.lines().skip_while(|line| !line.contains("Curve of")).collect::<Vec<_>>().join("\n");
    desk.run(Duration::from_secs(5));
    assert_eq!(chart(&desk.picture()), chart(&held), "a held picture stands still");
    desk.press(KeyCode::End).keys("e");
    assert!(desk.picture().contains("rows are in rows.csv"), "{}", desk.picture());
    let text = String::from_utf8(desk.files[Path::new("rows.csv")].clone()).expect("text");
    let lines: Vec<&str> = text.lines().collect();
    assert_eq!(lines[0], "time,source,CJ,TC1,TC2,TC3,TC4");
    // 30 s before, 15 s after its beginning.
    assert!((215..235).contains(&lines.len()), "{} lines", lines.len());
    let is_row = |line: &&str| line.contains("Z,fv,") || line.ends_with("Z,mark 1,,,,,");
    assert!(lines[1..].iter().all(|line| is_row(line) && line.split(',').count() == 7), "{text}");
    assert_eq!(lines.iter().filter(|line| line.contains("mark")).count(), 1, "{text}");
    assert!(lines[1..].windows(2).all(|pair| pair[0] < pair[1]), "in the order of time");
    let rows = lines.len();
    desk.run(Duration::from_secs(5));
    assert_eq!(desk.files[Path::new("rows.csv")].split(|&byte| byte == b'\n').count(), rows + 1, "it has ended");
}

#[test]
fn a_mark_goes_to_the_cursor_and_a_lost_link_into_the_file_of_rows() {
    let mut desk = Desk::on_cable();
    desk.keys("6t1000").press(KeyCode::Enter);
    desk.wait_for("every 1 s");
    desk.run(Duration::from_secs(70)).keys("ke").key(KeyCode::Char('u'), KeyModifiers::CONTROL);
    desk.keys("rows.csv").press(KeyCode::Enter);
    // A minute has sixty steps.
    for _ in 0..30 {
        desk.press(KeyCode::Left);
    }
    desk.keys("k").pull().plug_in().run(Duration::from_secs(3));
    let (first, second) = desk.marks[1].split_once(", ").expect("a mark of before");
    assert_eq!((desk.marks[0].as_str(), first), ("mark 1", "mark 2"));
    let before: f64 = second.strip_suffix(" s before").and_then(|seconds| seconds.parse().ok()).expect("seconds");
    assert!((28.0..36.0).contains(&before), "{before}");
    let text = String::from_utf8(desk.files[Path::new("rows.csv")].clone()).expect("text");
    let words: Vec<&str> = text.lines().filter_map(|line| line.strip_suffix(",,,,,")?.split(',').nth(1)).collect();
    assert_eq!(words, ["mark 1", "mark 2", "link lost", "link back"]);
    let moment = |word: &str| text.lines().find(|line| line.contains(word)).expect(word).to_owned();
    assert!(moment("mark 2") < moment("mark 1"), "it lies before: {text}");
}

#[test]
fn the_stream_is_suggested_as_it_was_and_a_change_of_source_says_what_it_costs() {
    let mut desk = Desk::on_cable();
    desk.keys("t20000").press(KeyCode::Enter);
    desk.wait_for("every 20 s");
    desk.run(Duration::from_secs(45)).pull().input(Input::LinkBack(CABLE.into()));
    desk.run(Duration::from_secs(5)).keys("6");
    let told = desk.picture();
    assert!(told.contains("No row since the unit came back") && !told.contains("The stream is off"), "{told}");
    desk.keys("t");
    let asked = desk.picture();
    assert!(asked.contains("› 20000") && !asked.contains("screens restart"), "{asked}");
    desk.keys("p");
    assert!(desk.picture().contains("The screens restart with it: 2 rows"), "{}", desk.picture());
    desk.press(KeyCode::Esc).run(Duration::from_secs(20));
    assert!(desk.picture().contains("every 20 s") && !desk.picture().contains("No row"), "{}", desk.picture());
}

#[test]
fn a_period_the_line_cannot_carry_is_named_before_it_is_set() {
    let mut desk = Desk::new();
    desk.keys("t3");
    assert!(desk.picture().contains("the line carries one every 4 ms"), "{}", desk.picture());
    desk.press(KeyCode::Backspace).keys("4");
    assert!(!desk.picture().contains("the line carries"), "{}", desk.picture());
}
