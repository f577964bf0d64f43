//! Links opened, lost, replaced and left, in sentences.

use ratatui::crossterm::event::{KeyCode, KeyModifiers};

use super::stage::*;
use crate::endpoint::Transmit;
use crate::session::{Job, Outcome};
use crate::time::Duration;
use crate::tui::{App, Effect, Failure, Input, LinkInfo, LinkKind, Options, Pace, Palette, Playing, PortEntry};

#[test]
fn connecting_asks_the_unit_who_it_is() {
    let mut stage = Stage::with_ports(SMALL);
    stage.asked();
    stage.press(KeyCode::Enter);
    assert_eq!(stage.asked(), [Effect::OpenLink("/dev/ttyUSB0".into())]);
    stage.opened("/dev/ttyUSB0");
    stage.wait(10_000);
    let sent = stage.sent();
    assert!(sent.contains(&b'm'), "{sent:?}");
    assert!(!sent.iter().any(|byte| b"VvDdTtSsLl".contains(byte)), "nothing but the menu is asked for: {sent:?}");
}

#[test]
fn the_link_given_at_the_start_is_opened_at_once() {
    let mut app = App::new(Options {
        link: Some("emu:axtc4co".into()),
        directory: "/".into(),
        home: None,
        palette: Palette::Dark,
        size: SMALL,
    });
    assert_eq!(app.start(), [Effect::ListPorts, Effect::ListRecordings, Effect::OpenLink("emu:axtc4co".into())]);
}

#[test]
fn another_link_is_asked_about_and_opened_before_the_first_is_given_up() {
    let opens = |link: &str| Effect::OpenLink(link.into());
    let mut stage = Stage::connected(SMALL);
    stage.keys("1").press(KeyCode::Down).asked();
    stage.press(KeyCode::Enter);
    assert!(stage.shows("Close the link?") && stage.shows("if that fails, the link stays"), "{}", stage.picture());
    stage.keys("n");
    assert_eq!(stage.asked(), [], "not without a yes");
    stage.press(KeyCode::Enter).keys("y");
    assert_eq!(stage.asked(), [opens("/dev/ttyUSB1")]);
    stage.input(Input::LinkFailed(Failure { text: "no such port".into(), hints: Vec::new() }));
    assert!(stage.shows("Not connected") && stage.shows("No such port"), "{}", stage.picture());
    stage.press(KeyCode::Enter).keys("2m");
    assert!(stage.shows("AXTC4CO 1.1.0") && stage.shows("/dev/ttyUSB0 │ connected"), "{}", stage.picture());
    assert!(stage.sent().ends_with(b"m"), "the first link goes on");
    stage.wait(3000).keys("1").press(KeyCode::Enter).keys("y").asked();
    stage.press(KeyCode::Esc);
    assert_eq!(stage.asked(), [Effect::DoNotOpen]);
    stage.press(KeyCode::Enter).keys("y").lost();
    assert!(stage.shows("Opening /dev/ttyUSB1."), "the first may go meanwhile: {}", stage.picture());
    stage.opened("/dev/ttyUSB1");
    assert!(stage.shows("/dev/ttyUSB1 │ connected") && !stage.shows("AXTC4CO 1.1.0"), "{}", stage.picture());
    // The same port cannot be opened twice; a recording is asked about as well.
    stage.keys("1").press(KeyCode::Enter).keys("y");
    assert!(stage.asked().ends_with(&[Effect::CloseLink, opens("/dev/ttyUSB1")]));
    let mut stage = Stage::connected(SMALL).with_recordings();
    stage.asked();
    stage.press(KeyCode::Enter);
    assert_eq!((stage.asked(), stage.shows("Close the link?")), (Vec::new(), true), "{}", stage.picture());
}

#[test]
fn an_enter_too_many_after_a_failure_opens_no_other_port() {
    let failed = || Input::LinkFailed(Failure { text: "it is busy".into(), hints: Vec::new() });
    // The list may come before or after the failure.
    for (link, opened) in [("/dev/ttyUSB1", Some("/dev/ttyUSB1")), ("/dev/ttyUSB7", None)] {
        for is_listed_first in [true, false] {
            let mut stage = Stage::on(SMALL, Some(link.into()));
            let port = |link: &str| PortEntry { link: link.into(), description: String::new(), busy_by: None };
            let listed = || Input::PortsListed(Ok(["/dev/ttyUSB0", "/dev/ttyUSB1"].map(port).into()));
            match is_listed_first {
                true => stage.input(listed()).input(failed()),
                false => stage.input(failed()).input(listed()),
            };
            stage.press(KeyCode::Enter).asked();
            stage.press(KeyCode::Enter);
            let effects = stage.asked();
            assert_eq!(effects, opened.map(|link| Effect::OpenLink(link.into())).into_iter().collect::<Vec<_>>());
            assert_eq!(stage.shows("Connect to"), opened.is_none(), "{}", stage.picture());
        }
    }
}

#[test]
fn a_link_that_is_lost_while_it_is_asked_about_is_not_called_connected() {
    let mut stage = Stage::connected(SMALL);
    stage.keys("1").press(KeyCode::Down).press(KeyCode::Enter);
    assert!(stage.shows("/dev/ttyUSB0 is connected."), "{}", stage.picture());
    stage.press(KeyCode::Enter).lost();
    assert!(stage.shows("/dev/ttyUSB0 is lost.") && !stage.shows("is connected."), "{}", stage.picture());
}

#[test]
fn a_lost_link_is_opened_again_by_c_and_the_terminal_keeps_its_lines() {
    let mut stage = Stage::connected(SMALL);
    stage.lost().asked();
    stage.keys("c");
    assert_eq!(stage.asked(), [Effect::OpenLink("/dev/ttyUSB0".into())]);
    stage.opened("/dev/ttyUSB0");
    stage.keys("3");
    assert!(stage.shows("Software Version V1.1.0") && stage.shows("link lost"), "{}", stage.picture());
}

#[test]
fn rows_go_on_to_their_file_when_the_same_link_is_back_and_end_with_another() {
    let row = b"  23.500; 181.250;  96.000; 410.000;Disabled\r\n";
    let appended = |stage: &mut Stage| {
        stage.wait(1000).bytes(row);
        stage.asked().iter().any(|effect| matches!(effect, Effect::AppendFile { .. }))
    };
    let mut stage = Stage::streaming(SMALL);
    stage.keys("6e").press(KeyCode::Enter).written().asked();
    assert!(appended(&mut stage));
    stage.lost().keys("c").opened("/dev/ttyUSB0");
    assert!(appended(&mut stage), "the same link");
    stage.wait(10_000).keys("1").press(KeyCode::Down).press(KeyCode::Enter).keys("y");
    stage.opened("/dev/ttyUSB1");
    assert!(!appended(&mut stage), "another unit's rows are not mixed in");
}

#[test]
fn leaving_with_the_view_open_offers_to_close_it() {
    let mut stage = Stage::connected(SMALL);
    stage.keys("vt").prefix().keys("2q");
    stage.asked();
    stage.keys("y");
    let effects = stage.asked();
    assert_eq!(effects, [Effect::Transmit(Transmit::open(*b"x")), Effect::Quit]);
}

#[test]
fn a_view_opened_by_a_typed_key_is_asked_about_on_every_way_out_and_closed() {
    for way in ["q", "1x"] {
        let mut stage = Stage::connected(SMALL);
        stage.keys("3v").sent();
        assert!(stage.shows("halted by V"), "{}", stage.picture());
        stage.prefix().keys("2").keys(way);
        assert!(stage.shows("The unit's view is open"), "{way}: {}", stage.picture());
        stage.keys("y");
        let effects = stage.asked();
        assert_eq!(effects.first(), Some(&Effect::Transmit(Transmit::open(*b"x"))), "{way}");
        assert!(matches!(effects.last(), Some(Effect::Quit | Effect::CloseLink)), "{way}: {effects:?}");
    }
    let mut stage = Stage::connected(SMALL);
    stage.keys("3vx").prefix().keys("q");
    assert_eq!(stage.asked().last(), Some(&Effect::Quit), "it was closed again: nothing to ask");
}

#[test]
fn nobody_is_there_only_until_somebody_says_something() {
    let mut stage = Stage::with_ports(SMALL);
    stage.press(KeyCode::Enter).opened("/dev/ttyUSB0").wait(5_000);
    assert!(stage.shows("Nobody has answered"), "{}", stage.picture());
    stage.bytes(b"Supply voltage 24.1 V\r\n");
    assert!(!stage.shows("Nobody has answered") && !stage.shows("nothing heard yet"), "{}", stage.picture());
    assert!(stage.shows("talks, in words not known"), "{}", stage.picture());
}

#[test]
fn a_silent_unit_holds_a_signal_for_two_seconds_and_q_for_none() {
    let reading = || {
        let mut stage = Stage::connected(SMALL);
        stage.keys("v").press(KeyCode::Enter).wait(200).asked();
        stage.input(Input::Signal);
        assert!(!stage.effects.contains(&Effect::Quit), "the unit is left in order first");
        stage
    };
    let mut stage = reading();
    stage.wait(1999);
    assert!(!stage.effects.contains(&Effect::Quit));
    stage.wait(1);
    assert!(stage.effects.contains(&Effect::Quit));
    let mut stage = reading();
    assert!(stage.shows("Leaving the unit in order"), "{}", stage.picture());
    stage.keys("q");
    assert!(stage.effects.contains(&Effect::Quit));
    let mut stage = reading();
    stage.lost();
    assert!(stage.effects.contains(&Effect::Quit), "nobody is there to wait for");
}

#[test]
fn another_link_is_opened_once_the_first_has_been_left_in_order() {
    let mut stage = Stage::connected(SMALL);
    stage.keys("3v").prefix().keys("1").press(KeyCode::Down).press(KeyCode::Enter);
    stage.asked();
    assert!(stage.shows("/dev/ttyUSB1 is opened first"), "{}", stage.picture());
    stage.keys("y");
    let opens = Effect::OpenLink("/dev/ttyUSB1".into());
    assert_eq!(stage.asked(), [Effect::Transmit(Transmit::open(*b"x")), opens]);
}

#[test]
fn ctrl_z_stops_the_program_but_not_in_the_middle_of_a_job() {
    let ctrl_z = |stage: &mut Stage| {
        stage.asked();
        stage.key(KeyCode::Char('z'), KeyModifiers::CONTROL).asked()
    };
    assert_eq!(ctrl_z(&mut Stage::connected(SMALL)), [Effect::Suspend]);
    assert_eq!(ctrl_z(&mut typed(Stage::connected(SMALL), "t")), [Effect::Suspend], "also in front of a question");
    let mut stage = Stage::loading(SMALL);
    assert_eq!(ctrl_z(&mut stage), []);
    assert!(stage.shows("Not stopped: a job runs."), "{}", stage.picture());
    let mut stage = typed(Stage::connected(SMALL), "3");
    assert_eq!(ctrl_z(&mut stage), [Effect::Transmit(Transmit::open([0x1a]))], "the bare terminal passes it on");
}

#[test]
fn a_signal_ends_the_program_without_a_question() {
    let mut stage = Stage::connected(SMALL);
    stage.keys("m").asked();
    stage.input(Input::Signal);
    assert_eq!(stage.asked(), [Effect::Quit]);
}

#[test]
fn a_link_that_takes_long_to_open_is_given_up_by_esc() {
    let mut stage = pressed(Stage::with_ports(SMALL), KeyCode::Enter);
    stage.asked();
    assert!(stage.shows("Opening /dev/ttyUSB0.") && stage.shows("Esc do not wait"), "{}", stage.picture());
    stage.press(KeyCode::Esc);
    assert_eq!(stage.asked(), [Effect::CloseLink]);
    stage.press(KeyCode::Down).press(KeyCode::Enter);
    assert_eq!(stage.asked(), [Effect::OpenLink("/dev/ttyUSB1".into())], "another can be chosen");
}

#[test]
fn a_unit_without_a_name_shows_the_channels_of_its_diagnostics_as_they_are_named() {
    let mut stage = Stage::with_ports(SMALL);
    stage.press(KeyCode::Enter).opened("/dev/ttyUSB0");
    let menu = String::from_utf8_lossy(MENU).replace("AXTC4CO V1.1.0", "Scanner");
    stage.bytes(menu.as_bytes()).wait(3_000).keys("s").wait(2_000);
    for channel in 1..=8 {
        stage.bytes(format!(" RTD{channel} {channel}1.5 C raw 1{channel}9.7 ohm\r\n").as_bytes());
    }
    stage.wait(2_000).keys("2");
    let picture = stage.picture();
    assert!(!picture.contains("AXRTD8CO"), "{picture}");
    for channel in 1..=8 {
        assert!(picture.contains(&format!("RTD{channel}       {channel}1.5 °C")), "{picture}");
    }
}

#[test]
fn a_recording_that_cannot_be_read_on_says_so_and_where() {
    let mut stage = Stage::with_ports(SMALL).with_recordings();
    stage
        .press(KeyCode::Enter)
        .input(Input::LinkOpened(LinkInfo { kind: LinkKind::Recording, ..link_info("replay:x") }));
    let seconds = Duration::from_secs(5);
    stage.input(Input::Playing(Playing { position: seconds, length: Some(seconds), pace: Pace::AtOnce }));
    let text = "x.cast:40:2: this is no event";
    stage.input(Input::RecordingOver(Some(Failure { text: text.into(), hints: Vec::new() })));
    assert!(stage.shows(&format!("── {text}")), "{}", stage.picture());
    stage.press(KeyCode::Down);
    assert!(stage.shows("cannot be read on") && stage.shows(&format!("  {text}")), "it stays: {}", stage.picture());
}

#[test]
fn a_question_outlives_the_link_but_not_the_unit_it_was_about() {
    let mut stage = Stage::connected(SMALL);
    stage.keys("dYe").lost();
    assert!(stage.shows("Link lost") && stage.shows("› Ye"), "{}", stage.picture());
    stage.keys("s").press(KeyCode::Enter);
    assert!(stage.shows("Not sent: the link is lost."), "{}", stage.picture());
    stage.keys("2t");
    assert!(stage.shows("Not sent: the link is lost."), "{}", stage.picture());
    let mut stage = Stage::connected(SMALL);
    stage.keys("dYe").lost().input(Input::LinkBack("/dev/ttyUSB0".into()));
    stage.bytes(String::from_utf8_lossy(BANNER).replace("V1.1.0", "V9.9.9").as_bytes()).wait(5000);
    assert!(stage.shows("Another unit") && !stage.shows("› Ye"), "{}", stage.picture());
}

#[test]
fn c_on_a_lost_link_that_is_not_there_yet_gives_nothing_up() {
    let mut stage = Stage::streaming(SMALL);
    stage.lost().asked();
    stage.keys("c");
    assert_eq!(stage.asked(), [Effect::OpenLink("/dev/ttyUSB0".into())], "the loop goes on looking for the cable");
    stage.input(Input::LinkFailed(Failure { text: "no such port".into(), hints: Vec::new() }));
    assert!(stage.shows("Not connected") && stage.shows("No such port"), "{}", stage.picture());
    stage.press(KeyCode::Enter);
    assert!(stage.shows("AXTC4CO 1.1.0") && stage.shows("Link lost: ") && stage.shows("TC1 "), "{}", stage.picture());
    stage.keys("c").press(KeyCode::Esc);
    assert!(stage.asked().ends_with(&[Effect::DoNotOpen]) && stage.shows("Link lost: "), "{}", stage.picture());
    stage.input(Input::LinkBack("/dev/ttyUSB0".into())).bytes(MENU).wait(5000);
    assert!(stage.shows("the AXTC4CO answers as before") && stage.shows("TC1 "), "{}", stage.picture());
    stage.keys("c");
    assert!(stage.shows("No link is lost"), "{}", stage.picture());
}

#[test]
fn nothing_said_of_the_link_stays_below_a_link_that_is_lost() {
    let mut stage = Stage::streaming(SMALL);
    stage.lost().input(Input::LinkBack("/dev/ttyUSB0".into())).bytes(MENU).wait(5000);
    assert!(stage.shows("The link is back"), "{}", stage.picture());
    stage.lost();
    assert!(!stage.shows("The link is back") && stage.shows("Link lost"), "{}", stage.picture());
    // What answered before it was lost again is not there any more.
    let mut stage = Stage::streaming(SMALL);
    stage.lost().input(Input::LinkBack("/dev/ttyUSB0".into())).lost().wait(5000);
    assert!(!stage.shows("answers"), "{}", stage.picture());
    // Of one version only it is not known to be the one of before.
    let mut stage = Stage::connected(SMALL);
    stage.lost().input(Input::LinkBack("/dev/ttyUSB0".into()));
    stage.bytes(String::from_utf8_lossy(MENU).replace(" V1.1.0", "").as_bytes()).wait(5000);
    assert!(stage.shows("and the AXTC4CO answers.") && !stage.shows("as before"), "{}", stage.picture());
}

#[test]
fn the_faults_of_eight_channels_stay_in_sight_when_the_link_is_lost() {
    let mut stage = Stage::eight_channels(SMALL);
    stage.lost().keys("2");
    let picture = stage.picture();
    assert!(picture.contains("1 when last seen") && picture.contains("RTD3    open circuit"), "{picture}");
    assert!(!picture.contains("1 now"), "{picture}");
}

#[test]
fn an_emulated_unit_that_is_gone_with_its_link_is_called_gone_and_another_asked_about() {
    let mut stage = Stage::with_ports(SMALL);
    stage.press(KeyCode::Enter).opened("emu:axtc4co").lost().asked();
    assert!(stage.shows("The emulated unit is gone with it; C starts a new one."), "{}", stage.picture());
    stage.keys("c").press(KeyCode::Enter);
    assert!(stage.shows("with all that was set") && stage.asked().is_empty(), "{}", stage.picture());
    assert!(stage.shows("as the factory made it"), "{}", stage.picture());
    stage.keys("y");
    assert_eq!(stage.asked(), [Effect::OpenLink("emu:axtc4co".into())]);
}

#[test]
fn a_unit_that_is_being_asked_who_it_is_is_not_called_silent_before_it_had_the_time_to_answer() {
    let mut stage = Stage::streaming(SMALL);
    stage.lost().wait(20_000).input(Input::LinkBack("/dev/ttyUSB0".into()));
    assert!(stage.shows("being asked") && stage.shows("the last values of the one before."), "{}", stage.picture());
    assert!(!stage.shows("silent") && !stage.shows("has not answered"), "{}", stage.picture());
    stage.wait(10_000);
    assert!(stage.shows("silent now") && stage.shows("The unit has not answered"), "{}", stage.picture());
}

#[test]
fn a_refusal_stays_for_some_seconds_before_other_news() {
    let mut stage = Stage::connected(SMALL);
    stage.keys("s").keys("t");
    assert!(stage.shows("Not sent: the unit prints its diagnostics"), "{}", stage.picture());
    stage.finished(Outcome::Done(Job::StreamOff));
    stage.wait(3900);
    assert!(stage.shows("Not sent: ") && !stage.shows("The stream is off"), "{}", stage.picture());
    stage.wait(200);
    assert!(stage.shows("The stream is off") && !stage.shows("Not sent"), "{}", stage.picture());
    // A user who goes on has read it.
    let mut stage = Stage::connected(SMALL);
    stage.keys("s").keys("t");
    stage.finished(Outcome::Done(Job::StreamOff));
    stage.press(KeyCode::Down);
    assert!(stage.shows("The stream is off"), "{}", stage.picture());
}

#[test]
fn diagnostics_that_are_being_stopped_are_called_that() {
    let mut stage = Stage::connected(SMALL);
    stage.keys("s").wait(2000).bytes(b"Supply: 24 V\r\nCurrent: 1 A\r\n").wait(1000);
    stage.keys("v");
    assert!(stage.shows("Not sent: the unit prints its diagnostics: S stops them first."), "{}", stage.picture());
    stage.keys("sv");
    assert!(stage.shows("Not sent: the diagnostics are being stopped: wait a moment."), "{}", stage.picture());
}

#[test]
fn a_link_that_is_not_listed_says_whether_it_is_connected_now() {
    let mut stage = Stage::with_ports(SMALL);
    stage.press(KeyCode::Enter).opened("tcp://hall-4:4001").keys("1");
    assert!(stage.shows("Connected now."), "{}", stage.picture());
    stage.lost();
    assert!(stage.shows("Connected last: the link is lost."), "{}", stage.picture());
}

#[test]
fn the_bytes_of_a_new_connection_are_in_sight_wherever_the_hex_view_was_stopped() {
    let mut stage = Stage::connected(SMALL);
    stage.keys("3").prefix().keys("h").press(KeyCode::Home);
    assert!(stage.shows("stopped"), "{}", stage.picture());
    stage.lost().prefix().keys("c").opened("/dev/ttyUSB0").bytes(b"fresh").keys("3");
    assert!(stage.shows("66 72 65 73 68"), "{}", stage.picture());
}
