//! What the unit is and its state, each fact with where it comes from.

use ratatui::text::{Line, Span};

use super::{diagnosed, is_asked};
use crate::session::{Known, Origin, UnitState};
use crate::tui::screens::Scene;
use crate::tui::visible;
use crate::tui::widgets::{format, lines};
use crate::wire::stream::Source;

pub(super) fn unit(scene: Scene, columns: u16) -> Vec<Line<'static>> {
    let (theme, facts) = (scene.theme, &scene.view.facts);
    let title = scene.view.product().map(|product| product.title.clone()).unwrap_or_default();
    let stream = match (facts.stream, scene.view.unit.monitor.stream.period()) {
        (None, _) if facts.state == UnitState::Loader => "none, in the loader".to_owned(),
        (None, _) if scene.view.unit.stream_is_off => "off".to_owned(),
        (None, _) => "no row so far".to_owned(),
        (Some(source), period) => {
            let source = match source {
                Source::FieldValue => "field value",
                Source::ProcessValue => "process value",
            };
            let every = period.map(|period| format!(", every {}", format::period(period))).unwrap_or_default();
            format!("{source}{every}")
        }
    };
    let state = match facts.state {
        UnitState::Silent if is_asked(scene) => Span::styled("being asked", theme.warning()),
        UnitState::Silent if scene.view.link.name.is_none() => Span::styled("not connected", theme.quiet()),
        UnitState::Silent if scene.record.entry_count() > 0 && scene.view.unit.monitor.stream.rows > 0 => {
            Span::styled("silent now", theme.warning())
        }
        UnitState::Silent => Span::styled("silent: nothing heard yet", theme.warning()),
        UnitState::Unknown => Span::styled("talks, in words not known", theme.warning()),
        UnitState::Application if scene.view.unit.viewing => Span::styled("view open, halted", theme.warning()),
        UnitState::Application => Span::styled("application runs", theme.good()),
        UnitState::Loader if scene.view.load.is_silent => Span::styled("silent: loader or no power", theme.warning()),
        UnitState::Loader => Span::styled("waits in its loader", theme.warning()),
    };
    let other_text = match facts.unrecognised_lines {
        0 => "none".to_owned(),
        count => format!("{}, see the terminal", format::counted(count, "line")),
    };
    let half = usize::from(columns) / 2 - 2;
    let left = [
        ("Product", known(&facts.product, |product| visible::text(product))),
        ("Version", known(&facts.version, |version| version.to_string())),
        ("Node-ID", known(&facts.node_id, |id| id.to_string())),
        ("CAN", known(&facts.can_kbps, |rate| format!("{rate} kbit/s"))),
    ];
    let right = [
        ("State", state),
        ("CANopen", canopen_state(scene, usize::from(columns).saturating_sub(half + 2 + lines::LABEL_COLUMNS))),
        ("Stream", Span::raw(stream)),
        ("Other text", Span::raw(other_text)),
    ];
    let mut shown = vec![lines::rule(theme, columns, "Unit", &title)];
    for ((left_label, left_value), (right_label, right_value)) in left.into_iter().zip(right) {
        let mut line = lines::labelled(theme, left_label, left_value);
        let missing = half.saturating_sub(line.width());
        line.push_span(Span::raw(" ".repeat(missing)));
        line.spans.extend(lines::labelled(theme, right_label, right_value).spans);
        shown.push(line);
    }
    shown.extend(diagnosed::beside_channels(scene, columns));
    shown.push(Line::default());
    shown
}

/// The CANopen state, in `room` columns. Any master on the bus changes it without the unit saying so here: what was
/// heard a while ago is shown with its age, and does not look like what is.
fn canopen_state(scene: Scene, room: usize) -> Span<'static> {
    let state = &scene.view.facts.nmt_state;
    let now = known(state, |state| visible::text(state));
    let age = scene.view.nmt_heard.and_then(|heard| format::ago(heard, scene.now));
    let Some(state) = state else { return now };
    let Some(age) = age else {
        // Where it comes from is said in full or not at all.
        return if now.width() <= room {
            now
        } else {
            Span::raw(format::keep_start(&visible::text(&state.value), room))
        };
    };
    let full = format!("{}, {age}", now.content);
    let text = if format::width(&full) <= room { full } else { format!("{}, {age}", visible::text(&state.value)) };
    Span::styled(text, scene.theme.quiet())
}

/// A fact and where it comes from: `127 (menu)`.
fn known<T>(fact: &Option<Known<T>>, show: impl Fn(&T) -> String) -> Span<'static> {
    match fact {
        None => Span::raw("not known"),
        Some(known) => {
            let origin = match known.origin {
                Origin::Banner => "banner",
                Origin::Menu => "menu",
                // In full it would push the second column aside.
                Origin::Dictionary => "dictionary",
                Origin::Diagnostics => "diagnostics",
            };
            Span::raw(format!("{} ({origin})", show(&known.value)))
        }
    }
}
