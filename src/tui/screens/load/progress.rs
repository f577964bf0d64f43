//! How far an upload is.

use ratatui::layout::Rect;
use ratatui::text::{Line, Span};

use super::{Load, file_name};
use crate::monitor::{Origin, TextLine};
use crate::session::{Phase, Progress};
use crate::time::Duration;
use crate::tui::screens::Scene;
use crate::tui::widgets::{format, lines};

/// The steps of an upload.
const PHASES: [(Phase, &str); 6] = [
    (Phase::Check, "check the unit"),
    (Phase::EnterLoader, "enter the loader"),
    (Phase::Erase, "erase"),
    (Phase::Transfer, "transfer"),
    (Phase::Finish, "finish"),
    (Phase::Verify, "verify by the new banner"),
];

impl Load {
    pub(super) fn running(&self, scene: Scene, area: Rect) -> Vec<Line<'static>> {
        let theme = scene.theme;
        let name = self.image().map(|facts| file_name(&facts.path)).unwrap_or_default();
        let mut rows = vec![lines::rule(theme, area.width, "Loading", &name), Line::default()];
        let progress = scene.view.load.progress;
        let current = progress.map_or(Phase::Check, |progress| progress.phase);
        // A loader that erases page by page has no step for it.
        let steps = PHASES.into_iter().filter(|(phase, _)| *phase != Phase::Erase || current == Phase::Erase);
        for (phase, words) in steps {
            let (mark, style) = match phase.cmp(&current) {
                std::cmp::Ordering::Less => ("done", theme.quiet()),
                std::cmp::Ordering::Equal => ("now", theme.strong()),
                std::cmp::Ordering::Greater => ("", theme.quiet()),
            };
            rows.push(Line::from(vec![Span::styled(format!("  {mark:<6}"), theme.good()), Span::styled(words, style)]));
        }
        rows.push(Line::default());
        match progress {
            None => rows.push(Line::styled("  Nothing has been sent yet.", theme.quiet())),
            Some(progress) => rows.extend(gauge_and_numbers(scene, &progress, usize::from(area.width))),
        }
        rows.push(Line::default());
        rows.push(Line::raw("  Keep the unit powered and the cable in. Esc cancels, after a question."));
        rows
    }
}

fn gauge_and_numbers(scene: Scene, progress: &Progress, columns: usize) -> Vec<Line<'static>> {
    let theme = scene.theme;
    let share = if progress.bytes_total == 0 { 0.0 } else { progress.bytes as f64 / progress.bytes_total as f64 };
    let left = progress.eta().map_or_else(
        || "time left not known yet".to_owned(),
        |eta| format!("{} left", format::minutes(Duration::from_secs_f64(eta.as_secs_f64().ceil()))),
    );
    let held = match (scene.view.load.held_since, progress.held) {
        (Some(since), _) => Some(scene.now.since(since)),
        (None, held) => held,
    };
    let line = match held {
        Some(held) => Span::styled(
            format!("held by the unit (XOFF) for {}.{} s", held.as_secs(), held.subsec_millis() / 100),
            theme.warning(),
        ),
        None => Span::raw("free"),
    };
    let again = if progress.again { ": once more, the loader had lost something" } else { "" };
    let of = |part: usize, whole: usize| format!("{} of {}", format::grouped(part), format::grouped(whole));
    vec![
        lines::gauge(theme, share, columns),
        Line::default(),
        lines::labelled(theme, "Records", of(progress.records, progress.records_total) + again),
        lines::labelled(theme, "Characters", of(progress.bytes, progress.bytes_total)),
        lines::labelled(
            theme,
            "Time",
            format!(
                "{} gone, {left}, {} characters a second",
                format::minutes(progress.elapsed),
                format::grouped(progress.rate() as u64)
            ),
        ),
        lines::labelled(theme, "Line", line),
        lines::labelled(theme, "Last heard", Span::raw(last_heard(scene, columns))),
    ]
}

/// The unit's last words: what a loader says while it takes a file, its dots too.
fn last_heard(scene: Scene, columns: usize) -> String {
    let said = |line: &&TextLine| line.origin == Origin::Unit && !line.text.trim().is_empty();
    let text = scene.scrollback.lines().rev().find(said).map_or("nothing yet", |line| line.text.trim());
    format::keep_end(text, columns.saturating_sub(lines::LABEL_COLUMNS + 4))
}
