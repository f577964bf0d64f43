//! Lines that tell units what to do.

use crate::device::Product;
use crate::emulator::scenario::{self, Verb, WordError};

/// What standard input can say.
#[derive(Debug, PartialEq)]
pub enum Order {
    /// The end.
    Quit,
    /// What there is to say.
    Help,
    /// What can go wrong.
    HelpFaults,
    /// Verbs with the places of their units.
    Tell(Vec<(usize, Verb)>),
}

/// A line that cannot be carried out.
#[derive(Debug, PartialEq)]
pub struct Refused {
    /// The place of the unit that it names, if it names one.
    pub place: Option<usize>,
    /// Where it is wrong, and what exists. It does not repeat the line: a person still sees it, and a script finds it
    /// in the JSON object.
    pub why: String,
}

/// All that can be said, for the help.
pub fn help() -> String {
    format!(
        "{}\nquit                       end\nhelp, help faults          this text, and what can go wrong\n\
         With several units, a number first says which one: 2 power off; 'all' means every one,\n\
         and without either it is the first",
        scenario::HELP
    )
}

impl Order {
    /// Reads a line; an empty one is nothing. A verb without a number is for the first unit.
    ///
    /// # Errors
    /// If it says nothing that can be done.
    pub fn read(line: &str, products: &[&Product]) -> Result<Option<Order>, Refused> {
        match line.trim().to_ascii_lowercase().as_str() {
            "" => return Ok(None),
            "quit" => return Ok(Some(Order::Quit)),
            "help" => return Ok(Some(Order::Help)),
            "help faults" => return Ok(Some(Order::HelpFaults)),
            _ => {}
        }
        let (named, verb) = places(line, products.len()).map_err(|why| Refused { place: None, why })?;
        let place = match named.as_deref() {
            Some(&[place]) => Some(place),
            _ => None,
        };
        let places = named.unwrap_or_else(|| vec![0]);
        let verbs = places.into_iter().map(|place| Ok((place, Verb::read(&verb, products[place])?)));
        let verbs: Result<Vec<_>, WordError> = verbs.collect();
        let refused = |error| Refused { place, why: format!("{error} ('help' says what there is)") };
        verbs.map(|verbs| Some(Order::Tell(verbs))).map_err(refused)
    }
}

/// The units that a line names with its first word, if it does, and the line with blanks in that word's place: so
/// complaints about the rest count the columns of the line.
pub fn places(line: &str, units: usize) -> Result<(Option<Vec<usize>>, String), String> {
    let first = line.split_whitespace().next().unwrap_or_default();
    let places = if first.eq_ignore_ascii_case("all") {
        (0..units).collect()
    } else {
        match first.parse::<usize>() {
            Ok(number) if (1..=units).contains(&number) => vec![number - 1],
            Ok(number) => return Err(format!("there is no unit {number}: they are numbered 1 to {units}")),
            Err(_) => return Ok((None, line.to_owned())),
        }
    };
    Ok((Some(places), line.replacen(first, &" ".repeat(first.chars().count()), 1)))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::emulator::fault::Fault;

    #[test]
    fn orders_name_their_units_and_bad_ones_name_the_good() {
        let products: Vec<&Product> = Product::all().iter().collect();
        let read = |line: &str| Order::read(line, &products);
        let tell = |verbs: &[(usize, Verb)]| Ok(Some(Order::Tell(verbs.to_vec())));
        assert_eq!(read(" Power  OFF "), tell(&[(0, Verb::PowerOff)]));
        assert_eq!(read("2 power on"), tell(&[(1, Verb::PowerOn)]));
        assert_eq!(read("ALL status"), tell(&[(0, Verb::Status), (1, Verb::Status)]));
        assert_eq!(read(""), Ok(None));
        assert_eq!(read("Quit"), Ok(Some(Order::Quit)));
        let refused = |line: &str| read(line).expect_err(line);
        let no_unit = "there is no unit 3: they are numbered 1 to 2".into();
        assert_eq!(refused("3 quit"), Refused { place: None, why: no_unit });
        let complaint = refused("explode\x1b[2J").why;
        assert!(complaint.starts_with("column 1: 'explode^[[2J' is not known; there is: set"), "{complaint}");
        let complaint = refused(" 2 open 0").why;
        assert!(complaint.starts_with("column 9: '0' is not an input"), "the column of the line: {complaint}");
        let complaint = refused(&format!("open {}", "x".repeat(100_000))).why;
        assert!(complaint.len() < 300, "{complaint}");
        assert!(refused("2").why.contains("a verb is missing"));
        assert!(refused("help  faults").why.contains("'help' is not known"));
        for (line, place) in [("1 set 1 temperature nan", Some(0)), ("2 explode", Some(1)), ("explode", None)] {
            assert_eq!(refused(line).place, place, "{line}");
        }
        assert_eq!(refused("all explode").place, None, "none in particular");
        assert_eq!(read("Help Faults"), Ok(Some(Order::HelpFaults)));
        let fault = Fault::read("queue 64", products[1]).expect("a fault");
        assert_eq!(read("2 fault queue 64"), tell(&[(1, Verb::Fault(fault))]));
    }
}
