//! The console on the screen against an emulated unit, in virtual time: keys in, pictures out.

mod listening;
mod returning;
mod sending;
mod states;
mod streams;
mod uploads;
mod values;

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use axcon::canopen::{ObjectAddress, Value};
use axcon::device::{LoaderKind, Product};
use axcon::emulator::cable::{Line, Plugged};
use axcon::emulator::knob::Knob;
use axcon::emulator::{Setup, Unit};
use axcon::image::make;
use axcon::time::{Duration, Instant, character_time};
use axcon::tui::{
    App, Effect, FIRST_BYTES, Failure, FileEntry, FileKind, ImageFacts, Input, LinkInfo, LinkKind, Noted, Options,
    Palette, Recorded, RecordingEntry, RecordingList,
};
use axcon::version::Version;
use insta::assert_snapshot;
use ratatui::Terminal;
use ratatui::backend::TestBackend;
use ratatui::crossterm::event::{Event, KeyCode, KeyEvent, KeyModifiers, MouseButton, MouseEvent, MouseEventKind};

use crate::support::bench::{BAUD, axtc4co, factory_flash, flash_with, full_image};

/// A unit of this program, and one behind a cable that can be pulled out.
const EMULATED: &str = "emu:axtc4co";
const CABLE: &str = "/dev/ttyUSB0";

/// How often somebody looks at the picture.
const LOOK: Duration = Duration::from_millis(100);

/// A console, a unit, and a cable between them.
struct Desk {
    now: Instant,
    app: App,
    link: &'static str,
    unit: Plugged<Unit>,
    to_app: Line,
    over: bool,
    /// Files the console has written.
    files: BTreeMap<PathBuf, Vec<u8>>,
    /// Remarks it has put in the recording.
    marks: Vec<String>,
    /// What it has sent to the unit.
    sent: Vec<u8>,
    /// Breaks it has asked for.
    breaks: usize,
    /// What the journal of uploads says of the unit's port.
    noted: Option<Noted>,
}

impl Desk {
    /// Connected to an emulated unit of this program with V1.1.0, just powered on.
    fn new() -> Self {
        Desk::on(EMULATED)
    }

    /// Connected to such a unit by a cable.
    fn on_cable() -> Self {
        Desk::on(CABLE)
    }

    fn on(link: &'static str) -> Self {
        let flash = factory_flash("1.1.0");
        let setup =
            Setup { product: axtc4co(), loader: LoaderKind::G1, seed: 1, dialect: 0, flash, parameters: Vec::new() };
        let mut unit = Unit::new(setup);
        unit.power_on(Instant::ZERO);
        let app = console(link);
        let latency = Duration::from_millis(1);
        let mut desk = Desk {
            now: Instant::ZERO,
            app,
            link,
            unit: Plugged::new(unit, Line::new(character_time(BAUD), latency)),
            to_app: Line::new(Duration::ZERO, latency),
            over: false,
            files: BTreeMap::new(),
            marks: Vec::new(),
            sent: Vec::new(),
            breaks: 0,
            noted: None,
        };
        let effects = desk.app.start();
        desk.perform(effects);
        desk.run(Duration::from_secs(10));
        desk
    }

    fn input(&mut self, input: Input) {
        let effects = self.app.handle(self.now, input);
        self.perform(effects);
    }

    fn perform(&mut self, effects: Vec<Effect>) {
        for effect in effects {
            match effect {
                Effect::OpenLink(link) => {
                    let noted = self.noted.clone();
                    let kind = if link == CABLE { LinkKind::Unit } else { LinkKind::Emulated(axtc4co()) };
                    self.input(Input::LinkOpened(LinkInfo {
                        link,
                        baud: BAUD,
                        kind,
                        noted,
                        recording: None,
                        start_of_day: Duration::ZERO,
                        start_millis: 0,
                    }));
                }
                Effect::Transmit(transmit) => {
                    self.sent.extend(&transmit.bytes);
                    self.unit.send(self.now, &transmit.bytes);
                }
                Effect::UploadBegins { noted, .. } => self.noted = Some(noted),
                Effect::UploadEnds { .. } => self.noted = None,
                Effect::ListRecordings => {
                    let recorded = Recorded {
                        begun: "2026-01-31 12:00:00".into(),
                        port: "/dev/ttyUSB0".into(),
                        part: 1,
                        length: Some(Duration::from_secs(600)),
                        is_being_written: false,
                    };
                    let path = "/home/service/.local/state/axcon/recordings/20260131T120000Z-ttyUSB0-1.cast";
                    let entry = RecordingEntry {
                        link: format!("replay:{path}"),
                        path: path.into(),
                        bytes: 123_456,
                        content: Ok(recorded),
                    };
                    let list = RecordingList { entries: vec![entry], older: 0 };
                    self.input(Input::RecordingsListed(Ok(list)));
                }
                Effect::ListFiles(directory) => {
                    let entry = |(path, bytes): (&PathBuf, &Vec<u8>)| FileEntry {
                        name: path.file_name().unwrap_or_default().to_string_lossy().into_owned(),
                        kind: FileKind::File,
                        bytes: bytes.len() as u64,
                        begins: bytes.iter().copied().take(FIRST_BYTES).collect(),
                        modified: Some("2026-01-31 12:00".into()),
                    };
                    let entries = self.files.iter().map(entry).collect();
                    self.input(Input::FilesListed { directory, entries: Ok(entries) });
                }
                Effect::ReadBytes(path) => {
                    let bytes = self.file(&path).ok_or_else(|| "there is no such file".to_owned());
                    self.input(Input::BytesRead { path, bytes });
                }
                Effect::CheckImage { path, loader, allow } => {
                    let target = |it: &Product| it.target_with(loader.unwrap_or(it.loader.kind));
                    let targets: Vec<_> = Product::all().iter().map(target).collect();
                    let file = self.file(&path).unwrap_or_else(new_image);
                    let report = axcon::image::check(file.as_slice(), None, &targets, None, &allow).expect("a slice");
                    self.input(Input::ImageChecked(Box::new(ImageFacts::of_report(path, &report, loader, &allow))));
                }
                Effect::Quit => self.over = true,
                Effect::CreateFile { path, bytes } => {
                    let is_new = self.files.insert(path.clone(), bytes).is_none();
                    let result = if is_new { Ok(()) } else { Err("it already exists".to_owned()) };
                    self.input(Input::FileWritten { path, result });
                }
                Effect::AppendFile { path, bytes } => {
                    self.files.get_mut(&path).expect("created before").extend(bytes);
                }
                Effect::ReadFile(path) => {
                    let text = self.file(&path).map(|bytes| String::from_utf8_lossy(&bytes).into_owned());
                    self.input(Input::FileRead { path, text: text.ok_or_else(|| "no such file".to_owned()) });
                }
                Effect::Mark(text) => self.marks.push(text),
                Effect::Break => {
                    self.breaks += 1;
                    self.input(Input::BreakSent(Ok(())));
                }
                Effect::CloseLink
                | Effect::DoNotOpen
                | Effect::Suspend
                | Effect::ListPorts
                | Effect::Play(_)
                | Effect::Order(_) => {}
            }
        }
    }

    /// A file by its name, wherever it is looked for.
    fn file(&self, path: &Path) -> Option<Vec<u8>> {
        self.files.iter().find(|(known, _)| known.file_name() == path.file_name()).map(|(_, bytes)| bytes.clone())
    }

    fn run(&mut self, span: Duration) -> &mut Self {
        self.run_until(span, |_| false);
        self
    }

    /// Lets time pass until the picture says something, and gives it.
    fn wait_for(&mut self, text: &str) -> String {
        assert!(self.run_until(Duration::from_secs(120), |desk| desk.picture().contains(text)), "{}", self.picture());
        self.picture()
    }

    fn run_until(&mut self, span: Duration, mut stop: impl FnMut(&Desk) -> bool) -> bool {
        let end = self.now + span;
        if stop(self) {
            return true;
        }
        let mut next_look = self.now;
        loop {
            let due = [self.app.poll_timeout(), self.unit.poll_timeout(), self.to_app.next_arrival()];
            let next = due.into_iter().flatten().min().unwrap_or(Instant::NEVER).max(self.now);
            if next > end {
                self.now = end;
                return false;
            }
            self.now = next;
            let to_app = &mut self.to_app;
            self.unit.advance(next, |at, bytes| to_app.push(at, bytes));
            while let Some((_, byte)) = self.to_app.pop_arrived(next) {
                self.input(Input::Bytes(vec![byte]));
            }
            self.input(Input::Timeout);
            if self.app.is_dirty() && self.now >= next_look {
                self.app.drawn();
                next_look = self.now + LOOK;
                if stop(self) {
                    return true;
                }
            }
        }
    }

    fn press(&mut self, code: KeyCode) -> &mut Self {
        self.key(code, KeyModifiers::NONE)
    }

    fn key(&mut self, code: KeyCode, modifiers: KeyModifiers) -> &mut Self {
        self.input(Input::Terminal(Event::Key(KeyEvent::new(code, modifiers))));
        self.run(Duration::from_millis(50))
    }

    fn keys(&mut self, text: &str) -> &mut Self {
        for character in text.chars() {
            self.press(KeyCode::Char(character));
        }
        self
    }

    /// On the load screen with a checked image, asked for the password.
    fn about_to_load(&mut self) -> &mut Self {
        self.keys("lp/images/AXTC4CO_V1.2.0.elf.S").press(KeyCode::Enter).press(KeyCode::Enter)
    }

    /// Clicks on a text, where it appears first.
    fn click(&mut self, text: &str) -> &mut Self {
        let picture = self.drawn();
        let (row, line) = picture.lines().enumerate().find(|(_, line)| line.contains(text)).expect(text);
        let column = line.split(text).next().map_or(0, |before| before.chars().count()) as u16 + 1;
        let kind = MouseEventKind::Down(MouseButton::Left);
        self.input(Input::Terminal(Event::Mouse(MouseEvent {
            kind,
            column,
            row: row as u16,
            modifiers: KeyModifiers::NONE,
        })));
        self.run(Duration::from_millis(50))
    }

    /// The cable is pulled out ...
    fn pull(&mut self) -> &mut Self {
        self.input(Input::LinkGone(Failure {
            text: format!("cannot read from {CABLE}: the port has gone"),
            hints: vec!["plug the adapter in again".into()],
        }));
        self.run(Duration::from_secs(3));
        assert!(!self.picture().contains("emulated"), "a unit of this program has no cable: {}", self.picture());
        self
    }

    /// ... and plugged in again.
    fn plug_in(&mut self) -> &mut Self {
        self.input(Input::LinkBack(CABLE.into()));
        self.run(Duration::from_secs(10))
    }

    /// The console is killed and started once more; the unit and the journal stay.
    fn started_again(&mut self) -> &mut Self {
        self.app = console(self.link);
        let effects = self.app.start();
        self.perform(effects);
        self.run(Duration::from_secs(10))
    }

    /// The picture without the quotes that the backend puts around its lines.
    fn drawn(&self) -> String {
        self.picture().lines().map(|line| line.trim_matches('"').trim_end()).collect::<Vec<_>>().join("\n")
    }

    fn picture(&self) -> String {
        let mut terminal = Terminal::new(TestBackend::new(100, 30)).expect("a test backend");
        terminal.draw(|frame| self.app.draw(frame)).expect("drawing in memory");
        terminal.backend().to_string()
    }
}

#[test]
fn connecting_shows_who_is_there() {
    let desk = Desk::new();
    let picture = desk.picture();
    for text in ["AXTC4CO 1.1.0", "node 127", "application runs", "125 kbit/s", "pre-operational", "has sent no values"]
    {
        assert!(picture.contains(text), "no '{text}' in\n{picture}");
    }
}

#[test]
fn t_brings_values_and_a_broken_wire_is_a_fault_with_its_time() {
    let mut desk = Desk::new();
    desk.keys("t500").press(KeyCode::Enter);
    desk.wait_for("every 500 ms");
    let now = desk.now;
    desk.unit.unit_mut().turn(now, Knob::Open(1, None)).expect("TC1");
    let picture = desk.wait_for("check sensor, wire and connector");
    assert!(picture.contains("1 now, 1 since connecting"), "{picture}");
    let now = desk.now;
    desk.unit.unit_mut().power_off(now);
    desk.wait_for("these values are old");
    let now = desk.now;
    desk.unit.unit_mut().power_on(now);
    desk.run(Duration::from_secs(5)).keys("t");
    desk.wait_for("The stream is off.");
}

#[test]
fn the_dictionary_is_read_searched_compared_and_written_down() {
    let mut desk = Desk::new();
    desk.keys("5");
    assert!(desk.picture().contains("the manual's; V reads the unit's"), "{}", desk.picture());
    desk.keys("v").press(KeyCode::Enter);
    desk.wait_for("so far");
    desk.wait_for("0 not as factory");
    desk.keys("e").key(KeyCode::Char('u'), KeyModifiers::CONTROL).keys("before.json").press(KeyCode::Enter);
    assert!(desk.picture().contains("before.json is written"), "{}", desk.picture());
    desk.keys("e").key(KeyCode::Char('u'), KeyModifiers::CONTROL).keys("before.json").press(KeyCode::Enter);
    assert!(desk.picture().contains("it already exists"), "an older file is left alone: {}", desk.picture());
    desk.press(KeyCode::Esc);

    // Somebody switches a channel off, and the next reading says so.
    let now = desk.now;
    let (at, value) = (ObjectAddress::new(0x6112, 2), Value::Unsigned8(0));
    desk.unit.unit_mut().write_object(now, at, &value.encode()).expect("written");
    desk.keys("v").press(KeyCode::Enter);
    desk.wait_for("1 not as factory");
    desk.keys("o");
    let picture = desk.picture();
    assert!(picture.contains("only those") && picture.contains("* 6112:02"), "{picture}");
    assert!(picture.contains("not as the factory made it"), "the pane explains it: {picture}");
    desk.keys("w");
    let choice = desk.picture();
    assert!(choice.contains("› before.json") && choice.contains("/images"), "the dump is found: {choice}");
    desk.press(KeyCode::Enter);
    let picture = desk.picture();
    assert!(picture.contains("before.json has") && picture.contains("≠ 6112:02"), "{picture}");
    desk.press(KeyCode::Esc).keys("/operating mode");
    assert!(desk.picture().contains("with 'operating mode'"), "{}", desk.picture());
    desk.press(KeyCode::Esc).keys("ex.pdf").press(KeyCode::Enter);
    assert!(desk.picture().contains("the name has to end in"), "{}", desk.picture());
    desk.press(KeyCode::Esc);
    for (name, holds) in [("a.csv", "6112,2,"), ("a.dcf", "[6112sub2]"), ("a.txt", "* 6112:02")] {
        desk.keys("e").key(KeyCode::Char('u'), KeyModifiers::CONTROL).keys(name).press(KeyCode::Enter);
        let text = String::from_utf8_lossy(&desk.files[Path::new(name)]).into_owned();
        assert!(text.contains(holds), "{name}: {text}");
    }
}

#[test]
fn the_units_list_of_errors_is_told_in_words() {
    let mut desk = Desk::new();
    let now = desk.now;
    desk.unit.unit_mut().turn(now, Knob::Open(2, None)).expect("TC2");
    desk.run(Duration::from_secs(5)).keys("v").press(KeyCode::Enter);
    desk.wait_for("not as factory");
    desk.keys("/1003:01").press(KeyCode::Enter);
    assert!(desk.picture().contains("0x0202F001: TC2: open circuit"), "{}", desk.picture());
    desk.keys("2");
    assert!(
        desk.picture().contains("TC2     open circuit   in the unit's list of errors (1003h)"),
        "{}",
        desk.picture()
    );
}

#[test]
fn diagnostics_stand_beside_their_numbers_until_s_stops_them() {
    let mut desk = Desk::new();
    desk.keys("s");
    desk.wait_for("Supply Voltage");
    let picture = desk.wait_for("page 3");
    assert!(picture.contains("Numbers on it") && picture.contains("S stops"), "{picture}");
    desk.keys("s");
    let picture = desk.wait_for("The diagnostics are off.");
    assert!(picture.contains("stopped"), "{picture}");
    desk.keys("2");
    assert!(desk.picture().contains("Supply Voltage"), "the overview has them too: {}", desk.picture());
}

#[test]
fn a_job_given_while_the_unit_is_being_asked_who_it_is_is_known_to_run_and_ended_by_its_key() {
    let mut desk = Desk::new();
    desk.keys("ms");
    desk.wait_for("page 3");
    assert!(desk.picture().contains("S stops"), "{}", desk.picture());
    desk.keys("s");
    desk.wait_for("The diagnostics are off.");
    let before = desk.picture();
    desk.run(Duration::from_secs(5));
    assert_eq!(desk.picture(), before, "no more pages come");
}

#[test]
fn words_are_found_in_the_terminal_one_place_after_the_other() {
    let mut desk = Desk::new();
    desk.keys("3");
    for _ in 0..5 {
        desk.keys("m").run(Duration::from_secs(2));
    }
    let prefix = |desk: &mut Desk, key: char| {
        desk.key(KeyCode::Char('5'), KeyModifiers::CONTROL).press(KeyCode::Char(key));
    };
    prefix(&mut desk, '/');
    desk.keys("main menu");
    let newest = desk.picture();
    assert!(newest.contains("'main menu'"), "{newest}");
    desk.press(KeyCode::Enter);
    prefix(&mut desk, 'n');
    assert!(desk.picture().contains("stopped"), "{}", desk.picture());
    assert_ne!(desk.picture(), newest);
    prefix(&mut desk, '/');
    desk.keys("xyzzy");
    assert!(desk.picture().contains("is nowhere"), "{}", desk.picture());
    desk.press(KeyCode::Esc);
    assert!(desk.picture().contains("follows"), "{}", desk.picture());
}

#[test]
fn defaults_are_restored_and_the_unit_comes_back() {
    let mut desk = Desk::new();
    desk.keys("dYes").press(KeyCode::Enter);
    desk.wait_for("The defaults are restored");
}

#[test]
fn task_identify() {
    assert_snapshot!(Desk::new().drawn());
}

#[test]
fn task_read_the_values() {
    let mut desk = Desk::new();
    desk.keys("t").press(KeyCode::Enter).run(Duration::from_secs(30));
    assert_snapshot!(desk.drawn());
}

#[test]
fn task_find_an_open_sensor() {
    let mut desk = Desk::new();
    desk.keys("t").press(KeyCode::Enter).run(Duration::from_secs(20));
    let now = desk.now;
    desk.unit.unit_mut().turn(now, Knob::Open(2, None)).expect("TC2");
    desk.run(Duration::from_secs(10));
    assert_snapshot!(desk.drawn());
}

#[test]
fn task_compare_the_settings_with_the_factorys_and_restore_them() {
    let mut desk = Desk::new();
    let now = desk.now;
    let (at, value) = (ObjectAddress::new(0x4010, 1), Value::Integer16(900));
    desk.unit.unit_mut().write_object(now, at, &value.encode()).expect("written");
    desk.keys("v").press(KeyCode::Enter);
    desk.wait_for("1 not as factory");
    desk.keys("o");
    assert_snapshot!("task_compare_the_settings", desk.drawn());
    desk.keys("dYes").press(KeyCode::Enter);
    desk.wait_for("The defaults are restored");
    desk.keys("v").press(KeyCode::Enter);
    desk.wait_for("0 not as factory");
    assert_snapshot!("task_restore_the_defaults", desk.drawn());
}

#[test]
fn task_record_the_stream_and_chart_it() {
    let mut desk = Desk::new();
    desk.keys("6t200").press(KeyCode::Enter).run(Duration::from_secs(20));
    desk.keys("e").key(KeyCode::Char('u'), KeyModifiers::CONTROL).keys("rows.csv").press(KeyCode::Enter);
    desk.run(Duration::from_secs(20));
    assert_snapshot!("task_record_the_stream", desk.drawn());
    let rows = String::from_utf8(desk.files[Path::new("rows.csv")].clone()).expect("text");
    assert!(rows.lines().count() > 150 && rows.starts_with("time,source,CJ,TC1"), "{rows}");
    desk.press(KeyCode::Down).keys("zk").press(KeyCode::Left);
    assert_snapshot!("task_chart_the_stream", desk.drawn());
}

#[test]
fn task_upload() {
    let mut desk = Desk::new();
    desk.keys("lp/images/AXTC4CO_V1.2.0.elf.S").press(KeyCode::Enter);
    assert_snapshot!("task_upload_plan", desk.drawn());
    desk.press(KeyCode::Enter).keys("AXIO-2010").press(KeyCode::Enter);
    desk.wait_for("50 %");
    assert_snapshot!("task_upload_half", desk.drawn());
    desk.wait_for("── Verdict");
    assert_snapshot!("task_upload_verdict", desk.drawn());
    assert_eq!(desk.noted, None, "it runs: nothing is left to be noted");
}

#[test]
fn task_recover_an_upload_whose_cable_was_pulled() {
    let mut desk = Desk::on_cable();
    desk.keys("t500").press(KeyCode::Enter);
    desk.wait_for("every 500 ms");
    desk.run(Duration::from_secs(3)).about_to_load().keys("AXIO-2010").press(KeyCode::Enter);
    desk.wait_for("30 %");
    desk.pull();
    assert_snapshot!("task_recover_lost", desk.drawn());
    desk.plug_in().keys("2");
    // It says nothing, but it is where its upload has left it.
    let told = desk.picture();
    assert!(told.contains("AXTC4CO?") && told.contains("these are its last values"), "{told}");
    desk.keys("4").press(KeyCode::Enter).press(KeyCode::Enter);
    let asked = desk.drawn();
    assert!(asked.contains("Is it the unit this was begun for?"), "{asked}");
    desk.keys("y");
    let begun = desk.drawn();
    assert!(begun.contains("── Loading"), "neither label nor password need be asked for: {begun}");
    desk.wait_for("1.2.0 afterwards");
    assert_snapshot!("task_recover_verdict", desk.drawn());
}

#[test]
fn task_recover_an_upload_whose_console_was_killed() {
    let mut desk = Desk::on_cable();
    desk.about_to_load().keys("AXIO-2010").press(KeyCode::Enter);
    desk.wait_for("30 %");
    desk.started_again();
    desk.keys("lp/images/AXTC4CO_V1.2.0.elf.S").press(KeyCode::Enter);
    assert_snapshot!("task_recover_after_a_kill", desk.drawn());
    desk.press(KeyCode::Enter).keys("y");
    desk.wait_for("1.2.0 afterwards");
    assert_eq!(desk.noted, None);
}

#[test]
fn the_mouse_is_enough_to_look_around() {
    let mut desk = Desk::new();
    desk.click("5 Dict").click("1002:00");
    assert!(desk.drawn().contains("── 1002:00 Manufacturer Status Register"), "{}", desk.drawn());
    desk.click("1 Link").click("emu:axrtd8co");
    assert!(desk.drawn().contains("Emulated AXRTD8CO"), "{}", desk.drawn());
    desk.click("8 Rec").click("2026-01-31");
    assert!(desk.drawn().contains("Close the link?"), "{}", desk.drawn());
    desk.press(KeyCode::Esc);
    desk.click("T stream");
    assert!(desk.drawn().contains("Switch the data stream on"), "{}", desk.drawn());
}

#[test]
fn task_send_us_a_recording() {
    let mut desk = Desk::new();
    desk.keys("8");
    assert_snapshot!(desk.drawn());
}

#[test]
fn leaving_in_the_middle_leaves_a_unit_that_measures() {
    for (begins, shows) in [("v\r", "so far"), ("s", "Supply Voltage"), ("3v", "halted by V")] {
        for way in ["signal", "question"] {
            let mut desk = Desk::new();
            for key in begins.chars() {
                desk.press(if key == '\r' { KeyCode::Enter } else { KeyCode::Char(key) });
            }
            desk.wait_for(shows);
            if way == "signal" {
                desk.input(Input::Signal);
            } else {
                desk.key(KeyCode::Char('5'), KeyModifiers::CONTROL).press(KeyCode::Char('q'));
                if !desk.picture().contains("Leave axcon?") {
                    desk.keys("q");
                }
                assert!(desk.picture().contains("Leave axcon?"), "{begins} {}", desk.picture());
                desk.keys("y");
            }
            assert!(desk.run_until(Duration::from_secs(3), |desk| desk.over), "{begins} {way}: {}", desk.picture());
            // Who comes next finds the menu, not a view that halts everything.
            desk.over = false;
            desk.started_again();
            assert!(desk.picture().contains("AXTC4CO 1.1.0"), "{begins} {way}: {}", desk.picture());
            desk.keys("t").press(KeyCode::Enter);
            desk.wait_for("every 1 s");
        }
    }
}

/// A console that opens this link.
fn console(link: &str) -> App {
    App::new(Options {
        link: Some(link.into()),
        directory: PathBuf::from("/images"),
        home: None,
        palette: Palette::Mono,
        size: (100, 30),
    })
}

/// An S-record file with V1.2.0, of the usual size.
fn new_image() -> Vec<u8> {
    image_of(Version::new(1, 2, 0))
}

fn image_of(version: Version) -> Vec<u8> {
    let target = axtc4co().target();
    let recipe = make::Recipe { target: &target, version, words: 0xC000, flaw: None };
    make::make(&recipe).expect("an image of the usual size")
}
