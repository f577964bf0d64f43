//! How an upload has ended, and what to do next.

use ratatui::layout::Rect;
use ratatui::text::{Line, Span};

use crate::session::{LoadReport, UnitNow, Verdict};
use crate::tui::screens::Scene;
use crate::tui::visible;
use crate::tui::widgets::{format, lines};

pub(super) fn verdict(scene: Scene, report: &LoadReport, area: Rect) -> Vec<Line<'static>> {
    let theme = scene.theme;
    let room = usize::from(area.width).saturating_sub(lines::LABEL_COLUMNS + 4);
    let (word, style) = match report.verdict {
        Verdict::Done => ("Done", theme.good()),
        Verdict::Refused => ("Refused, nothing was changed", theme.warning()),
        Verdict::UnitRefused => ("The unit refused", theme.bad()),
        Verdict::NoAnswer => ("No answer", theme.bad()),
        Verdict::Failed => ("Failed", theme.bad()),
        Verdict::WrongApplication => ("The unit does not run what was sent", theme.bad()),
        Verdict::Interrupted => ("Cancelled", theme.warning()),
    };
    let unit = match report.unit {
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
            report.product.as_deref().map(visible::text).unwrap_or_default().as_str(),
        ),
        Line::default(),
        Line::from(vec![Span::raw("  "), Span::styled(word, style)]),
        Line::default(),
    ];
    let mut paragraph = |label: &str, text: &str| {
        for (number, line) in format::wrap(&visible::text(text), room).into_iter().enumerate() {
            rows.push(lines::labelled(theme, if number == 0 { label } else { "" }, line));
        }
    };
    paragraph("Happened", &visible::sentence(&report.what));
    paragraph("Unit now", unit);
    let is_untouched = matches!(report.verdict, Verdict::Refused | Verdict::UnitRefused);
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
        paragraph("Heard", &report.heard);
    }
    if let Some(remark) = &report.remark {
        paragraph("Note", remark);
    }
    paragraph("What next", &format!("{}.", visible::sentence(report.advice())));
    rows.push(Line::default());
    rows.push(Line::from(vec![
        Span::styled("  Enter", theme.key()),
        Span::raw(" goes back to the file and its plan."),
    ]));
    rows
}
