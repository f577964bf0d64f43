//! The loop without its terminal: what happens around links that no machine in virtual time can show.

use std::sync::mpsc::sync_channel;

use ratatui::Terminal;
use ratatui::backend::TestBackend;
use ratatui::crossterm::event::KeyCode;

use super::*;
use crate::host::link::Options as LinkOptions;
use crate::host::pty::Pty;

/// A console that has been told nothing yet.
fn console() -> Console {
    let world = World {
        link: None,
        baud: 115_200,
        recording: Plan::Nothing,
        palette: Palette::Mono,
        resolve: |name| Ok(LinkSpec::Serial(name.into())),
        open: |spec, baud, clock, inputs| {
            let connection = Connection::open(spec, LinkOptions { baud }, clock, inputs.clone());
            let connection = connection.map_err(|error| Failure { text: error.to_string(), hints: Vec::new() })?;
            // A reader that is quicker than whoever has opened the link.
            let (link, bytes) = (connection.id(), format!("hello from {}\r\n", spec).into_bytes());
            inputs.send(host::Input::Bytes { link, at: clock.now(), bytes }).expect("there is room");
            Ok(connection)
        },
        explain: |error| Failure { text: error.to_string(), hints: Vec::new() },
        unreadable: |error| Failure { text: error.to_string(), hints: Vec::new() },
        check: |_, _, _| Err("nobody asks for it here".into()),
        note: |_, _| {},
        noted: |_| None,
    };
    let app =
        App::new(Options { link: None, directory: PathBuf::new(), home: None, palette: Palette::Mono, size: (80, 24) });
    let (sender, inputs) = host::channel();
    let (_, keys) = sync_channel(1);
    Console::new(app, world, Clock::start(), sender, inputs, keys)
}

fn type_keys(console: &mut Console, keys: &str) {
    for key in keys.chars() {
        let code = if key == '\r' { KeyCode::Enter } else { KeyCode::Char(key) };
        console.handle(Input::Terminal(TerminalEvent::Key(code.into())));
    }
}

/// What the unit says over the open link just now.
fn say(console: &Console, text: &str) {
    let link = console.link.as_ref().expect("a link").id();
    let bytes = host::Input::Bytes { link, at: console.clock.now(), bytes: text.into() };
    console.sender.send(bytes).expect("there is room");
}

fn failure() -> Failure {
    Failure { text: "the port has gone".into(), hints: Vec::new() }
}

#[test]
fn no_byte_is_lost_when_one_link_takes_the_place_of_another() {
    let folder = tempfile::tempdir().expect("a folder");
    let (first, second) = (Pty::open(115_200).expect("a port"), Pty::open(115_200).expect("another"));
    let mut console = console();
    console.world.recording = Plan::File(folder.path().join("it.cast"));
    for (number, pty) in [(1, &first), (2, &second)] {
        type_keys(&mut console, &format!("1p{}\r", pty.path().display()));
        if number == 2 {
            say(&console, "last words\r\n");
            type_keys(&mut console, "y");
        }
    }
    console.inbox.collect();
    console.take_arrived();
    console.close_link();
    let recorded = |name| std::fs::read_to_string(folder.path().join(name)).expect("a recording");
    // The second session has a recording of its own beside the first one's.
    let (first_heard, second_heard) = (recorded("it.cast"), recorded("it-2.cast"));
    let greeting = |pty: &Pty| format!("hello from {}", pty.path().display());
    assert!(first_heard.contains(&greeting(&first)) && first_heard.contains("last words"), "{first_heard}");
    assert!(second_heard.contains(&greeting(&second)), "{second_heard}");
    assert!(!second_heard.contains("last words") && !first_heard.contains(&greeting(&second)));
}

#[test]
fn what_the_reader_has_brought_counts_also_behind_the_loss_of_the_link() {
    let folder = tempfile::tempdir().expect("a folder");
    let pty = Pty::open(115_200).expect("a port");
    let mut console = console();
    console.world.recording = Plan::File(folder.path().join("it.cast"));
    type_keys(&mut console, &format!("1p{}\r", pty.path().display()));
    say(&console, "last words\r\n");
    console.lose_link(failure());
    let recorded = std::fs::read_to_string(folder.path().join("it.cast")).expect("a recording");
    assert!(recorded.contains("hello from") && recorded.contains("last words"), "{recorded}");
}

#[test]
fn a_path_of_nothing_is_told_as_what_it_is() {
    let mut console = console();
    type_keys(&mut console, "lp/nowhere/x.S\r");
    let words = "There is no such file: /nowhere/x.S";
    for _ in 0..2 {
        // The folder's list, and what came of the path.
        let answer = console.answers.recv_timeout(Duration::from_secs(60)).expect("an answer");
        console.handle(answer);
    }
    let mut terminal = Terminal::new(TestBackend::new(80, 24)).expect("a test backend");
    terminal.draw(|frame| console.app.draw(frame)).expect("drawing in memory");
    let picture = terminal.backend().to_string();
    assert!(picture.contains(words) && picture.contains("› /nowhere/x.S"), "{picture}");
}

#[test]
fn a_lost_link_is_looked_for_also_after_c_was_pressed_too_early() {
    let folder = tempfile::tempdir().expect("a folder");
    let (pty, name) = (Pty::open(115_200).expect("a port"), folder.path().join("unit"));
    let plug_in = || std::os::unix::fs::symlink(pty.path(), &name).expect("a link");
    plug_in();
    let mut console = console();
    type_keys(&mut console, &format!("1p{}\r", name.display()));
    assert!(console.link.is_some());
    std::fs::remove_file(&name).expect("removed");
    console.lose_link(failure());
    type_keys(&mut console, "c");
    assert!(console.link.is_none() && console.retry.is_some(), "there is nothing to open yet");
    plug_in();
    console.look_for_link();
    assert!(console.link.is_some() && console.retry.is_none());
}

#[test]
fn files_are_written_in_their_order_beside_the_loop_and_are_whole_when_it_ends() {
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("rows.csv");
    let mut console = console();
    let created = |text: &str| Effect::CreateFile { path: path.clone(), bytes: text.into() };
    let appended = |text: &str| Effect::AppendFile { path: path.clone(), bytes: text.into() };
    console.perform(vec![created("a"), appended("b"), appended("c")]);
    // The file of somebody else: what was to stand behind a new one is not put into it.
    let theirs = folder.path().join("theirs.csv");
    std::fs::write(&theirs, "theirs").expect("written");
    let more = Effect::AppendFile { path: theirs.clone(), bytes: "ours".into() };
    console.perform(vec![Effect::CreateFile { path: theirs.clone(), bytes: "ours".into() }, more]);
    let answer = || console.answers.recv_timeout(Duration::from_secs(60)).expect("an answer");
    assert!(matches!(answer(), Input::FileWritten { result: Ok(()), .. }));
    assert!(matches!(answer(), Input::FileWritten { result: Err(_), .. }), "it is there already");
    drop(console);
    let written = |path| std::fs::read_to_string(path).expect("there");
    assert_eq!((written(&path), written(&theirs)), ("abc".into(), "theirs".into()));
}
