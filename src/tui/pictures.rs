//! Keys in, picture out.
//!
//! What a person reads is held in snapshots, at the smallest size and at a large one; what keys do is said in
//! sentences. The unit is played by the bytes it would send.

use std::path::PathBuf;

use insta::assert_snapshot;
use ratatui::Terminal;
use ratatui::backend::TestBackend;
use ratatui::crossterm::event::{
    Event as TerminalEvent, KeyCode, KeyEvent, KeyEventKind, KeyModifiers, MouseButton, MouseEvent, MouseEventKind,
};

use super::{
    App, Effect, Failure, FileEntry, FileKind, ImageFacts, Input, LinkInfo, Noted, Options, Pace, Palette, Playback,
    Playing, PortEntry, RecordingEntry,
};
use crate::canopen::{ObjectAddress, Value};
use crate::device::Product;
use crate::device::dictionary::{Entry, Object};
use crate::dump::Dump;
use crate::endpoint::Transmit;
use crate::image::make;
use crate::record::Span;
use crate::session::{
    DictionaryReading, Event, Facts, Job, LoadReport, Outcome, Phase, Progress, ReadEntry, UnitNow, UnitState, Verdict,
};
use crate::time::{Duration, Instant};
use crate::version::Version;

const SMALL: (u16, u16) = (80, 24);
const LARGE: (u16, u16) = (200, 60);
/// 12:00:00 is the start of time here.
const NOON: Duration = Duration::from_secs(12 * 3600);

const BANNER: &[u8] = b"\r\nAxiomatic Technologies Corporation\r\nAXTC4CO 4 Thermocouple Scanner\r\n\
    Software Version V1.1.0, built 2026-01-31 12:00:00\r\n\r\n";
const MENU: &[u8] = b"\r\nMain Menu - AXTC4CO V1.1.0\r\n  V - View Object Dictionary\r\n\
    \x20 D - Default Object Dictionary\r\n  T - Toggle RS-232 Stream On/Off\r\n  S - Show/Stop Diagnostics\r\n\
    \x20 L - Load New Software\r\nCANopen: Node-ID 127 (0x7F), Baud Rate 125 kbit/s, State Pre-Operational\r\n";

/// The console, a user and a world that does what the test says.
struct Stage {
    app: App,
    size: (u16, u16),
    now: Instant,
    effects: Vec<Effect>,
}

impl Stage {
    fn new(size: (u16, u16)) -> Self {
        let options =
            Options { link: None, directory: PathBuf::from("/home/service/images"), palette: Palette::Mono, size };
        let mut app = App::new(options);
        let effects = app.start();
        Stage { app, size, now: Instant::ZERO, effects }
    }

    /// Connected to a port with a unit that has answered.
    fn connected(size: (u16, u16)) -> Self {
        let mut stage = Stage::with_ports(size);
        stage.press(KeyCode::Enter);
        stage.opened("/dev/ttyUSB0");
        stage.bytes(BANNER).bytes(MENU);
        stage.wait(3000);
        stage
    }

    fn with_ports(size: (u16, u16)) -> Self {
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
    fn streaming(size: (u16, u16)) -> Self {
        Stage::connected(size).with_rows()
    }

    fn with_rows(self) -> Self {
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

    fn opened(&mut self, link: &str) -> &mut Self {
        self.input(Input::LinkOpened(link_info(link)))
    }

    fn lost(&mut self) -> &mut Self {
        self.input(Input::LinkGone(Failure {
            text: "cannot read from /dev/ttyUSB0: the port has gone".into(),
            hints: vec!["Plug the adapter in again.".into()],
        }))
    }

    /// On the dictionary screen, the unit's read: two channels set differently, one entry not shown.
    fn with_dictionary(size: (u16, u16)) -> Self {
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
            ReadEntry { at, value, text, span: Span::default(), known: true }
        };
        let entries = axtc4co().dictionary.entries().filter(|(at, _, _)| *at != ObjectAddress::new(0x5010, 0));
        let reading =
            DictionaryReading { entries: entries.map(reading).collect(), complete: true, unrecognised_lines: 3 };
        stage.fold(Event::Finished(Outcome::DictionaryRead(Box::new(reading))));
        stage
    }

    /// On the screen of recordings, two there.
    fn with_recordings(mut self) -> Self {
        let entry = |begun: &str, port: &str, part, length| RecordingEntry {
            link: format!("replay:/home/user/{begun}.cast"),
            begun: begun.into(),
            port: port.into(),
            part,
            length,
            bytes: 1_234_567,
        };
        self.keys("8").input(Input::RecordingsListed(Ok(vec![
            entry("2026-01-31 11:00:00", "/dev/ttyUSB0", 1, Some(Duration::from_secs(300))),
            entry("2026-01-30 09:15:00", "rfc2217://terminal-server-in-hall-4:4001", 2, None),
        ])));
        self
    }

    /// On the load screen, the folder read.
    fn picking(mut self) -> Self {
        self.keys("l");
        let file = |name: &str, bytes| FileEntry {
            name: name.into(),
            kind: FileKind::File,
            bytes,
            begins: Vec::new(),
            modified: Some("2026-01-31 12:00".into()),
        };
        let folder = |name: &str| FileEntry {
            name: name.into(),
            kind: FileKind::Folder,
            bytes: 0,
            begins: Vec::new(),
            modified: None,
        };
        let entries = vec![
            file("AXTC4CO_V1.2.0.elf.S", 242_846),
            folder("bad"),
            file("AXTC4CO_V1.1.0.elf.S", 242_846),
            file("readme.txt", 99),
        ];
        self.input(Input::FilesListed { directory: "/home/service/images".into(), entries: Ok(entries) });
        self
    }

    /// On the load screen, a file checked.
    fn with_image(self, facts: ImageFacts) -> Self {
        let mut stage = self.picking();
        stage.keys("p").keys(&facts.path.to_string_lossy()).press(KeyCode::Enter);
        stage.input(Input::ImageChecked(Box::new(facts)));
        stage
    }

    fn input(&mut self, input: Input) -> &mut Self {
        let effects = self.app.handle(self.now, input);
        self.effects.extend(effects);
        self
    }

    fn key(&mut self, code: KeyCode, modifiers: KeyModifiers) -> &mut Self {
        self.input(Input::Terminal(TerminalEvent::Key(KeyEvent::new(code, modifiers))))
    }

    fn press(&mut self, code: KeyCode) -> &mut Self {
        self.key(code, KeyModifiers::NONE)
    }

    fn keys(&mut self, text: &str) -> &mut Self {
        text.chars().for_each(|character| {
            self.press(KeyCode::Char(character));
        });
        self
    }

    /// Clicks on a text, where it stands first.
    fn click(&mut self, text: &str) -> &mut Self {
        let picture = self.picture();
        let (row, line) = picture.lines().enumerate().find(|(_, line)| line.contains(text)).expect(text);
        let column = line.split(text).next().map_or(0, |before| before.chars().count()) as u16 + 1;
        let kind = MouseEventKind::Down(MouseButton::Left);
        let mouse = MouseEvent { kind, column, row: row as u16, modifiers: KeyModifiers::NONE };
        self.input(Input::Terminal(TerminalEvent::Mouse(mouse)))
    }

    /// What a terminal sends for Ctrl-].
    fn prefix(&mut self) -> &mut Self {
        self.key(KeyCode::Char('5'), KeyModifiers::CONTROL)
    }

    fn bytes(&mut self, bytes: &[u8]) -> &mut Self {
        self.input(Input::Bytes(bytes.to_vec()))
    }

    /// Lets time pass, waking the console when it wants to be.
    fn wait(&mut self, millis: u64) -> &mut Self {
        let end = self.now + Duration::from_millis(millis);
        while let Some(due) = self.app.poll_timeout().filter(|&due| due <= end) {
            self.now = self.now.max(due);
            self.input(Input::Timeout);
        }
        self.now = end;
        self
    }

    fn fold(&mut self, event: Event) -> &mut Self {
        self.fold_with(event, &Facts::default())
    }

    fn fold_with(&mut self, event: Event, facts: &Facts) -> &mut Self {
        self.app.fold(self.now, &event, facts);
        self
    }

    fn finished(&mut self, outcome: Outcome) -> &mut Self {
        self.fold_with(Event::Finished(outcome), &Facts::default())
    }

    /// Connected to a port with a unit that waits in its loader; on that port an upload was begun once.
    fn in_loader(size: (u16, u16), noted: Option<Noted>) -> Self {
        let mut stage = Stage::with_ports(size);
        stage.press(KeyCode::Enter).input(Input::LinkOpened(LinkInfo { noted, ..link_info("/dev/ttyUSB0") }));
        stage.fold_with(Event::FactsChanged, &Facts { state: UnitState::Loader, ..Facts::default() });
        stage.finished(Outcome::Identified);
        stage
    }

    /// The upload has been started with the password.
    fn loading(size: (u16, u16)) -> Self {
        let mut stage = Stage::connected(size).with_image(good_image());
        stage.press(KeyCode::Enter).keys("AXIO-2010").press(KeyCode::Enter);
        stage
    }

    /// What has left for the unit since the last question.
    fn sent(&mut self) -> Vec<u8> {
        let sent = self.effects.iter().filter_map(|effect| match effect {
            Effect::Transmit(Transmit { bytes, .. }) => Some(bytes.clone()),
            _ => None,
        });
        let sent = sent.flatten().collect();
        self.effects.clear();
        sent
    }

    fn asked(&mut self) -> Vec<Effect> {
        std::mem::take(&mut self.effects)
    }

    fn draw(&self) -> TestBackend {
        let mut terminal = Terminal::new(TestBackend::new(self.size.0, self.size.1)).expect("a test backend");
        terminal.draw(|frame| self.app.draw(frame)).expect("drawing in memory");
        terminal.backend().clone()
    }

    fn picture(&self) -> String {
        let lines = self.draw().to_string();
        // The backend quotes its lines; the quotes keep blanks at the end in sight and are of no use here.
        lines.lines().map(|line| line.trim_matches('"').trim_end()).collect::<Vec<_>>().join("\n")
    }

    fn shows(&self, text: &str) -> bool {
        self.picture().contains(text)
    }
}

fn link_info(link: &str) -> LinkInfo {
    LinkInfo {
        link: link.into(),
        baud: 115_200,
        read_only: false,
        noted: None,
        recording: Some("/home/user/.local/state/axcon/2026-01-31T12-00-00.cast".into()),
        start_of_day: NOON,
        start_millis: 1_769_860_800_000,
    }
}

fn noted(product: &str) -> Option<Noted> {
    Some(Noted { product: product.into(), image: "/home/service/images/AXTC4CO_V1.2.0.elf.S".into() })
}

fn axtc4co() -> &'static Product {
    Product::named("AXTC4CO").expect("built in")
}

fn good_image() -> ImageFacts {
    let recipe =
        make::Recipe { target: &axtc4co().target(), version: Version::new(1, 2, 0), words: 0xC000, flaw: None };
    let file = make::make(&recipe).expect("an image of the usual size");
    let targets: Vec<_> = Product::all().iter().map(Product::target).collect();
    let report = crate::image::check(file.as_slice(), None, &targets, None, &[]).expect("a slice");
    ImageFacts::of_report("/home/service/images/AXTC4CO_V1.2.0.elf.S".into(), &report)
}

/// What the checker says of a good file in which an editor has replaced digits and cut the end off.
fn bad_image() -> ImageFacts {
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
    ImageFacts::of_report("/home/service/images/bad.S".into(), &report)
}

fn progress() -> Progress {
    Progress {
        phase: Phase::Transfer,
        records: 1448,
        records_total: 3074,
        bytes: 114_392,
        bytes_total: 242_846,
        address: 0x5a80,
        elapsed: Duration::from_secs(10),
        moving: Duration::from_millis(9_950),
        moved: 114_280,
        held: None,
    }
}

fn report(verdict: Verdict, unit: UnitNow) -> LoadReport {
    LoadReport {
        verdict,
        phase: Phase::Transfer,
        unit,
        product: Some("AXTC4CO".into()),
        version_before: Some(Version::new(1, 1, 0)),
        version_after: None,
        records: 1448,
        records_total: 3074,
        address: Some(0x5a80),
        duration: Duration::from_secs(11),
        what: "The loader reported error 0004 (wrong checksum) and restarted.".into(),
        heard: "Error # 0004\u{1b}[2J Restarting.".into(),
    }
}

macro_rules! pictures {
    ($($name:ident: $stage:expr;)*) => {
        $(
            #[test]
            fn $name() {
                let stage: fn((u16, u16)) -> Stage = $stage;
                for (size, suffix) in [(SMALL, "small"), (LARGE, "large")] {
                    assert_snapshot!(format!("{}_{suffix}", stringify!($name)), stage(size).picture());
                }
            }
        )*
    };
}

pictures! {
    connect_while_listing: Stage::new;
    connect_without_ports: |size| {
        let mut stage = Stage::new(size);
        stage.input(Input::PortsListed(Ok(Vec::new())));
        stage
    };
    connect_with_ports: |size| {
        let mut stage = Stage::with_ports(size);
        stage.press(KeyCode::Down);
        stage
    };
    connect_cannot_list: |size| {
        let mut stage = Stage::new(size);
        stage.input(Input::PortsListed(Err("/sys/class/tty: permission denied".into())));
        stage.press(KeyCode::End);
        stage
    };
    connect_failed: |size| {
        let mut stage = Stage::with_ports(size);
        stage.press(KeyCode::Enter).input(Input::LinkFailed(Failure {
            text: "cannot open /dev/ttyUSB0: permission denied (it belongs to group 'dialout')".into(),
            hints: vec![
                "Add yourself to the group: sudo usermod -aG dialout $USER, then log in again.".into(),
                "Or open it once with sudo.".into(),
            ],
        }));
        stage
    };
    connect_by_path: |size| {
        let mut stage = Stage::with_ports(size);
        stage.press(KeyCode::End).press(KeyCode::Enter).keys("/dev/serial/by-id/usb-FTDI_FT232R_USB_UART_AX12345-if00-port0");
        stage
    };
    overview_without_link: |size| {
        let mut stage = Stage::with_ports(size);
        stage.keys("2");
        stage
    };
    overview_silent: |size| {
        let mut stage = Stage::with_ports(size);
        stage.press(KeyCode::Enter).opened("/dev/ttyUSB0");
        stage.wait(60_000);
        stage
    };
    overview_stream_off: Stage::connected;
    overview_streaming: |size| {
        let mut stage = Stage::streaming(size);
        stage.press(KeyCode::Down);
        stage
    };
    overview_of_a_broken_channel: |size| {
        let mut stage = Stage::streaming(size);
        stage.press(KeyCode::Down).press(KeyCode::Down).press(KeyCode::Down);
        stage
    };
    overview_late: |size| {
        let mut stage = Stage::streaming(size);
        stage.wait(10_000);
        stage
    };
    overview_link_lost: |size| {
        let mut stage = Stage::streaming(size);
        stage.lost();
        stage
    };
    stream_question: |size| {
        let mut stage = Stage::connected(size);
        stage.keys("tp70000").press(KeyCode::Enter);
        stage
    };
    defaults_question: |size| {
        let mut stage = Stage::connected(size);
        stage.keys("dyes").press(KeyCode::Enter);
        stage
    };
    view_question: |size| {
        let mut stage = Stage::connected(size);
        stage.keys("v");
        stage
    };
    terminal_empty: |size| {
        let mut stage = Stage::new(size);
        stage.keys("3");
        stage
    };
    terminal_text: |size| {
        let mut stage = Stage::connected(size);
        stage.keys("3m").bytes(MENU).bytes(b"a\tb \x1b[31mred\x07 \xff\r\n");
        stage
    };
    terminal_times: |size| {
        let mut stage = Stage::connected(size);
        stage.keys("3").prefix().keys("w");
        stage
    };
    terminal_hex: |size| {
        let mut stage = Stage::connected(size);
        stage.keys("3x").prefix().keys("h");
        stage
    };
    terminal_after_prefix: |size| {
        let mut stage = Stage::connected(size);
        stage.keys("3").prefix();
        stage
    };
    terminal_link_lost: |size| {
        let mut stage = Stage::connected(size);
        stage.keys("3").lost();
        stage
    };
    paste_question: |size| {
        let mut stage = Stage::connected(size);
        stage.keys("3").input(Input::Terminal(TerminalEvent::Paste("one\ntwo\n".into())));
        stage
    };
    load_picker: |size| Stage::connected(size).picking();
    load_cannot_list: |size| {
        let mut stage = Stage::connected(size);
        stage.keys("l").input(Input::FilesListed {
            directory: "/home/other/secret".into(),
            entries: Err("permission denied".into()),
        });
        stage
    };
    load_report_good: |size| Stage::connected(size).with_image(good_image());
    load_report_bad: |size| {
        let mut stage = Stage::connected(size).with_image(bad_image());
        stage.press(KeyCode::PageDown);
        stage
    };
    load_report_other_product: |size| {
        Stage::connected(size).with_image(ImageFacts { product: Some("AXRTD8CO".into()), ..good_image() })
    };
    load_running: |size| {
        let mut stage = Stage::connected(size).with_image(good_image());
        stage.fold(Event::Progress(progress()));
        stage
    };
    load_held: |size| {
        let mut stage = Stage::connected(size).with_image(good_image());
        stage.fold(Event::Progress(progress())).fold(Event::Held(true)).wait(2400);
        stage
    };
    load_cancel_question: |size| {
        let mut stage = Stage::connected(size).with_image(good_image());
        stage.fold(Event::Progress(progress())).press(KeyCode::Esc);
        stage
    };
    load_done: |size| {
        let mut stage = Stage::connected(size).with_image(good_image());
        let report = LoadReport {
            phase: Phase::Verify,
            version_after: Some(Version::new(1, 2, 0)),
            records: 3074,
            duration: Duration::from_secs(24),
            what: "The unit runs AXTC4CO 1.2.0: its new banner says so.".into(),
            heard: "AXTC4CO 4 Thermocouple Scanner Software Version V1.2.0".into(),
            ..report(Verdict::Done, UnitNow::Application)
        };
        stage.fold(Event::Finished(Outcome::Loaded(Box::new(report))));
        stage
    };
    load_failed: |size| {
        let mut stage = Stage::connected(size).with_image(good_image());
        stage.fold(Event::Finished(Outcome::Loaded(Box::new(report(Verdict::Failed, UnitNow::Loader)))));
        stage
    };
    load_link_lost: |size| {
        let mut stage = Stage::loading(size);
        stage.wait(1000).lost();
        stage
    };
    load_in_loader_with_a_note: |size| {
        Stage::in_loader(size, noted("AXTC4CO")).with_image(good_image())
    };
    load_in_loader_noted_for_another_product: |size| {
        Stage::in_loader(size, noted("AXRTD8CO")).with_image(good_image())
    };
    label_question: |size| {
        let mut stage = Stage::in_loader(size, None).with_image(good_image());
        stage.press(KeyCode::Enter).keys("AXRTD8CO").press(KeyCode::Enter);
        stage
    };
    password_question: |size| {
        let mut stage = Stage::connected(size).with_image(good_image());
        stage.press(KeyCode::Enter).keys("AXIO");
        stage
    };
    waiting_for_a_link: |size| {
        let mut stage = Stage::with_ports(size);
        stage.press(KeyCode::Enter);
        stage
    };
    terminal_find_question: |size| {
        let mut stage = Stage::connected(size);
        stage.keys("3").prefix().keys("/menu");
        stage
    };
    order_question: |size| {
        let mut stage = Stage::with_ports(size);
        stage.press(KeyCode::Enter).opened("emu:axtc4co").keys("9/short 2");
        stage
    };
    temperature_question: |size| {
        let mut stage = Stage::with_ports(size);
        stage.press(KeyCode::Enter).opened("emu:axtc4co").keys("9").press(KeyCode::Enter).keys("hot").press(KeyCode::Enter);
        stage
    };
    disconnect_question: |size| {
        let mut stage = Stage::connected(size);
        stage.keys("v").press(KeyCode::Enter).keys("1").press(KeyCode::Down).press(KeyCode::Enter);
        stage
    };
    quit_viewing_question: |size| {
        let mut stage = Stage::connected(size);
        stage.keys("3v").prefix().keys("q");
        stage
    };
    connect_link_lost: |size| {
        let mut stage = Stage::connected(size);
        stage.keys("1").lost();
        stage
    };
    diagnostics_link_lost: |size| {
        let mut stage = Stage::connected(size);
        stage.keys("s").wait(2000).bytes(b"Diagnostics\r\n Supply Voltage: 24.0 V\r\n").wait(1500).lost();
        stage
    };
    diagnostics_without_answer: |size| {
        let mut stage = Stage::connected(size);
        stage.keys("s").wait(60_000);
        stage
    };
    recordings_link_lost: |size| {
        let mut stage = Stage::connected(size).with_recordings();
        stage.lost();
        stage
    };
    bench_link_lost: |size| {
        let mut stage = Stage::with_ports(size);
        stage.press(KeyCode::Enter).opened("emu:axtc4co").bytes(MENU).wait(3000).keys("9o").lost();
        stage
    };
    help_link_lost: |size| {
        let mut stage = Stage::connected(size);
        stage.press(KeyCode::F(1)).lost();
        stage
    };
    dictionary_refused: |size| {
        let mut stage = Stage::connected(size);
        stage.keys("v").press(KeyCode::Enter);
        let reason = "not in the operational state".to_owned();
        stage.finished(Outcome::Refused { job: Job::ReadDictionary, reason, heard: None });
        stage
    };
    dictionary_incomplete: |size| {
        let mut stage = Stage::connected(size);
        stage.keys("v").press(KeyCode::Enter);
        let at = ObjectAddress::new(0x1001, 0);
        let entry = ReadEntry { at, value: Some(Value::Unsigned8(0)), text: "Error Register = 0".into(), span: Span::default(), known: true };
        let reading = DictionaryReading { entries: vec![entry], complete: false, unrecognised_lines: 0 };
        stage.finished(Outcome::DictionaryRead(Box::new(reading)));
        stage
    };
    stream_refused: |size| {
        let mut stage = Stage::connected(size);
        stage.keys("6t").press(KeyCode::Enter);
        stage.finished(Outcome::Refused { job: Job::StreamOn, reason: "invalid period".into(), heard: None });
        stage
    };
    stream_late_while_exporting: |size| {
        let mut stage = Stage::streaming(size);
        stage.keys("6e").press(KeyCode::Enter).wait(10_000);
        stage
    };
    overview_with_limits: |size| {
        let mut stage = Stage::with_dictionary(size).with_rows();
        stage.keys("2").press(KeyCode::Down);
        stage
    };
    recording_over: |size| {
        let mut stage = Stage::connected(size);
        stage.input(Input::Unrecorded("cannot write /home/user/a.cast: no space left on device".into()));
        stage
    };
    dictionary_of_no_unit: |size| {
        let mut stage = Stage::with_ports(size);
        stage.keys("5");
        stage
    };
    dictionary_of_the_manual: |size| {
        let mut stage = Stage::connected(size);
        stage.keys("5/filter").press(KeyCode::Enter);
        stage
    };
    dictionary_being_read: |size| {
        let mut stage = Stage::connected(size);
        stage.keys("v").press(KeyCode::Enter).fold(Event::EntriesRead(118));
        stage
    };
    dictionary_read: Stage::with_dictionary;
    dictionary_deviations: |size| {
        let mut stage = Stage::with_dictionary(size);
        stage.keys("o").press(KeyCode::Down);
        stage
    };
    dictionary_compared: |size| {
        let mut stage = Stage::with_dictionary(size);
        stage.keys("wyesterday.json").press(KeyCode::Enter);
        let text = Ok(Dump::factory(axtc4co()).json());
        stage.input(Input::FileRead { path: "yesterday.json".into(), text });
        stage
    };
    dictionary_finding: |size| {
        let mut stage = Stage::with_dictionary(size);
        stage.keys("/sensor type");
        stage
    };
    dictionary_finds_nothing: |size| {
        let mut stage = Stage::with_dictionary(size);
        stage.keys("/xyzzy").press(KeyCode::Enter);
        stage
    };
    dictionary_link_lost: |size| {
        let mut stage = Stage::with_dictionary(size);
        stage.lost();
        stage
    };
    stream_off: |size| {
        let mut stage = Stage::connected(size);
        stage.keys("6");
        stage
    };
    stream_running: |size| {
        let mut stage = Stage::streaming(size);
        stage.keys("6").press(KeyCode::Down);
        stage
    };
    stream_held_at_a_gap: |size| {
        let mut stage = Stage::streaming(size);
        stage.keys("6k").press(KeyCode::Down).press(KeyCode::Down).press(KeyCode::Down);
        (0..36).for_each(|_| {
            stage.press(KeyCode::Left);
        });
        stage
    };
    stream_export_question: |size| {
        let mut stage = Stage::streaming(size);
        stage.keys("6e");
        stage
    };
    stream_exporting: |size| {
        let mut stage = Stage::streaming(size);
        stage.keys("6e").press(KeyCode::Enter).bytes(b"  23.500; 181.250;  96.000; 410.000;Disabled\r\n");
        stage
    };
    stream_link_lost: |size| {
        let mut stage = Stage::streaming(size);
        stage.keys("6").lost();
        stage
    };
    diagnostics_none: |size| {
        let mut stage = Stage::connected(size);
        stage.keys("7");
        stage
    };
    diagnostics_running: |size| {
        let mut stage = Stage::connected(size);
        stage.keys("s").wait(2000);
        for supply in ["23.91", "24.10", "24.02"] {
            let page = format!(
                "Diagnostics   up 0:00:12\r\n Supply Voltage: {supply} V\r\n Cold Junction: 24.5 C\r\n\
                 \x20TC1  100.123 C   raw   3991 uV   status 0x00\r\n TC2  180.002 C   raw   7310 uV   status 0x00\r\n\
                 \x20Active Errors: 0\r\n"
            );
            stage.bytes(page.as_bytes()).wait(1000);
        }
        stage
    };
    recordings_none: |size| {
        let mut stage = Stage::with_ports(size);
        stage.keys("8").input(Input::RecordingsListed(Ok(Vec::new())));
        stage
    };
    recordings_cannot_list: |size| {
        let mut stage = Stage::with_ports(size);
        stage.keys("8").input(Input::RecordingsListed(Err("cannot read '/home/x': permission denied".into())));
        stage
    };
    recordings_listed: |size| Stage::with_ports(size).with_recordings();
    recordings_playing: |size| {
        let mut stage = Stage::with_ports(size).with_recordings();
        stage.press(KeyCode::Enter);
        stage.input(Input::LinkOpened(LinkInfo {
            link: "replay:/home/user/20260131T110000Z-ttyUSB0-7.cast".into(),
            baud: 115_200,
            read_only: true,
            noted: None,
            recording: None,
            start_of_day: NOON,
            start_millis: 1_769_860_800_000,
        }));
        let (position, length) = (Duration::from_secs(75), Some(Duration::from_secs(300)));
        stage.bytes(BANNER).input(Input::Playing(Playing { position, length, pace: Pace::Times(10) }));
        stage
    };
    bench_of_a_real_unit: |size| {
        let mut stage = Stage::connected(size);
        stage.keys("9");
        stage
    };
    bench_in_use: |size| {
        let mut stage = Stage::with_ports(size);
        stage.press(KeyCode::Enter).opened("emu:axtc4co");
        stage.bytes(BANNER).bytes(MENU).wait(3000).keys("9");
        stage.press(KeyCode::Right).press(KeyCode::Down).keys("oh/fault nonsense").press(KeyCode::Enter);
        for (line, answer) in [
            ("set 1 temperature 30.0", Ok(None)),
            ("open 2", Ok(None)),
            ("short 2", Err("this input cannot be shorted".to_owned())),
        ] {
            stage.input(Input::Ordered { line: line.into(), answer });
        }
        stage
    };
    help_on_overview: |size| {
        let mut stage = Stage::connected(size);
        stage.press(KeyCode::F(1));
        stage
    };
    help_on_terminal: |size| {
        let mut stage = Stage::connected(size);
        stage.keys("3").press(KeyCode::F(1)).press(KeyCode::PageDown);
        stage
    };
    quit_question: |size| {
        let mut stage = Stage::streaming(size);
        stage.keys("tq");
        stage
    };
}

#[test]
fn a_small_terminal_gets_one_clear_message() {
    assert_snapshot!(Stage::streaming((60, 10)).picture());
}

#[test]
fn every_screen_survives_every_size() {
    let scenes: [fn() -> Stage; 14] = [
        || Stage::with_dictionary(SMALL),
        || {
            let mut stage = Stage::streaming(SMALL);
            stage.keys("6").press(KeyCode::Left);
            stage
        },
        || {
            let mut stage = Stage::connected(SMALL);
            stage.keys("s").wait(2000).bytes(b"Supply: 24 V\r\nCurrent: 1 A\r\n").wait(1000);
            stage
        },
        || Stage::with_ports(SMALL).with_recordings(),
        || {
            let mut stage = Stage::with_ports(SMALL);
            stage.press(KeyCode::Enter).opened("emu:axrtd8co");
            stage.keys("9o");
            stage
        },
        || Stage::with_ports(SMALL),
        || Stage::streaming(SMALL),
        || Stage::connected(SMALL).picking(),
        || Stage::connected(SMALL).with_image(bad_image()),
        || {
            let mut stage = Stage::connected(SMALL);
            stage.fold(Event::Progress(progress())).keys("4");
            stage
        },
        || {
            let mut stage = Stage::connected(SMALL);
            stage.keys("4").fold(Event::Finished(Outcome::Loaded(Box::new(report(Verdict::Failed, UnitNow::Unknown)))));
            stage.lost();
            stage
        },
        || {
            let mut stage = Stage::streaming(SMALL);
            stage.keys("3").prefix().keys("h");
            stage
        },
        || {
            let mut stage = Stage::streaming(SMALL);
            stage.keys("3");
            stage
        },
        || {
            let mut stage = Stage::connected(SMALL);
            stage.press(KeyCode::F(1));
            stage
        },
    ];
    for scene in scenes {
        let mut stage = scene();
        for columns in 0..120 {
            for rows in 0..40 {
                stage.size = (columns, rows);
                stage.draw();
            }
        }
    }
}

#[test]
fn every_question_survives_every_size_it_is_drawn_at() {
    let questions: [(&str, fn() -> Stage); 15] = [
        ("Switch the data stream on", || typed(Stage::connected(SMALL), "t")),
        ("Type Yes", || typed(Stage::connected(SMALL), "d")),
        ("View the object", || typed(Stage::connected(SMALL), "v")),
        ("label", || pressed(Stage::in_loader(SMALL, None).with_image(good_image()), KeyCode::Enter)),
        ("Password", || pressed(Stage::connected(SMALL).with_image(good_image()), KeyCode::Enter)),
        ("Opening", || pressed(Stage::with_ports(SMALL), KeyCode::Enter)),
        ("Connect to", || typed(Stage::with_ports(SMALL), "p")),
        ("╭ Find", || typed(Stage::with_dictionary(SMALL), "/")),
        ("Image file", || typed(Stage::connected(SMALL).picking(), "p")),
        ("CSV", || typed(Stage::streaming(SMALL), "6e")),
        ("Write the object", || typed(Stage::with_dictionary(SMALL), "e")),
        ("Compare with", || typed(Stage::with_dictionary(SMALL), "w")),
        ("Cancel the upload", || pressed(Stage::loading(SMALL), KeyCode::Esc)),
        ("being loaded", || typed(Stage::loading(SMALL), "q")),
        ("Close the link", || typed(Stage::loading(SMALL), "1x")),
    ];
    for (words, question) in questions {
        let mut stage = question();
        assert!(stage.shows(words), "{words}: {}", stage.picture());
        for columns in 70..100 {
            for rows in 20..30 {
                stage.size = (columns, rows);
                stage.picture();
            }
        }
    }
}

fn typed(mut stage: Stage, keys: &str) -> Stage {
    stage.keys(keys);
    stage
}

fn pressed(mut stage: Stage, code: KeyCode) -> Stage {
    stage.press(code);
    stage
}

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
        palette: Palette::Dark,
        size: SMALL,
    });
    assert_eq!(app.start(), [Effect::ListPorts, Effect::ListRecordings, Effect::OpenLink("emu:axtc4co".into())]);
}

#[test]
fn opening_another_link_closes_the_first() {
    let mut stage = Stage::connected(SMALL);
    stage.asked();
    stage.keys("1").press(KeyCode::Down).press(KeyCode::Enter);
    assert_eq!(stage.asked(), [Effect::CloseLink, Effect::OpenLink("/dev/ttyUSB1".into())]);
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
fn a_recording_is_steered_by_its_keys() {
    let mut stage = Stage::with_ports(SMALL).with_recordings();
    stage.keys(" +").press(KeyCode::Left);
    stage.asked();
    stage.press(KeyCode::Enter);
    assert_eq!(stage.asked(), [Effect::OpenLink("replay:/home/user/2026-01-31 11:00:00.cast".into())]);
    stage.input(Input::LinkOpened(LinkInfo {
        link: "replay:x".into(),
        baud: 115_200,
        read_only: true,
        noted: None,
        recording: None,
        start_of_day: NOON,
        start_millis: 0,
    }));
    let seconds = Duration::from_secs;
    let plays = |stage: &mut Stage, position, pace| {
        stage.input(Input::Playing(Playing { position: seconds(position), length: Some(seconds(100)), pace }));
        stage.asked();
    };
    plays(&mut stage, 50, Pace::Times(5));
    for (key, wanted) in [
        (KeyCode::Char(' '), Playback::Pace(Pace::Paused)),
        (KeyCode::Char('+'), Playback::Pace(Pace::Times(10))),
        (KeyCode::Char('-'), Playback::Pace(Pace::Times(2))),
        (KeyCode::Left, Playback::Seek(seconds(40))),
        (KeyCode::Right, Playback::Seek(seconds(60))),
        (KeyCode::Home, Playback::Seek(seconds(0))),
        (KeyCode::End, Playback::Seek(seconds(100))),
    ] {
        stage.press(key);
        assert_eq!(stage.asked(), [Effect::Play(wanted)]);
    }
    plays(&mut stage, 50, Pace::Paused);
    stage.keys(" ");
    assert_eq!(stage.asked(), [Effect::Play(Playback::Pace(Pace::Times(5)))], "as fast as before the pause");
    plays(&mut stage, 100, Pace::AtOnce);
    plays(&mut stage, 100, Pace::Paused);
    stage.keys(" ");
    assert_eq!(stage.asked(), [Effect::Play(Playback::Again(Pace::Times(1)))], "from the beginning");
}

#[test]
fn a_click_is_the_key_it_stands_on_and_the_wheel_moves() {
    for size in [SMALL, LARGE] {
        let mut stage = Stage::with_dictionary(size);
        let click = |stage: &mut Stage, kind, text: &str| {
            let picture = stage.picture();
            let (row, line) = picture.lines().enumerate().find(|(_, line)| line.contains(text)).expect(text);
            let column = line.split(text).next().map_or(0, |before| before.chars().count()) as u16 + 1;
            let mouse = MouseEvent { kind, column, row: row as u16, modifiers: KeyModifiers::NONE };
            stage.input(Input::Terminal(TerminalEvent::Mouse(mouse)));
        };
        let left = MouseEventKind::Down(MouseButton::Left);
        click(&mut stage, MouseEventKind::ScrollDown, "Object");
        assert!(stage.shows("› "), "{}", stage.picture());
        assert!(stage.shows("1001:00 Error Register"), "{}", stage.picture());
        for (tab, shows) in
            [("6 Stream", "The stream is off"), ("8 Rec", "Looking for recordings"), ("5 Dict", "Object")]
        {
            click(&mut stage, left, tab);
            assert!(stage.shows(shows), "{}", stage.picture());
        }
        click(&mut stage, left, "T stream");
        assert!(stage.shows("Switch the data stream on"), "{}", stage.picture());
        click(&mut stage, left, "5 Dict");
        assert!(stage.shows("Switch the data stream on"), "a question wants an answer first");
    }
}

#[test]
fn rows_go_on_to_their_file_when_the_same_link_is_back_and_end_with_another() {
    let row = b"  23.500; 181.250;  96.000; 410.000;Disabled\r\n";
    let appended = |stage: &mut Stage| {
        stage.wait(1000).bytes(row);
        stage.asked().iter().any(|effect| matches!(effect, Effect::AppendFile { .. }))
    };
    let mut stage = Stage::streaming(SMALL);
    stage.keys("6e").press(KeyCode::Enter).asked();
    assert!(appended(&mut stage));
    stage.lost().keys("c").opened("/dev/ttyUSB0");
    assert!(appended(&mut stage), "the same link");
    stage.wait(10_000).keys("1").press(KeyCode::Down).press(KeyCode::Enter);
    assert!(stage.shows("rows are in axtc4co-stream-"), "{}", stage.picture());
    stage.opened("/dev/ttyUSB1");
    assert!(!appended(&mut stage), "another unit's rows are not mixed in");
}

#[test]
fn only_an_emulated_unit_is_given_orders() {
    let mut stage = Stage::connected(SMALL);
    stage.keys("9");
    stage.asked();
    stage.keys("ohp").press(KeyCode::Right).press(KeyCode::Enter);
    assert_eq!(stage.asked(), []);
    let mut stage = Stage::with_ports(SMALL);
    stage.press(KeyCode::Enter).opened("EMU:AXTC4CO");
    stage.keys("9").asked();
    stage.press(KeyCode::Down).press(KeyCode::Enter).keys("x").press(KeyCode::Enter);
    assert!(stage.shows("A number of degrees"), "{}", stage.picture());
    stage.press(KeyCode::Backspace).keys("451.5").press(KeyCode::Enter);
    stage.input(Input::Ordered { line: "set 2 temperature 451.5".into(), answer: Ok(None) });
    stage.press(KeyCode::Left).keys("p");
    let order = |line: &str| Effect::Order(line.into());
    assert_eq!(
        stage.asked(),
        [order("set 2 temperature 451.5"), order("set 2 temperature 441.5"), order("power cycle 1")]
    );
}

#[test]
fn menu_keys_do_what_the_manual_says_in_either_case() {
    let mut stage = Stage::connected(SMALL);
    stage.sent();
    stage.keys("S").wait(2000);
    assert_eq!(stage.sent(), b"s");
    assert!(stage.shows("Waiting for the unit's first page"), "{}", stage.picture());
    let mut stage = Stage::connected(SMALL);
    stage.sent();
    stage.keys("v");
    assert_eq!(stage.sent(), b"", "V halts scanning: it is asked first");
    stage.keys("t");
    assert_eq!(stage.sent(), b"v");
    assert!(stage.shows("halted by V"));
    stage.keys("x");
    assert_eq!(stage.sent(), b"x");
    assert!(!stage.shows("halted by V"));
}

#[test]
fn leaving_with_the_view_open_offers_to_close_it() {
    let mut stage = Stage::connected(SMALL);
    stage.keys("vt").prefix().keys("2q");
    stage.asked();
    stage.press(KeyCode::Enter);
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
    assert!(stage.shows("Then /dev/ttyUSB1 is opened."), "{}", stage.picture());
    stage.keys("y");
    let opens = Effect::OpenLink("/dev/ttyUSB1".into());
    assert_eq!(stage.asked(), [Effect::Transmit(Transmit::open(*b"x")), Effect::CloseLink, opens]);
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
fn an_upload_is_noted_once_it_is_taken_and_before_its_first_byte() {
    let mut stage = Stage::in_loader(SMALL, noted("AXTC4CO")).with_image(good_image());
    stage.press(KeyCode::Enter);
    assert!(stage.shows("Password for loading software"), "the note spares the label: {}", stage.picture());
    let mut stage = Stage::connected(SMALL).with_image(good_image());
    stage.press(KeyCode::Enter).keys("AXIO-2010").asked();
    stage.press(KeyCode::Enter);
    let effects = stage.asked();
    let note = effects
        .iter()
        .position(|effect| matches!(effect, Effect::UploadBegins { product, .. } if product == "AXTC4CO"));
    let first = effects.iter().position(|effect| matches!(effect, Effect::Transmit(_)));
    assert!(note.is_some() && (first.is_none() || note < first), "{effects:?}");
}

#[test]
fn the_end_of_every_finding_can_be_read() {
    let facts = bad_image();
    let last = facts.defects.last().and_then(|text| text.split_whitespace().last()).expect("findings").to_owned();
    let mut stage = Stage::connected(SMALL).with_image(facts.clone());
    let mut seen = stage.picture();
    for _ in 0..200 {
        stage.press(KeyCode::Down);
        seen.push_str(&stage.picture());
    }
    for defect in &facts.defects {
        for word in defect.split_whitespace() {
            assert!(seen.contains(word), "no '{word}' of '{defect}'");
        }
    }
    assert!(stage.shows(&last), "{}", stage.picture());
    let end = stage.picture();
    stage.press(KeyCode::Up);
    assert_ne!(stage.picture(), end, "one step back is one line");
}

#[test]
fn defaults_are_restored_only_after_yes_written_like_this() {
    let mut stage = Stage::connected(SMALL);
    stage.sent();
    stage.keys("dyes").press(KeyCode::Enter);
    stage.wait(1000);
    assert_eq!(stage.sent(), b"");
    stage.key(KeyCode::Char('u'), KeyModifiers::CONTROL).keys("Yes").press(KeyCode::Enter);
    assert_eq!(stage.sent(), b"d");
}

#[test]
fn t_switches_a_running_stream_off_and_asks_before_it_switches_one_on() {
    let mut stage = Stage::streaming(SMALL);
    stage.sent();
    stage.keys("t");
    assert_eq!(stage.sent(), b"t");
    let mut stage = Stage::connected(SMALL);
    stage.sent();
    stage.keys("t");
    assert_eq!(stage.sent(), b"");
    assert!(stage.shows("field value, object 6100h"));
    stage.press(KeyCode::Esc);
    assert!(!stage.shows("field value, object 6100h"));
}

#[test]
fn letters_typed_into_a_question_are_no_commands() {
    let mut stage = Stage::with_ports(SMALL);
    stage.asked();
    stage.keys("pq1?lt");
    assert_eq!(stage.asked(), []);
    stage.press(KeyCode::Enter);
    assert_eq!(stage.asked(), [Effect::OpenLink("q1?lt".into())]);
}

#[test]
fn on_the_terminal_screen_letters_go_to_the_unit_and_the_prefix_takes_one_back() {
    let mut stage = Stage::connected(SMALL);
    stage.keys("3").sent();
    stage.keys("q1").press(KeyCode::Enter).press(KeyCode::Left).press(KeyCode::Up).press(KeyCode::Tab);
    assert_eq!(stage.sent(), b"q1\r\t");
    stage.prefix().keys("q");
    assert_eq!(stage.asked(), [Effect::Quit]);
    stage.prefix().prefix();
    assert_eq!(stage.sent(), b"\x1d");
}

#[test]
fn pasted_text_goes_to_the_unit_only_after_a_yes() {
    let mut stage = Stage::connected(SMALL);
    stage.keys("3").sent();
    stage.input(Input::Terminal(TerminalEvent::Paste("m\n\x1b[D\n".into())));
    assert_eq!(stage.sent(), b"");
    stage.keys("y");
    assert_eq!(stage.sent(), b"m\r[D\r", "the escape character is not passed on");
}

#[test]
fn the_terminal_stays_where_it_was_scrolled_to_while_more_comes() {
    let mut stage = Stage::connected(SMALL);
    (0..100).for_each(|n| {
        stage.bytes(format!("line {n}\r\n").as_bytes());
    });
    stage.keys("3").press(KeyCode::PageUp);
    assert!(stage.shows("stopped") && !stage.shows("line 99"));
    let stopped = stage.picture();
    let place = stopped.lines().nth(10).map(str::to_owned);
    stage.bytes(b"more\r\n");
    assert_eq!(stage.picture().lines().nth(10).map(str::to_owned), place);
    stage.press(KeyCode::End);
    assert!(stage.shows("follows") && stage.shows("more"));
}

#[test]
fn an_upload_cannot_start_while_anything_stands_against_it() {
    let cases = [
        (bad_image(), "the file has errors"),
        (ImageFacts { product: Some("AXRTD8CO".into()), ..good_image() }, "the file is for an AXRTD8CO"),
    ];
    for (facts, why) in cases {
        let mut stage = Stage::connected(SMALL).with_image(facts);
        stage.sent();
        assert!(stage.shows(why), "{}", stage.picture());
        stage.press(KeyCode::Enter);
        assert!(!stage.shows("Password"));
        assert_eq!(stage.sent(), b"");
    }
    let mut stage = Stage::with_ports(SMALL).with_image(good_image());
    stage.press(KeyCode::Enter);
    assert!(stage.shows("no unit is connected") && !stage.shows("Password"));
}

#[test]
fn an_answer_about_a_file_nobody_waits_for_is_ignored() {
    let mut stage = Stage::connected(SMALL).picking();
    stage.input(Input::ImageChecked(Box::new(good_image())));
    assert!(stage.shows("Choose a file"));
}

#[test]
fn folders_are_walked_and_the_way_back_finds_the_folder_again() {
    let mut stage = Stage::connected(SMALL).picking();
    stage.asked();
    stage.press(KeyCode::Down).press(KeyCode::Enter);
    assert_eq!(stage.asked(), [Effect::ListFiles("/home/service/images/bad".into())]);
    stage.input(Input::FilesListed { directory: "/home/service/images/bad".into(), entries: Ok(Vec::new()) });
    stage.press(KeyCode::Esc);
    assert_eq!(stage.asked(), [Effect::ListFiles("/home/service/images".into())]);
    let bad = FileEntry { name: "bad".into(), kind: FileKind::Folder, bytes: 0, begins: Vec::new(), modified: None };
    stage.input(Input::FilesListed { directory: "/home/service/images".into(), entries: Ok(vec![bad]) });
    assert!(stage.shows("› bad/"));
}

#[test]
fn nothing_a_unit_sends_reaches_the_screen_as_a_control_code() {
    let mut stage = Stage::connected(LARGE);
    let every: Vec<u8> = (0..=255).collect();
    stage.bytes(&every).bytes(b"\r\n");
    for keys in ["2", "3"] {
        stage.keys(keys);
        assert!(stage.picture().chars().all(|character| character == '\n' || !character.is_control()));
    }
    stage.prefix().keys("h");
    assert!(stage.picture().chars().all(|character| character == '\n' || !character.is_control()));
}

#[test]
fn an_idle_console_wants_nothing_and_draws_nothing() {
    let mut stage = Stage::connected(SMALL);
    stage.wait(60_000);
    stage.app.drawn();
    assert_eq!(stage.app.poll_timeout(), None);
    stage.input(Input::Timeout);
    stage.input(Input::Terminal(TerminalEvent::FocusGained));
    assert!(!stage.app.is_dirty());
    let mut release = KeyEvent::new(KeyCode::Char('2'), KeyModifiers::NONE);
    release.kind = KeyEventKind::Release;
    stage.input(Input::Terminal(TerminalEvent::Key(release)));
    assert!(!stage.app.is_dirty(), "the release of a key is not a key");
    stage.keys("3");
    assert!(stage.app.is_dirty());
}

#[test]
fn a_signal_ends_the_program_without_a_question() {
    let mut stage = Stage::connected(SMALL);
    stage.keys("m").asked();
    stage.input(Input::Signal);
    assert_eq!(stage.asked(), [Effect::Quit]);
}

/// The screens with something chosen, and what stands on the chosen row.
fn scenes_with_a_choice() -> [(&'static str, Stage); 4] {
    let mut with_ports = Stage::with_ports(SMALL);
    with_ports.press(KeyCode::Down);
    [
        ("› /dev/ttyUSB1", with_ports),
        ("› bad/", pressed(Stage::connected(SMALL).picking(), KeyCode::Down)),
        ("› ", pressed(Stage::with_dictionary(SMALL), KeyCode::Down)),
        ("› 2026-01-31", Stage::with_ports(SMALL).with_recordings()),
    ]
}

#[test]
fn what_is_chosen_is_seen_without_colours_and_colours_are_those_of_the_ground() {
    use ratatui::style::{Color, Modifier};
    for (words, mut stage) in scenes_with_a_choice() {
        let colours_of = |stage: &Stage| {
            let buffer = stage.draw().buffer().clone();
            let mut colours: Vec<Color> = buffer.content().iter().flat_map(|cell| [cell.fg, cell.bg]).collect();
            colours.dedup();
            colours.retain(|colour| *colour != Color::Reset);
            colours
        };
        assert_eq!(colours_of(&stage), [], "{words}: none without colours");
        let picture = stage.picture();
        let row = picture.lines().position(|line| line.contains(words)).expect(words);
        let buffer = stage.draw().buffer().clone();
        let cells = &buffer.content()[row * usize::from(SMALL.0)..][4..20];
        assert!(cells.iter().all(|cell| cell.modifier.contains(Modifier::REVERSED)), "{words} has its bar");
        stage.press(KeyCode::F(2));
        let dark = colours_of(&stage);
        stage.press(KeyCode::F(2));
        let light = colours_of(&stage);
        assert!(dark.contains(&Color::Cyan) && !light.is_empty(), "{words}: {dark:?} {light:?}");
        let pale = [Color::Yellow, Color::Cyan, Color::White, Color::Gray];
        assert!(!light.iter().any(|colour| pale.contains(colour)), "{words}: {light:?} on a light ground");
        assert!(stage.shows("Colours: for a light ground."), "{}", stage.picture());
    }
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
fn a_click_chooses_an_entry_of_a_list_and_a_second_one_does_it() {
    for size in [SMALL, LARGE] {
        let mut stage = Stage::with_ports(size);
        stage.asked();
        stage.click("/dev/ttyUSB1");
        assert_eq!((stage.asked(), stage.shows("› /dev/ttyUSB1")), (Vec::new(), true), "{}", stage.picture());
        stage.click("/dev/ttyUSB1");
        assert_eq!(stage.asked(), [Effect::OpenLink("/dev/ttyUSB1".into())]);
        let mut stage = Stage::connected(size).picking();
        stage.asked();
        stage.click("bad/").click("bad/");
        assert_eq!(stage.asked(), [Effect::ListFiles("/home/service/images/bad".into())]);
        let mut stage = Stage::with_ports(size).with_recordings();
        stage.asked();
        stage.click("2026-01-30").click("2026-01-30");
        assert_eq!(stage.asked(), [Effect::OpenLink("replay:/home/user/2026-01-30 09:15:00.cast".into())]);
        let mut stage = Stage::with_dictionary(size);
        stage.click("1003:00");
        assert!(
            stage.picture().lines().any(|line| line.contains("› ") && line.contains("1003:00")),
            "{}",
            stage.picture()
        );
    }
}

#[test]
fn a_break_is_sent_by_its_key_and_stands_between_the_lines_and_in_the_recording() {
    let mut stage = Stage::connected(SMALL);
    stage.keys("3").asked();
    stage.prefix().keys("b");
    assert_eq!(stage.asked(), [Effect::Break]);
    stage.input(Input::BreakSent(Ok(())));
    assert_eq!(stage.asked(), [Effect::Mark("break sent".into())]);
    assert!(stage.shows("── break sent"), "{}", stage.picture());
    stage.input(Input::BreakSent(Err("this link cannot send one".into())));
    assert!(stage.shows("No break sent: this link cannot send one."), "{}", stage.picture());
}

#[test]
fn long_records_are_chosen_with_a_key_and_the_plan_says_so() {
    let mut stage = Stage::connected(SMALL).with_image(good_image());
    assert!(stage.shows("K pack") && !stage.shows("in long records"), "{}", stage.picture());
    stage.keys("k");
    assert!(stage.shows("in long records"), "{}", stage.picture());
}
