//! What is around every screen: header, tabs, the latest word, the unit's menu, the screen's keys.

use ratatui::Frame;
use ratatui::layout::Rect;
use ratatui::text::{Line, Span};

use super::keymap::{Binding, Cmd, EVERYWHERE, MENU};
use super::popup::in_the_middle;
use super::screens::ScreenId;
use super::theme::Theme;
use super::view::{LinkState, Tone, View};
use super::visible;
use super::widgets::{format, lines};
use crate::session::{Job, UnitState};

/// Smallest terminal the pictures are made for.
pub const LEAST: (u16, u16) = (80, 24);
/// Rows above the screen.
const ABOVE: u16 = 2;
/// Rows below it, the latest word in one line.
const BELOW: u16 = 3;
/// Lines that the latest word may take.
const MOST_NOTICE_ROWS: usize = 3;
/// What comes before the recording's name.
const RECORDING: &str = "rec ";
/// What comes before the unit's menu.
const UNIT: &str = " Unit  ";
/// What comes before the keys of the screen.
const KEYS: &str = " axcon ";
/// What is being done takes no more than this.
const ACTIVITY_COLUMNS: usize = 24;
/// With fewer columns than this the recording's name says nothing.
const LEAST_RECORDING: usize = 20;

/// Where the screen itself is drawn: a long word to the user takes a row of it.
pub fn body(area: Rect, view: &View) -> Rect {
    let notice = notice_rows(view, usize::from(area.width)).len().max(1) as u16;
    let height = area.height.saturating_sub(ABOVE + BELOW - 1 + notice);
    Rect { y: area.y + ABOVE.min(area.height), height, ..area }
}

/// Whether a terminal has less than the pictures need.
pub fn is_too_small((columns, rows): (u16, u16)) -> bool {
    columns < LEAST.0 || rows < LEAST.1
}

/// Says that the terminal is too small, and what can be done all the same; `asks` whether to leave.
pub fn too_small(view: &View, asks: bool, frame: &mut Frame) {
    let area = frame.area();
    let text = match asks {
        true => {
            let what = in_the_middle(view).map(|text| format!(" {text}")).concat();
            format!("Leave axcon? Y leaves, N stays.{what}")
        }
        false => format!(
            "axcon needs {} x {} characters, this terminal has {} x {}. Make it larger; everything goes on. \
             Until then only Q means something: it leaves.",
            LEAST.0, LEAST.1, area.width, area.height
        ),
    };
    let rows = format::wrap(&text, usize::from(area.width));
    let top = area.height.saturating_sub(rows.len() as u16) / 2;
    let (_, below) = lines::split(area, top);
    lines::draw(frame, below, rows.into_iter().map(|row| Line::raw(row).centered()));
}

/// Product, version, node and link, in one line.
pub fn header(view: &View, theme: Theme, columns: usize) -> Line<'static> {
    let facts = &view.facts;
    let product = facts.product.as_ref().map(|known| visible::text(&known.value));
    let version = facts.version.as_ref().map(|known| known.value.to_string());
    let unit = match (product, facts.state) {
        (Some(product), _) => version.map_or_else(|| product.clone(), |version| format!("{product} {version}")),
        (None, UnitState::Silent) => "no unit".into(),
        (None, UnitState::Unknown | UnitState::Application | UnitState::Loader) => match view.noted() {
            // What nobody but our own notes says is marked as such.
            Some(noted) => format!("{}?", noted.product),
            None => "unknown unit".into(),
        },
    };
    let state = match facts.state {
        // Without power it would look the same.
        UnitState::Loader if view.load.is_silent => Some("silent, in loader?"),
        UnitState::Loader => Some("in loader"),
        _ if view.unit.viewing => Some("halted by V"),
        _ if view.question.is_some() => Some("asks, see 3"),
        UnitState::Silent | UnitState::Unknown | UnitState::Application => None,
    };
    let link = match &view.link.state {
        LinkState::Closed => "not connected",
        LinkState::Opening => "opening",
        LinkState::Open if view.is_recording() => "read only",
        LinkState::Open if view.link.unrecorded.is_some() => "connected, not recorded",
        LinkState::Open => "connected",
        LinkState::Lost(_) => "link lost",
    };
    let node = facts.node_id.as_ref().map(|known| format!("node {}", known.value));
    let name = view.link.name.as_deref().map(visible::text);
    let mut parts = vec!["axcon".to_owned(), unit];
    parts.extend(state.map(str::to_owned));
    parts.extend(node);
    let fixed = parts.iter().map(|part| format::width(part) + 3).sum::<usize>() + format::width(link) + 2;
    let room = columns.saturating_sub(fixed);
    parts.extend(name.map(|name| format::keep_end(&name, room.saturating_sub(3).max(8))));
    parts.push(link.to_owned());
    Line::styled(format::left(&format!(" {}", parts.join(" │ ")), columns), theme.bar())
}

/// The tabs; on the right what is being done, or else where the recording goes.
pub fn tabs(view: &View, front: Option<ScreenId>, theme: Theme, columns: usize) -> Line<'static> {
    let mut line = Line::raw(" ");
    for (screen, text) in tab_texts(view, front, columns) {
        let (name, blank) = text.split_at(text.trim_end().len() + 1);
        line.push_span(match front == Some(screen) {
            true => Span::styled(name.to_owned(), theme.bar()),
            false => Span::raw(name.to_owned()),
        });
        line.push_span(Span::raw(blank.to_owned()));
    }
    if front.is_none() {
        line.push_span(Span::styled(" Help ", theme.bar()));
    }
    let activity = activity(view);
    let room = columns.saturating_sub(line.width() + 1);
    let right = match &view.link.recording {
        _ if !activity.is_empty() && format::width(activity) <= room => Span::styled(activity, theme.warning()),
        // It takes the place of the latest word.
        _ if !activity.is_empty() => Span::raw(""),
        Some(path) if room > LEAST_RECORDING => {
            let path = format::keep_end(&visible::text(path), room - RECORDING.len());
            Span::styled(format!("{RECORDING}{path}"), theme.quiet())
        }
        Some(_) | None => Span::raw(""),
    };
    line.push_span(Span::raw(" ".repeat(room.saturating_sub(right.width()))));
    line.push_span(right);
    line
}

/// The tabs, each with the blanks around it.
fn tab_texts(view: &View, front: Option<ScreenId>, columns: usize) -> Vec<(ScreenId, String)> {
    let needed: usize = ScreenId::ALL.map(|id| format::width(id.title()) + 5).iter().sum();
    let is_roomy = needed + ACTIVITY_COLUMNS <= columns;
    // Only an emulated unit has a bench.
    let has_place = |id: &ScreenId| *id != ScreenId::Bench || front == Some(*id) || view.emulated().is_some();
    let text = |(number, id): (usize, ScreenId)| match is_roomy {
        true => (id, format!(" {number} {}  ", id.title())),
        false => (id, format!(" {number} {} ", id.short_title())),
    };
    (1..).zip(ScreenId::ALL.into_iter().filter(has_place)).map(text).collect()
}

/// The screen whose tab is at a column.
pub fn tab_at(view: &View, front: Option<ScreenId>, columns: usize, column: usize) -> Option<ScreenId> {
    let mut end = 1;
    tab_texts(view, front, columns).into_iter().find_map(|(screen, text)| {
        end += format::width(&text);
        (1..end).contains(&column).then_some(screen)
    })
}

/// The command that the unit's menu shows at a column.
pub fn menu_at(column: usize) -> Option<Cmd> {
    let mut end = format::width(UNIT);
    MENU.iter().filter(|binding| !binding.short.is_empty()).find_map(|binding| {
        let begin = end;
        end += binding.keys.first().map_or(0, |press| format::width(&press.name())) + format::width(binding.short) + 3;
        (begin..end).contains(&column).then_some(binding.cmd)
    })
}

/// The command that the line of the screen's keys shows at a column.
pub fn key_at(theme: Theme, bindings: &[Binding], column: usize) -> Option<Cmd> {
    let mut end = format::width(KEYS);
    [bindings, EVERYWHERE].into_iter().flatten().filter(|binding| !binding.short.is_empty()).find_map(|binding| {
        let begin = end;
        end += hint(theme, binding).iter().map(Span::width).sum::<usize>();
        // The blanks after it are nobody's.
        (begin..end.saturating_sub(2)).contains(&column).then_some(binding.cmd)
    })
}

/// What is being done.
fn activity(view: &View) -> &'static str {
    match view.job {
        None if view.load.held_since.is_some() => "held by XOFF",
        None | Some(Job::Overhear) => "",
        Some(Job::Identify) => "asking the unit",
        Some(Job::StreamOn) if view.awaits_first_row() => "first row awaited",
        Some(Job::StreamOn | Job::StreamOff) => "setting the stream",
        Some(Job::RestoreDefaults) => "restoring defaults",
        Some(Job::ReadDictionary) => "reading the dictionary",
        Some(Job::Diagnostics) => "reading diagnostics",
        Some(Job::Load) => "loading",
        Some(Job::SendFile) => "sending a file",
    }
}

/// The lost link, or whose unit is not known yet, for the top of every screen.
pub fn lost(view: &View, front: ScreenId, theme: Theme, columns: usize) -> Vec<Line<'static>> {
    if view.returning.is_some() && view.can_send() {
        let text = match view.job {
            Some(Job::Identify) => " The link is back. The unit is being asked who it is.",
            _ => " The link is back, but nobody has answered yet: M asks again.",
        };
        let then = " Below is history, of the unit that was there before.";
        return vec![
            Line::styled(format::left(text, columns), theme.warning()),
            Line::styled(format::left(then, columns), theme.warning()),
        ];
    }
    let LinkState::Lost(failure) = &view.link.state else { return Vec::new() };
    let text = format!("Link lost: {}", visible::text(&failure.text));
    let mut rows = vec![Line::styled(format::left(&format!(" {text}"), columns), theme.alarm())];
    let then = match front {
        ScreenId::Terminal if view.emulated().is_some() => {
            " Below is history. The emulated unit is gone with it; Ctrl-] C starts a new one."
        }
        _ if view.emulated().is_some() => " Below is history. The emulated unit is gone with it; C starts a new one.",
        ScreenId::Terminal => " Below is history. Plug it in again; Ctrl-] C connects, Ctrl-] 1 lists links.",
        _ => " Below is history. Plug the cable in again; C connects, 1 chooses another link.",
    };
    rows.push(Line::styled(format::left(then, columns), theme.warning()));
    rows
}

/// The latest word, on the rule that closes the screen; one too long for it goes on in a second line.
pub fn notice(view: &View, theme: Theme, columns: usize) -> Vec<Line<'static>> {
    let style = match view.notice.as_ref().map(|notice| notice.tone) {
        None => theme.warning(),
        Some(Tone::Quiet) => theme.strong(),
        Some(Tone::Good) => theme.good(),
        Some(Tone::Bad | Tone::Refused) => theme.bad(),
    };
    let texts = notice_rows(view, columns);
    if texts.is_empty() {
        return vec![Line::styled("─".repeat(columns), theme.quiet())];
    }
    let line = |(number, text): (usize, String)| {
        let text = format!(" {text} ");
        let rest = columns.saturating_sub(2 + format::width(&text));
        let (before, after) = if number == 0 { ("──", "─") } else { ("  ", " ") };
        Line::from(vec![
            Span::styled(before, theme.quiet()),
            Span::styled(text, style),
            Span::styled(after.repeat(rest), theme.quiet()),
        ])
    };
    texts.into_iter().enumerate().map(line).collect()
}

/// The lines of the latest word, or else of what is being done.
fn notice_rows(view: &View, columns: usize) -> Vec<String> {
    let text = match &view.notice {
        None if activity(view).is_empty() => return Vec::new(),
        None => format!("{} ...", activity(view)),
        Some(notice) => visible::text(&notice.text),
    };
    let room = columns.saturating_sub(6);
    let mut rows = format::wrap(&text, room);
    if rows.len() > MOST_NOTICE_ROWS {
        let rest = rows.split_off(MOST_NOTICE_ROWS - 1).join(" ");
        rows.push(format::keep_start(&rest, room));
    }
    rows
}

/// The unit's menu.
pub fn menu(theme: Theme) -> Line<'static> {
    let mut line = Line::from(Span::styled(UNIT, theme.quiet()));
    line.spans.extend(hints(theme, &[MENU]));
    line
}

/// The screen's keys and those that work everywhere.
pub fn keys(theme: Theme, bindings: &[Binding]) -> Line<'static> {
    let mut line = Line::from(Span::styled(KEYS, theme.quiet()));
    line.spans.extend(hints(theme, &[bindings, EVERYWHERE]));
    line
}

/// The keys of the terminal screen: those after the prefix, as many as have room.
pub fn terminal_keys(theme: Theme, screen: ScreenId, after_prefix: bool, columns: usize) -> Line<'static> {
    let behind_prefix = |binding: &&Binding| is_letter(binding) && !binding.short.is_empty();
    let mut bindings: Vec<Binding> = screen.bindings().iter().filter(behind_prefix).copied().collect();
    let mut dispensable = screen.dispensable().iter();
    loop {
        let line = prefix_keys(theme, &bindings, after_prefix);
        match dispensable.next() {
            // Behind the last one no blank is needed.
            Some(cmd) if line.width() > columns + 2 => bindings.retain(|binding| binding.cmd != *cmd),
            _ => return line,
        }
    }
}

fn prefix_keys(theme: Theme, bindings: &[Binding], after_prefix: bool) -> Line<'static> {
    let mut line = Line::from(Span::styled(KEYS, theme.quiet()));
    if after_prefix {
        line.push_span(Span::styled("next key is for axcon: ", theme.warning()));
    } else {
        // Without Ctrl-] in front of it every key but this one is the unit's, Q too.
        line.push_span(Span::raw("keys to the unit; "));
        line.spans
            .extend(EVERYWHERE.iter().filter(|binding| binding.cmd == Cmd::Help).flat_map(|help| hint(theme, help)));
        line.push_span(Span::styled("Ctrl-]", theme.key()));
        line.push_span(Span::raw(" then "));
    }
    for binding in bindings {
        line.spans.extend(hint(theme, binding));
    }
    line.push_span(Span::styled("1-9", theme.key()));
    line.push_span(Span::raw(" screen  "));
    let rest = EVERYWHERE.iter().filter(|binding| after_prefix || binding.cmd != Cmd::Help);
    line.spans.extend(rest.filter(|binding| !binding.short.is_empty()).flat_map(|binding| hint(theme, binding)));
    line
}

/// The keys of the help page.
pub fn help_keys(theme: Theme) -> Line<'static> {
    let mut line = Line::from(Span::styled(KEYS, theme.quiet()));
    for (key, meaning) in [("↑↓", "scroll"), ("1-9", "screen"), ("any other key", "back")] {
        line.push_span(Span::styled(key, theme.key()));
        line.push_span(Span::raw(format!(" {meaning}  ")));
    }
    line
}

/// As many of these keys as have room beside those that work everywhere; the dispensable ones go first, in their order.
pub fn fitting(theme: Theme, mut bindings: Vec<Binding>, dispensable: &[Cmd], columns: usize) -> Vec<Binding> {
    // Behind the last one no blank is needed.
    let is_too_wide = |bindings: &[Binding]| keys(theme, bindings).width() > columns + 2;
    for cmd in dispensable {
        if !is_too_wide(&bindings) {
            break;
        }
        bindings.retain(|binding| binding.cmd != *cmd);
    }
    bindings
}

fn is_letter(binding: &Binding) -> bool {
    binding.keys.first().is_some_and(|press| press.name().chars().count() == 1 && !"↑↓".contains(&press.name()))
}

fn hints(theme: Theme, tables: &[&[Binding]]) -> Vec<Span<'static>> {
    tables
        .iter()
        .flat_map(|table| table.iter())
        .filter(|binding| !binding.short.is_empty())
        .flat_map(|binding| hint(theme, binding))
        .collect()
}

fn hint(theme: Theme, binding: &Binding) -> [Span<'static>; 2] {
    let key = match binding.keys.first().map(|press| press.name()) {
        // Two arrows belong together; the footer names them once.
        Some(name) if name == "↓" => "↑↓".to_owned(),
        Some(name) if name == "→" => "←→".to_owned(),
        Some(name) => name,
        None => String::new(),
    };
    [Span::styled(key, theme.key()), Span::raw(format!(" {}  ", binding.short))]
}
