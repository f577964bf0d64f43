//! What a dialect can be made of: phrases and layouts, and the draw among them.

use crate::rng::Rng;

/// Keys and subjects of the menu, as the manuals head their sections (4.1.1 to 4.1.5).
pub const MENU: [(&str, &str); 5] = [
    ("V", "View Object Dictionary"),
    ("D", "Default Object Dictionary"),
    ("T", "Toggle RS-232 Stream On/Off"),
    ("S", "Show/Stop Diagnostics"),
    ("L", "Load New Software"),
];

/// All choices of a dialect.
#[derive(Clone, Debug)]
pub struct Phrases {
    pub line_end: &'static str,
    pub echo: bool,
    pub letters: Letters,
    pub banner: BannerStyle,
    pub menu: MenuStyle,
    pub menu_title: &'static str,
    pub title_names_product: bool,
    pub network: NetworkStyle,
    pub network_first: bool,
    pub pre_operational: &'static str,
    pub source: SourceQuestion,
    pub ask_period: &'static str,
    pub ask_defaults: &'static str,
    pub ask_password: &'static str,
    pub cancelled: &'static str,
    pub stream_off: &'static str,
    pub defaults_restored: &'static str,
    pub wrong_password: &'static str,
    pub right_password: &'static str,
    pub view_refused: &'static str,
    pub view_title: &'static str,
    pub view_next: &'static str,
    pub view_end: &'static str,
    pub diagnostics_on: &'static str,
    pub diagnostics_off: &'static str,
    pub index: IndexStyle,
    pub entry: EntryStyle,
    pub numbers: NumberStyle,
    pub units: bool,
    pub meanings: bool,
    pub diagnostics: DiagnosticsStyle,
}

/// Which letters sentences are written in.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Letters {
    /// As they are.
    Mixed,
    /// Capitals only.
    Capitals,
}

/// Layouts of the banner.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum BannerStyle {
    /// Maker, product and title, version and build.
    Plain,
    /// All in one line.
    OneLine,
    /// Between rules of stars.
    Boxed,
    /// The version before the product.
    VersionFirst,
    /// Names before colons.
    Table,
}

/// Layouts of a menu entry.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum MenuStyle {
    /// `V - View`
    Dash,
    /// `[V] View`
    Brackets,
    /// `(V)iew`
    InWord,
    /// `V = View`
    Equals,
    /// `V: View`
    Colon,
    /// `V) View`
    Parenthesis,
}

/// Layouts of the network values.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum NetworkStyle {
    /// One line with commas.
    OneLine,
    /// A line each.
    Lines,
    /// `id=7Fh  125000 bit/s`
    Hexadecimal,
    /// A sentence.
    Sentence,
}

/// The question for the stream's source, and what answers it.
#[derive(Clone, Copy, Debug)]
pub struct SourceQuestion {
    pub question: &'static str,
    pub field_value: u8,
    pub process_value: u8,
    pub wants_enter: bool,
}

/// How the view writes an index.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum IndexStyle {
    /// `6126h`
    Suffix,
    /// `0x6126`
    Prefix,
    /// `$6126`
    Dollar,
}

/// How the view writes an entry.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum EntryStyle {
    /// Below a line with the object's index and name: `01h TC1 = 16.000`.
    Heading,
    /// The same, without names: `sub 1: 16.000`.
    SubHeading,
    /// `[6126:01] Thermocouple Scaling Factor TC1 = 16.000`
    Bracketed,
    /// `6126sub1  16.000  Thermocouple Scaling Factor TC1`
    Glued,
    /// `6126h:01  Thermocouple Scaling Factor TC1: 16.000`
    Colon,
    /// `6126h.1 Thermocouple Scaling Factor TC1 ..... 16.000`
    Dots,
}

/// How numbers are written.
#[derive(Clone, Copy, Debug)]
pub struct NumberStyle {
    /// Decimal places.
    pub decimals: usize,
    pub not_a_number: &'static str,
    /// Unsigned numbers without a unit in hexadecimal digits.
    pub hexadecimal: bool,
    /// `7Fh` instead of `0x7F`.
    pub suffix: bool,
}

/// Layouts of a page of diagnostics.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum DiagnosticsStyle {
    /// A line for each quantity.
    Plain,
    /// The same, painted over the last page.
    Repainted,
    /// Few lines.
    Compact,
}

impl Letters {
    /// A text in these letters.
    pub fn of(self, text: &str) -> String {
        match self {
            Letters::Mixed => text.to_owned(),
            Letters::Capitals => text.to_uppercase(),
        }
    }
}

impl EntryStyle {
    /// Whether a line with the object's index and name comes before its entries.
    pub fn has_heading(self) -> bool {
        matches!(self, EntryStyle::Heading | EntryStyle::SubHeading)
    }
}

impl Phrases {
    /// The first of everything.
    pub fn plain() -> Self {
        Phrases::choose(&mut First)
    }

    /// A choice for each thing.
    pub fn drawn(chance: &mut Rng) -> Self {
        Phrases::choose(chance)
    }

    fn choose(chooser: &mut impl Chooser) -> Self {
        Phrases {
            line_end: chooser.one(&["\r\n", "\r\n", "\r\n", "\r", "\n"]),
            echo: chooser.one(&[true, true, true, false]),
            letters: chooser.one(&[Letters::Mixed, Letters::Mixed, Letters::Mixed, Letters::Capitals]),
            banner: chooser.one(&[
                BannerStyle::Plain,
                BannerStyle::OneLine,
                BannerStyle::Boxed,
                BannerStyle::VersionFirst,
                BannerStyle::Table,
            ]),
            menu: chooser.one(&[
                MenuStyle::Dash,
                MenuStyle::Brackets,
                MenuStyle::InWord,
                MenuStyle::Equals,
                MenuStyle::Colon,
                MenuStyle::Parenthesis,
            ]),
            menu_title: chooser.one(&["Main Menu", "MAIN MENU", "*** Menu ***", "Commands:", "-- Options --"]),
            title_names_product: chooser.one(&[true, false]),
            network: chooser.one(&[
                NetworkStyle::OneLine,
                NetworkStyle::Lines,
                NetworkStyle::Hexadecimal,
                NetworkStyle::Sentence,
            ]),
            network_first: chooser.one(&[false, true]),
            pre_operational: chooser.one(&["Pre-Operational", "PRE-OPERATIONAL", "pre operational", "PreOperational"]),
            source: chooser.one(&[
                SourceQuestion {
                    question: "Send (F)ield Value or (P)rocess Value? ",
                    field_value: b'f',
                    process_value: b'p',
                    wants_enter: false,
                },
                SourceQuestion {
                    question: "1=FV 6100h, 2=PV 7130h: ",
                    field_value: b'1',
                    process_value: b'2',
                    wants_enter: false,
                },
                SourceQuestion {
                    question: "Stream source [F/P]: ",
                    field_value: b'f',
                    process_value: b'p',
                    wants_enter: true,
                },
                SourceQuestion {
                    question: "Select: (1) Field Value, (2) Process Value > ",
                    field_value: b'1',
                    process_value: b'2',
                    wants_enter: true,
                },
                SourceQuestion {
                    question: "F - field value, P - process value ? ",
                    field_value: b'f',
                    process_value: b'p',
                    wants_enter: false,
                },
            ]),
            ask_period: chooser.one(&[
                "Repetition rate in ms ({low}-{high}) [{default}]: ",
                "Enter the interval in milliseconds: ",
                "Rate (ms)? ",
                "Transmission period [ms, {low}..{high}] > ",
            ]),
            ask_defaults: chooser.one(&[
                "Restore the default object dictionary? Enter Yes to confirm: ",
                "Type 'Yes' to load defaults: ",
                "All parameters will be set to default! Yes? ",
                "Default object dictionary - are you sure (Yes/No)? ",
            ]),
            ask_password: chooser.one(&["Password: ", "Enter password > ", "Please enter the password:", "PASSWORD? "]),
            cancelled: chooser.one(&["Cancelled.", "Aborted", "No change.", "*** cancelled ***"]),
            stream_off: chooser.one(&["RS-232 stream is now OFF.", "Stream off", "Streaming stopped."]),
            defaults_restored: chooser.one(&[
                "Defaults restored. Resetting...",
                "Done, restarting",
                "Default parameters loaded - reset",
            ]),
            wrong_password: chooser.one(&[
                "Wrong password.",
                "Invalid password!",
                "Password incorrect",
                "Access denied",
            ]),
            right_password: chooser.one(&[
                "Resetting to load new software...",
                "OK, entering boot mode",
                "Accepted. Starting the loader",
            ]),
            view_refused: chooser.one(&[
                "The object dictionary can be viewed in Pre-Operational state only.",
                "Not allowed: node is not pre-operational",
                "View is only available in PRE-OPERATIONAL",
            ]),
            view_title: chooser.one(&[
                "Object Dictionary (scanning and CAN are halted)",
                "*** OBJECT DICTIONARY - operation halted ***",
                "Active object dictionary values:",
            ]),
            view_next: chooser.one(&[
                "<Enter> next object, <X> exit",
                "-- Enter for more, X to quit --",
                "Press Enter to continue or X to leave",
            ]),
            view_end: chooser.one(&[
                "End of view. Scanning and CAN resumed.",
                "Done.",
                "--- end of object dictionary ---",
            ]),
            diagnostics_on: chooser.one(&["Diagnostics ON.", "Diagnostics started", "Diagnostics: on"]),
            diagnostics_off: chooser.one(&["Diagnostics OFF.", "Diagnostics stopped", "Diagnostics: off"]),
            index: chooser.one(&[IndexStyle::Suffix, IndexStyle::Prefix, IndexStyle::Dollar]),
            entry: chooser.one(&[
                EntryStyle::Heading,
                EntryStyle::SubHeading,
                EntryStyle::Bracketed,
                EntryStyle::Glued,
                EntryStyle::Colon,
                EntryStyle::Dots,
            ]),
            numbers: NumberStyle {
                decimals: chooser.one(&[3, 2, 4, 6]),
                not_a_number: chooser.one(&["0xFFFFFFFF", "nan", "NaN", "----"]),
                hexadecimal: chooser.one(&[false, false, true]),
                suffix: chooser.one(&[false, true]),
            },
            units: chooser.one(&[false, true]),
            meanings: chooser.one(&[false, true]),
            diagnostics: chooser.one(&[
                DiagnosticsStyle::Plain,
                DiagnosticsStyle::Repainted,
                DiagnosticsStyle::Compact,
            ]),
        }
    }
}

/// Picks one of several.
trait Chooser {
    fn one<T: Copy>(&mut self, of: &[T]) -> T;
}

/// The plain dialect: the first of everything.
struct First;

impl Chooser for First {
    fn one<T: Copy>(&mut self, of: &[T]) -> T {
        of[0]
    }
}

impl Chooser for Rng {
    fn one<T: Copy>(&mut self, of: &[T]) -> T {
        of[self.below(of.len() as u64) as usize]
    }
}
