//! The user's terminal: taken over for a while, and given back on every way out.
//!
//! Drop gives it back, the panic hook gives it back before the message is printed, and signals come as inputs
//! (`signal`), so that the loop ends and drop does its work.

use std::io::{self, IsTerminal, Write, stdout};
use std::panic;
use std::sync::atomic::{AtomicU8, Ordering};
use std::sync::mpsc::{Receiver, SyncSender, TrySendError, sync_channel};
use std::sync::{Arc, Once};
use std::thread;

use ratatui::DefaultTerminal;
use ratatui::Terminal;
use ratatui::backend::CrosstermBackend;
use ratatui::crossterm::cursor::Show;
use ratatui::crossterm::event::{self, DisableBracketedPaste, EnableBracketedPaste};
use ratatui::crossterm::terminal::{EnterAlternateScreen, LeaveAlternateScreen, disable_raw_mode, enable_raw_mode};
use ratatui::crossterm::{execute, queue};

use super::Input;

/// The whole screen, for the console. Gives the terminal back when dropped.
#[derive(Debug)]
pub struct Screen {
    /// For drawing.
    pub terminal: DefaultTerminal,
    /// Whether clicks and the wheel come to us.
    has_mouse: bool,
}

/// Buttons and the wheel, with places beyond column 223. Not the pointer's every move, as the library's own command
/// asks for: nothing here needs those, and each would wake us.
const MOUSE_ON: &str = "\x1b[?1000h\x1b[?1006h";
const MOUSE_OFF: &str = "\x1b[?1006l\x1b[?1000l";

/// Raw mode only, for the plain terminal. Gives the terminal back when dropped.
#[derive(Debug)]
pub struct RawMode(());

/// The settings of the user's terminal, given back when dropped: for typing that is hidden in a thread which a signal
/// does not reach.
#[derive(Debug)]
pub struct KeptTerminal {
    #[cfg(unix)]
    kept: Option<(std::fs::File, rustix::termios::Termios)>,
}

/// Keys that wait at most; the terminal keeps the others.
const KEYS: usize = 64;

/// What of the terminal is ours at the moment.
static TAKEN: AtomicU8 = AtomicU8::new(NOTHING);
const NOTHING: u8 = 0;
const RAW: u8 = 1;
const SCREEN: u8 = 2;

impl Screen {
    /// Takes the terminal: raw mode, alternate screen, pastes in one piece.
    ///
    /// # Errors
    /// If standard output is not a terminal, or it refuses.
    pub fn enter() -> io::Result<Self> {
        if !stdout().is_terminal() {
            return Err(io::Error::new(io::ErrorKind::Unsupported, "standard output is not a terminal"));
        }
        restore_on_panic();
        take_screen()?;
        let terminal = Terminal::new(CrosstermBackend::new(stdout())).inspect_err(|_| give_back())?;
        Ok(Screen { terminal, has_mouse: false })
    }

    /// Says whether clicks and the wheel come to us, or stay the terminal program's own: to select text.
    ///
    /// # Errors
    /// If the terminal refuses.
    pub fn set_mouse(&mut self, wanted: bool) -> io::Result<()> {
        if self.has_mouse != wanted {
            self.has_mouse = wanted;
            let mut out = stdout();
            out.write_all(if wanted { MOUSE_ON } else { MOUSE_OFF }.as_bytes())?;
            out.flush()?;
        }
        Ok(())
    }

    /// Gives the terminal back, stops the process and those it was started with, as Ctrl-Z does elsewhere, and takes the
    /// terminal again when they are continued. Where no shell could continue them the system ignores it.
    ///
    /// # Errors
    /// If the terminal refuses.
    pub fn suspend(&mut self) -> io::Result<()> {
        give_back();
        #[cfg(unix)]
        rustix::process::kill_current_process_group(rustix::process::Signal::TSTP)?;
        self.retake()
    }

    /// Takes the terminal again, whatever a shell has made of it meanwhile. The next frame draws everything again.
    ///
    /// # Errors
    /// If the terminal refuses.
    pub fn retake(&mut self) -> io::Result<()> {
        give_back();
        self.has_mouse = false;
        take_screen()?;
        // Not `clear`: that asks the terminal for the cursor, whose answer the key thread would take.
        let size = self.terminal.size()?;
        self.terminal.resize(size.into())
    }
}

impl Drop for Screen {
    fn drop(&mut self) {
        give_back();
    }
}

impl RawMode {
    /// Switches the terminal to raw mode.
    ///
    /// # Errors
    /// If standard input is not a terminal, or it refuses.
    pub fn enter() -> io::Result<Self> {
        restore_on_panic();
        enable_raw_mode()?;
        TAKEN.store(RAW, Ordering::SeqCst);
        Ok(RawMode(()))
    }
}

impl KeptTerminal {
    /// As they are now. Where there is no terminal, nothing is kept.
    #[cfg(unix)]
    pub fn now() -> Self {
        let terminal = std::fs::File::options().read(true).write(true).open("/dev/tty").ok();
        let kept = terminal.and_then(|terminal| {
            let settings = rustix::termios::tcgetattr(&terminal).ok()?;
            Some((terminal, settings))
        });
        KeptTerminal { kept }
    }

    /// Nothing to keep: the program ends without a signal of its own there.
    #[cfg(not(unix))]
    pub fn now() -> Self {
        KeptTerminal {}
    }
}

impl Drop for KeptTerminal {
    fn drop(&mut self) {
        #[cfg(unix)]
        if let Some((terminal, settings)) = &self.kept {
            let _ = rustix::termios::tcsetattr(terminal, rustix::termios::OptionalActions::Now, settings);
        }
    }
}

impl Drop for RawMode {
    fn drop(&mut self) {
        give_back();
    }
}

/// Delivers what the user does at the terminal on a channel of its own, from a thread that lives as long as the process:
/// nothing ends a read of the terminal. A wait for `inputs` is woken. Keys do not queue behind what a port floods that
/// channel with. Started once, after [`Screen::enter`].
///
/// # Errors
/// If the system gives no thread.
pub fn listen(inputs: SyncSender<Input>) -> io::Result<Receiver<event::Event>> {
    let (keys, typed) = sync_channel(KEYS);
    thread::Builder::new().name("keys".into()).spawn(move || {
        // An error means that the terminal is gone; then a hang-up signal comes as well.
        while let Ok(event) = event::read() {
            // Windows reports that a key comes up again, which is not a key typed.
            if matches!(&event, event::Event::Key(key) if key.kind == event::KeyEventKind::Release) {
                continue;
            }
            if keys.send(event).is_err() {
                return;
            }
            // A full channel wakes its owner by itself.
            if let Err(TrySendError::Disconnected(_)) = inputs.try_send(Input::Wake) {
                return;
            }
        }
    })?;
    Ok(typed)
}

/// Whether reading standard input is harmless: a background job that reads its terminal is stopped by the system.
pub fn may_read_standard_input() -> bool {
    #[cfg(unix)]
    {
        let stdin = io::stdin();
        if stdin.is_terminal() {
            return rustix::termios::tcgetpgrp(&stdin).is_ok_and(|foreground| foreground == rustix::process::getpgrp());
        }
    }
    true
}

/// Columns and rows of the user's terminal, where it says.
pub fn size() -> Option<(usize, usize)> {
    let (columns, rows) = ratatui::crossterm::terminal::size().ok()?;
    (columns > 0 && rows > 0).then(|| (columns.into(), rows.into()))
}

fn take_screen() -> io::Result<()> {
    enable_raw_mode()?;
    TAKEN.store(SCREEN, Ordering::SeqCst);
    execute!(stdout(), EnterAlternateScreen, EnableBracketedPaste).inspect_err(|_| give_back())
}

/// Gives back what was taken. Harmless if nothing was.
pub(super) fn give_back() {
    let taken = TAKEN.swap(NOTHING, Ordering::SeqCst);
    // First, since this succeeds even on a terminal that takes no bytes.
    if taken != NOTHING {
        let _ = disable_raw_mode();
    }
    if taken == SCREEN {
        let mut out = stdout();
        let _ = out.write_all(MOUSE_OFF.as_bytes());
        let _ = queue!(out, DisableBracketedPaste, LeaveAlternateScreen, Show);
        let _ = out.flush();
    }
}

/// Makes every panic give the terminal back before its message. A panic in a worker also ends the process: its thread
/// is gone, and the rest would go on with half a program on a terminal that is no longer its own.
fn restore_on_panic() {
    static ONCE: Once = Once::new();
    ONCE.call_once(|| {
        let owner = thread::current().id();
        let report = Arc::new(panic::take_hook());
        panic::set_hook(Box::new(move |info| {
            let taken = TAKEN.load(Ordering::SeqCst) != NOTHING;
            give_back();
            report(info);
            if taken && thread::current().id() != owner {
                std::process::exit(PANIC_EXIT_CODE);
            }
        }));
    });
}

/// What the language's runtime ends with after a panic.
const PANIC_EXIT_CODE: i32 = 101;
