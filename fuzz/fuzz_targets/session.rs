//! A session against anything: every job ends in bounded time, every byte is in the record, the password is not.
#![no_main]

use axcon::endpoint::Endpoint;
use axcon::record::Direction;
use axcon::session::{Command, Event, Session};
use axcon::time::{Duration, Instant};
use axcon::wire::stream::Source;
use libfuzzer_sys::fuzz_target;

fuzz_target!(|input: (u8, Vec<(u16, Vec<u8>)>)| {
    let (job, answers) = input;
    let mut session = Session::new(115_200);
    let mut now = Instant::from_millis(1);
    let command = match job % 6 {
        0 => Command::Identify,
        1 => Command::StreamOn { source: Source::FieldValue, period: Duration::from_millis(100) },
        2 => Command::StreamOff,
        3 => Command::RestoreDefaults,
        4 => Command::ReadDictionary,
        _ => Command::Diagnostics { pages: Some(2) },
    };
    session.command(now, command).expect("the first job is taken");
    let mut ended = false;
    let mut received = 0u64;
    let drain = |session: &mut Session| {
        while session.poll_transmit().is_some() {}
        let mut ended = false;
        while let Some(event) = session.poll_event() {
            ended |= matches!(event, Event::Finished(_));
        }
        ended
    };
    for (wait, bytes) in answers {
        let then = now + Duration::from_millis(u64::from(wait));
        while let Some(due) = session.poll_timeout().filter(|due| *due <= then) {
            now = due.max(now);
            session.handle_timeout(now);
            ended |= drain(&mut session);
        }
        now = then;
        session.handle_bytes(now, &bytes);
        received += bytes.len() as u64;
        ended |= drain(&mut session);
    }
    // Silence from here on: whatever is under way ends.
    let limit = now + Duration::from_secs(120);
    while let Some(due) = session.poll_timeout().filter(|_| !ended) {
        assert!(due <= limit, "no end");
        now = due.max(now);
        session.handle_timeout(now);
        ended |= drain(&mut session);
    }
    assert!(ended, "the job has ended");
    let kept = session.record().entries().filter(|entry| entry.direction == Direction::FromUnit);
    let kept: u64 = kept.map(|entry| entry.bytes.len() as u64).sum();
    assert!(kept <= received);
});
