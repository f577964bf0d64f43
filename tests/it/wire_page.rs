//! `docs/wire.md` is true: its exchanges are those that console and emulated unit have, its words stand where it says
//! they come from, and nothing that the service port has is missing.

use std::collections::VecDeque;
use std::fs;
use std::path::Path;

use axcon::canopen::Value;
use axcon::device::{LoaderKind, Product};
use axcon::emulator::knob::Knob;
use axcon::record::{Direction, Entry};
use axcon::session::{Command, Event};
use axcon::time::{Duration, Instant};
use axcon::wire::stream::{FieldFormat, Source};
use axcon::wire::{Message, Prompt};

use crate::support::bench::{Bench, axrtd8co, axtc4co, flash_with, image_of, order};
use crate::tidy::{UPDATE, files, read, sources_and_tests, variants, with_blocks};
use crate::transcripts::{escaped, unescaped};

/// The page, from the repository's root.
const PAGE: &str = "docs/wire.md";

fn page() -> String {
    read(&root().join(PAGE))
}

fn root() -> &'static Path {
    Path::new(env!("CARGO_MANIFEST_DIR"))
}

// The exchanges.

/// Has an exchange and prints it.
type Exchange = fn() -> Vec<String>;

/// What the page prints below `<!-- exchange: NAME -->`, and how it comes about.
const EXCHANGES: &[(&str, Exchange)] = &[
    ("power-up", power_up),
    ("view", || without_menu(view())),
    ("defaults", defaults),
    ("stream", stream),
    ("stream-rtd", stream_rtd),
    ("diagnostics", diagnostics),
    ("wrong-password", wrong_password),
    ("load-g1", || without_menu(loading(axtc4co(), LoaderKind::G1))),
    ("load-g2", || without_menu(from("> S7", loading(axtc4co(), LoaderKind::G2)))),
    ("load-g3", || without_menu(loading(axrtd8co(), LoaderKind::G3))),
    ("error-g1", || error(axtc4co(), LoaderKind::G1)),
    ("error-g3", || error(axrtd8co(), LoaderKind::G3)),
];

#[test]
fn the_exchanges_are_those_that_console_and_unit_have() {
    let text = page();
    let mut shown = Vec::new();
    let current = with_blocks(&text, "exchange", |name| {
        shown.push(name.to_owned());
        let (_, talk) = EXCHANGES.iter().find(|(known, _)| *known == name).unwrap_or_else(|| panic!("{name}?"));
        talk().join("\n")
    });
    let names: Vec<&str> = EXCHANGES.iter().map(|(name, _)| *name).collect();
    assert_eq!(shown, names, "every exchange once, in this order");
    if current != text && std::env::var_os(UPDATE).is_some() {
        fs::write(root().join(PAGE), &current).expect("the page can be written");
        return;
    }
    let differs = text.lines().zip(current.lines()).find(|(old, new)| old != new);
    assert!(current == text, "{PAGE} shows other exchanges; {UPDATE}=1 prints them anew; first: {differs:?}");
}

fn power_up() -> Vec<String> {
    let mut talk = Talk::with(axtc4co(), LoaderKind::G1);
    talk.hear(500);
    talk.lines()
}

fn view() -> Vec<String> {
    let mut talk = Talk::measuring(axtc4co());
    for key in [b"v", b"\r", b"\r", b"x"] {
        talk.bench.command(Command::Keys(key.to_vec()));
        // The first block has more characters than the line carries in half a second.
        talk.hear(1_000);
    }
    talk.lines()
}

fn defaults() -> Vec<String> {
    let mut talk = Talk::measuring(axtc4co());
    talk.ask(Command::RestoreDefaults);
    talk.lines()
}

fn stream() -> Vec<String> {
    let mut talk = Talk::measuring(axtc4co());
    let now = talk.bench.now;
    let unit = talk.bench.unit.unit_mut();
    unit.turn(now, Knob::Open(3, None)).expect("an input");
    let at = "6112:4".parse().expect("an entry");
    unit.write_object(now, at, &Value::Unsigned8(0).encode()).expect("a channel can be switched off");
    talk.hear(2_000);
    talk.ask(Command::StreamOn { source: Source::FieldValue, period: Duration::from_millis(500) });
    talk.hear(100);
    talk.ask(Command::StreamOff);
    talk.lines()
}

fn stream_rtd() -> Vec<String> {
    let mut talk = Talk::measuring(axrtd8co());
    let now = talk.bench.now;
    let unit = talk.bench.unit.unit_mut();
    unit.turn(now, Knob::Open(3, None)).expect("an input");
    unit.turn(now, Knob::Short(4)).expect("an input");
    let at = "6112:5".parse().expect("an entry");
    unit.write_object(now, at, &Value::Unsigned8(0).encode()).expect("a channel can be switched off");
    talk.hear(2_000);
    talk.ask(Command::StreamOn { source: Source::FieldValue, period: Duration::from_millis(1_000) });
    talk.ask(Command::StreamOn { source: Source::ProcessValue, period: Duration::from_millis(1_000) });
    talk.lines().into_iter().filter(|line| is_row(line)).collect()
}

fn is_row(line: &str) -> bool {
    line.starts_with("= Row") || line.matches(';').count() == 7
}

fn diagnostics() -> Vec<String> {
    let mut talk = Talk::measuring(axtc4co());
    talk.ask(Command::Diagnostics { pages: Some(1) });
    talk.lines()
}

fn wrong_password() -> Vec<String> {
    let mut talk = Talk::measuring(axtc4co());
    talk.keys(b"l");
    talk.keys(b"axio-2010\r");
    talk.lines()
}

fn loading(product: &'static Product, loader: LoaderKind) -> Vec<String> {
    let mut talk = Talk::with(product, loader);
    talk.hear(6_000);
    // As many words as begin a second page of flash.
    talk.ask(Command::Load(Box::new(order(image_of(&product.name, "1.2.0", 320)))));
    from("> l", talk.lines())
}

fn error(product: &'static Product, loader: LoaderKind) -> Vec<String> {
    let mut talk = Talk::with(product, loader);
    talk.hear(6_000);
    talk.keys(b"l");
    talk.keys(b"AXIO-2010\r");
    talk.keys(b"\r");
    talk.forget();
    let damaged = Command::Keys(b"S00B0000000041584920312EFF\r".to_vec());
    talk.bench.command(damaged);
    talk.hear(500);
    talk.lines()
}

/// The lines from the first one on that begins like this.
fn from(beginning: &str, lines: Vec<String>) -> Vec<String> {
    let lines: Vec<String> = lines.into_iter().skip_while(|line| !line.starts_with(beginning)).collect();
    assert!(!lines.is_empty(), "no line begins with {beginning}");
    lines
}

/// Console and unit on one cable, and what each line meant.
struct Talk {
    bench: Bench,
    /// The first entry of the record that counts.
    begin: u64,
    /// Where in what the unit has sent a meaning ends, and what it is.
    meanings: VecDeque<(u64, String)>,
}

impl Talk {
    /// A unit just powered on, V1.1.0 in its flash, worded plainly.
    fn with(product: &'static Product, loader: LoaderKind) -> Self {
        let flash = flash_with(&image_of(&product.name, "1.1.0", 320));
        let bench = Bench::of(product, loader, flash, Duration::ZERO);
        Talk { bench, begin: 0, meanings: VecDeque::new() }
    }

    /// The same, with its menu printed and its first values there.
    fn measuring(product: &'static Product) -> Self {
        let mut talk = Talk::with(product, product.loader.kind);
        talk.hear(6_000);
        talk.forget();
        talk
    }

    fn keys(&mut self, keys: &[u8]) {
        self.bench.command(Command::Keys(keys.to_vec()));
        self.hear(300);
    }

    fn ask(&mut self, command: Command) {
        self.bench.command(command);
        let limit = self.bench.now + Duration::from_secs(120);
        let ended = self.listen(limit, |event| matches!(event, Event::Finished(_)));
        assert!(ended, "no outcome; heard:\n{}", self.bench.transcript());
    }

    fn hear(&mut self, millis: u64) {
        let end = self.bench.now + Duration::from_millis(millis);
        self.listen(end, |_| false);
    }

    fn listen(&mut self, end: Instant, stop: impl Fn(&Event) -> bool) -> bool {
        let meanings = &mut self.meanings;
        let stopped = self.bench.run_until(end, |event| {
            match event {
                Event::Heard { span, message, .. } => meanings.extend(meaning(message).map(|said| (span.end, said))),
                Event::Row { span, row, .. } => meanings.push_back((span.end, format!("Row({:?})", row.source))),
                _ => {}
            }
            stop(event)
        });
        stopped.is_some()
    }

    /// What was said so far is not part of the exchange.
    fn forget(&mut self) {
        self.begin = self.bench.session.record().entry_count();
        self.meanings.clear();
    }

    /// The exchange in the notation of `tests/transcripts`: `>` we send, `<` the unit says, `=` what that means.
    fn lines(&self) -> Vec<String> {
        let mut printer = Printer { meanings: self.meanings.clone(), ..Printer::default() };
        self.bench.session.record().entries_from(self.begin).for_each(|entry| printer.entry(entry));
        printer.flush();
        folded(printer.lines)
    }
}

/// What a message is called on the page; a text that means nothing is not called anything.
fn meaning(message: &Message) -> Option<String> {
    match message {
        Message::Text => None,
        Message::Software(_) => Some("Software".into()),
        Message::Network(_) => Some("Network".into()),
        Message::Prompt(Prompt::Source(_)) => Some("Prompt(Source)".into()),
        other => Some(format!("{other:?}")),
    }
}

/// Makes lines of the entries of a record.
#[derive(Default)]
struct Printer {
    lines: Vec<String>,
    meanings: VecDeque<(u64, String)>,
    from_unit: bool,
    begun: Vec<u8>,
    /// How much the unit has said.
    offset: u64,
}

impl Printer {
    fn entry(&mut self, entry: &Entry) {
        let from_unit = entry.direction == Direction::FromUnit;
        if from_unit != self.from_unit {
            self.flush();
            self.from_unit = from_unit;
        }
        if from_unit {
            self.offset = entry.start;
        }
        for &byte in &entry.bytes {
            let after_return = self.begun.ends_with(b"\r") && !self.begun.iter().all(u8::is_ascii_whitespace);
            if after_return && byte != b'\n' {
                self.flush();
            }
            self.begun.push(byte);
            self.offset += u64::from(from_unit);
            // Empty lines stand before the line they part from the last one.
            if byte == b'\n' && !self.begun.iter().all(u8::is_ascii_whitespace) {
                self.flush();
            }
        }
    }

    fn flush(&mut self) {
        if !self.begun.is_empty() {
            let way = if self.from_unit { '<' } else { '>' };
            self.lines.push(format!("{way} {}", escaped(&std::mem::take(&mut self.begun))));
        }
        while self.meanings.front().is_some_and(|&(end, _)| end <= self.offset) {
            self.lines.extend(self.meanings.pop_front().map(|(_, meaning)| format!("= {meaning}")));
        }
    }
}

/// Without what only repeats: most data records, and the middle of what the unit says at length.
fn folded(lines: Vec<String>) -> Vec<String> {
    let mut kept = Vec::new();
    for run in without_records(lines).chunk_by(|a, b| a.starts_with('<') && b.starts_with('<')) {
        match run.len() {
            0..=12 => kept.extend_from_slice(run),
            length => {
                kept.extend_from_slice(&run[..8]);
                kept.push(format!("... {} lines", length - 9));
                kept.extend_from_slice(&run[length - 1..]);
            }
        }
    }
    kept
}

/// Without the data records behind the second, and what the unit says to them; but with one that alone is answered.
fn without_records(lines: Vec<String>) -> Vec<String> {
    let is_data = |line: &String| line.starts_with("> S3");
    let second = lines.iter().enumerate().filter(|(_, line)| is_data(line)).nth(1).map(|(at, _)| at);
    let end = lines.iter().position(|line| line.starts_with("> S7"));
    let (Some(second), Some(end)) = (second, end) else { return lines };
    let answers: Vec<usize> = (second + 1..end).filter(|&at| lines[at].starts_with('<')).collect();
    let lone = answers.first().filter(|&&first| answers.iter().all(|&at| at - first == 0 || !is_data(&lines[at - 1])));
    let lone = lone.map_or(end..end, |&first| first - 1..(first..end).find(|&at| is_data(&lines[at])).unwrap_or(end));
    let mut kept = lines[..=second].to_vec();
    let leave_out = |range: std::ops::Range<usize>| {
        let records = lines[range.clone()].iter().filter(|line| is_data(line)).count();
        let answers = if lines[range].iter().all(is_data) { "" } else { ", and what is said to them" };
        (records > 0).then(|| format!("... {records} data records{answers}"))
    };
    kept.extend(leave_out(second + 1..lone.start));
    kept.extend_from_slice(&lines[lone.clone()]);
    kept.extend(leave_out(lone.end..end));
    kept.extend_from_slice(&lines[end..]);
    kept
}

/// Without the menu at the end, which another exchange shows.
fn without_menu(lines: Vec<String>) -> Vec<String> {
    let menu = lines.iter().position(|line| line.contains("Main Menu")).expect("a menu");
    [&lines[..menu], &["... the menu".to_owned()]].concat()
}

// The tables.

/// How sure a row can be.
const CERTAINTIES: [&str; 4] = ["certain", "likely", "ours", "unknown"];

/// A row of a table that says how sure it is.
struct Row<'a> {
    line: usize,
    way: &'a str,
    what: &'a str,
    section: &'a str,
    certainty: &'a str,
    read_by: &'a str,
    held_by: &'a str,
}

/// Columns of such a table.
const HEADING: &str = "| | what | section | certainty | read by | held by |";

fn rows(text: &str) -> Vec<Row<'_>> {
    let mut rows = Vec::new();
    let mut within = false;
    for (number, line) in text.lines().enumerate() {
        within = line == HEADING || (within && line.starts_with('|'));
        if !within || line == HEADING || line.starts_with("|-") {
            continue;
        }
        let cells: Vec<&str> = line.trim_matches('|').split('|').map(str::trim).collect();
        let [way, what, section, certainty, read_by, held_by] = cells[..] else {
            panic!("{PAGE}:{}: six cells are wanted, not {}", number + 1, cells.len());
        };
        rows.push(Row { line: number + 1, way, what, section, certainty, read_by, held_by });
    }
    rows
}

/// Texts between backticks.
fn quoted(text: &str) -> impl Iterator<Item = &str> {
    text.split('`').skip(1).step_by(2)
}

/// Where words may come from.
struct Evidence {
    /// What the manuals quote, as the product files and the transcripts hold it.
    manuals: Vec<u8>,
    /// What public sources quote, and the loaders that were made after them.
    public: Vec<u8>,
    /// The emulated units, and what a product's file guesses.
    ours: Vec<u8>,
    /// The console's jobs.
    session: String,
    tests: Vec<(String, String)>,
}

impl Evidence {
    fn collect() -> Self {
        let said = |name: &str| {
            let text = read(&root().join("tests/transcripts").join(name));
            text.lines().filter_map(|line| line.strip_prefix("< ")).flat_map(unescaped).collect::<Vec<u8>>()
        };
        let mut manuals = [said("axtc4co.txt"), said("axrtd8co.txt")].concat();
        let mut guessed = Vec::new();
        for product in Product::all() {
            manuals.extend(texts_of(product).join("\0").bytes());
            guessed.extend(guesses_of(product).join("\0").bytes());
        }
        let tests = sources_and_tests();
        let below = |folder: &str| {
            let inside = tests.iter().filter(|(path, _)| path.starts_with(folder));
            inside.map(|(_, text)| text.as_str()).collect::<String>()
        };
        let public = [said("loaders.txt"), below("src/emulator/bootloader/").into_bytes()].concat();
        let ours = [guessed, below("src/emulator/").into_bytes()].concat();
        let session = below("src/session/");
        Evidence { manuals, public, ours, session, tests }
    }

    fn complaints(&self, row: &Row<'_>) -> Vec<String> {
        let mut complaints = Vec::new();
        if ![">", "<"].contains(&row.way) {
            complaints.push(format!("'{}' is neither > nor <", row.way));
        }
        if !CERTAINTIES.contains(&row.certainty) {
            complaints.push(format!("'{}' is none of {CERTAINTIES:?}", row.certainty));
        }
        if row.certainty == "certain" && !row.section.starts_with(|c: char| c.is_ascii_digit() || c == 'A') {
            complaints.push("what is certain stands in a section of a manual".into());
        }
        for words in quoted(row.what) {
            let bytes = unescaped(words);
            let known = match (row.way, row.certainty) {
                (">", "certain") => self.is_sent(words),
                (_, "certain") => contains(&self.manuals, &bytes),
                (_, "likely") => contains(&self.public, &bytes) || contains(&self.manuals, &bytes),
                (_, "ours") => contains(&self.ours, words.as_bytes()),
                _ => true,
            };
            if !known {
                complaints.push(format!("'{words}' is not where what is {} comes from", row.certainty));
            }
        }
        for word in quoted(row.read_by).filter(|word| word.ends_with(".rs")) {
            if !root().join("src/wire").join(word).exists() {
                complaints.push(format!("there is no src/wire/{word}"));
            }
        }
        let held = quoted(row.held_by).map(|test| self.missing(test)).collect::<Vec<_>>();
        if held.is_empty() && row.certainty != "unknown" && !row.held_by.starts_with("none: ") {
            complaints.push("nothing holds it, and nothing says why".into());
        }
        complaints.extend(held.into_iter().flatten());
        complaints.into_iter().map(|complaint| format!("{PAGE}:{}: {complaint}", row.line)).collect()
    }

    /// Whether the console sends this, or a product's file says that it is to be sent.
    fn is_sent(&self, words: &str) -> bool {
        let literal = format!("b\"{words}");
        let answers = Product::all().iter().map(|product| product.console.defaults_answer.as_str());
        self.session.contains(&literal) || answers.into_iter().any(|answer| answer == words)
    }

    /// What is wrong with something that is to hold a row.
    fn missing(&self, holder: &str) -> Option<String> {
        let there = match holder.split_once("::") {
            None => root().join("tests/transcripts").join(holder).exists(),
            Some((path, name)) => {
                let file = self.tests.iter().find(|(file, _)| file == path);
                file.is_some_and(|(_, text)| {
                    text.contains(&format!("#[test]\nfn {name}(")) || has_inner_test(text, name)
                })
            }
        };
        (!there).then(|| format!("there is no {holder}"))
    }
}

/// Whether a module of tests beside the code has this one.
fn has_inner_test(text: &str, name: &str) -> bool {
    text.contains(&format!("#[test]\n    fn {name}(")) || text.contains(&format!("#[test]\n        fn {name}("))
}

fn contains(all: &[u8], part: &[u8]) -> bool {
    !part.is_empty() && all.windows(part.len()).any(|window| window == part)
}

/// Everything fixed that a product's file has from its manual.
fn texts_of(product: &Product) -> Vec<String> {
    let console = &product.console;
    let mut texts = vec![product.name.clone(), console.defaults_answer.clone(), console.loader_prompt.clone()];
    texts.extend([console.loaded.clone(), console.first_start.clone()].into_iter().flatten());
    texts.extend([product.stream.channels.join(";"), product.loader.progress.to_string()]);
    for source in [Source::FieldValue, Source::ProcessValue] {
        texts.extend(padded_words(product.stream.format(source)).into_iter().take(3).flatten());
    }
    texts
}

/// The word for a value that is missing for another reason stands in no manual (errata E-I4).
fn guesses_of(product: &Product) -> Vec<String> {
    let formats = [&product.stream.field_value, &product.stream.process_value];
    formats.into_iter().filter_map(|format| padded_words(format)[3].clone()).collect()
}

/// The words for a missing value, filled up to the field: disabled, open, short, other.
fn padded_words(format: &FieldFormat) -> [Option<String>; 4] {
    let width = format.widths[0];
    let words = [Some(&format.disabled), Some(&format.open), format.short.as_ref(), format.error.as_ref()];
    words.map(|word| word.map(|word| format!("{word:<width$}")))
}

#[test]
fn every_row_says_how_sure_it_is_and_its_words_stand_where_that_comes_from() {
    let text = page();
    let rows = rows(&text);
    assert!(rows.len() > 40, "rows are looked for: {}", rows.len());
    let evidence = Evidence::collect();
    let complaints: Vec<String> = rows.iter().flat_map(|row| evidence.complaints(row)).collect();
    assert!(complaints.is_empty(), "{} complaints:\n{}", complaints.len(), complaints.join("\n"));
}

#[test]
fn nothing_that_the_service_port_has_is_missing_from_the_page() {
    let text = page();
    let mut missing = Vec::new();
    for (path, _) in files("src/wire", "rs").into_iter().chain(files("tests/transcripts", "txt")) {
        let name = path.file_name().expect("a name").to_string_lossy().into_owned();
        if !text.contains(&format!("`{name}`")) {
            missing.push(name);
        }
    }
    let read_by: Vec<&str> = rows(&text).iter().flat_map(|row| quoted(row.read_by)).collect();
    for (file, name, others) in [
        // These two hold what the others are.
        ("mod.rs", "Message", &["Loader", "Prompt"][..]),
        ("boot.rs", "LoaderText", &[]),
        ("prompt.rs", "Prompt", &[]),
    ] {
        for variant in variants(&read(&root().join("src/wire").join(file)), name) {
            if !read_by.contains(&variant.as_str()) && !others.contains(&variant.as_str()) {
                missing.push(format!("{name}::{variant}"));
            }
        }
    }
    for product in Product::all() {
        let texts = texts_of(product).into_iter().chain(guesses_of(product));
        missing.extend(texts.filter(|words| !text.contains(&format!("`{words}`"))));
        let (low, high) = product.measurement.stream_period_ms;
        let periods = format!("{low} to {high} ms on an {}", product.name);
        missing.extend((!text.contains(&periods)).then_some(periods));
        missing.extend(row_formats(product).into_iter().filter(|row| !text.lines().any(|line| line == row)));
    }
    assert!(missing.is_empty(), "{PAGE} does not have:\n{}", missing.join("\n"));
}

/// How a product's rows look, as the page's table prints it.
fn row_formats(product: &Product) -> Vec<String> {
    let kinds = [(Source::FieldValue, "field value"), (Source::ProcessValue, "process value")];
    let rows = kinds.map(|(source, name)| {
        let format = product.stream.format(source);
        let widths: Vec<String> = format.widths.iter().map(ToString::to_string).collect();
        let words = padded_words(format).map(|word| word.map_or("-".to_owned(), |word| format!("`{word}`")));
        let (fields, decimals) = (product.stream.channels.len(), format.decimals);
        let widths = widths.join(" or ");
        format!("| {} | {name} | {fields} | {widths} | {decimals} | {} |", product.name, words.join(" | "))
    });
    rows.to_vec()
}
