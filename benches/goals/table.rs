//! The table at the end.

use std::fmt;

/// What a figure has to be.
#[derive(Clone, Debug)]
pub struct Goal {
    bound: f64,
    at_least: bool,
    /// What the figure is compared with, if not with the bound itself.
    peer: Option<&'static str>,
}

/// One figure beside its goal.
#[derive(Debug)]
pub struct Row {
    name: String,
    goal: Goal,
    figure: Option<String>,
    ratio: Option<f64>,
    verdict: Verdict,
    /// Why the goal is out of reach, where that is known.
    reason: Option<&'static str>,
}

#[derive(Debug)]
enum Verdict {
    Met,
    Missed,
    NotMeasured(&'static str),
}

/// All rows.
#[derive(Debug, Default)]
pub struct Table {
    rows: Vec<Row>,
}

impl Goal {
    /// No more than this.
    pub const fn at_most(bound: f64) -> Self {
        Goal { bound, at_least: false, peer: None }
    }

    /// No less than this.
    pub const fn at_least(bound: f64) -> Self {
        Goal { bound, at_least: true, peer: None }
    }

    /// So many times what a peer has in the same run.
    pub const fn of(self, peer: &'static str) -> Self {
        Goal { peer: Some(peer), ..self }
    }

    fn is_met_by(&self, figure: f64) -> bool {
        if self.at_least { figure >= self.bound } else { figure <= self.bound }
    }
}

impl fmt::Display for Goal {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{} {}", if self.at_least { ">=" } else { "<=" }, number(self.bound))?;
        self.peer.map_or(Ok(()), |peer| write!(f, " x {peer}"))
    }
}

impl Row {
    /// A figure with its unit, against its goal.
    pub fn new(name: impl Into<String>, goal: Goal, figure: f64, unit: &str) -> Self {
        // Nothing can be put in proportion to nothing.
        let ratio = (goal.bound != 0.0).then(|| figure / goal.bound);
        let verdict = if goal.is_met_by(figure) { Verdict::Met } else { Verdict::Missed };
        Row { name: name.into(), goal, figure: Some(with_unit(figure, unit)), ratio, verdict, reason: None }
    }

    /// A figure whose goal is so many times a peer's.
    pub fn beside(name: impl Into<String>, goal: Goal, figure: f64, unit: &str, peers: f64) -> Self {
        let ratio = figure / peers;
        let verdict = if goal.is_met_by(ratio) { Verdict::Met } else { Verdict::Missed };
        Row {
            name: name.into(),
            goal,
            figure: Some(with_unit(figure, unit)),
            ratio: Some(ratio),
            verdict,
            reason: None,
        }
    }

    /// No figure, and why.
    pub fn not_measured(name: impl Into<String>, goal: Goal, why: &'static str) -> Self {
        let verdict = Verdict::NotMeasured(why);
        Row { name: name.into(), goal, figure: None, ratio: None, verdict, reason: None }
    }

    /// What stands below the table if the goal is missed.
    pub fn because(self, reason: &'static str) -> Self {
        Row { reason: Some(reason), ..self }
    }
}

impl Table {
    /// One more row.
    pub fn push(&mut self, row: Row) {
        self.rows.push(row);
    }
}

impl fmt::Display for Table {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        writeln!(f, "{:<46} {:>18} {:>14} {:>7}  verdict", "row", "goal", "figure", "ratio")?;
        let mut reasons: Vec<&str> = Vec::new();
        for Row { name, goal, figure, ratio, verdict, reason } in &self.rows {
            let figure = figure.as_deref().unwrap_or("-");
            let ratio = ratio.map_or_else(|| "-".to_owned(), |ratio| format!("{ratio:.2}"));
            let verdict = match (verdict, reason) {
                (Verdict::Met, _) => "met".to_owned(),
                (Verdict::Missed, None) => "missed".to_owned(),
                (Verdict::Missed, Some(reason)) => {
                    let place = reasons.iter().position(|known| known == reason).unwrap_or_else(|| {
                        reasons.push(reason);
                        reasons.len() - 1
                    });
                    format!("missed ({})", place + 1)
                }
                (Verdict::NotMeasured(why), _) => format!("not measured: {why}"),
            };
            writeln!(f, "{name:<46} {:>18} {figure:>14} {ratio:>7}  {verdict}", goal.to_string())?;
        }
        for (number, reason) in (1..).zip(reasons) {
            writeln!(f, "({number}) {reason}")?;
        }
        let count = |wanted: fn(&Verdict) -> bool| self.rows.iter().filter(|row| wanted(&row.verdict)).count();
        let met = count(|verdict| matches!(verdict, Verdict::Met));
        let missed = count(|verdict| matches!(verdict, Verdict::Missed));
        writeln!(f, "{met} met, {missed} missed, {} not measured", self.rows.len() - met - missed)
    }
}

fn with_unit(figure: f64, unit: &str) -> String {
    if unit.is_empty() { number(figure) } else { format!("{} {unit}", number(figure)) }
}

/// As many digits as mean something.
fn number(value: f64) -> String {
    match value {
        _ if value.fract() == 0.0 || value >= 100.0 => format!("{value:.0}"),
        _ if value >= 10.0 => format!("{value:.1}"),
        _ if value >= 0.1 => format!("{value:.3}"),
        _ => format!("{value:.4}"),
    }
}
