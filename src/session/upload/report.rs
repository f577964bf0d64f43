//! What an upload reports: its progress, how it ended, and what to do next.
//!
//! The words of a report are for a user who has to act on it and cannot see the unit; the evidence for them is gathered
//! in `telling.rs`. Nothing here decides anything.

use crate::image::DefectId;
use crate::time::Duration;
use crate::version::Version;

/// How far an upload is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Progress {
    /// What is being done.
    pub phase: Phase,
    /// Records the unit must have taken, header and terminator included.
    pub records: usize,
    /// Records in all.
    pub records_total: usize,
    /// Characters the unit must have taken.
    pub bytes: usize,
    /// Characters in all.
    pub bytes_total: usize,
    /// Program address of the record last sent, in the image's unit.
    pub address: u32,
    /// Time since the first record left.
    pub elapsed: Duration,
    /// Time since the unit had taken the first data. After the header a loader may erase for ten seconds, which says
    /// nothing about the rate at which it takes data.
    pub moving: Duration,
    /// Characters it has taken since then.
    pub moved: usize,
    /// How long the unit has held us by XOFF, if it does.
    pub held: Option<Duration>,
    /// Everything is being sent once more: the loader has shown that it had lost something. The counts are those of the
    /// second pass, and begin at 0.
    pub again: bool,
}

impl Progress {
    /// Characters per second since the first data; 0 before.
    pub fn rate(&self) -> f64 {
        let seconds = self.moving.as_secs_f64();
        if seconds > 0.0 { self.moved as f64 / seconds } else { 0.0 }
    }

    /// Time until all characters have been taken, where that can be told.
    pub fn eta(&self) -> Option<Duration> {
        let rest = self.bytes_total.saturating_sub(self.bytes) as f64;
        let rate = self.rate();
        // At less than a character per second the unit is holding us, for an unknown time.
        (rate >= 1.0).then(|| Duration::from_secs_f64(rest / rate))
    }
}

/// Steps of an upload, in their order.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Phase {
    /// Finding out who is there and whether the image is for it.
    Check,
    /// Asking for the loader: L, password, reset.
    EnterLoader,
    /// The loader erases all of its flash after the header; only g3 does so.
    Erase,
    /// Records are on their way.
    Transfer,
    /// The terminator has been sent: the loader finishes, and the unit has to come back.
    Finish,
    /// The unit is back; it has to name the image's product and version.
    Verify,
}

/// How an upload ended, what is true of the unit now, and on what evidence.
#[derive(Clone, Debug, PartialEq)]
pub struct LoadReport {
    /// The verdict.
    pub verdict: Verdict,
    /// What a success rests on.
    pub proof: Proof,
    /// The step in which it ended.
    pub phase: Phase,
    /// What is at the other end now.
    pub unit: UnitNow,
    /// The unit was found waiting in its loader: which software it had was unknown from the beginning.
    pub found_in_loader: bool,
    /// The password has been sent to the unit.
    pub password_sent: bool,
    /// Product, as far as known.
    pub product: Option<String>,
    /// Version before, if the unit said it.
    pub version_before: Option<Version>,
    /// Version after, from the new banner only.
    pub version_after: Option<Version>,
    /// Records sent, header and terminator included.
    pub records: usize,
    /// Records in all.
    pub records_total: usize,
    /// Address of the data record last sent, in the image's unit.
    pub address: Option<u32>,
    /// From the first record to the end.
    pub duration: Duration,
    /// What happened, in one sentence.
    pub what: String,
    /// The text the verdict rests on, as printed (control characters made visible), shortened.
    pub heard: String,
    /// Why the image does not fit this unit, if it was refused for that; `--allow` takes this name.
    pub misfit: Option<DefectId>,
    /// Which assumption about the loader has turned out to be wrong, in one sentence.
    pub remark: Option<String>,
}

/// How long a loader can be silent at most while it is sent a file: it stops its sender for each page, several times a
/// second, and may take two seconds to start over.
pub const SILENT: Duration = Duration::from_millis(2500);

/// What to do about a unit that has part of the file and is not heard any more ([`LoadReport::doubt`]).
pub const SEE_POWER: &str = "see that it has power and that the cable is in, and send the file again: it has no complete \
                             software and comes back to its loader";

impl LoadReport {
    /// Whether the unit has part of the file and was last known in its loader. If it has been silent for [`SILENT`], it
    /// may just as well be without power.
    pub fn left_in_the_middle(&self) -> bool {
        self.verdict == Verdict::Failed && self.unit == UnitNow::Loader && self.records > 0
    }

    /// What can be said of a unit that was left in the middle of the file and is not heard any more, because its link
    /// is lost or it is silent; to follow "the unit is". The advice is then [`SEE_POWER`] instead of
    /// [`LoadReport::advice`]. `None` if what the report says of the unit still holds.
    pub fn doubt(&self, is_lost: bool, is_silent: bool) -> Option<&'static str> {
        match (is_lost, is_silent) {
            _ if !self.left_in_the_middle() => None,
            // Without a link it cannot be known whether the unit is silent.
            (true, _) => Some("in its loader, or without power"),
            (false, true) => Some("silent: in its loader, or without power"),
            (false, false) => None,
        }
    }

    /// What the user should do now, depending on the state of the unit. It begins in lower case, to follow other words.
    pub fn advice(&self) -> &'static str {
        match (self.verdict, self.unit) {
            (Verdict::Done, _) if self.proof == Proof::Missing => {
                "compare what the unit says it runs with what you meant to send: the file itself does not say what it is"
            }
            (Verdict::Done, _) => "nothing: the unit runs what was sent",
            (Verdict::WrongApplication, _) => {
                "do not put the unit into service: compare its version with the file's and send the right one; if it \
                 comes out the same, keep the recording"
            }
            (Verdict::Refused, _) if self.product.is_none() => {
                "look at the label of the unit and say which product it is"
            }
            (Verdict::Refused, _) if self.misfit == Some(DefectId::Downgrade) => {
                "nothing was changed: take newer software, unless the old one is wanted"
            }
            (Verdict::Refused, _) => "nothing was changed: take the file that is made for this unit",
            (Verdict::UnitRefused, UnitNow::Application) if !self.password_sent => {
                "the unit runs what it ran, and has got no password: look at what it says, then try again"
            }
            (Verdict::UnitRefused, UnitNow::Application) => {
                "the unit runs what it ran: check the password, capital and small letters count, and try again"
            }
            (Verdict::NoAnswer, UnitNow::Application) => {
                "nothing was changed: no password was sent, and the question was left with Enter; press L in a terminal to \
                 see what the unit asks, and keep the recording"
            }
            (Verdict::NoAnswer, _) => "nothing was changed: look at power, cable and port, then try again",
            (_, UnitNow::Loader) if self.records == 0 && self.found_in_loader => {
                "nothing was sent: the unit waits in its loader, as it was found; send the file"
            }
            (_, UnitNow::Loader) if self.records == 0 => {
                "nothing was sent: the unit waits in its loader with the software it had; send the file, or switch the \
                 unit off and on"
            }
            (_, UnitNow::Loader) if self.phase == Phase::Finish && self.records == self.records_total => {
                "send the file again, since its end may have been lost on the line; if it is taken and not started once more, it \
                 is not made for this unit: 'axcon image info' says what it is"
            }
            (_, UnitNow::Loader) => {
                "keep the unit powered and send the file again: it waits in its loader and has no complete software; a \
                 power cycle does no harm, it comes back to the loader"
            }
            (_, UnitNow::Application) if self.records == 0 => {
                "the unit runs its software: nothing was changed, try again"
            }
            (_, UnitNow::Application) => {
                "the unit runs software again, and whether parts of its flash were changed is not known: send the file \
                 again before it goes into service"
            }
            (_, UnitNow::Unknown) => {
                "switch the unit off and on, then send again: what it says at power-up tells whether software runs or a \
                 loader waits"
            }
        }
    }
}

/// What shows that the unit runs what was sent.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Proof {
    /// Its new banner, which has to name product and version of the image.
    Banner,
    /// Nothing: the image has no identity that a banner could be compared with.
    Missing,
}

/// Verdict on an upload.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Verdict {
    /// The unit runs the image: its new banner says so. For an image that does not say what it is, the banner says what
    /// the unit runs, and nothing more is known.
    Done,
    /// Refused before anything was changed: wrong product, or product unknown.
    Refused,
    /// The unit refused: wrong password, or it did not leave the menu.
    UnitRefused,
    /// No answer, or a question in words that are not understood; only the request was sent.
    NoAnswer,
    /// The upload failed.
    Failed,
    /// The unit runs, but its banner names another product or version than the image.
    WrongApplication,
    /// Cancelled.
    Interrupted,
}

/// The state of a unit after an upload.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum UnitNow {
    /// The application runs.
    Application,
    /// It waits in its loader for a file.
    Loader,
    /// Not known.
    Unknown,
}

#[cfg(test)]
mod tests {
    use super::*;

    fn report(verdict: Verdict, unit: UnitNow, records: usize) -> LoadReport {
        LoadReport {
            verdict,
            proof: Proof::Banner,
            phase: Phase::Transfer,
            unit,
            product: Some("AXTC4CO".into()),
            version_before: None,
            version_after: None,
            records,
            records_total: 3074,
            address: None,
            duration: Duration::ZERO,
            what: String::new(),
            heard: String::new(),
            found_in_loader: false,
            password_sent: true,
            misfit: None,
            remark: None,
        }
    }

    #[test]
    fn before_anything_was_sent_nobody_is_told_that_the_software_is_gone() {
        let early = report(Verdict::Interrupted, UnitNow::Loader, 0).advice();
        assert!(early.starts_with("nothing was sent") && !early.contains("no complete software"), "{early}");
        let late = report(Verdict::Interrupted, UnitNow::Loader, 1).advice();
        assert!(late.contains("no complete software"), "{late}");
    }

    #[test]
    fn each_end_of_an_upload_has_advice_that_fits_it() {
        let advice = |report: LoadReport| report.advice().split([':', ';']).next().unwrap_or_default().to_owned();
        let done = || report(Verdict::Done, UnitNow::Application, 3074);
        assert_eq!(advice(done()), "nothing");
        let unproven = LoadReport { proof: Proof::Missing, ..done() };
        assert!(unproven.advice().starts_with("compare what the unit says"), "{}", unproven.advice());
        let refused = || report(Verdict::Refused, UnitNow::Application, 0);
        assert_eq!(
            advice(LoadReport { product: None, ..refused() }),
            "look at the label of the unit and say which product it is"
        );
        let older = LoadReport { misfit: Some(DefectId::Downgrade), ..refused() };
        assert!(older.advice().contains("take newer software"), "{}", older.advice());
        assert!(refused().advice().contains("made for this unit"), "{}", refused().advice());
        let waits = |records, phase, found_in_loader| {
            LoadReport { phase, found_in_loader, ..report(Verdict::Failed, UnitNow::Loader, records) }.advice()
        };
        assert!(waits(0, Phase::Transfer, true).contains("as it was found"));
        assert!(waits(0, Phase::Transfer, false).contains("with the software it had"));
        assert!(waits(3074, Phase::Finish, false).contains("not made for this unit"));
        for (records, phase, found) in
            [(1, Phase::Transfer, true), (3073, Phase::Finish, false), (3074, Phase::Transfer, false)]
        {
            assert!(waits(records, phase, found).contains("no complete software"), "{records} {phase:?}");
        }
    }

    #[test]
    fn of_a_unit_that_is_not_heard_with_part_of_the_file_nobody_says_that_it_waits() {
        let half = report(Verdict::Failed, UnitNow::Loader, 9);
        assert_eq!(half.doubt(false, false), None);
        assert_eq!(half.doubt(false, true), Some("silent: in its loader, or without power"));
        for is_silent in [false, true] {
            assert_eq!(half.doubt(true, is_silent), Some("in its loader, or without power"));
        }
        for (verdict, unit, records) in [
            (Verdict::Failed, UnitNow::Loader, 0),
            (Verdict::Failed, UnitNow::Unknown, 9),
            (Verdict::Interrupted, UnitNow::Loader, 9),
        ] {
            assert_eq!(report(verdict, unit, records).doubt(true, true), None, "{verdict:?} {unit:?} {records}");
        }
    }

    #[test]
    fn nobody_is_told_to_check_a_password_that_was_not_sent_or_that_nothing_was_changed_by_records() {
        let refused = || report(Verdict::UnitRefused, UnitNow::Application, 0);
        assert!(refused().advice().contains("check the password"), "{}", refused().advice());
        let unsent = LoadReport { password_sent: false, ..refused() }.advice();
        assert!(unsent.contains("has got no password") && !unsent.contains("check"), "{unsent}");
        let asked = report(Verdict::NoAnswer, UnitNow::Application, 0).advice();
        assert!(asked.contains("no password was sent") && !asked.contains("cable"), "{asked}");
        let nothing = report(Verdict::NoAnswer, UnitNow::Unknown, 0).advice();
        assert!(nothing.contains("cable"), "{nothing}");
        let untouched = report(Verdict::Failed, UnitNow::Application, 0).advice();
        assert!(untouched.contains("nothing was changed"), "{untouched}");
        let touched = report(Verdict::Failed, UnitNow::Application, 1).advice();
        assert!(touched.contains("is not known: send the file again"), "{touched}");
    }

    #[test]
    fn the_time_left_counts_from_the_first_data_and_not_from_the_erasing_before_it() {
        let mut progress = Progress {
            phase: Phase::Transfer,
            records: 1,
            records_total: 101,
            bytes: 20,
            bytes_total: 10_020,
            address: 0,
            elapsed: Duration::from_secs(10),
            moving: Duration::ZERO,
            moved: 0,
            held: None,
            again: false,
        };
        assert_eq!((progress.rate(), progress.eta()), (0.0, None));
        progress = Progress { bytes: 5_020, elapsed: Duration::from_secs(15), ..progress };
        progress = Progress { moving: Duration::from_secs(5), moved: 5_000, ..progress };
        assert_eq!((progress.rate(), progress.eta()), (1000.0, Some(Duration::from_secs(5))));
    }
}
