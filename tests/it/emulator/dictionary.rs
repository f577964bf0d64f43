//! The object dictionary of a unit that runs: what the network reads and writes, what is kept, and what V halts.

use axcon::canopen::Abort;
use axcon::device::Product;
use axcon::emulator::knob::Knob;
use axcon::emulator::{NetworkState, NmtCommand, Refusal};
use axcon::wire::stream::{Reading, Row};

use super::{Bench, Setup};

const PRODUCTS: [&str; 2] = ["AXTC4CO", "AXRTD8CO"];

/// A unit whose first values are there.
fn measuring(name: &str) -> Bench {
    let mut bench = Bench::of(name, 0);
    bench.run_ms(7_000);
    bench
}

// B-001, B-002, B-004, B-008, B-009, B-1, B-2, B-3, B-6, B-7, B-94, B-93, B-044, B-043, B-040, B-67
#[test]
fn a_unit_from_the_factory_reads_as_its_manual_prints_it() {
    for name in PRODUCTS {
        let mut bench = measuring(name);
        let product = Product::named(name).expect("built in");
        for (at, object, entry) in product.dictionary.entries() {
            let now = bench.now;
            let value = bench.unit().read_object(now, at).unwrap_or_else(|refusal| panic!("{name} {at}: {refusal}"));
            let live = matches!(at.index, 0x1018 | 0x1020 | 0x2000..=0x2100 | 0x2130 | 0x3100 | 0x3130 | 0x5000..=0x5001)
                || matches!(at.index, 0x6100 | 0x7130);
            if let Some(default) = entry.default.filter(|_| !live) {
                assert_eq!(value, default.on_node(127), "{name} {at} {}", object.name);
            }
            assert_eq!(value.data_type(), entry.data_type);
        }
        let expected = [
            ("1000", f64::from(0x1002_0194)),
            ("1002", 0.0),
            ("1018:0", 4.0),
            ("1018:1", f64::from(0x55)),
            ("1018:2", f64::from(product.can.product_code)),
            ("1400:1", f64::from(0xC000_027Fu32)),
            ("1403:1", f64::from(0xC000_057Fu32)),
            ("1600:0", 0.0),
            ("1800:1", f64::from(0x4000_01FF)),
            ("1801:1", f64::from(0x4000_02FF)),
            ("1A00:1", f64::from(0x7130_0110)),
            ("1A00:0", 4.0),
        ];
        for (entry, value) in expected {
            assert_eq!(bench.read(entry), Ok(value), "{name} {entry}");
        }
        assert!(bench.read("5000").is_ok_and(|volts| (20.0..30.0).contains(&volts)), "the supply in V");
        assert_eq!((bench.unit().settings().node_id, bench.unit().settings().kbps), (127, 125));
    }
    let mut tc4 = measuring("AXTC4CO");
    for (entry, value) in [
        ("1802:1", 0xC000_03FFu32),
        ("1803:1", 0xC000_04FF),
        ("1A01:1", 0x2130_0110),
        ("1A01:2", 0x2130_0210),
        ("1A01:3", 0x2130_0310),
        ("1A01:4", 0x3130_0010),
        ("1A02:0", 0),
        ("1800:5", 1_000),
        ("1801:5", 0),
        ("1802:5", 0),
    ] {
        assert_eq!(tc4.read(entry), Ok(f64::from(value)), "{entry}");
    }
    let mut rtd8 = measuring("AXRTD8CO");
    for (entry, value) in [
        ("1803:1", 0x4000_04FFu32),
        ("1A01:1", 0x7130_0510),
        ("1A02:0", 3),
        ("1A02:1", 0x2130_0110),
        ("1A02:3", 0x2130_0310),
        ("1A03:0", 2),
        ("1A03:2", 0x5001_0020),
        ("1802:5", 1_000),
        ("1803:5", 0),
        ("6114:8", 900),
    ] {
        assert_eq!(rtd8.read(entry), Ok(f64::from(value)), "{entry}");
    }
}

// B-003, B-8
#[test]
fn the_network_is_refused_with_the_reason() {
    for name in PRODUCTS {
        let mut bench = measuring(name);
        assert_eq!(bench.read("1005"), Err(Refusal::Abort(Abort::NoSuchObject)));
        assert_eq!(bench.read("6100:9"), Err(Refusal::Abort(Abort::NoSuchEntry)));
        assert_eq!(bench.write("6100:1", 1.0), Err(Refusal::Abort(Abort::ReadOnly)));
        assert_eq!(bench.write("1017", 5.0), Err(Refusal::Abort(Abort::TooLow)));
        assert_eq!(bench.write("5010", 55.0), Err(Refusal::Abort(Abort::ValueRange)));
    }
}

// B-150, B-151, B-153, B-157, B-112, B-113, B-114, B-118
#[test]
fn changes_act_at_once_and_stay_only_if_they_are_saved() {
    for name in PRODUCTS {
        let mut bench = measuring(name);
        assert_eq!(bench.write("6126:1", 18.0), Ok(()));
        assert_eq!(bench.read("6126:1"), Ok(18.0));
        bench.power_off();
        bench.run_ms(200);
        bench.power_on();
        bench.run_ms(1_000);
        assert_eq!(bench.read("6126:1"), Ok(16.0), "{name}: not saved");
        assert_eq!(bench.write("6126:1", 18.0), Ok(()));
        bench.save();
        bench.power_off();
        bench.run_ms(200);
        bench.power_on();
        bench.run_ms(1_000);
        assert_eq!(bench.read("6126:1"), Ok(18.0), "{name}: saved");
        assert_eq!(bench.write("1011:1", f64::from(0x6461_6F6C)), Ok(()));
        assert_eq!(bench.read("6126:1"), Ok(18.0), "{name}: restored at the next reset");
        bench.nmt(NmtCommand::ResetNode);
        bench.run_ms(1_000);
        assert_eq!(bench.read("6126:1"), Ok(16.0), "{name}: after it");
    }
    let mut rtd8 = measuring("AXRTD8CO");
    for (entry, number) in [("3000:2", 0.0), ("3010:2", 3.9), ("3020:2", -5.0), ("3030:2", -4.0)] {
        assert_eq!(rtd8.write(entry, number), Ok(()));
    }
    rtd8.save();
    rtd8.power_off();
    rtd8.power_on();
    rtd8.run_ms(1_000);
    assert_eq!((rtd8.read("3000:2"), rtd8.read("3030:2")), (Ok(0.0), Ok(-4.0)), "the user's own constants");
}

#[test]
fn a_unit_keeps_its_serial_number_with_its_memory_whatever_the_seed() {
    for name in PRODUCTS {
        let number = |bench: &mut Bench| bench.read("1018:4").expect("it runs");
        let mut bench = Bench::of(name, 0);
        let first = number(&mut bench);
        let made_with = |seed, parameters| {
            let product = Product::named(name).expect("built in");
            let mut bench = Bench::of(name, 0);
            let flash = bench.unit().flash().to_vec();
            let loader = product.loader.kind;
            let mut bench = Bench::new(Setup { product, loader, seed, dialect: 0, flash, parameters });
            bench.run_ms(500);
            bench
        };
        let parameters = bench.unit().parameters().to_vec();
        assert_eq!(number(&mut made_with(2, parameters)), first, "{name}");
        let mut other = made_with(2, Vec::new());
        assert_ne!(number(&mut other), first, "{name}: another unit");
        other.keys(b"dYes\r");
        other.run_ms(1_000);
        assert_eq!(number(&mut other), number(&mut made_with(2, Vec::new())), "{name}: no default touches it");
    }
}

// Errata E-93, E-G4.
#[test]
fn a_reset_of_communication_brings_back_what_is_kept_of_it_and_nothing_else() {
    for name in PRODUCTS {
        let mut bench = measuring(name);
        assert_eq!((bench.write("1017", 500.0), bench.write("100C", 70.0)), (Ok(()), Ok(())));
        bench.save();
        for (entry, number) in [("1017", 900.0), ("1801:5", 250.0), ("6126:1", 18.0), ("4030:1", 0.0)] {
            assert_eq!(bench.write(entry, number), Ok(()), "{entry}");
        }
        let period = if name == "AXTC4CO" { 0.0 } else { 1_000.0 };
        bench.nmt(NmtCommand::ResetCommunication);
        let found = ["1017", "100C", "1801:5", "1010:1", "6126:1", "4030:1"].map(|entry| bench.read(entry));
        assert_eq!(found, [500.0, 70.0, period, 1.0, 18.0, 0.0].map(Ok), "{name}");
    }
}

// B-028, B-027, B-109, B-108, B-026
#[test]
fn the_node_starts_by_itself_if_it_was_told_to() {
    for name in PRODUCTS {
        let mut bench = measuring(name);
        bench.run_ms(60_000);
        assert_eq!(bench.unit().network_state(), Some(NetworkState::PreOperational), "{name}: never by itself");
        assert_eq!(bench.write("5555", 1.0), Ok(()));
        bench.save();
        bench.power_off();
        bench.power_on();
        bench.run_ms(5_000);
        assert_eq!(bench.unit().network_state(), Some(NetworkState::PreOperational), "{name}: not before 5 s");
        bench.run_ms(100);
        assert_eq!(bench.unit().network_state(), Some(NetworkState::Operational), "{name}");
    }
}

// Errata E-110: after the view the node is pre-operational.
#[test]
fn a_start_that_is_due_while_the_view_is_open_comes_later() {
    for name in PRODUCTS {
        let mut bench = measuring(name);
        assert_eq!(bench.write("5555", 1.0), Ok(()));
        bench.save();
        bench.power_off();
        bench.power_on();
        bench.run_ms(3_000);
        bench.keys(b"v");
        bench.run_ms(20_000);
        bench.keys(b"x");
        bench.run_ms(1_500);
        assert_eq!(bench.unit().network_state(), Some(NetworkState::PreOperational), "{name}");
        bench.run_ms(500);
        assert_eq!(bench.unit().network_state(), Some(NetworkState::Operational), "{name}: 5 s without the view");
    }
}

// B-008, B-17: the supply has nothing to do with the converters of the inputs, which have to settle.
#[test]
fn the_supply_is_known_from_the_start_and_nothing_else_is() {
    for (name, unread) in [("AXTC4CO", ["6100:1", "3100"]), ("AXRTD8CO", ["2000:1", "5001"])] {
        let mut bench = measuring(name);
        bench.power_off();
        bench.power_on();
        bench.run_ms(60);
        assert!(bench.read("5000").is_ok_and(|volts| (20.0..30.0).contains(&volts)), "{name}");
        for entry in unread {
            assert!(bench.read(entry).is_ok_and(f64::is_nan), "{name} {entry}");
        }
        bench.turn(Knob::Supply(Some(12.5)));
        bench.run_ms(300);
        assert_eq!(bench.read("5000"), Ok(12.5), "{name}: read with every scan");
    }
}

// B-199, B-186: scanning is halted, so nothing becomes valid meanwhile.
#[test]
fn a_view_that_is_opened_before_the_first_data_puts_them_off() {
    for (name, first_data_ms) in [("AXTC4CO", 3_000), ("AXRTD8CO", 5_000)] {
        let layout = &Product::named(name).expect("built in").stream;
        let rows = |text: &str| text.lines().filter_map(|line| layout.parse(line)).collect::<Vec<Row>>();
        let mut bench = Bench::of(name, 0);
        bench.keys(b"tf100\r");
        bench.keys(b"v");
        bench.run_ms(10_000);
        bench.keys(b"x");
        bench.nmt(NmtCommand::Start);
        bench.run_ms(1_000);
        assert_eq!(rows(&bench.take()), [], "{name}");
        assert_eq!(bench.unit().network_state(), Some(NetworkState::PreOperational), "{name}");
        bench.run_ms(first_data_ms);
        let rows = rows(&bench.take());
        assert!(rows.len() > 10, "{name}: {}", rows.len());
        let is_number = |reading: &Reading| matches!(reading, Reading::Value(celsius) if *celsius > 20.0);
        assert!(rows.iter().all(|row| row.readings.iter().all(is_number)), "{name}: {rows:?}");
    }
}

// B-126, B-127, B-84, B-83
#[test]
fn errors_move_the_node_as_1029h_says() {
    for (name, class) in [("AXTC4CO", "1029:2"), ("AXRTD8CO", "1029:2")] {
        for (reaction, expected) in
            [(1.0, NetworkState::Operational), (0.0, NetworkState::PreOperational), (2.0, NetworkState::Stopped)]
        {
            let mut bench = measuring(name);
            assert_eq!(bench.write(class, reaction), Ok(()));
            bench.nmt(NmtCommand::Start);
            bench.turn(Knob::Open(1, None));
            bench.run_ms(3_000);
            assert_eq!(bench.unit().network_state(), Some(expected), "{name} with {reaction}");
        }
    }
    let mut frozen = measuring("AXRTD8CO");
    frozen.nmt(NmtCommand::Start);
    frozen.turn(Knob::Freeze(true));
    frozen.run_ms(4_000);
    assert_eq!(frozen.unit().network_state(), Some(NetworkState::PreOperational), "a scanner error's default");
    let mut slow = measuring("AXTC4CO");
    assert_eq!(slow.write("1029:2", 2.0), Ok(()));
    slow.nmt(NmtCommand::Start);
    slow.turn(Knob::Temperature(1, 200.0));
    slow.run_ms(4_500);
    assert_eq!(slow.unit().network_state(), Some(NetworkState::Operational), "not before the reaction delay");
    slow.run_ms(1_000);
    assert_eq!(slow.unit().network_state(), Some(NetworkState::Stopped));
    assert_eq!(slow.read("1001"), Err(Refusal::NoAnswer), "a stopped node answers no SDO");
}

// B-113, B-73, B-110, B-70
#[test]
fn the_list_of_errors_is_emptied_by_the_network() {
    for name in PRODUCTS {
        let mut bench = measuring(name);
        bench.turn(Knob::Open(2, None));
        bench.run_ms(3_000);
        assert_eq!((bench.read("1003:0"), bench.read("1001")), (Ok(1.0), Ok(1.0)));
        assert_eq!(bench.read("1003:1"), Ok(f64::from(0x0202_F001)));
        assert_eq!(bench.write("1003:0", 0.0), Ok(()));
        bench.run_ms(1_000);
        assert_eq!((bench.read("1003:0"), bench.read("1001"), bench.read("6150:2")), (Ok(0.0), Ok(1.0), Ok(3.0)));
        bench.turn(Knob::Repair(2));
        bench.run_ms(2_000);
        assert_eq!(bench.read("1001"), Ok(0.0));
    }
}

// B-186, B-187, B-185, B-132, B-133
#[test]
fn the_view_shows_active_values_and_halts_scanning_and_can() {
    for name in PRODUCTS {
        let mut bench = measuring(name);
        assert_eq!(bench.write("6126:1", 18.0), Ok(()));
        bench.turn(Knob::Temperature(1, 50.0));
        bench.run_ms(2_000);
        bench.keys(b"v");
        bench.turn(Knob::Temperature(1, 90.0));
        bench.run_ms(3_000);
        bench.take();
        assert_eq!(bench.read("6100:1"), Err(Refusal::NoAnswer));
        assert_eq!(bench.write("6126:1", 1.0), Err(Refusal::NoAnswer));
        bench.nmt(NmtCommand::Start);
        let mut objects = 0;
        loop {
            let text = bench.keys(b"\r");
            objects += 1;
            assert!(objects < 100, "the walk has an end");
            if text.contains("6100h") {
                assert!(text.contains("= 50.0") || text.contains("= 49.9"), "{name}: frozen: {text}");
            }
            if text.contains("6126h") {
                assert!(text.contains("= 18.000"), "{name}: the active value: {text}");
            }
            if text.contains("7130h") {
                break;
            }
        }
        assert_eq!(objects, if name == "AXTC4CO" { 39 } else { 40 }, "every object but the PDOs' 16");
        bench.keys(b"X");
        bench.run_ms(2_000);
        assert_eq!(bench.unit().network_state(), Some(NetworkState::PreOperational));
        assert!(bench.read("6100:1").is_ok_and(|celsius| (celsius - 90.0).abs() < 0.1), "{name}: goes on");
    }
}
