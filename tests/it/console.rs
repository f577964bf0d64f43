//! The console on the screen against an emulated unit, in virtual time: keys in, pictures out.

use std::path::PathBuf;

use axcon::device::{LoaderKind, Product};
use axcon::emulator::cable::{Line, Plugged};
use axcon::emulator::knob::Knob;
use axcon::emulator::{Setup, Unit};
use axcon::image::make;
use axcon::time::{Duration, Instant, character_time};
use axcon::tui::{App, Effect, ImageFacts, Input, LinkInfo, Options};
use axcon::version::Version;
use ratatui::Terminal;
use ratatui::backend::TestBackend;
use ratatui::crossterm::event::{Event, KeyCode, KeyEvent, KeyModifiers};

use crate::support::bench::{BAUD, axtc4co, factory_flash, flash_with, full_image};

/// How often somebody looks at the picture.
const LOOK: Duration = Duration::from_millis(100);

/// A console, a unit, and a cable between them.
struct Desk {
    now: Instant,
    app: App,
    unit: Plugged<Unit>,
    to_app: Line,
    over: bool,
}

impl Desk {
    /// Connected to a unit with V1.1.0, just powered on.
    fn new() -> Self {
        let flash = factory_flash("1.1.0");
        let setup =
            Setup { product: axtc4co(), loader: LoaderKind::G1, seed: 1, dialect: 0, flash, parameters: Vec::new() };
        let mut unit = Unit::new(setup);
        unit.power_on(Instant::ZERO);
        let app = App::new(Options {
            link: Some("emu:axtc4co".into()),
            directory: PathBuf::from("/images"),
            colour: false,
            size: (100, 30),
        });
        let latency = Duration::from_millis(1);
        let mut desk = Desk {
            now: Instant::ZERO,
            app,
            unit: Plugged::new(unit, Line::new(character_time(BAUD), latency)),
            to_app: Line::new(Duration::ZERO, latency),
            over: false,
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
                    self.input(Input::LinkOpened(LinkInfo {
                        link,
                        baud: BAUD,
                        read_only: false,
                        recording: None,
                        start_of_day: Duration::ZERO,
                    }));
                }
                Effect::Transmit(transmit) => self.unit.send(self.now, &transmit.bytes),
                Effect::ListFiles(directory) => {
                    self.input(Input::FilesListed { directory, entries: Ok(Vec::new()) });
                }
                Effect::CheckImage(path) => {
                    let targets: Vec<_> = Product::all().iter().map(Product::target).collect();
                    let file = new_image();
                    let report = axcon::image::check(file.as_slice(), None, &targets, None, &[]).expect("a slice");
                    self.input(Input::ImageChecked(Box::new(ImageFacts::of_report(path, &report))));
                }
                Effect::Quit => self.over = true,
                Effect::CloseLink | Effect::ListPorts | Effect::UploadBegins { .. } | Effect::UploadEnds { .. } => {}
            }
        }
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
        self.input(Input::Terminal(Event::Key(KeyEvent::new(code, KeyModifiers::NONE))));
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
    for text in ["AXTC4CO 1.1.0", "node 127", "application runs", "125 kbit/s", "pre-operational", "The stream is off"]
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
fn defaults_are_restored_and_the_unit_comes_back() {
    let mut desk = Desk::new();
    desk.keys("dYes").press(KeyCode::Enter);
    desk.wait_for("The defaults are restored");
}

#[test]
fn an_upload_goes_from_the_plan_to_the_new_banner() {
    let mut desk = Desk::new();
    desk.keys("lp/images/AXTC4CO_V1.2.0.elf.S").press(KeyCode::Enter);
    let plan = desk.picture();
    assert!(plan.contains("passed") && plan.contains("AXTC4CO 1.2.0 (newer)"), "{plan}");
    desk.press(KeyCode::Enter).keys("AXIO-2010");
    assert!(!desk.picture().contains("AXIO-2010\n"), "the password is not shown");
    desk.press(KeyCode::Enter);
    desk.wait_for("50 %");
    let verdict = desk.wait_for("── Verdict");
    assert!(verdict.contains("Done") && verdict.contains("before 1.1.0, after 1.2.0"), "{verdict}");
    assert_eq!(desk.unit.unit().flash()[..0xC000 * 2], flash_with(&full_image("1.2.0"))[..0xC000 * 2]);
    desk.press(KeyCode::Enter);
    assert!(desk.picture().contains("the same version again"), "{}", desk.picture());
}

#[test]
fn a_wrong_password_changes_nothing_and_says_so() {
    let mut desk = Desk::new();
    desk.about_to_load().keys("axio-2010").press(KeyCode::Enter);
    let verdict = desk.wait_for("── Verdict");
    assert!(verdict.contains("The unit refused") && verdict.contains("runs its application"), "{verdict}");
}

#[test]
fn a_cancelled_upload_can_be_sent_again_after_the_label_has_been_read() {
    let mut desk = Desk::new();
    desk.about_to_load().keys("AXIO-2010").press(KeyCode::Enter);
    desk.wait_for("20 %");
    desk.keys("q");
    assert!(desk.picture().contains("Leave axcon?"), "{}", desk.picture());
    desk.press(KeyCode::Esc).press(KeyCode::Esc);
    assert!(desk.picture().contains("Cancel the upload?"), "{}", desk.picture());
    desk.keys("y");
    let verdict = desk.wait_for("── Verdict");
    assert!(verdict.contains("Cancelled") && verdict.contains("send again"), "{verdict}");
    desk.run(Duration::from_secs(5)).press(KeyCode::Enter).press(KeyCode::Enter);
    if desk.picture().contains("Which product is the unit?") {
        desk.keys("AXTC4CO").press(KeyCode::Enter);
    }
    desk.keys("AXIO-2010").press(KeyCode::Enter);
    desk.wait_for("── Verdict");
    assert!(desk.picture().contains("after 1.2.0"), "{}", desk.picture());
    desk.keys("q");
    assert!(desk.over);
}

/// An S-record file with V1.2.0, of the usual size.
fn new_image() -> Vec<u8> {
    let target = axtc4co().target();
    let recipe = make::Recipe { target: &target, version: Version::new(1, 2, 0), words: 0xC000, flaw: None };
    make::make(&recipe).expect("an image of the usual size")
}
