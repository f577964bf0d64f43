//! Whatever talks on the other side: nothing it sends acts on the user's terminal, all of it is in the recording, and
//! memory stays bounded.

use std::fs;
use std::ops::Range;
use std::path::PathBuf;
use std::sync::Arc;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::thread;

use axcon::record::{Direction, Piece, Reader};
use axcon::time::{Duration, Instant};
use axcon::tui::{App, Effect, Input, LinkInfo, LinkKind, Options};
use ratatui::Terminal;
use ratatui::backend::TestBackend;
use ratatui::crossterm::event::{Event, KeyCode, KeyEvent, KeyModifiers};

use crate::support::puppet::Puppet;
use crate::support::shell::World;

/// Sequences that terminals obey: titles, clipboards, questions whose answer is typed into the shell, colours, cursor
/// moves, alternate screens, C1 controls; characters that turn the direction of writing; damage.
fn hostile() -> Vec<u8> {
    let mut bytes = Vec::new();
    for piece in [
        &b"\x1b]0;owned\x07\x1b]52;c;cm0gLXJmIC8=\x07\x1b]52;c;AAAA\x1b\\"[..],
        b"\x05\x1b[c\x1b[6n\x1b[>0q\x1bZ\x1b[5i\x1b[?1049h\x1bc\x1b[2J\x1b[31m",
        b"\x1bP$q\"p\x1b\\\x1b_apc\x1b\\\x1b^pm\x1b\\\x1bX sos\x1b\\",
        b"\x90\x9b31m\x9d0;title\x9c\x85\x84",
        "\u{202e}txt.exe\u{2066}\u{200f}\u{feff}\u{e000}\u{9b}2J".as_bytes(),
        b"\0\0\0\x7f\x08\x08\xff\xfe\xc3(\xf0\x9f\xed\xa0\x80\r\n",
        b"AXTC4CO\x1b]0;V9.9.9\x07 V1.1.0\x1b[8m hidden\r\nM - menu\x1b[0m\r\nV - view\x9b?25l dictionary\r\nT - toggle stream\r\n",
        b"$6110:01 \x1b]0;x\x07 1 \xe2\x80\xae\r\n  25.125; 101.500;\x1b[2J;OpenCct ;  -3.250\r\n",
    ] {
        bytes.extend_from_slice(piece);
    }
    bytes
}

/// What a terminal would do something else with than show it.
fn acts(text: &str) -> Option<char> {
    text.chars().find(|&c| {
        let laid_out = matches!(c, '\n' | '\t' | '\r' | '\u{8}');
        let turns =
            matches!(c, '\u{200b}'..='\u{200f}' | '\u{202a}'..='\u{202e}' | '\u{2066}'..='\u{2069}' | '\u{feff}');
        (c.is_control() && !laid_out) || turns
    })
}

#[test]
fn nothing_hostile_reaches_the_users_terminal_and_everything_the_recording() {
    let image = concat!(env!("CARGO_MANIFEST_DIR"), "/firmware_images/AXTC4CO_V1.2.0.elf.S");
    let stories: [&[&str]; 9] = [
        &["identify"],
        &["identify", "--deep", "--yes"],
        &["stream", "--duration", "3"],
        &["dictionary", "dump", "--yes"],
        &["dictionary", "dump", "--yes", "--json"],
        &["diagnostics", "--count", "2"],
        &["defaults", "--yes"],
        &["load", image, "--yes", "--password-file", "password", "--product", "AXTC4CO"],
        &["terminal", "--timestamps", "--echo"],
    ];
    // Each waits for answers that never make sense: side by side.
    thread::scope(|scope| {
        for story in stories {
            scope.spawn(move || {
                let world = World::new();
                fs::write(world.path("password"), "AXIO-2010").expect("written");
                let said = Arc::new(AtomicUsize::new(0));
                let counted = said.clone();
                let puppet = Puppet::start(Box::new(move |keys| {
                    let answer = hostile().repeat(keys.len().min(3));
                    counted.fetch_add(answer.len(), Ordering::Relaxed);
                    answer
                }));
                let args = [story, &["--port", puppet.port(), "--record", "it.cast"]].concat();
                let ran = world.run(&args, b"mtvsdl\r");
                assert!(ran.code.is_some_and(|code| code != 101), "{story:?}: {:?}\n{}", ran.code, ran.err);
                for (stream, text) in [("out", &ran.out), ("err", &ran.err)] {
                    assert_eq!(acts(text), None, "{story:?}, {stream}: {}", text.escape_debug());
                }
                let mut reader = Reader::default();
                let mut recorded = Vec::new();
                let mut keep = |piece| {
                    if let Piece::Bytes { direction: Direction::FromUnit, bytes, .. } = piece {
                        recorded.extend(bytes);
                    }
                };
                reader.push(&fs::read(world.path("it.cast")).expect("a recording"), &mut keep).expect("sound");
                // Nobody asks for the password or says it, so not a byte is changed.
                let answer = hostile();
                let same = recorded.iter().eq(answer.iter().cycle().take(recorded.len()));
                assert!(same, "{story:?}: {}", recorded.escape_ascii());
                // Two wait for the end of the last answer. The others leave with a key whose answer nobody awaits.
                let waits = *story == ["identify"] || story.contains(&"terminal");
                let least = if waits { said.load(Ordering::Relaxed) } else { answer.len() };
                assert!(recorded.len() >= least, "{story:?}: {} bytes of {least}", recorded.len());
            });
        }
    });
}

#[test]
fn forty_megabytes_without_a_line_end_take_no_more_memory_than_ten() {
    const MEGABYTE: usize = 1 << 20;
    let world = World::new();
    let puppet = Puppet::silent();
    let mut running = world.start(&["terminal", "--port", puppet.port(), "--record", "it.cast", "--log", "it.log"]);
    puppet.wait_for_client();
    let peak_after = |megabytes: Range<usize>, end: &str| {
        for megabyte in megabytes {
            puppet.say(&vec![b'a' + (megabyte % 26) as u8; MEGABYTE]);
        }
        puppet.say(end.as_bytes());
        running.wait_out(end);
        running.peak_memory()
    };
    // The newest eight are kept.
    let (ten, forty) = (peak_after(0..10, "[ten]"), peak_after(10..40, "[forty]"));
    running.end_input();
    assert_eq!(running.wait().code, Some(0));
    assert!(ten < 40 * MEGABYTE && forty - ten < 4 * MEGABYTE, "{} KiB, {} KiB", ten / 1024, forty / 1024);
    let log = fs::read(world.path("it.log")).expect("a log");
    assert_eq!(log.len(), 40 * MEGABYTE + "[ten][forty]".len(), "not a byte is lost");
}

#[test]
fn no_picture_of_the_console_holds_what_a_terminal_obeys() {
    for (columns, rows) in [(80, 24), (200, 60)] {
        let mut app = App::new(Options {
            link: Some("/dev/ttyUSB0".into()),
            directory: PathBuf::from("/images"),
            home: None,
            palette: axcon::tui::Palette::Dark,
            size: (columns, rows),
        });
        let mut now = Instant::ZERO;
        let mut pending = app.start();
        for effect in std::mem::take(&mut pending) {
            if let Effect::OpenLink(link) = effect {
                let info = LinkInfo {
                    link,
                    baud: 115_200,
                    kind: LinkKind::Unit,
                    recording: Some("\x1b]0;x\x07".into()),
                    noted: None,
                    start_of_day: Duration::ZERO,
                    start_millis: 0,
                };
                app.handle(now, Input::LinkOpened(info));
            }
        }
        let mut terminal = Terminal::new(TestBackend::new(columns, rows)).expect("a picture");
        let mut look = |app: &App| {
            terminal.draw(|frame| app.draw(frame)).expect("drawn");
            for cell in terminal.backend().buffer().content() {
                assert_eq!(acts(cell.symbol()), None, "{:?}", cell.symbol());
            }
        };
        let key = |code, modifiers| Input::Terminal(Event::Key(KeyEvent::new(code, modifiers)));
        for round in 0..40u64 {
            now += Duration::from_millis(70);
            app.handle(now, Input::Bytes(hostile()));
            app.handle(now, Input::Timeout);
            if round == 20 {
                app.handle(now, Input::Bytes(vec![b'x'; 1 << 20]));
            }
            // The terminal passes keys on, but for the prefix.
            app.handle(now, key(KeyCode::Char(']'), KeyModifiers::CONTROL));
            let screen = char::from(b'1' + (round % 5) as u8);
            app.handle(now, key(KeyCode::Char(screen), KeyModifiers::NONE));
            look(&app);
        }
    }
}
