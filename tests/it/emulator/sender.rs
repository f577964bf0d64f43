//! The other end of a loader's line in these tests: records, and terminal programs of various manners.

use axcon::time::{Duration, Instant, character_time};

use super::{BAUD, Bench};

pub const S0: &str = "S0110000000050524F4752414D264441544196\r";
pub const S7: &str = "S70500000000FA\r";
/// Longer than any loader holds anybody: one that erases everything takes ten seconds.
const PATIENCE: Duration = Duration::from_secs(15);
/// Data bytes of one record, as CodeWarrior writes them.
const RECORD_BYTES: usize = 32;

/// A record of a type with four address bytes, followed by a CR.
pub fn record(digit: u8, address: u32, data: &[u8]) -> String {
    let mut bytes = vec![(data.len() + 5) as u8];
    bytes.extend(address.to_be_bytes());
    bytes.extend(data);
    let sum = bytes.iter().fold(0u8, |sum, byte| sum.wrapping_add(*byte));
    bytes.push(!sum);
    let digits: String = bytes.iter().map(|byte| format!("{byte:02X}")).collect();
    format!("S{digit}{digits}\r")
}

pub fn s3(address: u32, data: &[u8]) -> String {
    record(3, address, data)
}

/// S3 records for a whole program, words from address 0 on.
pub fn data_records(program: &[u8], bytes: usize) -> Vec<String> {
    let numbered = program.chunks(bytes).enumerate();
    numbered.map(|(number, data)| s3((number * bytes / 2) as u32, data)).collect()
}

/// A complete file.
pub fn file(program: &[u8]) -> Vec<String> {
    let mut records = vec![S0.to_owned()];
    records.extend(data_records(program, RECORD_BYTES));
    records.push(S7.to_owned());
    records
}

/// A sender that obeys like a terminal program: after XOFF nothing but the character on its way, and before S7 it waits
/// until the loader is idle. Ends with the file, with a unit that holds it for longer than [`PATIENCE`], or at `until`.
pub fn send_obeying(bench: &mut Bench, records: &[String], until: Instant) {
    let character = character_time(BAUD);
    for record in records {
        if record.starts_with("S7") {
            bench.run_ms(1);
        }
        for byte in record.bytes() {
            let give_up = bench.now + PATIENCE;
            while bench.is_stopped() && bench.now < give_up && bench.now < until {
                bench.run(Duration::from_micros(100));
            }
            if bench.now >= until {
                return;
            }
            bench.send(&[byte]);
            bench.run(character);
        }
    }
}

/// Sends and gives what the unit has said until half a second later.
pub fn upload(bench: &mut Bench, records: &[String]) -> String {
    send_obeying(bench, records, Instant::NEVER);
    bench.run_ms(500);
    bench.take()
}

/// Sends without any regard for what the unit says.
pub fn talk_over(bench: &mut Bench, text: &str) -> String {
    bench.send(text.as_bytes());
    bench.run(Duration::from_micros(87) * text.len() as u32);
    bench.run_ms(500);
    bench.take()
}

pub fn without_flow_control(text: &str) -> String {
    text.replace(['\x11', '\x13'], "")
}
