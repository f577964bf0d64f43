//! Uploads: the way into the loader, and what comes back after the end record.

use axcon::device::longest_erase;
use axcon::secret::Secret;
use axcon::session::{LoadOrder, Phase, Proof, UnitNow, UnitState};
use axcon::version::Version;

use super::*;
use crate::support::bench::{image_of, nameless_image};

#[test]
fn a_loader_that_wants_a_key_gets_three_and_then_is_asked_who_it_is() {
    let script = [("\u{11}m", 3, MENU), ("l", 5, "Password: ")];
    let mut alone = Alone::with(&script);
    let (outcome, time) = alone.ask(Command::Load(Box::new(order(small_image("AXRTD8CO", "1.2.0")))));
    let Outcome::Loaded(report) = outcome else { panic!("{outcome:?}") };
    assert_eq!((report.verdict, report.unit), (Verdict::UnitRefused, UnitNow::Unknown), "{report:?}");
    assert_eq!(report.what, "the password was sent, but no loader asks for the file");
    assert_eq!(report.heard, "Password:", "what was heard last");
    let begun = alone.sent.iter().find(|(_, text)| text == "AXIO-2010").expect("the password").0;
    let behind: Vec<(u64, &str)> =
        alone.sent.iter().map(|(at, text)| (at.saturating_sub(begun), text.as_str())).skip(4).collect();
    let wanted = [(3_000, "~"), (4_000, "~"), (5_000, "~"), (8_000, "\u{11}m"), (8_800, "~m"), (9_600, "xm")];
    let rounded: Vec<(u64, &str)> = behind.iter().map(|(at, text)| ((at + 20) / 100 * 100, *text)).collect();
    assert_eq!(rounded, wanted, "{}", alone.log());
    assert_eq!((time - begun + 20) / 100 * 100, 10_400);
}

#[test]
fn the_password_is_asked_for_in_many_words_and_sent_when_the_question_is_complete() {
    for asks in ["Please enter the access code (case sensitive): ", "Code: ", "lPW:", "PIN > ", "Password: "] {
        let (report, alone) = upload_behind(&[("l", 5, asks)]);
        assert!(report.password_sent && password_at(&alone).is_some_and(|at| at < 100), "{asks:?}: {}", alone.log());
    }
    // In pieces, and without a sign at its end.
    let pieces = [("l", 5, "Pass"), ("", 305, "word"), ("", 605, ": ")];
    let (_, alone) = upload_behind(&pieces);
    assert!(password_at(&alone).is_some_and(|at| (665..700).contains(&at)), "{}", alone.log());
    let (_, alone) = upload_behind(&[("l", 5, "Enter password")]);
    assert!(password_at(&alone).is_some_and(|at| (565..600).contains(&at)), "{}", alone.log());
}

#[test]
fn a_question_behind_l_that_is_not_understood_is_quoted_and_gets_no_password() {
    for (script, heard, what) in [
        (&[("l", 5, "Parole bitte: ")][..], "Parole bitte:", "the unit asks something that is not understood"),
        (&[("l", 5, "Das Zauberwort\r\n> ")], "Das Zauberwort", "the unit does not ask for its password in words"),
        (
            &[("l", 5, "Load new software? Enter Yes: ")],
            "Load new software? Enter Yes:",
            "the unit asks for something other than the password",
        ),
    ] {
        let (report, alone) = upload_behind(script);
        assert_eq!((report.verdict, report.unit), (Verdict::NoAnswer, UnitNow::Application), "{report:?}");
        assert_eq!((report.heard.as_str(), report.password_sent), (heard, false), "{report:?}");
        assert!(report.what.starts_with(what), "{report:?}");
        assert!(!report.advice().contains("check the password"), "{}", report.advice());
        assert_eq!((password_at(&alone), alone.sent.last().map(|(_, text)| text.as_str())), (None, Some("~")));
    }
    let (report, _) = upload_behind(&[]);
    assert_eq!((report.verdict, report.heard.as_str()), (Verdict::UnitRefused, ""), "no old line: {report:?}");
}

#[test]
fn an_upload_that_turns_back_leaves_every_question_the_unit_asks() {
    const OTHER: (&str, u64, &str) = ("l", 5, "Load new software? Enter Yes: ");
    const PASSWORD: (&str, u64, &str) = ("l", 5, "Password: ");
    type Script = &'static [(&'static str, u64, &'static str)];
    let table: [(Script, Verdict, &str); 5] = [
        (&[OTHER], Verdict::NoAnswer, "l ~"),
        (&[OTHER, ("~", 300, "\r\nSure? ")], Verdict::NoAnswer, "l ~ ~"),
        (&[PASSWORD, ("AXIO-2010", 40, "\r\nWrong password\r\n")], Verdict::UnitRefused, "l AXIO-2010 ~ ~"),
        (
            &[PASSWORD, ("AXIO-2010", 40, "\r\nPassword: "), ("~", 0, ""), ("~", 5, "\r\nOnce more: ")],
            Verdict::UnitRefused,
            "l AXIO-2010 ~ ~ ~",
        ),
        // Known again by its own words.
        (
            &[
                ("l", 5, "Authorisation code: "),
                ("AXIO-2010", 40, "\r\nsorry\r\nauthorisation code (attempt 2 of 3): "),
            ],
            Verdict::UnitRefused,
            "l AXIO-2010 ~ ~",
        ),
    ];
    for (script, verdict, sent) in table {
        let (report, alone) = upload_behind(script);
        assert_eq!((report.verdict, report.unit), (verdict, UnitNow::Application), "{report:?}");
        let from_l = alone.sent.iter().map(|(_, text)| text.as_str()).skip_while(|text| *text != "l");
        assert_eq!(from_l.collect::<Vec<_>>().join(" "), sent);
    }
    // What came of it is quoted, and not only that the password was wrong.
    let locked =
        [PASSWORD, ("AXIO-2010", 40, "\r\nWrong password\r\nPassword: "), ("~", 0, ""), ("~", 5, "\r\nLocked.\r\n")];
    let (report, _) = upload_behind(&locked);
    assert_eq!((report.what.as_str(), report.heard.as_str()), ("the unit did not accept the password", "Locked."));
}

#[test]
fn a_password_that_is_the_word_with_which_it_is_refused_is_refused_at_once_and_still_recorded_nowhere() {
    let script = [("\u{11}m", 3, MENU), ("l", 5, "Password: "), ("wrong", 40, "\r\nWrong password.\r\n")];
    for (password, what) in [
        ("wrong", "the unit did not accept the password"),
        // Stars alone are the echo.
        ("wrongs", "the unit did not accept the password"),
    ] {
        let mut alone = Alone::with(&script);
        let order =
            LoadOrder { password: Some(Secret::new(password.into())), ..order(small_image("AXRTD8CO", "1.2.0")) };
        let (outcome, time) = alone.ask(Command::Load(Box::new(order)));
        let Outcome::Loaded(report) = outcome else { panic!("{outcome:?}") };
        assert_eq!((report.verdict, report.what.as_str()), (Verdict::UnitRefused, what), "{password}");
        assert!(time < 2_500, "{password}: {time}");
        let is_secret = !recorded(&alone.session).to_lowercase().contains(&format!("{password}\r"));
        assert!(is_secret && !report.heard.to_lowercase().contains(&format!(" {password}")), "{password}: {report:?}");
    }
    let echoes = [("\u{11}m", 3, MENU), ("l", 5, "Password: "), ("wrong", 40, "*****\r\n")];
    let mut alone = Alone::with(&echoes);
    let order = LoadOrder { password: Some(Secret::new("wrong".into())), ..order(small_image("AXRTD8CO", "1.2.0")) };
    let (Outcome::Loaded(report), _) = alone.ask(Command::Load(Box::new(order))) else { panic!("{}", alone.log()) };
    assert_eq!(report.what, "the password was sent, but no loader asks for the file", "the echo is no refusal");
}

#[test]
fn what_a_unit_says_where_it_does_not_echo_is_recorded_and_quoted_as_it_says_it() {
    let record = |alone: &Alone| {
        let bytes: Vec<u8> = alone.session.record().entries().flat_map(|entry| entry.bytes.clone()).collect();
        bytes.escape_ascii().to_string()
    };
    let (report, alone) = upload_behind(&[("l", 5, "Password: "), ("AXIO", 5, "Password wrong\r\n")]);
    assert_eq!((report.verdict, report.heard.as_str()), (Verdict::UnitRefused, "Password wrong"), "{report:?}");
    assert!(record(&alone).contains("Password: *********\\rPassword wrong\\r\\n"), "{}", record(&alone));
    let accepted = [("l", 5, "Password: "), ("AXIO", 5, "Password AXIO-2010 accepted\r\n")];
    let (_, alone) = upload_behind(&accepted);
    assert!(record(&alone).contains("Password ********* accepted"), "{}", record(&alone));
    assert!(!record(&alone).contains("AXIO"), "{}", record(&alone));
}

/// Uploads to a loader that stops nobody and says this behind the end record. Gives the report, the milliseconds from
/// the end record on, and what was sent behind it.
fn end_of_an_upload(
    behind: &[(u64, &'static str)],
    asked: &[(&'static str, u64, &'static str)],
) -> (LoadReport, u64, String) {
    end_of_an_upload_of(order(image_of("AXTC4CO", "1.2.0", 320)), behind, asked)
}

fn end_of_an_upload_of(
    order: LoadOrder,
    behind: &[(u64, &'static str)],
    asked: &[(&'static str, u64, &'static str)],
) -> (LoadReport, u64, String) {
    const WAITS: &str = "\r\nWaiting for application S-Record.\r\n";
    const HERE: &str = "AXTC4CO V1.1.0\r\nV - View Object Dictionary\r\nD - Default Object Dictionary\r\n\
                        T - Toggle Stream\r\nS - Diagnostics\r\nL - Load New Software\r\n";
    let mut script = vec![("\u{11}m", 3, HERE), ("l", 5, "Password: "), ("AXIO-2010", 50, WAITS)];
    script.extend(
        behind.iter().enumerate().map(|(number, &(late, text))| (if number == 0 { "S7" } else { "" }, late, text)),
    );
    script.extend(asked);
    let mut alone = Alone::with(&script);
    let (outcome, time) = alone.ask(Command::Load(Box::new(order)));
    let Outcome::Loaded(report) = outcome else { panic!("{outcome:?}") };
    let end = alone.sent.iter().position(|(_, text)| text.starts_with("S7")).unwrap_or_else(|| panic!("{report:?}"));
    let (at, _) = alone.sent[end];
    let log = alone.sent[end + 1..].iter().map(|(_, text)| text.as_str()).collect::<Vec<_>>().join(" ");
    (*report, time - at, log)
}

#[test]
fn behind_the_end_record_what_comes_back_decides_and_every_wait_has_its_end() {
    let (report, time, log) = end_of_an_upload(&[], &[]);
    assert_eq!((report.verdict, report.unit, time), (Verdict::Failed, UnitNow::Unknown, 20_000), "{report:?}");
    assert_eq!((report.what.as_str(), log.as_str()), ("the file was sent, but the unit has not come back", ""));
    assert_eq!((report.phase, report.records), (Phase::Finish, report.records_total));

    let (report, time, _) = end_of_an_upload(&[(100, "AXTC4CO V1.2.0\r\n")], &[]);
    assert_eq!((report.verdict, report.unit, time), (Verdict::Done, UnitNow::Application, 400), "{report:?}");
    assert_eq!((report.version_after, report.heard.as_str()), (Some(Version::new(1, 2, 0)), "AXTC4CO V1.2.0"));

    let (report, time, _) = end_of_an_upload(&[(100, "AXTC4CO V1.1.0\r\n")], &[]);
    assert_eq!(
        (report.verdict, report.unit, time),
        (Verdict::WrongApplication, UnitNow::Application, 400),
        "{report:?}"
    );

    // A loader that waits for the next file may still start what it has, so it gets three seconds.
    let (report, time, _) = end_of_an_upload(&[(100, "Waiting for application S-Record.\r\n")], &[]);
    assert_eq!((report.verdict, report.unit, time), (Verdict::Failed, UnitNow::Loader, 3_100), "{report:?}");
    assert!(report.what.contains("does not start what was sent"), "{}", report.what);
    let late = [(100, "Waiting for application S-Record.\r\n"), (2_500, "AXTC4CO V1.2.0\r\n")];
    assert_eq!(end_of_an_upload(&late, &[]).0.verdict, Verdict::Done);

    let error = [(100, "Error # 0003\r\nRestarting.\r\n"), (300, "Waiting for application S-Record.\r\n")];
    let (report, time, _) = end_of_an_upload(&error, &[]);
    assert_eq!(
        (report.verdict, report.unit, report.phase),
        (Verdict::Failed, UnitNow::Loader, Phase::Finish),
        "{report:?}"
    );
    assert!(report.what.contains("at the end of the file") && time == 300, "{time}: {}", report.what);
    // Without a prompt behind it, too.
    let (report, time, _) = end_of_an_upload(&error[..1], &[]);
    assert_eq!((report.verdict, report.unit, time), (Verdict::Failed, UnitNow::Loader, 2_100), "{report:?}");
}

#[test]
fn a_unit_that_comes_back_with_rows_alone_is_asked_for_its_version() {
    let rows: Vec<(u64, &'static str)> = (0..20).map(|number| (100 + number * 200, ROW)).collect();
    let named = "AXTC4CO V1.2.0\r\nV - View Object Dictionary\r\nT - Toggle Stream\r\nL - Load New Software\r\n";
    let (report, _, log) = end_of_an_upload(&rows, &[("\u{11}m", 5, named)]);
    assert_eq!((report.verdict, log.as_str()), (Verdict::Done, "\u{11}m"), "{report:?}");
    assert_eq!(report.heard, "L - Load New Software", "rows are no words to quote");
    // It runs, but whatever it is asked it does not say what.
    let (report, time, log) = end_of_an_upload(&rows, &[]);
    assert_eq!((report.verdict, report.unit), (Verdict::Failed, UnitNow::Unknown), "{report:?}");
    assert_eq!((log.as_str(), time), ("\u{11}m ~m xm", 1_100 + 2_400));
}

#[test]
fn a_unit_that_comes_back_with_a_menu_without_its_name_is_asked_a_second_later() {
    let named = "AXTC4CO V1.2.0\r\nV - View Object Dictionary\r\nT - Toggle Stream\r\nL - Load New Software\r\n";
    let (report, time, log) = end_of_an_upload(&[(100, NAMELESS_MENU)], &[("\u{11}m", 5, named)]);
    assert_eq!((report.verdict, log.as_str(), time), (Verdict::Done, "\u{11}m", 1_100 + 5 + 150), "{report:?}");
}

#[test]
fn a_loader_that_names_itself_and_wants_a_key_is_one_and_either_alone_is_not() {
    let state = |text: &str| {
        let mut session = Session::new(115_200);
        session.handle_bytes(Instant::from_millis(10), text.as_bytes());
        session.handle_timeout(Instant::from_millis(500));
        session.facts().state
    };
    let (header, key) = ("56F83xx Serial Bootloader v2.0\r\n", "Hit any key to continue");
    assert_eq!(state(&format!("{header}{key}")), UnitState::Loader);
    assert_eq!(state(&format!("{header}(c) 2005\r\n{key}\r\n")), UnitState::Loader);
    assert_eq!(state(&format!("{key}\r\n{header}")), UnitState::Unknown);
    assert_eq!(state(key), UnitState::Unknown);
    assert_eq!(state(&format!("{header}AXTC4CO V1.1.0\r\n{key}\r\n")), UnitState::Application);
}

#[test]
fn a_unit_that_restarts_again_and_again_is_not_waited_for_without_end() {
    let waits: Vec<_> = (1..60).map(|number| (number * 2_000, "Waiting for application S-Record.\r\n")).collect();
    let (report, time, _) = end_of_an_upload(&waits, &[]);
    assert_eq!((report.verdict, report.unit, time), (Verdict::Failed, UnitNow::Loader, 30_000), "{report:?}");
    let banners: Vec<_> = (1..600).map(|number| (number * 200, "AXTC4CO V1.2.0\r\n")).collect();
    let (report, time, _) = end_of_an_upload(&banners, &[]);
    assert_eq!((report.verdict, time), (Verdict::Done, 30_000), "{report:?}");
}

#[test]
fn of_an_image_without_identity_nobody_says_that_it_is_what_the_unit_runs() {
    let (report, _, _) = end_of_an_upload_of(order(nameless_image("AXTC4CO")), &[(100, "AXTC4CO V1.1.0\r\n")], &[]);
    assert_eq!((report.verdict, report.proof), (Verdict::Done, Proof::Missing), "{report:?}");
    assert!(report.what.contains("cannot be told"), "{}", report.what);
    assert!(report.advice().starts_with("compare"), "{}", report.advice());
    let (report, _, _) = end_of_an_upload_of(order(nameless_image("AXTC4CO")), &[(100, "AXRTD8CO V1.2.0\r\n")], &[]);
    assert_eq!((report.verdict, report.unit), (Verdict::WrongApplication, UnitNow::Application), "{report:?}");
    assert_eq!(report.what, "the unit runs AXRTD8CO V1.2.0, but the file was sent to an AXTC4CO");
    let (report, _, _) = end_of_an_upload(&[(100, "AXTC4CO V1.2.0\r\n")], &[]);
    assert_eq!((report.proof, report.what.as_str()), (Proof::Banner, "the unit runs AXTC4CO V1.2.0"));
}

/// A menu that does not say whose it is.
const NAMELESS_MENU: &str = "V - View Object Dictionary\r\nD - Default Object Dictionary\r\nT - Toggle Stream\r\n\
                             S - Diagnostics\r\nL - Load New Software\r\n";

#[test]
fn a_name_that_was_heard_before_the_upload_may_be_that_of_another_unit() {
    let load = |menu: &'static str, product: Option<&str>| {
        let mut alone = Alone::with(&[("\u{11}m", 3, menu), ("~m", 3, menu), ("l", 5, "Not allowed\r\n")]);
        alone.session.handle_bytes(alone.now, b"AXTC4CO V1.1.0\r\n");
        let product = product.map(str::to_owned);
        let order = LoadOrder { product, ..order(image_of("AXTC4CO", "1.2.0", 320)) };
        let (outcome, _) = alone.ask(Command::Load(Box::new(order)));
        let Outcome::Loaded(report) = outcome else { panic!("{outcome:?}") };
        (*report, alone)
    };
    let (report, alone) = load(NAMELESS_MENU, None);
    assert_eq!((report.verdict, report.product), (Verdict::Refused, None), "{}", report.what);
    assert!(report.what.contains("does not say which product"), "{}", report.what);
    assert!(alone.log().ends_with(":~m") && alone.session.facts().product.is_none(), "{}", alone.log());
    // Somebody says it, or the unit itself does.
    let (report, _) = load(NAMELESS_MENU, Some("AXTC4CO"));
    assert_eq!(report.verdict, Verdict::UnitRefused, "{}", report.what);
    let (report, _) = load("AXTC4CO\r\nV - View\r\nD - Default\r\nL - Load\r\n", None);
    assert_eq!(report.verdict, Verdict::UnitRefused, "{}", report.what);
    let (report, _) = load(MENU, None);
    assert_eq!((report.verdict, report.product.as_deref()), (Verdict::Refused, Some("AXRTD8CO")), "{}", report.what);
    let (report, _) = load(MENU, Some("AXTC4CO"));
    assert_eq!((report.verdict, report.product.as_deref()), (Verdict::Refused, Some("AXRTD8CO")), "{}", report.what);
    assert_eq!(report.what, "the unit is an AXRTD8CO, not an AXTC4CO");
}

#[test]
fn what_one_unit_has_said_of_itself_is_not_true_of_another() {
    let mut session = Session::new(115_200);
    session.handle_bytes(
        Instant::from_millis(1),
        b"AXTC4CO V1.1.0\r\nNode-ID: 5\r\n  23.500;  24.125;Disabled;OpenCct ; -12.750\r\n",
    );
    let before = session.facts().clone();
    assert!(before.version.is_some() && before.node_id.is_some() && before.stream.is_some(), "{before:?}");
    session.handle_bytes(Instant::from_millis(9_000), b"Welcome to AXTC4CO\r\n");
    assert_eq!(session.facts().version, before.version);
    session.handle_bytes(Instant::from_millis(9_100), b"Welcome to AXRTD8CO\r\n");
    let facts = session.facts();
    assert_eq!(facts.product.as_ref().map(|known| known.value.as_str()), Some("AXRTD8CO"));
    assert_eq!((&facts.version, &facts.node_id, facts.stream), (&None, &None, None));
    assert_eq!(facts.state, UnitState::Application);
}

#[test]
fn a_note_before_the_question_is_not_a_refusal_and_a_refusal_is_left_with_enter() {
    for asks in
        ["Note: a wrong password is refused.\r\nPassword: ", "Note: a wrong password is refused.\r\nPassword:\r\n"]
    {
        let (report, alone) = upload_behind(&[("l", 5, asks)]);
        assert!(report.password_sent && password_at(&alone).is_some_and(|at| at < 300), "{asks:?}: {}", alone.log());
    }
    let (report, alone) = upload_behind(&[("l", 5, "Not allowed in operational state\r\n")]);
    assert_eq!((report.verdict, report.password_sent), (Verdict::UnitRefused, false), "{report:?}");
    assert_eq!(report.what, "the unit refuses to load new software");
    let pressed = alone.sent.iter().find(|(_, text)| text == "l").expect("L").0;
    assert_eq!(alone.sent.last(), Some(&(pressed + 505, "~".to_owned())), "{}", alone.log());
}

#[test]
fn an_upload_that_is_cancelled_after_l_sends_no_password_and_leaves_the_question() {
    let mut alone = Alone::with(&[("\u{11}m", 3, MENU), ("l", 300, "Password: ")]);
    let load = Command::Load(Box::new(order(small_image("AXRTD8CO", "1.2.0"))));
    alone.session.command(alone.now, load).expect("it is free");
    while !alone.log().ends_with(":l") {
        alone.step();
        alone.take_sent(Instant::ZERO);
    }
    alone.session.command(alone.now, Command::Cancel).expect("always");
    let (outcome, _) = alone.end(Instant::ZERO);
    let Outcome::Loaded(report) = outcome else { panic!("{outcome:?}") };
    assert_eq!((report.verdict, report.unit), (Verdict::Interrupted, UnitNow::Application), "{report:?}");
    assert_eq!((report.what.as_str(), report.password_sent), ("cancelled before anything was changed", false));
    let from_l = alone.sent.iter().map(|(_, text)| text.as_str()).skip_while(|text| *text != "l");
    assert_eq!(from_l.collect::<Vec<_>>().join(" "), "l ~ ~", "the question comes later, and is left as well");
}

#[test]
fn a_line_about_the_password_that_was_sent_is_no_question_for_another() {
    let accepts = [
        ("l", 5, "Password: "),
        ("AXIO-2010", 40, "\r\nChecking the password:\r\n"),
        ("", 900, "Waiting for application S-Record.\r\n"),
    ];
    let (report, _) = upload_behind(&accepts);
    assert!(report.password_sent && report.records > 0, "{report:?}");
}

#[test]
fn a_silent_unit_is_asked_until_the_longest_erasing_is_over_if_its_product_is_known() {
    let silent = |product: Option<&str>| {
        let product = product.map(str::to_owned);
        let order = LoadOrder { product, ..order(image_of("AXTC4CO", "1.2.0", 320)) };
        let (outcome, time) = Alone::with(&[]).ask(Command::Load(Box::new(order)));
        let Outcome::Loaded(report) = outcome else { panic!("{outcome:?}") };
        assert_eq!((report.verdict, report.unit), (Verdict::NoAnswer, UnitNow::Unknown), "{report:?}");
        time
    };
    let once = silent(None);
    assert_eq!(once, 2_400);
    // What it was doing when it was asked for the first time may have taken so long, and four seconds more.
    let erasing = longest_erase(&Product::named("AXTC4CO").expect("it is known").flash);
    let patience = once + millis(erasing) + 4_000;
    assert_eq!(silent(Some("AXTC4CO")), patience.div_ceil(once) * once);
}

#[test]
fn an_error_after_data_that_was_taken_is_not_a_late_answer_of_a_loader_that_was_found_waiting() {
    const COMPLAINT: &str = "Error # 0004\r\nRestarting.\r\nWaiting for application S-Record.\r\n";
    let mut script = vec![("\u{11}m", 3, COMPLAINT), ("~", 3, COMPLAINT)];
    // A page has been written, and the record after it is wrong.
    script.extend([("S3", 0, ""); 16]);
    script.extend([("S3", 8, "\u{13}"), ("", 30, "\u{11}"), ("S3", 10, COMPLAINT)]);
    let mut alone = Alone::with(&script);
    let order = LoadOrder { product: Some("AXTC4CO".into()), ..order(image_of("AXTC4CO", "1.2.0", 768)) };
    let (outcome, time) = alone.ask(Command::Load(Box::new(order)));
    let Outcome::Loaded(report) = outcome else { panic!("{outcome:?}") };
    assert_eq!((report.verdict, report.unit), (Verdict::Failed, UnitNow::Loader), "{report:?}");
    assert_eq!(report.what, "the loader reports error 4 (wrong checksum)");
    let headers = alone.sent.iter().filter(|(_, text)| text.starts_with("S0")).count();
    assert!(report.found_in_loader && headers == 1 && time < 2_000, "{headers} headers in {time} ms: {report:?}");
}

/// An upload whose first data has been let go, and has not been taken to the line yet.
fn with_data_let_go() -> Alone {
    let waits = "\r\nWaiting for application S-Record.\r\n";
    let mut alone = Alone::with(&[("\u{11}m", 3, MENU), ("l", 5, "Password: "), ("AXIO-2010", 50, waits)]);
    let load = Command::Load(Box::new(order(small_image("AXRTD8CO", "1.2.0"))));
    alone.session.command(alone.now, load).expect("it is free");
    while !alone.log().contains(":S0") {
        alone.step();
        alone.take_sent(Instant::ZERO);
    }
    while alone.session.waiting() == 0 {
        alone.now = alone.session.poll_timeout().expect("a deadline").max(alone.now);
        alone.session.handle_timeout(alone.now);
    }
    alone
}

#[test]
fn a_record_that_waits_when_the_upload_fails_never_leaves() {
    let end = |mut alone: Alone| {
        let (outcome, _) = alone.end(Instant::ZERO);
        let Outcome::Loaded(report) = outcome else { panic!("{outcome:?}") };
        assert!(report.verdict == Verdict::Failed && !alone.log().contains(":S3"), "{report:?}: {}", alone.log());
        (*report, alone.log())
    };
    // The unit shows its menu: only what leaves a dialogue is sent.
    let mut alone = with_data_let_go();
    alone.session.handle_bytes(alone.now, b"\r\nV - View Object Dictionary\r\n");
    let (report, log) = end(alone);
    assert!(report.unit == UnitNow::Application && log.ends_with(":~"), "{report:?}: {log}");
    // The loader stops us for too long, and lets us go on when that has been given up.
    let mut alone = with_data_let_go();
    alone.session.handle_bytes(alone.now, b"\x13");
    alone.says.push((alone.now + Duration::from_secs(5), "\u{11}"));
    let (report, log) = end(alone);
    assert!(report.what.contains("(XOFF)"), "{report:?}: {log}");
}
