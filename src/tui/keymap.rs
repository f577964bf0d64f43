//! Which key does what.
//!
//! A screen lists its bindings; the menu of the unit's manual and the keys that work everywhere are here. Footer and
//! help screen are made from these tables, so they cannot say anything else than what the keys do.

use ratatui::crossterm::event::{KeyCode, KeyEvent, KeyModifiers};

use super::screens::ScreenId;

/// What a key asks for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Cmd {
    /// A key of the unit's main menu (AXTC4CO manual, section 4.1).
    Menu(MenuCmd),
    /// Show a screen.
    Go(ScreenId),
    /// Show the next screen.
    Next,
    /// Show the screen before.
    Previous,
    /// Show the keys.
    Help,
    /// Leave the program.
    Quit,
    /// Stop the program until the shell continues it.
    Suspend,
    /// Other colours.
    Palette,
    /// Open the lost link again.
    Reconnect,
    /// One up.
    Up,
    /// One down.
    Down,
    /// A page up.
    PageUp,
    /// A page down.
    PageDown,
    /// To the first.
    First,
    /// To the last.
    Last,
    /// Do it.
    Accept,
    /// Back one step.
    Back,
    /// The folder above.
    Above,
    /// Look again.
    Refresh,
    /// Type a name.
    Type,
    /// Close the link.
    Disconnect,
    /// Text or hexadecimal.
    Hex,
    /// With or without times.
    Times,
    /// Restart minimum and maximum.
    Restart,
    /// Left, or earlier.
    Left,
    /// Right, or later.
    Right,
    /// More or less of it.
    Zoom,
    /// Hold, or go on.
    Pause,
    /// Remember this moment.
    Mark,
    /// Write it to a file.
    Export,
    /// Look for words.
    Find,
    /// The next one further up.
    FindNext,
    /// Only some of it.
    Filter,
    /// Compare with a file.
    Compare,
    /// Send long records.
    Pack,
    /// Send in spite of an error.
    Allow,
    /// Another kind of loader.
    Loader,
    /// Another unit than the noted one.
    OtherUnit,
    /// Send a file as it is.
    SendFile,
    /// Hold the line low for a moment.
    Break,
    /// Play faster.
    Faster,
    /// Play slower.
    Slower,
    /// Break a sensor's wire.
    OpenWire,
    /// Short a sensor.
    ShortWire,
    /// Make a sensor's wires whole.
    Repair,
    /// Pull the power for a moment.
    Power,
    /// The next key is for the console.
    Prefix,
}

impl Cmd {
    /// Where a cursor at `place` goes in a list whose last place is `last` and of which `page` rows are in sight. `None` if
    /// the command is another one.
    pub fn moved(self, place: usize, last: usize, page: usize) -> Option<usize> {
        let moved = match self {
            Cmd::Up => place.saturating_sub(1),
            Cmd::Down => place.saturating_add(1),
            Cmd::PageUp => place.saturating_sub(page),
            Cmd::PageDown => place.saturating_add(page),
            Cmd::First => 0,
            Cmd::Last => last,
            _ => return None,
        };
        Some(moved.min(last))
    }
}

/// The keys of the unit's main menu.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum MenuCmd {
    /// M: main menu.
    Menu,
    /// V: view the object dictionary.
    View,
    /// D: default object dictionary.
    Defaults,
    /// T: toggle the stream.
    Stream,
    /// S: show or stop diagnostics.
    Diagnostics,
    /// L: load new software.
    Load,
}

/// One command and its keys.
#[derive(Clone, Copy, Debug)]
pub struct Binding {
    /// Keys that do it; the first is the one to show.
    pub keys: &'static [Press],
    /// What they do.
    pub cmd: Cmd,
    /// For the footer, in a word or two; empty: not there.
    pub short: &'static str,
    /// For the help screen.
    pub long: &'static str,
}

/// A key as pressed. Letters are meant in either case.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Press {
    /// A key by itself.
    Plain(KeyCode),
    /// A character with Ctrl.
    Ctrl(char),
}

/// What the unit's own menu offers, in the manual's order and words.
pub const MENU: &[Binding] = &[
    menu(
        &[Press::Plain(KeyCode::Char('m'))],
        MenuCmd::Menu,
        "menu",
        "ask who is there: the unit prints menu and network variables",
    ),
    menu(
        &[Press::Plain(KeyCode::Char('v'))],
        MenuCmd::View,
        "view",
        "view the object dictionary; halts scanning and CAN meanwhile",
    ),
    menu(
        &[Press::Plain(KeyCode::Char('d'))],
        MenuCmd::Defaults,
        "defaults",
        "restore the default object dictionary; the unit restarts",
    ),
    menu(&[Press::Plain(KeyCode::Char('t'))], MenuCmd::Stream, "stream", "switch the data stream on or off"),
    menu(
        &[Press::Plain(KeyCode::Char('s'))],
        MenuCmd::Diagnostics,
        "diagnostics",
        "show or stop the diagnostics page, printed by the unit",
    ),
    menu(&[Press::Plain(KeyCode::Char('l'))], MenuCmd::Load, "load", "load new software"),
];

/// Keys that work everywhere but where text is typed.
pub const EVERYWHERE: &[Binding] = &[
    Binding {
        keys: &[Press::Plain(KeyCode::F(1)), Press::Plain(KeyCode::Char('?'))],
        cmd: Cmd::Help,
        short: "help",
        long: "show this page",
    },
    Binding {
        keys: &[Press::Plain(KeyCode::Char('q')), Press::Ctrl('c')],
        cmd: Cmd::Quit,
        short: "quit",
        long: "leave; asks first if something would be left half done",
    },
    Binding {
        keys: &[Press::Plain(KeyCode::F(2))],
        cmd: Cmd::Palette,
        short: "",
        long: "colours for a dark terminal, for a light one, or none",
    },
    Binding {
        keys: &[Press::Ctrl('z')],
        cmd: Cmd::Suspend,
        short: "",
        long: "back to the shell; fg goes on; not while a job runs",
    },
    Binding { keys: &[Press::Plain(KeyCode::Tab)], cmd: Cmd::Next, short: "", long: "next screen" },
    Binding { keys: &[Press::Plain(KeyCode::BackTab)], cmd: Cmd::Previous, short: "", long: "screen before" },
    go(&[Press::Plain(KeyCode::Char('1'))], ScreenId::Connect, "ports and emulated units"),
    go(&[Press::Plain(KeyCode::Char('2'))], ScreenId::Overview, "values, faults and identity"),
    go(&[Press::Plain(KeyCode::Char('3'))], ScreenId::Terminal, "what goes over the line, as it comes"),
    go(&[Press::Plain(KeyCode::Char('4'))], ScreenId::Load, "files and upload"),
    go(&[Press::Plain(KeyCode::Char('5'))], ScreenId::Dictionary, "object dictionary with what it means"),
    go(&[Press::Plain(KeyCode::Char('6'))], ScreenId::Stream, "table and curves of the stream"),
    go(&[Press::Plain(KeyCode::Char('7'))], ScreenId::Diagnostics, "the unit's own pages"),
    go(&[Press::Plain(KeyCode::Char('8'))], ScreenId::Recordings, "what was recorded, and playing it"),
    go(&[Press::Plain(KeyCode::Char('9'))], ScreenId::Bench, "sensors and power of an emulated unit"),
    Binding {
        keys: &[Press::Plain(KeyCode::Char('c'))],
        cmd: Cmd::Reconnect,
        short: "",
        long: "connect again after the link was lost",
    },
];

/// What a key does, looked up in one table after the other.
pub fn find(tables: &[&[Binding]], key: KeyEvent) -> Option<Cmd> {
    tables
        .iter()
        .flat_map(|table| table.iter())
        .find_map(|binding| binding.keys.iter().any(|press| press.is(key)).then_some(binding.cmd))
}

impl Press {
    /// Whether this is the key that was pressed.
    pub fn is(self, key: KeyEvent) -> bool {
        let with_ctrl = key.modifiers.contains(KeyModifiers::CONTROL);
        let with_alt = key.modifiers.contains(KeyModifiers::ALT);
        match (self, key.code) {
            _ if with_alt => false,
            (Press::Plain(KeyCode::Char(wanted)), KeyCode::Char(pressed)) => {
                !with_ctrl && wanted.eq_ignore_ascii_case(&pressed)
            }
            (Press::Plain(wanted), pressed) => wanted == pressed,
            // Terminals send 1Dh for Ctrl-], which arrives under the name Ctrl-5.
            (Press::Ctrl(']'), KeyCode::Char('5')) => with_ctrl,
            (Press::Ctrl(wanted), KeyCode::Char(pressed)) => with_ctrl && wanted.eq_ignore_ascii_case(&pressed),
            (Press::Ctrl(_), _) => false,
        }
    }

    /// The event of pressing it.
    pub fn event(self) -> KeyEvent {
        match self {
            Press::Plain(code) => KeyEvent::new(code, KeyModifiers::NONE),
            Press::Ctrl(character) => KeyEvent::new(KeyCode::Char(character), KeyModifiers::CONTROL),
        }
    }

    /// The key's name for footer and help.
    pub fn name(self) -> String {
        match self {
            Press::Ctrl(character) => format!("Ctrl-{}", character.to_ascii_uppercase()),
            Press::Plain(KeyCode::Char(' ')) => "Space".into(),
            Press::Plain(KeyCode::Char(character)) => character.to_ascii_uppercase().to_string(),
            Press::Plain(KeyCode::F(number)) => format!("F{number}"),
            Press::Plain(KeyCode::Up) => "↑".into(),
            Press::Plain(KeyCode::Down) => "↓".into(),
            Press::Plain(KeyCode::PageUp) => "PgUp".into(),
            Press::Plain(KeyCode::PageDown) => "PgDn".into(),
            Press::Plain(KeyCode::Left) => "←".into(),
            Press::Plain(KeyCode::Right) => "→".into(),
            Press::Plain(KeyCode::BackTab) => "Shift-Tab".into(),
            Press::Plain(code) => code.to_string(),
        }
    }
}

impl Binding {
    /// All its keys for the help screen: `F1 or ?`.
    pub fn names(&self) -> String {
        self.keys.iter().map(|press| press.name()).collect::<Vec<_>>().join(" or ")
    }
}

const fn menu(keys: &'static [Press], cmd: MenuCmd, short: &'static str, long: &'static str) -> Binding {
    Binding { keys, cmd: Cmd::Menu(cmd), short, long }
}

const fn go(keys: &'static [Press], screen: ScreenId, long: &'static str) -> Binding {
    Binding { keys, cmd: Cmd::Go(screen), short: "", long }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn key(code: KeyCode, modifiers: KeyModifiers) -> KeyEvent {
        KeyEvent::new(code, modifiers)
    }

    #[test]
    fn letters_count_in_either_case_and_not_with_ctrl_or_alt() {
        let find = |code, modifiers| find(&[MENU, EVERYWHERE], key(code, modifiers));
        assert_eq!(find(KeyCode::Char('L'), KeyModifiers::SHIFT), Some(Cmd::Menu(MenuCmd::Load)));
        assert_eq!(find(KeyCode::Char('l'), KeyModifiers::NONE), Some(Cmd::Menu(MenuCmd::Load)));
        assert_eq!(find(KeyCode::Char('d'), KeyModifiers::CONTROL), None);
        assert_eq!(find(KeyCode::Char('d'), KeyModifiers::ALT), None);
        assert_eq!(find(KeyCode::Char('c'), KeyModifiers::CONTROL), Some(Cmd::Quit));
        assert_eq!(find(KeyCode::Char('c'), KeyModifiers::NONE), Some(Cmd::Reconnect));
    }

    #[test]
    fn a_cursor_stays_in_its_list() {
        let moved = |cmd: Cmd| cmd.moved(3, 5, 4);
        let moves = [Cmd::Up, Cmd::Down, Cmd::PageUp, Cmd::PageDown, Cmd::First, Cmd::Last];
        assert_eq!(moves.map(moved), [2, 4, 0, 5, 0, 5].map(Some));
        assert_eq!((moved(Cmd::Left), Cmd::Up.moved(9, 5, 4)), (None, Some(5)), "where the list has become shorter");
    }

    #[test]
    fn the_terminals_byte_for_the_prefix_is_known_by_both_names() {
        for code in [']', '5'] {
            assert!(Press::Ctrl(']').is(key(KeyCode::Char(code), KeyModifiers::CONTROL)));
        }
    }

    #[test]
    fn no_key_means_two_things_on_any_screen() {
        for screen in ScreenId::ALL {
            let tables = [screen.bindings(), MENU, EVERYWHERE];
            let presses: Vec<Press> =
                tables.iter().flat_map(|table| table.iter()).flat_map(|binding| binding.keys.iter().copied()).collect();
            for (position, press) in presses.iter().enumerate() {
                assert!(!presses[..position].contains(press), "{screen:?}: {}", press.name());
            }
        }
    }

    #[test]
    fn every_explanation_fits_on_the_help_page_at_80_columns() {
        let all = ScreenId::ALL.iter().flat_map(|screen| screen.bindings()).chain(MENU).chain(EVERYWHERE);
        let long: Vec<&str> = all.map(|binding| binding.long).filter(|long| long.chars().count() > 61).collect();
        assert_eq!(long, [""; 0]);
    }
}
