//! How fast image files are checked, and in how much memory; beside it other tools on the same file.
//!
//! MB of text per CPU-second and the largest resident memory. Each measurement is a process of its own, so that its memory
//! is its own. Tools that are not installed are left out.

use std::fs::File;
use std::io::{BufWriter, Write};
use std::path::Path;
use std::process::{Command, Stdio};

use axcon::device::Product;
use axcon::image::srecord::{self, Kind, Record};
use axcon::image::{self, AddressUnit, Block, Format, Image, LineEnd, Shape, Target};

use crate::support::median;
use crate::table::{Goal, Row, Table};

/// Names the file in the process that measures.
pub const FILE: &str = "AXCON_BENCH_IMAGE";

/// Text of the file.
const SIZE: usize = 160_000_000;
/// MB of text per CPU-second, and MiB resident.
const SPEED: Goal = Goal::at_least(400.0);
const MEMORY: Goal = Goal::at_most(8.0);
/// Checks whose median counts. The others are slow, and run once.
const ROUNDS: usize = 5;

pub fn run(table: &mut Table) {
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("image");
    let myself = std::env::current_exe().expect("a name");
    println!("{:<28} {:>10} {:>10} {:>10}", "160 MB of text", "MB/CPU s", "MiB", "x ours");
    for (name, intel) in [("S-records", false), ("Intel HEX", true)] {
        write(&path, intel).expect("written");
        let measured: Option<Vec<(f64, f64)>> =
            (0..ROUNDS).map(|_| of_process(Command::new(&myself).env(FILE, &path))).collect();
        let Some(measured) = measured else {
            table.push(Row::not_measured(format!("check of {name}"), SPEED, "no /proc to ask"));
            continue;
        };
        let (mut speeds, memories): (Vec<f64>, Vec<f64>) = measured.into_iter().unzip();
        let (speed, memory) = (median(&mut speeds), memories.into_iter().fold(0.0, f64::max));
        println!("{name:<28} {speed:>10.0} {memory:>10.1} {:>10.2}", 1.0);
        for (tool, mut command) in others(&path, intel) {
            match of_process(&mut command) {
                Some((theirs, memory)) => {
                    println!("  {tool:<26} {theirs:>10.1} {memory:>10.1} {:>10.3}", theirs / speed);
                }
                None => println!("  {tool:<26} {:>10}", "not there"),
            }
        }
        table.push(Row::new(format!("check of {name}, per CPU-second"), SPEED, speed, "MB/s"));
        table.push(Row::new(format!("check of {name}, resident"), MEMORY, memory, "MiB"));
    }
}

/// What other people read such a file with.
fn others(path: &Path, intel: bool) -> [(&'static str, Command); 3] {
    let command = |program: &str, args: &[&str]| {
        let mut command = Command::new(program);
        command.args(args).arg(path);
        command
    };
    let mut srec_info = Command::new("srec_info");
    srec_info.arg(path).arg(if intel { "-intel" } else { "-motorola" });
    let mut objcopy = command("objcopy", &["-I", if intel { "ihex" } else { "srec" }, "-O", "binary"]);
    objcopy.arg("/dev/null");
    let python = std::env::var("AXCON_TEST_PYTHON").unwrap_or_else(|_| "python3".into());
    let reads = "import bincopy, sys; bincopy.BinFile().add_file(sys.argv[1], overwrite=True)";
    [("srec_info", srec_info), ("objcopy", objcopy), ("bincopy", command(&python, &["-c", reads]))]
}

/// Checks the file: what is measured.
pub fn measure(path: &Path) {
    let targets: Vec<Target> = Product::all().iter().map(Product::target).collect();
    let report = image::check(File::open(path).expect("the file"), None, &targets, None, &[]).expect("readable");
    assert!(report.facts.records > 1_000_000);
}

/// Runs a process; MB of the file per second of its CPU time, and its largest resident memory in MiB. `None` if it is
/// not there or fails.
fn of_process(command: &mut Command) -> Option<(f64, f64)> {
    let mut child = command.stdout(Stdio::null()).stderr(Stdio::null()).spawn().ok()?;
    // What the system says of a process that has ended and is not waited for yet is gone, so it is asked all along.
    let (mut memory, mut ticks) = (0.0f64, 0.0f64);
    let status = loop {
        if let Some(kib) = resident(child.id()) {
            memory = memory.max(kib / 1024.0);
        }
        ticks = cpu_ticks(child.id()).unwrap_or(ticks);
        if is_zombie(child.id()) {
            break child.wait().ok()?;
        }
        std::thread::sleep(std::time::Duration::from_millis(2));
    };
    (status.success() && ticks > 0.0).then(|| (SIZE as f64 / 1e6 / (ticks / TICKS_PER_SECOND), memory))
}

fn resident(process: u32) -> Option<f64> {
    let status = std::fs::read_to_string(format!("/proc/{process}/status")).ok()?;
    status.lines().find_map(|line| line.strip_prefix("VmHWM:"))?.split_whitespace().next()?.parse().ok()
}

/// Fields of the process' state behind its name, which may hold blanks.
fn state(process: u32) -> Option<Vec<String>> {
    let stat = std::fs::read_to_string(format!("/proc/{process}/stat")).ok()?;
    Some(stat.rsplit_once(')')?.1.split_whitespace().map(str::to_owned).collect())
}

fn cpu_ticks(process: u32) -> Option<f64> {
    let fields = state(process)?;
    Some(fields.get(11)?.parse::<f64>().ok()? + fields.get(12)?.parse::<f64>().ok()?)
}

fn is_zombie(process: u32) -> bool {
    state(process).is_none_or(|fields| fields.first().is_some_and(|state| state == "Z"))
}

/// Linux counts CPU time in hundredths of a second.
const TICKS_PER_SECOND: f64 = 100.0;

/// The same 64 K words over and over, in ascending order, as a file that is far too large would have them.
fn write(path: &Path, intel: bool) -> std::io::Result<()> {
    let mut file = BufWriter::new(File::create(path)?);
    let data: Vec<u8> = (0..32).map(|at| at * 7).collect();
    let mut lines = Vec::new();
    if intel {
        let blocks = (0..0x1000).map(|at| Block { address: at * 16, data: data.clone() }).collect();
        let image = Image { header: Vec::new(), blocks, entry: 0, address_unit: AddressUnit::Word };
        let unit = AddressUnit::Word;
        let shape = Shape { format: Format::IntelHex, address_unit: unit, record_bytes: None, line_end: LineEnd::CrLf };
        lines = image::convert(&image, &shape).expect("expressible");
        let end = b":0400000500000000F7\r\n:00000001FF\r\n".len();
        lines.truncate(lines.len() - end);
    } else {
        srecord::write_header(b"PROGRAM&DATA", &mut lines);
        lines.extend(b"\r\n");
        file.write_all(&lines)?;
        lines.clear();
        for at in 0..0x1000 {
            Record { kind: Kind::Data32, address: at * 16, data: &data }.write(&mut lines);
            lines.extend(b"\r\n");
        }
    }
    for _ in 0..SIZE.div_ceil(lines.len()) {
        file.write_all(&lines)?;
    }
    file.write_all(if intel { b":00000001FF\r\n" } else { b"S70500000000FA\r\n" })?;
    file.flush()
}
