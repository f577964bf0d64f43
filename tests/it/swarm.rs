//! Uploads by the thousand: product, loader, size of its pages, wording, latency, image, the state the unit is found
//! in, faults on the line, and the moment of an interruption, all drawn from a seed; then a checker that knows the
//! truth, since it sees the flash.
//!
//! - the upload ends within bounded virtual time;
//! - one that nothing disturbs succeeds;
//! - *success* only if the flash holds the image and the unit runs it;
//! - what a failure says of the unit is true;
//! - after the end of the loader hardly a record more reaches what is no loader;
//! - the password is nowhere in the record;
//! - with the faults gone, the next upload, by a console that knows nothing but port and journal, succeeds.
//!
//! And the checker is not blind: with each of the defects of real senders put into the machine it complains of that.

use std::collections::BTreeMap;
use std::sync::Mutex;

use axcon::device::{LoaderKind, Pacing, Product};
use axcon::emulator::Running;
use axcon::emulator::memory::Defect;
use axcon::image::CheckedImage;
use axcon::rng::Rng;
use axcon::session::flaw::Flaw;
use axcon::session::{Command, LoadOrder, LoadReport, Outcome, UnitNow, Verdict};
use axcon::time::Duration;

use crate::support::bench::{Bench, axrtd8co, axtc4co, flash_with, image_of, order, with_pages};
use crate::support::flash;

/// Seeds that run with the tests; the environment may ask for more, or for a single one.
const SEEDS: u64 = 2_000;
/// Stories in which a defect has to show, of those in which it can.
const STORIES_OF_A_FLAW: usize = 1_000;
/// Longest an upload may take: everything erased twice, the file sent twice, and every wait at its end.
const LONGEST: Duration = Duration::from_secs(150);
/// How long a unit takes from its power-up until what it is has been heard.
const TOLD: Duration = Duration::from_secs(3);
/// How long most units take from the first question to the first record.
const EARLY: Duration = Duration::from_secs(1);
/// Records that may reach something that is no loader: those on their way when it left, and one more.
const STRAYS: u64 = 8;

/// What a seed draws.
struct Story {
    product: &'static Product,
    before: &'static str,
    after: &'static str,
    loader: LoaderKind,
    dialect: u64,
    latency: Duration,
    words: u32,
    packed: bool,
    found: Found,
    to_unit: Vec<Fault>,
    from_unit: Vec<Fault>,
    interruption: Interruption,
    /// A word of the flash that cannot be written.
    spoiled: Option<(u32, Defect)>,
}

/// The state in which the console finds the unit.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Found {
    Menu,
    View,
    PasswordPrompt,
    Streaming,
    Diagnosing,
    /// An upload before this one was given up in the middle.
    Loader,
    /// And the loader was then talked to by somebody who is none.
    LoaderBehindErrors,
    Starting,
}

/// What happens to characters on the line.
#[derive(Clone, Copy, Debug)]
struct Fault {
    /// Number of the first character concerned.
    at: u64,
    kind: Kind,
}

#[derive(Clone, Copy, Debug)]
enum Kind {
    Changed(u8),
    Lost,
    Doubled,
    /// So many characters in a row are lost.
    Gap(u64),
    /// So many are noise.
    Noise(u64),
    /// From here on every XON is lost, so many of them.
    NoXon(u64),
    /// The next record vanishes whole, line end and all.
    Record,
}

#[derive(Clone, Copy, Debug)]
enum Interruption {
    None,
    /// The unit's power goes, and comes back after a while.
    Power {
        at: Duration,
        off: Duration,
    },
    /// The user has had enough.
    Cancel {
        at: Duration,
    },
    /// The program is killed.
    Kill {
        at: Duration,
    },
    /// The cable is pulled out.
    Cable {
        at: Duration,
    },
}

impl std::fmt::Display for Story {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let Story { loader, dialect, latency, words, packed, found, to_unit, from_unit, interruption, .. } = self;
        let pages = self.product.flash.page_words;
        write!(f, "{} {loader:?}, pages of {pages}, dialect {dialect}", self.product.name)?;
        write!(f, ", {latency:?}, {words} words")?;
        write!(
            f,
            ", packed {packed}, found {found:?}, {interruption:?}, to unit {to_unit:?}, from it {from_unit:?}, spoiled {:?}",
            self.spoiled
        )
    }
}

impl Story {
    fn of(seed: u64) -> Self {
        let mut rng = Rng::new(seed).fork("swarm");
        let is_tc = rng.chance(50);
        let (product, before, after) =
            if is_tc { (axtc4co(), "1.1.0", "1.2.0") } else { (axrtd8co(), "2.1.1", "2.2.0") };
        let own = product.loader.kind;
        let any = LoaderKind::ALL[rng.below(3) as usize];
        let loader = if rng.chance(60) { own } else { any };
        // Every third unit has other pages than its product's file believes.
        let page_words = if rng.chance(33) { [64, 128, 512, 1_024][rng.below(4) as usize] } else { 256 };
        let product = with_pages(product, page_words);
        let words = [600, 700, 900, 1_300][rng.below(4) as usize];
        // How many characters there are to disturb, about.
        let (sent, said) = (u64::from(words) * 5 + 300, if loader == LoaderKind::G3 { 700 } else { 450 });
        let takes = if loader == LoaderKind::G3 { 13_000 } else { 1_500 } + u64::from(words);
        let story = |rng: &mut Rng, span: u64, most: u64| -> Vec<Fault> {
            let count = if rng.chance(55) { 1 + rng.below(most) } else { 0 };
            (0..count).map(|_| Fault { at: rng.below(span), kind: Kind::of(rng) }).collect()
        };
        Story {
            product,
            before,
            after,
            loader,
            dialect: if rng.chance(50) { 0 } else { rng.below(100_000) },
            latency: Duration::from_millis(rng.below(21)),
            words,
            packed: rng.chance(40),
            found: Found::of(&mut rng),
            to_unit: story(&mut rng, sent, 3),
            from_unit: story(&mut rng, said, 3),
            interruption: Interruption::of(&mut rng, takes),
            spoiled: rng.chance(6).then(|| {
                let defects = [Defect::WornOut, Defect::Protected, Defect::Stuck];
                (rng.below(u64::from(words)) as u32, defects[rng.below(3) as usize])
            }),
        }
    }

    /// Whether nothing happens in it but the upload.
    fn is_undisturbed(&self) -> bool {
        let is_left_alone = matches!(self.interruption, Interruption::None) && self.spoiled.is_none();
        is_left_alone && self.to_unit.is_empty() && self.from_unit.is_empty()
    }
}

impl Found {
    fn of(rng: &mut Rng) -> Self {
        match rng.below(12) {
            0 => Found::View,
            1 => Found::PasswordPrompt,
            2 => Found::Streaming,
            3 => Found::Diagnosing,
            4 => Found::Loader,
            5 => Found::LoaderBehindErrors,
            6 => Found::Starting,
            _ => Found::Menu,
        }
    }
}

impl Kind {
    fn of(rng: &mut Rng) -> Self {
        match rng.below(9) {
            0 | 1 => Kind::Changed(1 << rng.below(8)),
            2 | 3 => Kind::Lost,
            4 => Kind::Doubled,
            5 => Kind::Gap(2 + rng.below(120)),
            6 => Kind::Noise(1 + rng.below(40)),
            7 => Kind::Record,
            _ => Kind::NoXon(1 + rng.below(3)),
        }
    }
}

impl Interruption {
    fn of(rng: &mut Rng, takes_ms: u64) -> Self {
        let at = Duration::from_millis(rng.below(takes_ms));
        match rng.below(12) {
            0 | 1 => Interruption::Power { at, off: Duration::from_millis(rng.below(2_000)) },
            2 => Interruption::Cancel { at },
            3 => Interruption::Kill { at },
            4 => Interruption::Cable { at },
            _ => Interruption::None,
        }
    }
}

/// Somebody on the line who does what the faults say.
fn middleman(faults: Vec<Fault>, seed: u64) -> impl FnMut(u64, u8) -> Vec<u8> {
    let mut rng = Rng::new(seed).fork("noise on the line");
    let mut xons_lost = 0;
    // Where a record vanishes: not begun, begun, over.
    let mut vanishing = vec![None; faults.len()];
    move |number, byte| {
        for (fault, vanishing) in faults.iter().zip(&mut vanishing) {
            let behind = number.checked_sub(fault.at);
            match (fault.kind, behind) {
                (Kind::Changed(bit), Some(0)) => return vec![byte ^ bit],
                (Kind::Lost, Some(0)) => return Vec::new(),
                (Kind::Doubled, Some(0)) => return vec![byte, byte],
                (Kind::Gap(length), Some(behind)) if behind < length => return Vec::new(),
                (Kind::Noise(length), Some(behind)) if behind < length => return vec![rng.next_u64() as u8],
                (Kind::Record, Some(_)) if *vanishing == Some(true) || (vanishing.is_none() && byte == b'S') => {
                    *vanishing = Some(byte != b'\r');
                    return Vec::new();
                }
                (Kind::NoXon(most), Some(_)) if byte == 0x11 && xons_lost < most => {
                    xons_lost += 1;
                    return Vec::new();
                }
                _ => {}
            }
        }
        vec![byte]
    }
}

/// Runs one seed. What is wrong with it, if something is.
fn run(seed: u64, flaw: Option<Flaw>) -> Result<(), String> {
    let story = Story::of(seed);
    let image = made(story.product, story.after, story.words);
    let before = flash_with(&made(story.product, story.before, 600));
    let mut bench = Bench::story(story.product, story.loader, story.dialect, before, story.latency);
    // A console that was here before has noted the product, as the journal does.
    let mut order = order(image.clone());
    order.packed = story.packed;
    order.flaw = flaw;
    find(&mut bench, story.found, &order);
    order.product =
        matches!(story.found, Found::Loader | Found::LoaderBehindErrors).then(|| story.product.name.clone());

    bench.wire.clear();
    bench.disturb(middleman(shifted(&story.to_unit, bench.sent_so_far()), seed));
    bench.disturb_answers(middleman(shifted(&story.from_unit, bench.received_so_far()), seed ^ 1));
    if let Some((word, defect)) = story.spoiled {
        bench.unit.unit_mut().spoil_word(word, defect);
    }
    let begun = bench.now;
    let strays = bench.strays();
    let report = first_upload(&mut bench, &order, story.interruption);
    if bench.now.since(begun) > LONGEST {
        return Err(format!("it took {:?}", bench.now.since(begun)));
    }
    // A unit whose power came back a moment ago has had no time to say so.
    let had_time = match story.interruption {
        Interruption::Power { at, off } => bench.now >= begun + at + off + TOLD,
        _ => true,
    };
    bench.run_for(Duration::from_millis(200)); // A unit that has just got its power starts.
    let flash_is_right = flash::holds(bench.unit.unit(), &image);
    let running = bench.unit.unit().running();
    if let Some(report) = &report {
        let claims = match (report.verdict, report.unit) {
            (Verdict::Done, _) if !flash_is_right => Some("a false success"),
            (Verdict::Done, _) if running != Running::Application => Some("done, and it does not run"),
            (_, UnitNow::Loader) if had_time && running != Running::Loader => Some("it is said to be in its loader"),
            (_, UnitNow::Application) if had_time && running != Running::Application => Some("it is said to run"),
            _ => None,
        };
        if let Some(claim) = claims {
            return Err(format!("{claim}, and is {running:?}: {report:?}"));
        }
        // A console that has just come cannot know what a unit is whose menu does not name it.
        let is_nameless = story.dialect != 0 && report.verdict == Verdict::Refused && report.product.is_none();
        if story.is_undisturbed() && report.verdict != Verdict::Done && !is_nameless {
            return Err(format!("nothing disturbed it, and it fails: {report:?}"));
        }
    }
    if report.as_ref().is_some_and(|report| format!("{report:?}").contains("AXIO-2010")) {
        return Err(format!("the password is in the report: {report:?}"));
    }
    if bench.transcript().contains("AXIO-2010") {
        let heard = bench.transcript();
        let at = heard.find("AXIO-2010").unwrap_or_default();
        let near: String = heard[..at].chars().rev().take(200).collect::<Vec<_>>().into_iter().rev().collect();
        return Err(format!("the password is in the record after {near}"));
    }
    if bench.strays() - strays > STRAYS {
        let heard = bench.transcript();
        let end = heard.char_indices().rev().nth(6_000).map_or(0, |(at, _)| at);
        let strays = bench.strays() - strays;
        return Err(format!("{strays} records went to what is no loader: {report:?}\n{}", &heard[end..]));
    }

    // The faults stop; another console comes, and knows what the journal says.
    bench.leave_in_peace();
    bench.unit.unit_mut().repair_flash();
    bench.unit.to_unit_mut().clear();
    bench.run_for(Duration::from_secs(3));
    bench.reconnect();
    // This one has no defect: what the checker says of a defect it says of the first upload.
    (order.product, order.flaw) = (Some(story.product.name.clone()), None);
    let second = bench.load(order);
    if second.verdict != Verdict::Done {
        let heard = bench.transcript();
        let end = heard.char_indices().rev().nth(600).map_or(0, |(at, _)| at);
        return Err(format!("first {report:?}\nthen {second:?}\n{}", &heard[end..]));
    }
    if !flash::holds(bench.unit.unit(), &image) {
        return Err("the second upload is a false success".into());
    }
    Ok(())
}

/// An image, made once.
fn made(product: &Product, version: &str, words: u32) -> CheckedImage {
    static MADE: Mutex<BTreeMap<(String, String, u32), CheckedImage>> = Mutex::new(BTreeMap::new());
    let key = (product.name.clone(), version.to_owned(), words);
    let mut all = MADE.lock().expect("no panic");
    all.entry(key).or_insert_with(|| image_of(&product.name, version, words)).clone()
}

/// Brings the unit into the state in which the console finds it.
fn find(bench: &mut Bench, found: Found, order: &LoadOrder) {
    if found == Found::Starting {
        return;
    }
    bench.run_for(Duration::from_secs(5));
    let keys = |bench: &mut Bench, keys: &[u8]| {
        for &key in keys {
            let now = bench.now;
            bench.unit.send(now, &[key]);
            bench.run_for(Duration::from_millis(120));
        }
    };
    match found {
        Found::Menu | Found::Starting => {}
        Found::View => keys(bench, b"v\r\r"),
        Found::PasswordPrompt => keys(bench, b"l"),
        Found::Streaming => {
            let source = axcon::wire::stream::Source::FieldValue;
            bench.ask(Command::StreamOn { source, period: Duration::from_millis(200) });
        }
        Found::Diagnosing => keys(bench, b"s"),
        Found::Loader | Found::LoaderBehindErrors => {
            let mut before = order.clone();
            before.flaw = None;
            bench.command(Command::Load(Box::new(before)));
            let limit = bench.now + LONGEST;
            bench.run_until(limit, |event| {
                matches!(event, axcon::session::Event::Progress(progress) if progress.records > 8)
                    || matches!(event, axcon::session::Event::Finished(_))
            });
            bench.unit.to_unit_mut().clear();
            bench.reconnect();
            bench.run_for(Duration::from_secs(1));
            if found == Found::LoaderBehindErrors {
                keys(bench, b"hello?\r\n");
            }
        }
    }
    bench.reconnect();
}

/// Counted from where the upload begins.
fn shifted(faults: &[Fault], by: u64) -> Vec<Fault> {
    faults.iter().map(|fault| Fault { at: fault.at + by, ..*fault }).collect()
}

/// The upload that runs into the faults. `None` if nobody was left to tell.
fn first_upload(bench: &mut Bench, order: &LoadOrder, interruption: Interruption) -> Option<LoadReport> {
    bench.command(Command::Load(Box::new(order.clone())));
    let is_over = |bench: &Bench| bench.session.job().is_none();
    match interruption {
        Interruption::None => {}
        Interruption::Power { at, off } => {
            bench.run_for(at);
            if !is_over(bench) {
                bench.power_cycle(off);
            }
        }
        Interruption::Cancel { at } => {
            bench.run_for(at);
            if !is_over(bench) {
                bench.command_again(Command::Cancel);
            }
        }
        Interruption::Kill { at } => {
            bench.run_for(at);
            if !is_over(bench) {
                bench.unit.to_unit_mut().clear();
                bench.reconnect();
                return None;
            }
        }
        Interruption::Cable { at } => {
            bench.run_for(at);
            if !is_over(bench) {
                bench.unit.to_unit_mut().clear();
                bench.lose_link();
            }
        }
    }
    match bench.outcome() {
        Outcome::Loaded(report) => Some(*report),
        other => panic!("an upload ended as {other:?}"),
    }
}

/// Runs seeds on all processors, each seed with its own story, and says what is wrong with the first few of which the
/// checker says this.
fn complaints(seeds: impl Iterator<Item = u64> + Send, flaw: Option<Flaw>, said: &str, enough: usize) -> Vec<String> {
    let seeds = Mutex::new(seeds);
    let next = || seeds.lock().expect("no panic").next();
    let found = Mutex::new(Vec::new());
    let workers = std::thread::available_parallelism().map_or(1, usize::from);
    std::thread::scope(|scope| {
        for _ in 0..workers {
            scope.spawn(|| {
                while let Some(seed) = next() {
                    if found.lock().expect("no panic").len() >= enough {
                        return;
                    }
                    let ran = std::panic::catch_unwind(|| run(seed, flaw));
                    // Not a complaint: the checker itself has come to nothing.
                    let ran = ran.unwrap_or_else(|_| panic!("a panic, AXCON_SEED={seed}: {}", Story::of(seed)));
                    if let Err(what) = ran
                        && what.contains(said)
                    {
                        let what = format!("{what}\n{}", Story::of(seed));
                        found.lock().expect("no panic").push(format!("AXCON_SEED={seed}: {what}"));
                    }
                }
            });
        }
    });
    found.into_inner().expect("no panic")
}

/// `AXCON_SEED=N cargo test --test it every_upload_of_the_swarm` replays a single one.
#[test]
fn every_upload_of_the_swarm_is_judged_truly_and_the_next_one_succeeds() {
    let number = |name: &str| std::env::var(name).ok().and_then(|text| text.parse::<u64>().ok());
    let first = number("AXCON_FIRST_SEED").unwrap_or(0);
    let seeds = match number("AXCON_SEED") {
        Some(seed) => seed..seed + 1,
        None => first..first + number("AXCON_SEEDS").unwrap_or(SEEDS),
    };
    let complaints = complaints(seeds, None, "", 20);
    assert!(complaints.is_empty(), "{}", complaints.join("\n\n"));
}

/// Seeds that found something once, beyond those that are usually run.
const FOUND: [u64; 1] = [
    // The line lost the end of the first line of a banner, and nine records went to the menu before it was looked at.
    798_296,
];

#[test]
fn every_upload_that_once_was_judged_wrongly_is_judged_truly() {
    let complaints = complaints(FOUND.into_iter(), None, "", FOUND.len());
    assert!(complaints.is_empty(), "{}", complaints.join("\n\n"));
}

#[test]
fn the_checker_notices_every_defect_that_real_senders_have() {
    for flaw in Flaw::ALL {
        // What is said of it, and the stories in which it can show.
        let (said, can_show): (&str, fn(&Story) -> bool) = match flaw {
            // A record has to be lost on the way, unnoticed.
            Flaw::BelievesTheLoader => ("a false success, and is ", |story| !story.to_unit.is_empty()),
            // A loader that keeps a page loses what was parked, one with a ring takes no LF, and one that keeps no more
            // than one record is overrun.
            Flaw::EndsAtOnce | Flaw::SendsCrLf | Flaw::IgnoresHolds => ("nothing disturbed it", Story::is_undisturbed),
            // Only as long as no record has come is there software that starts when the power is back; and few records
            // are packed ones.
            Flaw::SendsBehindErrors => ("records went to what is no loader", |story| {
                let is_early = matches!(story.interruption, Interruption::Power { at, .. } if at < EARLY);
                is_early && !story.packed && story.loader.pacing() == Pacing::Pages
            }),
        };
        let seeds = (0..).filter(|&seed| can_show(&Story::of(seed))).take(STORIES_OF_A_FLAW);
        let found = complaints(seeds, Some(flaw), said, 1);
        assert!(!found.is_empty(), "{flaw:?} goes unnoticed in {STORIES_OF_A_FLAW} stories");
    }
}
