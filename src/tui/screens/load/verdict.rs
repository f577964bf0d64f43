//! How an upload has ended, and what to do next.

use ratatui::layout::Rect;
use ratatui::style::Style;
use ratatui::text::{Line, Span};

use crate::session::{LoadReport, SEE_POWER, UnitNow, Verdict};
use crate::tui::screens::Scene;
use crate::tui::theme::Theme;
use crate::tui::view::{LinkState, View};
use crate::tui::visible;
use crate::tui::widgets::{format, lines};

/// Rows beside the text: heading, verdict, what Enter does, and blanks between them.
const FRAME_ROWS: usize = 6;
/// The label of the unit's last words.
const HEARD: &str = "Heard";

/// A label, and the lines beside it.
type Told = (&'static str, Vec<String>);

pub(super) fn verdict(scene: Scene, report: &LoadReport, area: Rect) -> Vec<Line<'static>> {
    let theme = scene.theme;
    let product = report.product.as_deref().map(visible::text).unwrap_or_default();
    let remark = if scene.view.load.is_of_earlier_unit {
        format!("{product}, not of the unit that is there now")
    } else {
        product
    };
    let (word, style) = word(theme, report);
    let mut rows = vec![
        lines::rule(theme, area.width, "Verdict", &remark),
        Line::default(),
        Line::from(vec![Span::raw("  "), Span::styled(word, style)]),
        Line::default(),
    ];
    let room = usize::from(area.width).saturating_sub(lines::LABEL_COLUMNS + 4);
    let mut told = told(scene.view, report, room);
    shorten(&mut told, usize::from(area.height).saturating_sub(FRAME_ROWS));
    rows.extend(told.into_iter().flat_map(|(label, text)| lines::labelled_rows(theme, label, text)));
    rows.push(Line::default());
    rows.push(Line::from(vec![
        Span::styled("  Enter", theme.key()),
        Span::raw(" goes back to the file and its plan."),
    ]));
    rows
}

fn word(theme: Theme, report: &LoadReport) -> (&'static str, Style) {
    match report.verdict {
        Verdict::Done => ("Done", theme.good()),
        Verdict::Refused => ("Refused, nothing was changed", theme.warning()),
        Verdict::UnitRefused => ("The unit refused", theme.bad()),
        Verdict::NoAnswer if report.unit == UnitNow::Application => {
            ("The unit's question is not understood", theme.bad())
        }
        Verdict::NoAnswer => ("No answer", theme.bad()),
        Verdict::Failed => ("Failed", theme.bad()),
        Verdict::WrongApplication => ("The unit does not run what was sent", theme.bad()),
        Verdict::Interrupted => ("Cancelled", theme.warning()),
    }
}

/// What happened, what is true of the unit, and what to do next, in lines of `room` columns.
fn told(view: &View, report: &LoadReport, room: usize) -> Vec<Told> {
    let doubt = doubt(view, report);
    let unit = doubt.unwrap_or(match report.unit {
        UnitNow::Application => "runs its application",
        UnitNow::Loader => "waits in its loader for a file",
        UnitNow::Unknown => "nobody can say",
    });
    let advice = if doubt.is_some() { SEE_POWER } else { report.advice() };
    let sentence = |text: &str| format!("{}.", visible::sentence(text).trim_end_matches('.'));
    let mut told: Vec<Told> = Vec::new();
    let mut tell = |label, text: &str| told.push((label, format::wrap(&visible::text(text), room)));
    tell("Happened", &sentence(&report.what));
    tell(if view.load.is_of_earlier_unit { "Unit then" } else { "Unit now" }, unit);
    tell("Version", &versions(report));
    // Until the file is counted nothing of it is sent.
    if report.records_total > 0 {
        let (sent, total) = (format::grouped(report.records), format::grouped(report.records_total));
        tell("Sent", &format!("{sent} of {total} records in {}", format::minutes(report.duration)));
    }
    if let Some(address) = report.address.filter(|_| report.verdict != Verdict::Done) {
        tell("Stopped at", &format!("{address:#08x}"));
    }
    if !report.heard.is_empty() {
        tell(HEARD, &report.heard);
    }
    if let Some(remark) = &report.remark {
        tell("Note", remark);
    }
    tell("What next", &sentence(advice));
    told
}

/// What can be said of the unit if nothing is heard of it: also of one that was on the cable before.
fn doubt(view: &View, report: &LoadReport) -> Option<&'static str> {
    let is_back = view.returning.is_none() && !view.load.is_of_earlier_unit;
    let is_lost = matches!(view.link.state, LinkState::Lost(_)) || !is_back;
    report.doubt(is_lost, view.load.is_silent)
}

/// The software before and after, as far as it is known: `1.1.0 before, unknown afterwards`.
fn versions(report: &LoadReport) -> String {
    let is_untouched = matches!(report.verdict, Verdict::Refused | Verdict::UnitRefused | Verdict::NoAnswer);
    match (report.version_before, report.version_after) {
        (Some(before), None) if is_untouched && report.unit == UnitNow::Application => format!("{before}, as before"),
        (Some(before), Some(after)) => format!("{before} before, {after} afterwards"),
        (Some(before), None) => format!("{before} before, unknown afterwards"),
        (None, Some(after)) => format!("unknown before, {after} afterwards"),
        (None, None) => "unknown".to_owned(),
    }
}

/// A unit may say any number of words: what has no room must not be what there is to do next.
fn shorten(told: &mut [Told], room: usize) {
    let over = told.iter().map(|(_, lines)| lines.len()).sum::<usize>().saturating_sub(room);
    let Some((_, heard)) = told.iter_mut().find(|(label, _)| *label == HEARD).filter(|_| over > 0) else { return };
    heard.truncate(heard.len().saturating_sub(over).max(1));
    if let Some(last) = heard.last_mut() {
        last.push_str(" …");
    }
}
