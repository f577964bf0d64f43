//! Scenarios: what happens to a unit, and when, as a file says it.
//!
//! A file is TOML, with deeds at moments and ramps between moments; `docs/emulator.md` describes it. A [`Scenario`] is
//! what was read; the [`Stage`] plays it.

mod stage;
mod verb;

pub use super::words::WordError;
pub use stage::Stage;
pub use verb::{HELP, Verb};

use serde::Deserialize;
use toml::Spanned;

use super::knob::{Knob, KnobError};
use super::sensors::Sensors;
use super::words::{self, shown};
use crate::device::{Complaint, Complaints, Product};
use crate::time::Duration;

/// What happens to a unit.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Scenario {
    /// Deeds with their moments, in order.
    deeds: Vec<(Duration, Verb)>,
    /// After this time it starts over.
    repeat: Option<Duration>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct RawScenario {
    product: Option<Spanned<String>>,
    repeat: Option<Spanned<f64>>,
    #[serde(default)]
    at: Vec<RawMoment>,
    #[serde(default)]
    ramp: Vec<RawRamp>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct RawMoment {
    seconds: Spanned<f64>,
    #[serde(rename = "do")]
    deeds: Vec<Spanned<String>>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct RawRamp {
    from: Spanned<f64>,
    to: Spanned<f64>,
    what: Spanned<String>,
    start: Spanned<f64>,
    end: Spanned<f64>,
}

/// Largest file that is read; a scenario of a day with a deed every second has half of it.
pub const LARGEST_FILE: u64 = 4 << 20;
/// The longest scenario.
const LONGEST_S: f64 = 7.0 * 86_400.0;
/// Time between two steps of a ramp: the fastest scan of any unit.
const RAMP_STEP: Duration = Duration::from_millis(100);
/// The shortest round of a scenario that repeats: in less, no scan would notice anything and the unit would never get done.
const SHORTEST_ROUND: Duration = RAMP_STEP;
/// The most deeds of one scenario, the steps of its ramps included.
const MOST_DEEDS: usize = 1_000_000;

impl Scenario {
    /// Reads a file for a unit of a product. `None` if the file is for another product.
    ///
    /// # Errors
    /// If it is not a scenario, with everything that is wrong with it.
    pub fn read(file: &str, text: &str, product: &Product) -> Result<Option<Scenario>, Vec<Complaint>> {
        let mut complaints = Complaints::about(file, text);
        let raw: RawScenario = match toml::from_str(text) {
            Ok(raw) => raw,
            Err(error) => {
                if let Some(key) = key_of(&error) {
                    complaints.add(error.span().map_or(0, |span| span.start), key, error.message());
                    return complaints.or(None);
                }
                return Err(complaints.ended_by(&error));
            }
        };
        if let Some(named) = &raw.product {
            match Product::named(named.get_ref()) {
                None => {
                    let known: Vec<String> = Product::all().iter().map(|known| known.name.to_lowercase()).collect();
                    let message =
                        format!("'{}' is not a product; there is {}", shown(named.get_ref()), known.join(", "));
                    complaints.add(named.span().start, "product", message);
                    return complaints.or(None);
                }
                Some(named) if named.name != product.name => return Ok(None),
                Some(_) => {}
            }
        }
        let others = Product::all().iter().filter(|other| raw.product.is_none() && other.name != product.name);
        let terminals = others.chain([product]).map(|product| Sensors::new(product, 0)).collect();
        let mut reading = Reading { text, product, terminals, complaints, deeds: Vec::new() };
        for moment in &raw.at {
            reading.moment(moment);
        }
        for ramp in &raw.ramp {
            reading.ramp(ramp);
        }
        reading.deeds.sort_by_key(|(at, _)| *at);
        let repeat = raw.repeat.as_ref().and_then(|repeat| reading.round(repeat));
        reading.complaints.or(Some(Scenario { deeds: reading.deeds, repeat }))
    }
}

/// A file while it is read.
struct Reading<'a> {
    text: &'a str,
    product: &'a Product,
    /// The terminals of the products that the file is for, this one's last. One of them has to take what is turned: a file
    /// for several products may turn what some of them do not have.
    terminals: Vec<Sensors>,
    complaints: Complaints<'a>,
    deeds: Vec<(Duration, Verb)>,
}

impl Reading<'_> {
    fn moment(&mut self, moment: &RawMoment) {
        let at = self.seconds(&moment.seconds, "at.seconds").unwrap_or_default();
        if !self.has_room_for(moment.deeds.len(), moment.seconds.span().start, "at") {
            return;
        }
        for deed in &moment.deeds {
            match self.act(deed.get_ref()) {
                Ok(verb) => self.deeds.push((at, verb)),
                Err(error) => self.complaints.add(place_of(self.text, deed, error.column), "at.do", error.message),
            }
        }
    }

    fn ramp(&mut self, ramp: &RawRamp) {
        let can_be_set = self.ends_can_be_set(ramp);
        let from = self.seconds(&ramp.from, "ramp.from");
        let to = self.seconds(&ramp.to, "ramp.to");
        let (Some(from), Some(to)) = (from, to) else { return };
        if to <= from {
            self.complaints.add(ramp.to.span().start, "ramp.to", "a ramp ends later than it begins");
            return;
        }
        let steps = ramp_steps(to - from);
        if !can_be_set || !self.has_room_for(steps as usize + 1, ramp.from.span().start, "ramp") {
            return;
        }
        let (start, end) = (*ramp.start.get_ref(), *ramp.end.get_ref());
        for step in 0..=steps {
            let part = f64::from(step) / f64::from(steps);
            let value = start + (end - start) * part;
            match self.act(&set(ramp, value)) {
                Ok(verb) => self.deeds.push((from + (to - from).mul_f64(part), verb)),
                Err(error) => {
                    self.complaints.add(ramp.what.span().start, "ramp.what", error.message);
                    return;
                }
            }
        }
    }

    /// Whether what a ramp sets can have the values at its ends, and so those in between; complains if not.
    fn ends_can_be_set(&mut self, ramp: &RawRamp) -> bool {
        let mut can_be_set = true;
        let mut refuse = |reading: &mut Self, at: usize, key: &str, message: String| {
            reading.complaints.add(at, key, message);
            can_be_set = false;
        };
        for (raw, key) in [(&ramp.start, "ramp.start"), (&ramp.end, "ramp.end")] {
            let (value, at) = (*raw.get_ref(), raw.span().start);
            // TOML has words for infinity and NaN.
            if !value.is_finite() {
                refuse(self, at, key, format!("{value} is not a number like 23.5"));
                continue;
            }
            let what = ramp.what.span().start;
            match Verb::read(&set(ramp, value), self.product) {
                Err(error) => {
                    refuse(self, what, "ramp.what", error.message);
                    break;
                }
                Ok(Verb::Turn(knob)) => match self.turn(knob) {
                    Ok(()) => {}
                    Err(error @ KnobError::Value { .. }) => refuse(self, at, key, error.to_string()),
                    Err(error) => {
                        refuse(self, what, "ramp.what", error.to_string());
                        break;
                    }
                },
                Ok(_) => {}
            }
        }
        can_be_set
    }

    /// Whether there is room for this many more deeds; complains if not.
    fn has_room_for(&mut self, deeds: usize, place: usize, key: &str) -> bool {
        let has_room = self.deeds.len() + deeds <= MOST_DEEDS;
        if !has_room {
            self.complaints.add(place, key, format!("more than {MOST_DEEDS} deeds in all, steps of ramps included"));
        }
        has_room
    }

    /// After what time the scenario starts over.
    fn round(&mut self, repeat: &Spanned<f64>) -> Option<Duration> {
        let after = self.seconds(repeat, "repeat")?;
        let last = self.deeds.last().map_or(Duration::ZERO, |(at, _)| *at);
        if after < last {
            let message = format!("{} s is before the last deed, at {} s", repeat.get_ref(), last.as_secs_f64());
            self.complaints.add(repeat.span().start, "repeat", message);
        } else if after < SHORTEST_ROUND {
            let message = format!("{} s is less than {} s", repeat.get_ref(), SHORTEST_ROUND.as_secs_f64());
            self.complaints.add(repeat.span().start, "repeat", message);
        }
        Some(after)
    }

    fn seconds(&mut self, raw: &Spanned<f64>, key: &str) -> Option<Duration> {
        let value = *raw.get_ref();
        if !(0.0..=LONGEST_S).contains(&value) {
            self.complaints.add(
                raw.span().start,
                key,
                format!("{} is not 0 to {LONGEST_S} seconds", words::number(value)),
            );
            return None;
        }
        Some(Duration::from_secs_f64(value))
    }

    /// A verb that does something, as nobody would hear an answer; where the terminals are known, something that can be
    /// done there.
    fn act(&mut self, line: &str) -> Result<Verb, WordError> {
        match Verb::read(line, self.product)? {
            Verb::Read(_) | Verb::Status => {
                Err(WordError { column: 1, message: "a scenario does things; nobody would hear the answer".into() })
            }
            Verb::Turn(knob) => {
                let turned = self.turn(knob);
                turned.map(|()| Verb::Turn(knob)).map_err(|error| WordError { column: 1, message: error.to_string() })
            }
            verb => Ok(verb),
        }
    }

    /// Turns a knob of every product that the file is for. If all refuse, the one that comes closest says why.
    fn turn(&mut self, knob: Knob) -> Result<(), KnobError> {
        let turned: Vec<_> = self.terminals.iter_mut().map(|terminals| terminals.turn(knob)).collect();
        if turned.iter().any(Result::is_ok) {
            return Ok(());
        }
        // The last of equals is this product's own.
        let closeness = |error: &KnobError| match error {
            KnobError::NotHere { .. } => 0,
            KnobError::NoSuchInput { .. } => 1,
            KnobError::Value { .. } => 2,
        };
        turned.into_iter().filter_map(Result::err).max_by_key(closeness).map_or(Ok(()), Err)
    }
}

/// The verb that sets what a ramp sets.
fn set(ramp: &RawRamp, value: f64) -> String {
    format!("set {} {value}", ramp.what.get_ref())
}

/// The key whose value is of the wrong type, e.g. `at.seconds`. The parser names it only in its whole text, and there
/// only where that does not show the line; other errors name their key themselves, or are about none.
fn key_of(error: &toml::de::Error) -> Option<String> {
    let mut error = error.clone();
    error.set_input(None);
    let text = error.to_string();
    let (message, key) = text.trim_end().rsplit_once("\nin `")?;
    message.starts_with("invalid ").then(|| key.trim_end_matches('`').to_owned())
}

/// Where in the file a column of a deed is; where the deed begins if it is not written as it reads (escapes, several
/// lines).
fn place_of(text: &str, deed: &Spanned<String>, column: usize) -> usize {
    let start = deed.span().start;
    // After the opening quotation mark.
    let written = text.get(start + 1..).is_some_and(|rest| rest.starts_with(deed.get_ref().as_str()));
    let before: usize = deed.get_ref().chars().take(column.saturating_sub(1)).map(char::len_utf8).sum();
    if written { start + 1 + before } else { start }
}

/// Steps of a ramp of this length.
fn ramp_steps(length: Duration) -> u32 {
    (length.as_nanos() / RAMP_STEP.as_nanos()).clamp(1, u128::from(u32::MAX)) as u32
}

#[cfg(test)]
mod tests {
    use super::*;

    fn product() -> &'static Product {
        Product::named("AXTC4CO").expect("built in")
    }

    #[test]
    fn the_example_of_the_documentation_can_be_played() {
        let text = include_str!("../../../docs/emulator.md");
        let example = text.split("```toml\n").nth(1).and_then(|rest| rest.split("```").next()).expect("an example");
        let scenario = Scenario::read("emulator.md", example, product()).expect("no fault").expect("for this product");
        assert!(scenario.deeds.len() > 600, "ten steps of the ramp in each second");
        for verb in HELP.lines().map(|line| line.split_whitespace().next().unwrap_or_default().trim_end_matches(',')) {
            assert!(text.contains(&format!("`{verb}")), "{verb} is not in the documentation");
        }
    }

    #[test]
    fn each_fault_of_a_file_is_named_with_line_column_and_what_is_allowed() {
        let table = [
            ("[[at]]\nseconds = -1\ndo = []", "test.toml:2:11: at.seconds: -1 is not 0 to 604800 seconds"),
            ("[[at]]\nseconds = 1\ndo = [\"opne 3\"]", "test.toml:3:8: at.do: 'opne' is not known; there is: set"),
            (
                "[[at]]\nseconds = 1\ndo = ['open 3', 'open 3 X']",
                "test.toml:3:25: at.do: 'X' is not known; there is: A",
            ),
            ("[[at]]\nseconds = 1\ndo = ['status']", "test.toml:3:8: at.do: a scenario does things"),
            ("[[at]]\nsecond = 1\ndo = []", "test.toml:2:1: unknown field `second`, expected `seconds` or `do`"),
            ("[[ramp]]\nfrom = 5\nto = 2\nwhat = 'supply'\nstart = 1\nend = 2", "test.toml:3:6: ramp.to: a ramp ends"),
            (
                "[[ramp]]\nfrom = 1\nto = 2\nwhat = '1 pressure'\nstart = 1\nend = 2",
                "test.toml:4:8: ramp.what: 'pressure' is not known",
            ),
            (
                "[[ramp]]\nfrom = 1\nto = 2\nwhat = '1 temperature'\nstart = 1\nend = inf",
                "test.toml:6:7: ramp.end: inf is not a number like 23.5",
            ),
            ("[[at]]\nseconds = 1e99\ndo = []", "test.toml:2:11: at.seconds: 1e99 is not 0 to 604800 seconds"),
            ("product = 'axtc5'", "test.toml:1:11: product: 'axtc5' is not a product; there is axtc4co, axrtd8co"),
            (
                "repeat = 1\n[[at]]\nseconds = 2\ndo = []\n[[at]]\nseconds = 3\ndo = ['freeze']",
                "test.toml:1:10: repeat: 1 s is",
            ),
            (
                "product = 'axtc4co'\n[[at]]\nseconds = 1\ndo = ['open 5']",
                "test.toml:4:8: at.do: there is no input 5: this unit has inputs 1 to 4",
            ),
            (
                "product = 'axtc4co'\n[[at]]\nseconds = 1\ndo = ['set 1 temperature 9999']",
                "test.toml:4:8: at.do: a temperature cannot be 9999: it is from -273.15 to 3000",
            ),
            (
                "product = 'axtc4co'\n[[ramp]]\nfrom = 1\nto = 2\nwhat = '1 resistance'\nstart = 1\nend = 2",
                "test.toml:5:8: ramp.what: a unit with thermocouples has no resistance",
            ),
            (
                "[[ramp]]\nfrom = 0\nto = 200_000\nwhat = 'supply'\nstart = 1\nend = 2",
                "test.toml:2:8: ramp: more than 1000000 deeds in all, steps of ramps included",
            ),
            ("repeat = 0.000000001", "test.toml:1:10: repeat: 0.000000001 s is less than 0.1 s"),
            // Blanks of two bytes; one written as an escape; a deed on a line of its own.
            ("[[at]]\nseconds = 1\ndo = ['open\u{a0}\u{a0}3\u{a0}X']", "test.toml:3:16: at.do: 'X' is not known"),
            ("[[at]]\nseconds = 1\ndo = [\"open\\u00203 X\"]", "test.toml:3:7: at.do: 'X' is not known"),
            ("[[at]]\nseconds = 1\ndo = ['''\nopen 3 X''']", "test.toml:3:7: at.do: 'X' is not known"),
            ("[[at", "test.toml:1:5: "),
            ("[[at]]\nseconds = '1'\ndo = []", "test.toml:2:11: at.seconds: invalid type: string \"1\", expected f64"),
            ("[[at]]\nseconds = 1\ndo = ['freeze', 3]", "test.toml:3:17: at.do: invalid type: integer `3`"),
            ("repeat = []", "test.toml:1:10: repeat: invalid type: "),
            // Nothing of a file reaches the terminal as a control code.
            ("product = \"\\u001b[2J\"", "test.toml:1:11: product: '^[[2J' is not a product; there is axtc4co"),
            ("\"\\u001b[2J\" = 1", "test.toml:1:1: unknown field `^[[2J`, expected one of `product`"),
        ];
        for (text, expected) in table {
            let complaints = Scenario::read("test.toml", text, product()).expect_err(text);
            let found: Vec<String> = complaints.iter().map(Complaint::to_string).collect();
            assert!(found.iter().any(|complaint| complaint.starts_with(expected)), "{text}:\n{}", found.join("\n"));
        }
        let two = Scenario::read("test.toml", "[[at]]\nseconds = -1\ndo = ['x', 'y']", product()).expect_err("three");
        assert_eq!(two.len(), 3, "none hides another");
        for text in [
            "repeat = 1e9\n[[at]]\nseconds = 2\ndo = ['freeze']",
            "[[ramp]]\nfrom = 5\nto = 1e9\nwhat = 'supply'\nstart = 1\nend = 2",
        ] {
            let complaints = Scenario::read("test.toml", text, product()).expect_err(text);
            assert_eq!(complaints.len(), 1, "and none has a second that says something else: {complaints:?}");
        }
        let long = Scenario::read("test.toml", &format!("{} = 1", "x".repeat(100_000)), product()).expect_err("no key");
        assert!(long[0].to_string().len() < 500, "{}", long[0]);
        let many = format!("[[at]]\nseconds = 1\ndo = [{}]", "\n'x',".repeat(100_000));
        let complaints = Scenario::read("test.toml", &many, product()).expect_err("no verbs");
        assert_eq!(complaints.len(), 101);
        assert_eq!(complaints[100].to_string(), "test.toml:104:2: and more is wrong");
        let for_all = "[[at]]\nseconds = 1\ndo = ['set 8 temperature 20']";
        assert!(Scenario::read("test.toml", for_all, product()).is_ok(), "another product has that input");
        assert_eq!(Scenario::read("test.toml", "product = 'axrtd8co'", product()), Ok(None), "for another product");
    }

    #[test]
    fn what_no_product_could_take_is_refused_in_a_file_for_all() {
        let deed = |deed: &str| -> Vec<String> {
            let read = Scenario::read("test.toml", &format!("[[at]]\nseconds = 1\ndo = ['{deed}']"), product());
            read.err().unwrap_or_default().iter().map(Complaint::to_string).collect()
        };
        assert_eq!(deed("set supply 2000"), ["test.toml:3:8: at.do: a supply cannot be 2000: it is from 0 to 100"]);
        let hot = "test.toml:3:8: at.do: a temperature cannot be 5000: it is from -273.15 to 3000";
        assert_eq!(deed("set 1 temperature 5000"), [hot]);
        let far = "test.toml:3:8: at.do: there is no input 99: this unit has inputs 1 to 4";
        assert_eq!(deed("set 99 temperature 20"), [far]);
        let high = "test.toml:3:8: at.do: a resistance cannot be 2000000: it is from 0 to 1000000";
        assert_eq!(deed("set 1 resistance 2e6"), [high]);
        for other in ["set 8 temperature 20", "set 1 resistance 100", "set cold-junction 20", "open 8 A"] {
            assert_eq!(deed(other), [""; 0], "{other}");
        }
    }

    #[test]
    fn the_end_of_a_ramp_that_cannot_be_is_named_with_its_own_number_and_place() {
        let found = |ramp: &str| {
            let complaints = Scenario::read("test.toml", &format!("[[ramp]]\n{ramp}"), product()).expect_err(ramp);
            complaints.iter().map(Complaint::to_string).collect::<Vec<_>>()
        };
        let both = found("from=1\nto=2\nwhat='supply'\nstart=-1\nend=2000");
        let low = "test.toml:5:7: ramp.start: a supply cannot be -1: it is from 0 to 100";
        assert_eq!(both, [low, "test.toml:6:5: ramp.end: a supply cannot be 2000: it is from 0 to 100"]);
        let and_time = found("from=3\nto=2\nwhat='1 temperature'\nstart=20\nend=1e9");
        let hot = "test.toml:6:5: ramp.end: a temperature cannot be 1000000000: it is from -273.15 to 3000";
        assert_eq!(and_time, [hot, "test.toml:3:4: ramp.to: a ramp ends later than it begins"]);
        let nowhere = found("from=1\nto=2\nwhat='99 temperature'\nstart=20\nend=30");
        assert_eq!(nowhere, ["test.toml:4:6: ramp.what: there is no input 99: this unit has inputs 1 to 4"]);
    }

    #[test]
    fn deeds_at_moments_are_limited_as_those_of_ramps_are() {
        let text = "[[at]]\nseconds = 1\ndo = ['heal']";
        let raw: RawScenario = toml::from_str(text).expect("a scenario");
        let mut reading = Reading {
            text,
            product: product(),
            terminals: Vec::new(),
            complaints: Complaints::about("test.toml", text),
            deeds: vec![(Duration::ZERO, Verb::Heal); MOST_DEEDS - 1],
        };
        reading.moment(&raw.at[0]);
        assert_eq!(reading.deeds.len(), MOST_DEEDS);
        reading.moment(&raw.at[0]);
        assert_eq!(reading.deeds.len(), MOST_DEEDS);
        let complaints = reading.complaints.or(()).expect_err("one more than there may be");
        let found: Vec<String> = complaints.iter().map(Complaint::to_string).collect();
        assert_eq!(found, ["test.toml:2:11: at: more than 1000000 deeds in all, steps of ramps included"]);
    }
}
