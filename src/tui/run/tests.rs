//! The loop without its terminal: what happens around links that no machine in virtual time can show.

use std::sync::mpsc::sync_channel;

use ratatui::Terminal;
use ratatui::backend::TestBackend;
use ratatui::crossterm::event::KeyCode;

use super::answers::Found;
use super::*;
use crate::host::LinkId;
use crate::host::link::Options as LinkOptions;
use crate::host::pty::Pty;

/// A screen in memory.
struct Paper(Terminal<TestBackend>);

impl Paper {
    fn new() -> Self {
        Paper(Terminal::new(TestBackend::new(80, 24)).expect("a test backend"))
    }

    fn picture(&mut self, console: &Console) -> String {
        self.draw(&console.app).expect("drawing in memory");
        self.0.backend().to_string()
    }
}

impl Canvas for Paper {
    fn size(&self) -> io::Result<Size> {
        Ok(self.0.size().expect("a test backend"))
    }

    fn draw(&mut self, app: &App) -> io::Result<()> {
        self.0.draw(|frame| app.draw(frame)).expect("drawing in memory");
        Ok(())
    }

    fn suspend(&mut self) -> io::Result<()> {
        Ok(())
    }

    fn retake(&mut self) -> io::Result<()> {
        Ok(())
    }
}

/// A console that has been told nothing yet.
fn console() -> Console {
    console_and_keys().0
}

/// The same, and where its keys are typed.
fn console_and_keys() -> (Console, SyncSender<TerminalEvent>) {
    let world = World {
        link: None,
        baud: 115_200,
        recording: Plan::Nothing,
        palette: Palette::Mono,
        resolve: |name| Ok(LinkSpec::Serial(name.into())),
        open: |spec, baud, clock, inputs| {
            let connection = Connection::open(spec, LinkOptions { baud }, clock, inputs.clone());
            let connection = connection.map_err(|error| Failure { text: error.to_string(), hints: Vec::new() })?;
            // A reader that is quicker than the code that opens the link.
            let (link, bytes) = (connection.id(), format!("hello from {}\r\n", spec).into_bytes());
            inputs.send(host::Input::Bytes { link, at: clock.now(), bytes }).expect("there is room");
            Ok(connection)
        },
        explain: |error| Failure { text: error.to_string(), hints: Vec::new() },
        unreadable: |error| Failure { text: error.to_string(), hints: Vec::new() },
        check: |_, _, _| Err("nobody asks for it here".into()),
        note: |_, _| {},
        noted: |_| None,
        incomplete: |_| {},
    };
    let app =
        App::new(Options { link: None, directory: PathBuf::new(), home: None, palette: Palette::Mono, size: (80, 24) });
    let (sender, inputs) = host::channel();
    let (typed, keys) = sync_channel(1);
    let console = Console::new(app, world, Clock::start(), sender, inputs, keys);
    (console.expect("a thread for files"), typed)
}

/// What a thread reports next.
fn found(console: &Console) -> Found {
    console.answers.recv_timeout(std::time::Duration::from_secs(60)).expect("an answer")
}

/// The same, where it is an input for the app.
fn answer(console: &Console) -> Input {
    match found(console) {
        Found::News(input) | Found::Answer(_, input) => input,
        Found::Dialled(_) | Found::Recording(_) => panic!("no link is opened here"),
    }
}

fn key(character: char) -> TerminalEvent {
    let code = if character == '\r' { KeyCode::Enter } else { KeyCode::Char(character) };
    TerminalEvent::Key(code.into())
}

fn type_keys(console: &mut Console, keys: &str) {
    for character in keys.chars() {
        console.handle(Input::Terminal(key(character)));
    }
}

/// What the unit says over the open link just now.
fn say(console: &Console, text: &str) {
    let link = console.connection().expect("a link").id();
    let bytes = host::Input::Bytes { link, at: console.clock.now(), bytes: text.into() };
    console.sender.send(bytes).expect("there is room");
}

fn failure() -> Failure {
    Failure { text: "the port has gone".into(), hints: Vec::new() }
}

#[test]
fn pictures_come_thirty_times_a_second_at_most_and_what_a_key_changes_at_once() {
    assert!(FRAME * 30 >= Duration::from_secs(1));
    let mut pace = Pace { next: Instant::ZERO, hurries: false };
    pace.drawn(Instant::ZERO);
    assert_eq!(pace.due(), Instant::ZERO + FRAME);
    pace.hurries = true;
    assert_eq!(pace.due(), Instant::ZERO);
    // The next one pays for it.
    pace.drawn(Instant::from_millis(1));
    assert_eq!(pace.due(), Instant::ZERO + FRAME * 2);
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
fn what_the_reader_has_brought_counts_also_after_the_loss_of_the_link() {
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
        let answer = answer(&console);
        console.handle(answer);
    }
    let picture = Paper::new().picture(&console);
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
    assert!(console.connection().is_some());
    std::fs::remove_file(&name).expect("removed");
    console.lose_link(failure());
    type_keys(&mut console, "c");
    let retry = |console: &Console| console.cable.as_ref().and_then(Cable::retry_at);
    let next = retry(&console).expect("it is looked for");
    console.look_for_link(next);
    assert!(console.connection().is_none(), "there is nothing to open yet");
    plug_in();
    console.look_for_link(retry(&console).expect("it is looked for again"));
    assert!(console.connection().is_some() && retry(&console).is_none());
}

#[test]
fn files_are_written_in_their_order_beside_the_loop_and_are_whole_when_it_ends() {
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("rows.csv");
    let mut console = console();
    let created = |text: &str| Effect::CreateFile { path: path.clone(), bytes: text.into() };
    let appended = |text: &str| Effect::AppendFile { path: path.clone(), bytes: text.into() };
    console.perform(vec![created("a"), appended("b"), appended("c")]);
    // The file of somebody else: what was to follow in a new one is not put into it.
    let theirs = folder.path().join("theirs.csv");
    std::fs::write(&theirs, "theirs").expect("written");
    let more = Effect::AppendFile { path: theirs.clone(), bytes: "ours".into() };
    console.perform(vec![Effect::CreateFile { path: theirs.clone(), bytes: "ours".into() }, more]);
    assert!(matches!(answer(&console), Input::FileWritten { result: Ok(()), .. }));
    assert!(matches!(answer(&console), Input::FileWritten { result: Err(_), .. }), "it already exists");
    assert_eq!(console.into_writer().finish(std::time::Duration::from_secs(60)), Vec::<PathBuf>::new());
    let written = |path| std::fs::read_to_string(path).expect("there");
    assert_eq!((written(&path), written(&theirs)), ("abc".into(), "theirs".into()));
}

#[test]
fn an_answer_is_taken_also_when_the_channel_had_no_room_to_wake_the_loop() {
    let mut console = console();
    let mut paper = Paper::new();
    let byte = || host::Input::Bytes { link: LinkId::next(), at: Instant::ZERO, bytes: vec![0] };
    while console.sender.try_send(byte()).is_ok() {}
    console.reporter.report(Input::PortsListed(Err("they are on strike".into())));
    console.turn(&mut paper);
    let picture = paper.picture(&console);
    assert!(picture.contains("they are on strike"), "{picture}");
}

#[test]
fn the_loop_ends_when_the_user_leaves_and_when_the_terminal_fails() {
    let (mut console, keys) = console_and_keys();
    keys.send(key('q')).expect("there is room");
    assert_eq!(console.serve(&mut Paper::new()).ok(), Some(End::Quit));

    struct Torn;
    impl Canvas for Torn {
        fn size(&self) -> io::Result<Size> {
            Ok(Size::new(80, 24))
        }
        fn draw(&mut self, _: &App) -> io::Result<()> {
            Err(io::Error::other("torn"))
        }
        fn suspend(&mut self) -> io::Result<()> {
            Ok(())
        }
        fn retake(&mut self) -> io::Result<()> {
            Ok(())
        }
    }
    let error = self::console().serve(&mut Torn).expect_err("there is nothing to draw on");
    assert_eq!(error.to_string(), "torn");
}

#[test]
fn what_is_not_a_regular_file_is_refused_and_not_waited_for() {
    let folder = tempfile::tempdir().expect("a folder");
    let pipe = folder.path().join("pipe.S");
    let made = std::process::Command::new("mkfifo").arg(&pipe).status().expect("a program of every Unix");
    assert!(made.success());
    let mut console = console();
    let check = Effect::CheckImage { path: pipe.clone(), loader: None, allow: Vec::new() };
    console.perform(vec![check, Effect::ReadFile(pipe.clone())]);
    for _ in 0..2 {
        let (Input::ImageUnreadable { why, .. } | Input::FileRead { text: Err(why), .. }) = answer(&console) else {
            panic!("it was read");
        };
        assert_eq!(why, "it is not a regular file");
    }
    console.world.resolve = |name| Ok(LinkSpec::Replay(name.into()));
    type_keys(&mut console, &format!("1p{}\r", pipe.display()));
    let opened = found(&console);
    console.take_found(opened);
    let picture = Paper::new().picture(&console);
    assert!(picture.contains("Not connected") && picture.contains("a regular file"), "{picture}");
}

#[test]
fn the_same_is_not_asked_twice_at_a_time_however_often_a_key_wants_it() {
    let folder = tempfile::tempdir().expect("a folder");
    let mut console = console();
    let list = |place: &std::path::Path| Effect::ListFiles(place.to_owned());
    let other = folder.path().join("other");
    console.perform(vec![list(folder.path()), list(folder.path()), list(folder.path()), list(&other)]);
    assert_eq!(console.inquiries.len(), 2, "each is asked once");
    let mut listed = Vec::new();
    while !console.inquiries.is_empty() {
        let found = found(&console);
        if let Found::Answer(_, Input::FilesListed { directory, .. }) = &found {
            listed.push(directory.clone());
        }
        console.take_found(found);
    }
    listed.sort();
    // What was asked for meanwhile is looked at once more: it may have changed.
    assert_eq!(listed, [folder.path(), folder.path(), other.as_path()]);
}

#[test]
fn a_journal_that_keeps_everybody_waiting_does_not_keep_an_upload() {
    let mut console = console();
    console.world.note = |_, _| loop {
        std::thread::park();
    };
    let noted = Noted { product: "AXTC4CO".into(), image: "a.S".into(), ran: None, begun: "today".into() };
    console.perform(vec![Effect::UploadBegins { link: "u0".into(), noted }, Effect::Quit]);
    assert!(console.quits);
}

#[test]
fn a_journal_that_keeps_everybody_waiting_does_not_keep_a_link() {
    let pty = Pty::open(115_200).expect("a port");
    let mut console = console();
    console.world.noted = |_| loop {
        std::thread::park();
    };
    type_keys(&mut console, &format!("1p{}\r", pty.path().display()));
    assert!(console.connection().is_some());
}

#[test]
fn a_recording_is_opened_beside_the_loop_and_not_played_to_a_user_who_has_gone_on() {
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("it.cast");
    std::fs::write(&path, "{\"version\": 2, \"width\": 80, \"height\": 24}\n").expect("written");
    let mut console = console();
    console.world.resolve = |name| Ok(LinkSpec::Replay(name.into()));
    for is_awaited in [false, true] {
        type_keys(&mut console, &format!("1p{}\r", path.display()));
        assert!(console.player.is_none(), "a disk may take its time");
        if !is_awaited {
            console.handle(Input::Terminal(TerminalEvent::Key(KeyCode::Esc.into())));
        }
        let opened = found(&console);
        assert!(matches!(opened, Found::Recording(_)));
        console.take_found(opened);
        assert_eq!(console.player.is_some(), is_awaited);
    }
}

#[test]
fn the_screens_write_links_as_the_loop_reads_them() {
    for product in crate::device::Product::all() {
        let name = crate::tui::link_name::emulated(product);
        assert_eq!(name.parse(), Ok(LinkSpec::Emulated(product)));
    }
    let expanded = crate::tui::link_name::expanded("Replay:~/a.cast", Some("/home/me".as_ref()));
    assert_eq!(expanded.parse(), Ok(LinkSpec::Replay("/home/me/a.cast".into())));
}
