//! What is typed by hand: passwords, questions that it opens, keys that wait.

use axcon::wire::MenuKey;

use super::*;

#[test]
fn what_is_typed_as_a_password_is_known_again_wherever_the_unit_repeats_it() {
    let mut session = Session::new(115_200);
    let mut now = Instant::ZERO;
    // With a slip of the finger that is taken back.
    session.command(now, Command::Keys(b"lAXIP\x08O-2010\r".to_vec())).expect("taken");
    for _ in 0..10 {
        now += Duration::from_millis(10);
        session.handle_timeout(now);
        while session.poll_transmit().is_some() {}
    }
    session.handle_bytes(now, b"Password: AXIP\x08 \x08O-2010\r\nno such password: AXIO-2010, sorry\r\nAXI");
    let received = |session: &Session| {
        let bytes: Vec<u8> = session.record().entries().flat_map(|entry| entry.bytes.clone()).collect();
        String::from_utf8(bytes).expect("text")
    };
    assert!(received(&session).ends_with("\r\nno such password: *********, sorry\r\n"), "{}", received(&session));
    // What looks like its beginning is kept back for a moment, and no longer.
    let due = session.poll_timeout().expect("it is given out by itself");
    assert!(due <= now + Duration::from_millis(500), "{due:?}");
    session.handle_timeout(due);
    session.handle_timeout(due + Duration::from_millis(500));
    assert!(received(&session).ends_with(", sorry\r\nAXI"), "{}", received(&session));
}

#[test]
fn a_question_that_was_opened_by_hand_is_answered_by_no_job() {
    let typed = |keys: &[&str]| {
        let mut alone = Alone::with(&[("d", 10, "Enter Yes to restore the defaults: ")]);
        for keys in keys {
            alone.session.command(alone.now, Command::Keys(keys.as_bytes().to_vec())).expect("no job runs");
            alone.take_sent(Instant::ZERO);
        }
        let open = alone.session.open_question();
        (open, alone.session.command(alone.now, Command::Diagnostics { pages: Some(1) }))
    };
    let (default, load) = (MenuKey::Default, MenuKey::Load);
    assert_eq!(typed(&["d"]), (Some(default), Err(Refusal::QuestionOpen(default))));
    assert_eq!(typed(&["d", "Ye"]), (Some(default), Err(Refusal::QuestionOpen(default))));
    assert_eq!(typed(&["l", "AXIO"]), (Some(load), Err(Refusal::QuestionOpen(load))));
    for ended in [&["d", "Ye", "\r"][..], &["d", "\x1b"], &["l", "AXIO", "\r"], &["m"]] {
        assert_eq!(typed(ended), (None, Ok(())), "{ended:?}");
    }
    // A job leaves its own questions, whatever came of them.
    let mut alone = Alone::with(&[("d", 10, "Enter Yes to restore the defaults: ")]);
    alone.session.command(alone.now, Command::RestoreDefaults).expect("it is free");
    alone.take_sent(Instant::ZERO);
    alone.session.command(alone.now, Command::Cancel).expect("always");
    assert_eq!(alone.end(Instant::ZERO).0, Outcome::Cancelled(Job::RestoreDefaults));
    assert_eq!(alone.session.open_question(), None);
    alone.session.command(alone.now, Command::Identify).expect("it is free");
}

#[test]
fn nothing_answers_a_question_that_a_hand_has_opened_while_the_unit_was_asked_who_it_is() {
    let mut alone = Alone::with(&[]);
    let begun = alone.now;
    alone.session.command(begun, Command::Identify).expect("it is free");
    alone.take_sent(begun);
    alone.session.command(begun, Command::Keys(b"dYes".to_vec())).expect("only who is there is asked");
    let (outcome, _) = alone.end(begun);
    assert_eq!(outcome, Outcome::Identified);
    // No Enter has left, and no job puts one there.
    assert_eq!(alone.log(), "0:\u{11}m 0:dYes");
    let refused = alone.session.command(alone.now, Command::StreamOff);
    assert_eq!(refused, Err(Refusal::QuestionOpen(MenuKey::Default)));
    // Behind a job that waits for its turn nobody opens one.
    let mut alone = Alone::with(&[]);
    alone.session.command(begun, Command::Identify).expect("it is free");
    alone.session.command(begun, Command::StreamOff).expect("it waits");
    let refused = alone.session.command(begun, Command::Keys(b"d".to_vec()));
    assert_eq!(refused, Err(Refusal::Busy(Job::StreamOff)));
}

/// Types this, and lets all of it leave.
fn type_in(session: &mut Session, now: &mut Instant, keys: &str) -> String {
    session.command(*now, Command::Keys(keys.as_bytes().to_vec())).expect("no job runs");
    let mut sent = Vec::new();
    for _ in 0..20 {
        *now += Duration::from_millis(5);
        session.handle_timeout(*now);
        while let Some(piece) = session.poll_transmit() {
            sent.extend(piece.bytes);
        }
    }
    String::from_utf8(sent).expect("keys")
}

#[test]
fn a_password_that_is_typed_after_the_adapter_was_out_is_recorded_nowhere() {
    for (before, after) in [("", "AXIO-2010\r"), ("AXIO-", "2010\r")] {
        let mut session = Session::new(115_200);
        let mut now = Instant::from_millis(1);
        session.handle_bytes(now, b"\r\nPassword: ");
        type_in(&mut session, &mut now, before);
        session.link_lost(now);
        now += Duration::from_secs(3);
        session.link_back(now);
        assert!(session.password_open());
        assert_eq!(type_in(&mut session, &mut now, after), after);
        let recorded = recorded(&session);
        assert!(!recorded.contains("AXIO") && !recorded.contains("2010"), "{recorded:?}");
        // That was the answer.
        session.handle_bytes(now, b"\r\n");
        assert!(!session.password_open());
        assert_eq!(type_in(&mut session, &mut now, "m"), "m");
        assert!(self::recorded(&session).ends_with('m'));
    }
}

#[test]
fn keys_that_still_wait_have_opened_their_question_all_the_same() {
    let mut session = Session::new(115_200);
    let now = Instant::from_millis(1);
    session.handle_bytes(now, b"\x13");
    session.command(now, Command::Keys(b"dYe".to_vec())).expect("it is free");
    assert_eq!((session.waiting(), session.open_question()), (3, Some(MenuKey::Default)));
    let refused = session.command(now, Command::Diagnostics { pages: Some(1) });
    assert_eq!(refused, Err(Refusal::QuestionOpen(MenuKey::Default)));
    // The question who is there ends before it can send the Enter that would be the answer.
    let mut session = Session::new(115_200);
    session.handle_bytes(now, b"\x13");
    session.command(now, Command::Identify).expect("it is free");
    session.command(now, Command::Keys(b"d".to_vec())).expect("only who is there is asked");
    assert_eq!(session.job(), None);
}

#[test]
fn behind_an_l_between_other_keys_all_is_secret_and_a_line_feed_ends_it() {
    let mut session = Session::new(115_200);
    let mut now = Instant::from_millis(1);
    for keys in ["\x1b[A", "l"] {
        type_in(&mut session, &mut now, keys);
    }
    session.handle_bytes(now, b"Enter access: ");
    type_in(&mut session, &mut now, "AXIO-2010\r");
    assert!(!recorded(&session).contains("AXIO"), "{:?}", recorded(&session));
    let mut session = Session::new(115_200);
    type_in(&mut session, &mut now, "l\nAXIO\n");
    assert_eq!(session.open_question(), None);
    session.command(now, Command::Diagnostics { pages: Some(1) }).expect("it is free");
}

#[test]
fn a_key_in_the_middle_of_a_row_leaves_the_row_live_and_in_a_recording() {
    let (begin, end) = ROW.split_at(16);
    let heard = |session: &mut Session| {
        let mut heard = Vec::new();
        while let Some(event) = session.poll_event() {
            match event {
                Event::Row { span, .. } => heard.push(format!("row {}", span.start)),
                Event::Heard { message, .. } => heard.push(format!("{message:?}")),
                _ => {}
            }
        }
        heard
    };
    let [at_once, later] = [10, 200].map(Instant::from_millis);
    let question = "F - field value, P - process value: ";
    for (begin, end, key_at, expected) in [
        (begin, end, at_once, 1),
        // The question has been heard, and is not part of what answers it.
        (question, ROW, later, 2),
    ] {
        let mut live = Session::new(115_200);
        live.handle_bytes(Instant::from_millis(5), begin.as_bytes());
        live.handle_timeout(key_at);
        live.command(key_at, Command::Keys(b"m".to_vec())).expect("it is free");
        assert!(live.poll_transmit().is_some());
        live.handle_bytes(later, end.as_bytes());
        let mut replay = Session::of_recording(115_200);
        replay.handle_bytes(Instant::from_millis(5), begin.as_bytes());
        replay.handle_sent(key_at, b"m");
        replay.handle_bytes(later, end.as_bytes());
        let live = heard(&mut live);
        assert_eq!((live.len(), &live), (expected, &heard(&mut replay)), "{begin:?}");
    }
}
