//! Mutation testing with one build. `run` says how to use it, and what it does.

mod find;
mod schema;
mod tree;
mod trial;
mod values;

use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::io::Write;
use std::path::{Path, PathBuf};
use std::sync::Mutex;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::time::{Duration, Instant};

use anyhow::{Context, Result, ensure};
use tree::{Candidate, Tree};
use trial::{End, Test};

const WORKERS: usize = 2;
/// Tests that take no longer come before the others.
const QUICK: Duration = Duration::from_millis(200);
/// Tests that take longer are left out: a survivor would need them all.
const SLOWEST: Duration = Duration::from_secs(3);
/// What starting a program and a busy computer may cost, before a mutant is said to hang.
const GRACE: Duration = Duration::from_secs(8);

/// The steps in which a mutant is tried, the cheapest first.
const STEPS: [&str; 4] = ["what caught its neighbours", "tests of its module", "other quick tests", "slow tests"];

/// The stories about a module, next to its unit tests.
const STORIES: [(&str, &[&str]); 4] = [
    ("session", &["uploads", "talks", "stranger", "oddities", "foreigner"]),
    ("image", &["image_corpus", "image_files", "images"]),
    ("record", &["recordings"]),
    ("emulator", &["emulator", "faults", "uploads"]),
];

/// Tests that caught something in a file, and are tried first.
const RECENT: usize = 3;

fn main() -> Result<()> {
    let chosen: Vec<String> = std::env::args().skip(1).collect();
    ensure!(!chosen.is_empty(), "name folders or files, as src/image");
    let folder = PathBuf::from("target/mutants");
    fs::create_dir_all(&folder)?;
    let folder = folder.canonicalize()?;
    let mut tree = Tree::copy(&folder.join("tree"), &chosen)?;
    let total = tree.candidates.len();
    eprintln!("{total} candidates");

    let known = Lines::read(&folder.join("dropped.tsv"));
    let numbered = (0..).zip(&tree.candidates);
    tree.dropped = numbered.filter(|(_, one)| known.get(&one.unique_key()).is_some()).map(|(n, _)| n).collect();
    tree.drop_what_does_not_compile()?;
    let keys = tree.dropped.iter().map(|&number| tree.candidates[number as usize].unique_key() + "\tdropped\n");
    fs::write(folder.join("dropped.tsv"), keys.collect::<String>())?;

    let programs = tree.build()?;
    let mut tests = trial::list(&programs.unit, true)?;
    tests.extend(trial::list(&programs.stories, false)?);
    eprintln!("{} tests, each alone", tests.len());
    let tests = measured(tests, &folder)?;

    let mut viable: Vec<u32> = (0..total as u32).filter(|number| !tree.dropped.contains(number)).collect();
    // In no order that has to do with the code: whatever has been tried when the time is over is a fair sample.
    viable.sort_by_key(|number| number.wrapping_mul(0x9E37_79B1));
    eprintln!("{total} candidates, {} viable", viable.len());
    let verdicts = judged(&tree, &viable, &tests, &folder)?;
    report(&tree, &viable, &verdicts)
}

/// Each test with what it reaches. Those that fail without any mutant are named and left out.
fn measured(mut tests: Vec<Test>, folder: &Path) -> Result<Vec<Test>> {
    let queue = Mutex::new(tests.iter_mut());
    let failed = Mutex::new(Vec::new());
    std::thread::scope(|scope| {
        let workers: Vec<_> = (0..WORKERS)
            .map(|worker| {
                let (queue, failed) = (&queue, &failed);
                scope.spawn(move || -> Result<()> {
                    let notes = folder.join(format!("reached.{worker}"));
                    loop {
                        let next = queue.lock().expect("no worker panics").next();
                        let Some(test) = next else { return Ok(()) };
                        if !trial::measure(test, &folder.join("tree"), &notes)? {
                            failed.lock().expect("no worker panics").push(test.name.clone());
                        }
                    }
                })
            })
            .collect();
        workers.into_iter().try_for_each(|worker| worker.join().expect("no worker panics"))
    })?;
    let failed = failed.into_inner()?;
    for name in &failed {
        eprintln!("left out, since it fails without a mutant: {name}");
    }
    tests.retain(|test| !failed.contains(&test.name) && test.takes <= SLOWEST);
    tests.sort_by_key(|test| test.takes);
    Ok(tests)
}

/// What became of each mutant, also in `verdicts.tsv`; nothing for those that were not tried. What is there already is
/// not tried again, but for survivors where that is wanted.
fn judged(tree: &Tree, tried: &[u32], tests: &[Test], folder: &Path) -> Result<Vec<String>> {
    let path = folder.join("verdicts.tsv");
    let known = Lines::read(&path);
    let again = std::env::var_os("MUTANTS_AGAIN").is_some();
    let minutes: Option<u64> = std::env::var("MUTANTS_MINUTES").ok().map(|text| text.parse()).transpose()?;
    let end = minutes.map(|minutes| Instant::now() + Duration::from_secs(minutes * 60));
    let recent = Recent::default();
    let next = AtomicUsize::new(0);
    let verdicts = Mutex::new(vec![String::new(); tried.len()]);
    let file = Mutex::new(fs::OpenOptions::new().create(true).append(true).open(&path)?);
    std::thread::scope(|scope| {
        let workers: Vec<_> = (0..WORKERS)
            .map(|_| {
                scope.spawn(|| -> Result<()> {
                    loop {
                        let place = next.fetch_add(1, Ordering::Relaxed);
                        let Some(&number) = tried.get(place) else { return Ok(()) };
                        let candidate = &tree.candidates[number as usize];
                        let before = known.get(&candidate.unique_key());
                        let verdict = match before.filter(|verdict| !again || verdict.starts_with("caught")) {
                            Some(verdict) => verdict.to_owned(),
                            None if end.is_some_and(|end| end <= Instant::now()) => continue,
                            None => {
                                let verdict = judge(number, candidate, tests, &recent, &folder.join("tree"))?;
                                let line = format!("{}\t{verdict}\n", candidate.unique_key());
                                file.lock().expect("no worker panics").write_all(line.as_bytes())?;
                                verdict
                            }
                        };
                        if !verdict.starts_with("caught") && before.is_none() {
                            eprintln!("[{place}] {verdict}: {}", shown(candidate));
                        } else if place.is_multiple_of(100) {
                            eprintln!("[{place}]");
                        }
                        verdicts.lock().expect("no worker panics")[place] = verdict;
                    }
                })
            })
            .collect();
        workers.into_iter().try_for_each(|worker| worker.join().expect("no worker panics"))
    })?;
    Ok(verdicts.into_inner()?)
}

/// The tests that caught something last, by file, the last one first.
type Recent = Mutex<BTreeMap<String, Vec<String>>>;

/// "caught", step, how; "survived"; or "unreached".
fn judge(number: u32, candidate: &Candidate, tests: &[Test], recent: &Recent, tree: &Path) -> Result<String> {
    let module = candidate.file.split('/').nth(1).context("a file below src")?.trim_end_matches(".rs");
    let reaching: Vec<&Test> = tests.iter().filter(|test| test.reaches.contains(&number)).collect();
    if reaching.is_empty() {
        return Ok("unreached".into());
    }
    let first = recent.lock().expect("no worker panics").get(&candidate.file).cloned().unwrap_or_default();
    let stories = STORIES.iter().find(|(of, _)| *of == module).map_or(&[][..], |(_, stories)| stories);
    let step_of = |test: &Test| match test.name.split("::").next().unwrap_or_default() {
        _ if first.contains(&test.name) => 0,
        top if if test.is_unit { top == module } else { stories.contains(&top) } && test.takes <= QUICK => 1,
        _ if test.takes <= QUICK => 2,
        _ => 3,
    };
    for (step, name) in STEPS.iter().enumerate() {
        for is_unit in [true, false] {
            let part: Vec<&Test> =
                reaching.iter().filter(|test| test.is_unit == is_unit && step_of(test) == step).copied().collect();
            let Some(one) = part.first() else { continue };
            let names: Vec<&str> = part.iter().map(|test| test.name.as_str()).collect();
            let limit = GRACE + 6 * part.iter().map(|test| test.takes).sum::<Duration>();
            let number = number.to_string();
            let how = match trial::run(&one.program, &names, tree, ("MUTANT", &number), limit)? {
                End::Passed => continue,
                End::Failed(test) => {
                    let mut recent = recent.lock().expect("no worker panics");
                    let killers = recent.entry(candidate.file.clone()).or_default();
                    killers.retain(|killer| *killer != test);
                    killers.insert(0, test.clone());
                    killers.truncate(RECENT);
                    test
                }
                End::Crashed => "crash".into(),
                End::TimedOut => "hang".into(),
            };
            return Ok(format!("caught\t{name}\t{how}"));
        }
    }
    Ok("survived".into())
}

fn report(tree: &Tree, viable: &[u32], verdicts: &[String]) -> Result<()> {
    let equivalent = Lines::read(Path::new("tests/mutants/equivalent.tsv"));
    let mut counts: BTreeMap<String, usize> = BTreeMap::new();
    let mut used = BTreeSet::new();
    let mut left = Vec::new();
    for (&number, verdict) in viable.iter().zip(verdicts) {
        let candidate = &tree.candidates[number as usize];
        let mut words = verdict.split('\t');
        let kind = match (words.next(), words.next(), words.next()) {
            (Some(""), ..) => "not tried".to_owned(),
            (Some("caught"), Some(step), Some("hang" | "crash")) => format!("caught by {step}, hanging or crashing"),
            (Some("caught"), Some(step), _) => format!("caught by {step}"),
            (Some(survived), ..) if equivalent.get(&candidate.key()).is_none() => {
                left.push((number, survived));
                survived.to_owned()
            }
            _ => {
                used.insert(candidate.key());
                "equivalent".into()
            }
        };
        *counts.entry(kind).or_default() += 1;
    }
    left.sort_unstable();
    for &(number, survived) in &left {
        println!("{survived}: {}", shown(&tree.candidates[number as usize]));
    }
    println!();
    for (kind, count) in &counts {
        println!("{count:5} {kind}");
    }
    println!("{:5} not viable", tree.dropped.len());
    for key in equivalent.0.keys().filter(|key| !counts.contains_key("not tried") && !used.contains(*key)) {
        println!("no longer there, or caught: {key}");
    }
    ensure!(left.is_empty(), "mutants are left that no test notices");
    Ok(())
}

fn shown(candidate: &Candidate) -> String {
    let mutant = &candidate.mutant;
    format!("{}:{} {}: `{}` -> `{}`", candidate.file, mutant.line, mutant.function, mutant.original, mutant.mutated)
}

/// A file of lines, each a key and what is said of it. The last one counts.
struct Lines(BTreeMap<String, String>);

impl Lines {
    fn read(path: &Path) -> Self {
        let text = fs::read_to_string(path).unwrap_or_default();
        let is_unique = path.file_name().is_some_and(|name| name != "equivalent.tsv");
        let columns = if is_unique { 5 } else { 4 };
        let mut lines = BTreeMap::new();
        for line in text.lines().filter(|line| !line.is_empty() && !line.starts_with('#')) {
            if let Some((end, _)) = line.match_indices('\t').nth(columns - 1) {
                lines.insert(line[..end].to_owned(), line[end + 1..].to_owned());
            }
        }
        Lines(lines)
    }

    fn get(&self, key: &str) -> Option<&str> {
        self.0.get(key).map(String::as_str)
    }
}
