//! How an upload has ended, and what to do next.

use ratatui::layout::Rect;
use ratatui::text::{Line, Span};

use crate::session::{LoadReport, SEE_POWER, UnitNow, Verdict};
use crate::tui::screens::Scene;
use crate::tui::visible;
use crate::tui::widgets::{format, lines};

/// Rows beside the text: heading, verdict, what Enter does, and blanks between them.
const FRAME_ROWS: usize = 6;
/// The label of the unit's last words.
const HEARD: &str = "Heard";

pub(super) fn verdict(scene: Scene, report: &LoadReport, area: Rect) -> Vec<Line<'static>> {
    let theme = scene.theme;
    let room = usize::from(area.width).saturating_sub(lines::LABEL_COLUMNS + 4);
    let (word, style) = match report.verdict {
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
    };
    let load = &scene.view.load;
    let unit = match report.unit {
        UnitNow::Loader if load.is_silent => "silent: in its loader, or without power",
        UnitNow::Application => "runs its application",
        UnitNow::Loader => "waits in its loader for a file",
        UnitNow::Unknown => "nobody can say",
    };
    let version = |version: Option<crate::version::Version>| version.map_or("not known".into(), |v| v.to_string());
    let mut rows = vec![
        lines::rule(
            theme,
            area.width,
            "Verdict",
            &match (report.product.as_deref().map(visible::text), load.is_of_before) {
                (product, false) => product.unwrap_or_default(),
                (product, true) => format!("{}, not of the unit that is there now", product.unwrap_or_default()),
            },
        ),
        Line::default(),
        Line::from(vec![Span::raw("  "), Span::styled(word, style)]),
        Line::default(),
    ];
    let mut told: Vec<(&str, Vec<String>)> = Vec::new();
    let mut paragraph = |label, text: &str| told.push((label, format::wrap(&visible::text(text), room)));
    paragraph("Happened", &format!("{}.", visible::sentence(&report.what).trim_end_matches('.')));
    paragraph(if load.is_of_before { "Unit then" } else { "Unit now" }, unit);
    let is_untouched = matches!(report.verdict, Verdict::Refused | Verdict::UnitRefused | Verdict::NoAnswer);
    let versions = match (report.version_before, report.version_after) {
        (Some(before), None) if is_untouched && report.unit == UnitNow::Application => format!("{before}, as before"),
        (before, after) => format!("before {}, after {}", version(before), version(after)),
    };
    paragraph("Version", &versions);
    let (sent, total) = (format::grouped(report.records), format::grouped(report.records_total));
    paragraph("Sent", &format!("{sent} of {total} records in {}", format::minutes(report.duration)));
    if let Some(address) = report.address.filter(|_| report.verdict != Verdict::Done) {
        paragraph("Stopped at", &format!("{address:#08x}"));
    }
    if !report.heard.is_empty() {
        paragraph(HEARD, &report.heard);
    }
    if let Some(remark) = &report.remark {
        paragraph("Note", remark);
    }
    let advice = match load.is_silent {
        true => SEE_POWER,
        false => report.advice(),
    };
    paragraph("What next", &format!("{}.", visible::sentence(advice)));
    shorten(&mut told, usize::from(area.height).saturating_sub(FRAME_ROWS));
    for (label, broken) in told {
        for (number, line) in broken.into_iter().enumerate() {
            rows.push(lines::labelled(theme, if number == 0 { label } else { "" }, line));
        }
    }
    rows.push(Line::default());
    rows.push(Line::from(vec![
        Span::styled("  Enter", theme.key()),
        Span::raw(" goes back to the file and its plan."),
    ]));
    rows
}

/// A unit may say any number of words: what has no room must not be what there is to do next.
fn shorten(told: &mut [(&str, Vec<String>)], room: usize) {
    let over = told.iter().map(|(_, lines)| lines.len()).sum::<usize>().saturating_sub(room);
    let Some((_, heard)) = told.iter_mut().find(|(label, _)| *label == HEARD).filter(|_| over > 0) else { return };
    heard.truncate(heard.len().saturating_sub(over).max(1));
    if let Some(last) = heard.last_mut() {
        last.push_str(" …");
    }
}
