//! A console that panics gives its terminal back, and what it has to say can be read.
//!
//! No input makes the real program panic, and none shall: a key, an argument or a variable that did it on purpose would be
//! one that somebody trips over. But the console is told by its caller what opens a link and what checks a file
//! (`tui::run::World`). So this program is a caller of its own: it hands in functions that panic, and everything else is
//! what the real one does, with loop, threads, hook and guard on a terminal of their own. It starts itself once more for
//! that, as a process has one panic hook and one terminal; hence no harness, whose hook and threads would come between.

#[cfg(unix)]
mod support;

/// First argument of the program that panics.
#[cfg(unix)]
const CHILD: &str = "be-a-console-that-panics";

#[cfg(unix)]
fn main() {
    let mut args = std::env::args().skip(1);
    match args.next().as_deref() {
        Some(CHILD) => child::run(),
        _ => {
            story::a_panic_of_the_loop();
            story::a_panic_of_a_worker();
        }
    }
}

/// There are no pseudo-terminals to try it on.
#[cfg(not(unix))]
fn main() {}

#[cfg(unix)]
mod child {
    use axcon::host::recorder::Plan;
    use axcon::tui::run::World;
    use axcon::tui::{Failure, Palette};

    /// The console, with a caller that panics: where it names a link, and where it checks a file.
    pub fn run() {
        let world = World {
            link: None,
            baud: 115_200,
            recording: Plan::Nothing,
            palette: Palette::Mono,
            resolve: |name| panic!("no link is named {name}, said on the loop's own thread"),
            open: |_, _, _, _| Err(Failure { text: "no link opens here".into(), hints: Vec::new() }),
            explain: |error| Failure { text: error.to_string(), hints: Vec::new() },
            unreadable: |error| Failure { text: error.to_string(), hints: Vec::new() },
            check: |path, _, _| panic!("{} is not an image, said by a worker", path.display()),
            note: |_, _| {},
            noted: |_| None,
            incomplete: |_| {},
        };
        axcon::tui::run::run(world).expect("a terminal");
    }
}

#[cfg(unix)]
mod story {
    use std::process::Command;

    use crate::CHILD;
    use crate::support::screen::Screen;

    /// What the language's runtime ends with after a panic.
    const PANICKED: Option<i32> = Some(101);

    fn console() -> Screen {
        let mut command = Command::new(std::env::current_exe().expect("this program"));
        command.arg(CHILD).env_clear();
        Screen::start(command, 24, 80)
    }

    pub fn a_panic_of_the_loop() {
        let mut screen = console();
        screen.wait("Serial ports");
        assert!(!screen.is_as_the_shell_left_it(), "the console has the terminal");
        screen.keys("pnowhere\r");
        assert_eq!(screen.wait_end(), PANICKED, "{}", screen.text());
        is_told(&screen, "no link is named nowhere, said on the loop's own thread");
    }

    pub fn a_panic_of_a_worker() {
        let mut screen = console();
        screen.wait("Serial ports");
        screen.keys("l");
        screen.wait("Choose a file");
        screen.keys("pCargo.toml\r");
        assert_eq!(screen.wait_end(), PANICKED, "half a program must not go on: {}", screen.text());
        is_told(&screen, "Cargo.toml is not an image, said by a worker");
    }

    /// The terminal is the shell's again, and the panic is on it: whole, and each line at the left edge, which raw mode
    /// would have moved.
    fn is_told(screen: &Screen, message: &str) {
        assert!(screen.is_given_back(), "{}", screen.text());
        let text = screen.wait(message);
        assert!(text.lines().any(|line| line.starts_with("thread '") && line.contains("panicked at")), "{text}");
        assert!(!text.contains("Serial ports") && !text.contains("Choose a file"), "the picture is gone: {text}");
        let unmoved = text.lines().filter(|line| !line.is_empty()).all(|line| !line.starts_with(' '));
        assert!(unmoved, "{text}");
    }
}
