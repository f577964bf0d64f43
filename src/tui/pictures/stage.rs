//! A console, a user, and a world that does what the test says; what it shows and holds.

use std::path::PathBuf;

use ratatui::Terminal;
use ratatui::backend::TestBackend;
use ratatui::crossterm::event::{
    Event as TerminalEvent, KeyCode, KeyEvent, KeyModifiers, MouseButton, MouseEvent, MouseEventKind,
};

use crate::canopen::{ObjectAddress, Value};
use crate::device::Product;
use crate::device::dictionary::{Entry, Object};
use crate::endpoint::Transmit;
use crate::image::{DefectId, make};
use crate::record::Span;
use crate::session::{
    DictionaryReading, Event, Facts, LoadReport, Outcome, Phase, Progress, Proof, ReadEntry, UnitNow, UnitState,
    Verdict, WalkEnd,
};
use crate::time::{Duration, Instant};
use crate::tui::{
    App, Effect, Failure, FileEntry, FileKind, ImageFacts, Input, LinkInfo, LinkKind, Noted, Options, Palette,
    PortEntry, Recorded, RecordingEntry, RecordingList,
};
use crate::version::Version;
use crate::wire::LoaderError;
use crate::wire::dictionary::{Reading, Shown};

pub(super) const SMALL: (u16, u16) = (80, 24);
pub(super) const LARGE: (u16, u16) = (200, 60);
/// 12:00:00 is the start of time here.
pub(super) const NOON: Duration = Duration::from_secs(12 * 3600);

pub(super) const BANNER: &[u8] = b"\r\nAxiomatic Technologies Corporation\r\nAXTC4CO 4 Thermocouple Scanner\r\n\
    Software Version V1.1.0, built 2026-01-31 12:00:00\r\n\r\n";
pub(super) const MENU: &[u8] = b"\r\nMain Menu - AXTC4CO V1.1.0\r\n  V - View Object Dictionary\r\n\
    \x20 D - Default Object Dictionary\r\n  T - Toggle RS-232 Stream On/Off\r\n  S - Show/Stop Diagnostics\r\n\
    \x20 L - Load New Software\r\nCANopen: Node-ID 127 (0x7F), Baud Rate 125 kbit/s, State Pre-Operational\r\n";

/// The console, a user and a world that does what the test says.
pub(super) struct Stage {
    pub(super) app: App,
    pub(super) size: (u16, u16),
    pub(super) now: Instant,
    pub(super) effects: Vec<Effect>,
    /// The link that was opened last.
    link: String,
}

impl Stage {
    pub(super) fn new(size: (u16, u16)) -> Self {
        Stage::on(size, None)
    }

    /// Started with this link.
    pub(super) fn on(size: (u16, u16), link: Option<String>) -> Self {
        let options = Options {
            link,
            directory: PathBuf::from("/home/service/images"),
            home: Some("/home/service".into()),
            palette: Palette::Mono,
            size,
        };
        let mut app = App::new(options);
        let effects = app.start();
        Stage { app, size, now: Instant::ZERO, effects, link: "/dev/ttyUSB0".into() }
    }

    /// Connected to a port with a unit that has answered.
    pub(super) fn connected(size: (u16, u16)) -> Self {
        Stage::connected_to(size, str::to_owned)
    }

    /// Connected to a port with a unit that says of itself what this makes of the usual words.
    fn connected_to(size: (u16, u16), words: impl Fn(&str) -> String) -> Self {
        let mut stage = Stage::with_ports(size);
        stage.press(KeyCode::Enter);
        stage.opened("/dev/ttyUSB0");
        for said in [BANNER, MENU] {
            stage.bytes(words(&String::from_utf8_lossy(said)).as_bytes());
        }
        stage.wait(3000);
        stage
    }

    /// Connected to the unit with eight channels.
    pub(super) fn connected_to_eight(size: (u16, u16)) -> Self {
        Stage::connected_to(size, |words| {
            words.replace("4 Thermocouple", "8 Channel RTD").replace("AXTC4CO", "AXRTD8CO").replace("V1.1.0", "V2.1.1")
        })
    }

    pub(super) fn with_ports(size: (u16, u16)) -> Self {
        let mut stage = Stage::new(size);
        let port = |link: &str, description: &str, busy_by: Option<&str>| PortEntry {
            link: link.into(),
            description: description.into(),
            busy_by: busy_by.map(str::to_owned),
        };
        stage.input(Input::PortsListed(Ok(vec![
            port("/dev/ttyUSB0", "USB, FTDI FT232R USB UART, 0403:6001, AX12345", None),
            port("/dev/ttyUSB1", "USB, Prolific PL2303, 067b:2303", Some("picocom, process 4711")),
            port("/dev/ttyS0", "serial port of this computer", None),
        ])));
        stage
    }

    /// Connected, with the stream on for a while and a loose wire.
    pub(super) fn streaming(size: (u16, u16)) -> Self {
        Stage::connected(size).with_rows()
    }

    /// Connected to a unit with eight channels that has said no more than its rows: wires break, and once it was away.
    pub(super) fn eight_channels(size: (u16, u16)) -> Self {
        let mut stage = Stage::with_ports(size);
        stage.press(KeyCode::Enter).opened("/dev/ttyUSB0");
        for second in 0..40 {
            let broken = |channel| channel == 2 && second > 9 || channel == 5 && (second / 4) % 3 == 1;
            let value =
                |channel| if broken(channel) { "Open  ".into() } else { format!("{:6.1}", 20.0 + f64::from(channel)) };
            let row = (0..8).map(value).collect::<Vec<_>>().join(";") + "\r\n";
            stage.wait(if second == 30 { 20_000 } else { 1000 }).bytes(row.as_bytes());
        }
        stage
    }

    pub(super) fn with_rows(self) -> Self {
        let mut stage = self;
        for second in 0..90u32 {
            let swing = f64::from(second % 30) * 0.37;
            let third = if (40..52).contains(&second) || second >= 80 {
                "OpenCct ".into()
            } else {
                format!("{:8.3}", 410.0 + swing)
            };
            let row = format!("{:8.3};{:8.3};{:8.3};{third};Disabled\r\n", 23.5, 181.25 + swing, 96.0 - swing);
            stage.wait(1000).bytes(row.as_bytes());
        }
        stage
    }

    pub(super) fn opened(&mut self, link: &str) -> &mut Self {
        self.link = link.to_owned();
        self.input(Input::LinkOpened(link_info(link)))
    }

    pub(super) fn lost(&mut self) -> &mut Self {
        self.input(Input::LinkGone(Failure {
            text: format!("cannot read from {}: the port has gone", self.link),
            hints: vec!["Plug the adapter in again.".into()],
        }))
    }

    /// On the dictionary screen, the unit's read: two channels set differently, one entry not shown.
    pub(super) fn with_dictionary(size: (u16, u16)) -> Self {
        let mut stage = Stage::connected(size);
        stage.keys("v").press(KeyCode::Enter);
        let reading = |(at, object, entry): (ObjectAddress, &Object, &Entry)| {
            let value = match (at.index, at.sub) {
                (0x6110, 2) => Some(Value::Unsigned16(2)),
                (0x6112, 4) => Some(Value::Unsigned8(0)),
                (0x4000, 3) => Some(Value::Integer16(1000)),
                (0x2100, sub @ 1..) => Some(Value::Real32(137.5 + f32::from(sub))),
                _ => entry.default.map(|default| default.on_node(127)),
            };
            let text = format!("{} = {}", object.name, value.map_or_else(|| "?".to_owned(), |value| value.to_string()));
            let reading = match value {
                Some(value) => Reading { shown: Shown::Value(value), numeral: value.to_string(), plain: false },
                None => Reading { shown: Shown::Nothing, numeral: text.clone(), plain: false },
            };
            ReadEntry { at, text, span: Span::default(), reading: Some(reading) }
        };
        let entries = axtc4co().dictionary.entries().filter(|(at, _, _)| *at != ObjectAddress::new(0x5010, 0));
        let reading =
            DictionaryReading { entries: entries.map(reading).collect(), end: WalkEnd::Whole, unrecognised_lines: 3 };
        stage.fold(Event::Finished(Outcome::DictionaryRead(Box::new(reading))));
        stage
    }

    /// On the screen of recordings, two there.
    pub(super) fn with_recordings(mut self) -> Self {
        self.keys("8");
        self.recordings(vec![
            recording("2026-01-31 11:00:00", "/dev/ttyUSB0", 1, Some(Duration::from_secs(300))),
            recording("2026-01-30 09:15:00", "rfc2217://terminal-server-in-hall-4:4001", 2, None),
        ]);
        self
    }

    /// These recordings are there, and no others.
    pub(super) fn recordings(&mut self, entries: Vec<RecordingEntry>) -> &mut Self {
        self.input(Input::RecordingsListed(Ok(RecordingList { entries, older: 0 })))
    }

    /// On the load screen, the folder read.
    pub(super) fn picking(mut self) -> Self {
        self.keys("l");
        self.input(Input::FilesListed { directory: "/home/service/images".into(), entries: Ok(files()) });
        self
    }

    /// On the load screen, a file checked.
    pub(super) fn with_image(self, facts: ImageFacts) -> Self {
        let mut stage = self.picking();
        stage.keys("p").keys(&facts.path.to_string_lossy()).press(KeyCode::Enter);
        stage.input(Input::ImageChecked(Box::new(facts)));
        stage
    }

    pub(super) fn input(&mut self, input: Input) -> &mut Self {
        let effects = self.app.handle(self.now, input);
        self.effects.extend(effects);
        self
    }

    pub(super) fn key(&mut self, code: KeyCode, modifiers: KeyModifiers) -> &mut Self {
        self.input(Input::Terminal(TerminalEvent::Key(KeyEvent::new(code, modifiers))))
    }

    pub(super) fn press(&mut self, code: KeyCode) -> &mut Self {
        self.key(code, KeyModifiers::NONE)
    }

    pub(super) fn keys(&mut self, text: &str) -> &mut Self {
        text.chars().for_each(|character| {
            self.press(KeyCode::Char(character));
        });
        self
    }

    /// Clicks on a text, where it appears first.
    pub(super) fn click(&mut self, text: &str) -> &mut Self {
        let picture = self.picture();
        let (row, line) = picture.lines().enumerate().find(|(_, line)| line.contains(text)).expect(text);
        let column = line.split(text).next().map_or(0, |before| before.chars().count()) as u16 + 1;
        let kind = MouseEventKind::Down(MouseButton::Left);
        let mouse = MouseEvent { kind, column, row: row as u16, modifiers: KeyModifiers::NONE };
        self.input(Input::Terminal(TerminalEvent::Mouse(mouse)))
    }

    /// The terminal has another size now.
    pub(super) fn resized(&mut self, size: (u16, u16)) -> &mut Self {
        self.size = size;
        self.input(Input::Terminal(TerminalEvent::Resize(size.0, size.1)))
    }

    /// What a terminal sends for Ctrl-].
    pub(super) fn prefix(&mut self) -> &mut Self {
        self.key(KeyCode::Char('5'), KeyModifiers::CONTROL)
    }

    pub(super) fn bytes(&mut self, bytes: &[u8]) -> &mut Self {
        self.input(Input::Bytes(bytes.to_vec()))
    }

    /// Lets time pass, waking the console when it wants to be.
    pub(super) fn wait(&mut self, millis: u64) -> &mut Self {
        let end = self.now + Duration::from_millis(millis);
        while let Some(due) = self.app.poll_timeout().filter(|&due| due <= end) {
            self.now = self.now.max(due);
            self.input(Input::Timeout);
        }
        self.now = end;
        self
    }

    pub(super) fn fold(&mut self, event: Event) -> &mut Self {
        self.fold_with(event, &Facts::default())
    }

    pub(super) fn fold_with(&mut self, event: Event, facts: &Facts) -> &mut Self {
        self.app.fold(self.now, &event, facts);
        self
    }

    pub(super) fn finished(&mut self, outcome: Outcome) -> &mut Self {
        self.fold_with(Event::Finished(outcome), &Facts::default())
    }

    /// Connected to a port with a unit that waits in its loader; on that port an upload was begun once.
    pub(super) fn in_loader(size: (u16, u16), noted: Option<Noted>) -> Self {
        let mut stage = Stage::with_ports(size);
        stage.press(KeyCode::Enter).input(Input::LinkOpened(LinkInfo { noted, ..link_info("/dev/ttyUSB0") }));
        stage.fold_with(Event::FactsChanged, &Facts { state: UnitState::Loader, ..Facts::default() });
        stage.finished(Outcome::Identified);
        stage
    }

    /// In the middle of an upload: the unit waits in its loader for the file, and takes it.
    pub(super) fn in_transfer(size: (u16, u16)) -> Self {
        let mut stage = Stage::connected(size).with_image(good_image());
        stage.bytes(b"\r\nWaiting for application S-Record.\r\n").bytes(&[b'.'; 57]);
        stage.fold(Event::Progress(progress()));
        stage
    }

    /// The upload has been started with the password.
    pub(super) fn loading(size: (u16, u16)) -> Self {
        let mut stage = Stage::connected(size).with_image(good_image());
        stage.press(KeyCode::Enter).keys("AXIO-2010").press(KeyCode::Enter);
        stage
    }

    /// What has left for the unit since the last question.
    pub(super) fn sent(&mut self) -> Vec<u8> {
        let sent = self.effects.iter().filter_map(|effect| match effect {
            Effect::Transmit(Transmit { bytes, .. }) => Some(bytes.clone()),
            _ => None,
        });
        let sent = sent.flatten().collect();
        self.effects.clear();
        sent
    }

    pub(super) fn asked(&mut self) -> Vec<Effect> {
        std::mem::take(&mut self.effects)
    }

    /// The file that the console wants written is written.
    pub(super) fn written(&mut self) -> &mut Self {
        let path = self.effects.iter().rev().find_map(|effect| match effect {
            Effect::CreateFile { path, .. } => Some(path.clone()),
            _ => None,
        });
        self.input(Input::FileWritten { path: path.expect("a file"), result: Ok(()) })
    }

    pub(super) fn draw(&self) -> TestBackend {
        let mut terminal = Terminal::new(TestBackend::new(self.size.0, self.size.1)).expect("a test backend");
        terminal.draw(|frame| self.app.draw(frame)).expect("drawing in memory");
        terminal.backend().clone()
    }

    pub(super) fn picture(&self) -> String {
        let lines = self.draw().to_string();
        // The backend quotes its lines; the quotes keep blanks at the end in sight and are of no use here.
        lines.lines().map(|line| line.trim_matches('"').trim_end()).collect::<Vec<_>>().join("\n")
    }

    pub(super) fn shows(&self, text: &str) -> bool {
        self.picture().contains(text)
    }
}

/// A recording that can be read, named by when it was begun.
pub(super) fn recording(begun: &str, port: &str, part: u32, length: Option<Duration>) -> RecordingEntry {
    let path = cast_file(begun, port, part);
    RecordingEntry {
        link: format!("replay:{path}"),
        path,
        bytes: 1_234_567,
        content: Ok(Recorded { begun: begun.into(), port: port.into(), part, length, is_being_written: false }),
    }
}

/// Where such a recording lies.
pub(super) fn cast_file(begun: &str, port: &str, part: u32) -> String {
    let digits: String = begun.chars().filter(char::is_ascii_digit).collect();
    let (day, time) = digits.split_at(8);
    let port = port.trim_start_matches("/dev/").replace(|sign: char| !sign.is_ascii_alphanumeric(), "_");
    let part = if part == 1 { String::new() } else { format!(".p{part:05}") };
    format!("/home/service/.local/state/axcon/recordings/{day}T{time}Z-{port}-4711{part}.cast")
}

/// A file with the name of a recording, and why it is not one.
pub(super) fn no_recording(path: &str, why: &str) -> RecordingEntry {
    RecordingEntry { link: format!("replay:{path}"), path: path.into(), bytes: 12, content: Err(why.into()) }
}

/// Bytes of an image of the usual size, as a file with two characters at the end of each line.
const IMAGE_BYTES: usize = 245_816;
/// Characters of it that a loader gets.
const CHARACTERS: usize = 242_742;

/// What is in the folder of images.
pub(super) fn files() -> Vec<FileEntry> {
    let file = |name: &str, bytes, begins: &str| FileEntry {
        name: name.into(),
        kind: FileKind::File,
        bytes,
        begins: begins.as_bytes().to_vec(),
        modified: Some("2026-01-31 12:00".into()),
    };
    let folder = FileEntry { name: "bad".into(), kind: FileKind::Folder, bytes: 0, begins: Vec::new(), modified: None };
    vec![
        file("AXTC4CO_V1.2.0.elf.S", IMAGE_BYTES as u64, ""),
        folder,
        file("AXTC4CO_V1.1.0.elf.S", IMAGE_BYTES as u64, ""),
        file("readme.txt", 99, ""),
        file("before.json", 31_250, r#"{"schema":"axcon.dictionary/1","product":"AXTC4CO""#),
    ]
}

pub(super) fn link_info(link: &str) -> LinkInfo {
    let (scheme, product) = link.split_once(':').unwrap_or_default();
    let emulated = Product::named(product).filter(|_| scheme.eq_ignore_ascii_case("emu"));
    LinkInfo {
        link: link.into(),
        baud: 115_200,
        kind: emulated.map_or(LinkKind::Unit, LinkKind::Emulated),
        noted: None,
        recording: Some(cast_file("2026-01-31 12:00:00", link, 1)),
        start_of_day: NOON,
        start_millis: 1_769_860_800_000,
    }
}

pub(super) fn noted(product: &str) -> Option<Noted> {
    Some(Noted {
        product: product.into(),
        image: "/home/service/images/AXTC4CO_V1.2.0.elf.S".into(),
        ran: None,
        begun: "2026-01-30 16:20:00".into(),
    })
}

pub(super) fn axtc4co() -> &'static Product {
    Product::named("AXTC4CO").expect("built in")
}

pub(super) fn good_image() -> ImageFacts {
    let recipe =
        make::Recipe { target: &axtc4co().target(), version: Version::new(1, 2, 0), words: 0xC000, flaw: None };
    let file = make::make(&recipe).expect("an image of the usual size");
    let targets: Vec<_> = Product::all().iter().map(Product::target).collect();
    let report = crate::image::check(file.as_slice(), None, &targets, None, &[]).expect("a slice");
    assert_eq!((report.facts.size, report.facts.characters), (IMAGE_BYTES as u64, CHARACTERS as u64));
    ImageFacts::of_report("/home/service/images/AXTC4CO_V1.2.0.elf.S".into(), &report, None, &[])
}

/// What the checker says of a file that is sound but for not saying what it is; these errors are allowed.
pub(super) fn nameless_image(allow: &[DefectId]) -> ImageFacts {
    let (target, flaw) = (axtc4co().target(), Some(DefectId::NoIdentity));
    let recipe = make::Recipe { target: &target, version: Version::new(1, 2, 0), words: 320, flaw };
    let file = make::make(&recipe).expect("a small image");
    let targets: Vec<_> = Product::all().iter().map(Product::target).collect();
    let report = crate::image::check(file.as_slice(), None, &targets, None, allow).expect("a slice");
    ImageFacts::of_report("/home/service/images/no-identity.elf.S".into(), &report, None, allow)
}

/// A page of diagnostics of a unit with eight channels, the first of them shorted.
pub(super) fn page_of_eight() -> Vec<u8> {
    let mut page =
        String::from("Diagnostics   up 0:00:12\r\nSupply Voltage     24.10 V\r\nSource Current      4.000 mA\r\n");
    for channel in 1..=8 {
        let value = if channel == 1 { "   Short".to_owned() } else { format!("{:8.1}", 100.0 + f64::from(channel)) };
        page.push_str(&format!(
            "RTD{channel} {value} C   raw {:7} uV   {:8.2} Ohm   PV {:6}   status 0x00\r\n",
            4000 + channel,
            138.5 + f64::from(channel),
            1000 + channel
        ));
    }
    page.push_str("Active Errors              1\r\n");
    page.into_bytes()
}

/// What the checker says of a good file in which an editor has replaced digits and cut the end off.
pub(super) fn bad_image() -> ImageFacts {
    let recipe =
        make::Recipe { target: &axtc4co().target(), version: Version::new(1, 2, 0), words: 0xC000, flaw: None };
    let text = String::from_utf8(make::make(&recipe).expect("an image of the usual size")).expect("ASCII");
    let spoil = |(number, line): (usize, &str)| match number % 7 {
        3 if number < 200 => format!("{}ZZ{}\n", &line[..20], &line[22..]),
        5 if number < 100 => format!("{}\n", &line[..line.len() - 6]),
        _ => format!("{line}\n"),
    };
    let file: String = text.lines().take(2000).enumerate().map(spoil).collect();
    let targets: Vec<_> = Product::all().iter().map(Product::target).collect();
    let report = crate::image::check(file.as_bytes(), None, &targets, None, &[]).expect("a slice");
    ImageFacts::of_report("/home/service/images/bad.S".into(), &report, None, &[])
}

pub(super) fn progress() -> Progress {
    Progress {
        phase: Phase::Transfer,
        records: 1448,
        records_total: 3074,
        bytes: 114_392,
        bytes_total: CHARACTERS,
        address: 0x5a80,
        elapsed: Duration::from_secs(10),
        moving: Duration::from_millis(9_950),
        moved: 114_280,
        held: None,
        again: false,
    }
}

pub(super) fn report(verdict: Verdict, unit: UnitNow) -> LoadReport {
    LoadReport {
        verdict,
        proof: Proof::Banner,
        phase: Phase::Transfer,
        unit,
        product: Some("AXTC4CO".into()),
        version_before: Some(Version::new(1, 1, 0)),
        version_after: None,
        records: 1448,
        records_total: 3074,
        address: Some(0x5a80),
        duration: Duration::from_secs(11),
        what: format!("the loader reports error {}", LoaderError::Number(4)),
        heard: "Error # 0004\u{1b}[2J Restarting.".into(),
        found_in_loader: false,
        password_sent: true,
        misfit: None,
        remark: None,
    }
}

pub(super) fn typed(mut stage: Stage, keys: &str) -> Stage {
    stage.keys(keys);
    stage
}

pub(super) fn pressed(mut stage: Stage, code: KeyCode) -> Stage {
    stage.press(code);
    stage
}

/// On the terminal, asked for a file to send.
pub(super) fn to_send(size: (u16, u16)) -> Stage {
    let mut stage = Stage::connected(size);
    stage.keys("3").prefix().keys("f");
    stage.input(Input::FilesListed { directory: "/home/service/images".into(), entries: Ok(files()) });
    stage
}

/// A file is chosen and read; it is asked once more.
pub(super) fn asked_to_send(size: (u16, u16), name: &str) -> Stage {
    let mut stage = to_send(size);
    stage.keys(name).press(KeyCode::Enter);
    let path = format!("/home/service/images/{name}").into();
    stage.input(Input::BytesRead { path, bytes: Ok(vec![b'S'; IMAGE_BYTES]) });
    stage
}
