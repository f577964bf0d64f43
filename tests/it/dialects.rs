//! The console against units that word and lay out everything in their own way, within what the manuals fix: the same
//! facts and the same deeds for every dialect.

use axcon::canopen::{ObjectAddress, Value};
use axcon::device::Product;
use axcon::device::dictionary::Access;
use axcon::session::{Command, Event, Job, Outcome, UnitState};
use axcon::time::Duration;
use axcon::version::Version;
use axcon::wire::stream::Source;

use crate::support::bench::Bench;

/// Dialects that are tried, so many unless the environment asks for more, or for a single one.
fn seeds(usual: u64) -> Vec<u64> {
    let number = |name: &str| std::env::var(name).ok().and_then(|text| text.parse::<u64>().ok());
    match number("AXCON_SEED") {
        Some(seed) => vec![seed],
        None => (0..number("AXCON_SEEDS").unwrap_or(usual)).collect(),
    }
}

/// Runs a story with both products in every dialect and says in which ones it failed.
fn in_every_dialect(story: impl Fn(&mut Bench, &'static Product) -> Result<(), String>) {
    in_dialects(150, story);
}

fn in_dialects(usual: u64, story: impl Fn(&mut Bench, &'static Product) -> Result<(), String>) {
    let mut failed = Vec::new();
    let seeds = seeds(usual);
    for &seed in &seeds {
        for product in Product::all() {
            let mut bench = Bench::in_dialect(product, seed);
            bench.run_for(Duration::from_secs(6));
            if let Err(what) = story(&mut bench, product) {
                let heard = bench.transcript();
                let end = heard.char_indices().rev().nth(700).map_or(0, |(at, _)| at);
                failed.push(format!("AXCON_SEED={seed}, {}: {what}\n{}", product.name, &heard[end..]));
            }
        }
    }
    assert!(
        failed.is_empty(),
        "{} of {} failed:\n{}",
        failed.len(),
        2 * seeds.len(),
        failed[..failed.len().min(3)].join("\n\n")
    );
}

#[test]
fn every_dialect_is_identified() {
    in_every_dialect(|bench, product| {
        bench.reconnect();
        bench.ask(Command::Identify);
        let facts = bench.session.facts();
        let said = (
            facts.state,
            facts.node_id.as_ref().map(|known| known.value),
            facts.can_kbps.as_ref().map(|known| known.value),
            facts.nmt_state.as_ref().map(|known| known.value.as_str()),
        );
        let right = said == (UnitState::Application, Some(127), Some(125), Some("pre-operational"));
        // A menu that does not name product and version leaves them to the banner.
        let heard = bench.transcript();
        let is_said = |known: &Option<String>, text: &str| match known {
            Some(known) => known == text,
            None => !heard.contains(text),
        };
        let name = facts.product.as_ref().map(|known| known.value.clone());
        let version = facts.version.as_ref().map(|known| known.value.to_string());
        let named = is_said(&name, &product.name) && is_said(&version, "1.1.0");
        if right && named { Ok(()) } else { Err(format!("{said:?}, {name:?} {version:?}")) }
    });
}

#[test]
fn every_dialects_banner_says_product_and_version() {
    in_every_dialect(|bench, product| {
        bench.power_cycle(Duration::from_secs(1));
        bench.run_for(Duration::from_secs(2));
        let facts = bench.session.facts();
        let said =
            (facts.product.as_ref().map(|known| known.value.as_str()), facts.version.as_ref().map(|known| known.value));
        let expected = (Some(product.name.as_str()), Some(Version::new(1, 1, 0)));
        if said == expected { Ok(()) } else { Err(format!("{said:?}")) }
    });
}

#[test]
fn every_dialects_stream_is_switched_on_and_off() {
    in_every_dialect(|bench, _| {
        for source in [Source::FieldValue, Source::ProcessValue] {
            let outcome = bench.ask(Command::StreamOn { source, period: Duration::from_millis(200) });
            if !matches!(outcome, Outcome::StreamRuns { was_on: false }) {
                return Err(format!("{source:?}: {outcome:?}"));
            }
            let off = bench.ask(Command::StreamOff);
            if off != Outcome::Done(Job::StreamOff) {
                return Err(format!("{source:?} off: {off:?}"));
            }
            let end = bench.now + Duration::from_secs(1);
            if bench.run_until(end, |event| matches!(event, Event::Row { .. })).is_some() {
                return Err(format!("{source:?}: a row after the end"));
            }
        }
        Ok(())
    });
}

#[test]
fn every_dialects_diagnostics_are_read_and_stopped() {
    in_every_dialect(|bench, _| {
        bench.command(Command::Diagnostics { pages: Some(2) });
        let (mut pages, mut outcome) = (0, None);
        bench.run_until(bench.now + Duration::from_secs(60), |event| {
            match event {
                Event::Page { .. } => pages += 1,
                Event::Finished(ended) => outcome = Some(ended.clone()),
                _ => {}
            }
            outcome.is_some()
        });
        if (pages, &outcome) != (2, &Some(Outcome::Done(Job::Diagnostics))) {
            return Err(format!("{pages} pages, {outcome:?}"));
        }
        let received = bench.received_so_far();
        bench.run_for(Duration::from_secs(2));
        if bench.received_so_far() == received { Ok(()) } else { Err("pages after the end".into()) }
    });
}

#[test]
fn every_dialects_dictionary_is_read_to_the_same_facts() {
    // A walk over the whole dictionary takes its time: fewer of them.
    in_dialects(40, |bench, product| {
        // Settings with more digits than any temperature has.
        let real = |number: f32| number.to_le_bytes().to_vec();
        let mut settings = vec![(0x6126, 1, real(0.000_5)), (0x6127, 2, real(-1_234.567_8))];
        if product.name == "AXRTD8CO" {
            settings.extend([(0x3000, 1, vec![0, 0]), (0x3020, 1, real(0.000_012_5))]);
        }
        for (index, sub, data) in settings {
            let at = ObjectAddress::new(index, sub);
            bench.unit.unit_mut().write_object(bench.now, at, &data).map_err(|refusal| format!("{at}: {refusal}"))?;
        }
        let outcome = bench.ask(Command::ReadDictionary);
        let Outcome::DictionaryRead(reading) = outcome else { return Err(format!("{outcome:?}")) };
        if !reading.is_complete() {
            return Err(format!("not complete, {} entries", reading.entries.len()));
        }
        let mut wrong = Vec::new();
        for (at, object, entry) in product.dictionary.entries() {
            let read = reading.entries.iter().find(|read| read.at == at);
            let (Some(read), Ok(value)) = (read, bench.unit.unit_mut().read_object(bench.now, at)) else {
                let said = bench.transcript();
                let line = said.lines().find(|line| line.contains(&format!("{:04X}", at.index))).unwrap_or_default();
                wrong.push(format!("{at} {} {} is missing: {line}", object.name, entry.name));
                continue;
            };
            let same = match read.value() {
                None => value.as_f64().is_nan(),
                Some(setting) if entry.access == Access::ReadWrite => setting == value,
                // As many digits as the unit prints, and one scan older perhaps.
                Some(Value::Real32(number)) => (f64::from(number) - value.as_f64()).abs() < 1.0,
                Some(other) => {
                    let live = matches!(at.index, 0x2010 | 0x2130 | 0x3130 | 0x7130);
                    other == value || (live && (other.as_f64() - value.as_f64()).abs() < 2_000.0)
                }
            };
            if !same {
                wrong.push(format!("{at}: {:?} from {:?}, not {value}", read.value(), read.text));
            }
        }
        if wrong.is_empty() {
            Ok(())
        } else {
            Err(format!("{} wrong: {}", wrong.len(), wrong[..wrong.len().min(5)].join("; ")))
        }
    });
}

#[test]
fn every_dialects_defaults_are_restored() {
    in_every_dialect(|bench, _| {
        // A setting of the unit's own, kept across its restarts.
        let factor = ObjectAddress::new(0x6126, 1);
        for (at, data) in [(factor, 18f32.to_le_bytes()), (ObjectAddress::new(0x1010, 1), *b"save")] {
            bench.unit.unit_mut().write_object(bench.now, at, &data).map_err(|refusal| format!("{at}: {refusal}"))?;
        }
        let outcome = bench.ask(Command::RestoreDefaults);
        if outcome != Outcome::Done(Job::RestoreDefaults) {
            return Err(format!("{outcome:?}"));
        }
        let read = bench.unit.unit_mut().read_object(bench.now, factor);
        if read == Ok(Value::Real32(16.0)) { Ok(()) } else { Err(format!("{factor} is {read:?}")) }
    });
}
