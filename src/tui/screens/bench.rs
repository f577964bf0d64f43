//! The bench of an emulated unit: its sensors, its power, its faults.
//!
//! Everything here is an order in words, the same that `axcon emulate` takes; the emulated unit answers in words too.

use std::collections::VecDeque;

use ratatui::Frame;
use ratatui::crossterm::event::KeyCode;
use ratatui::layout::Rect;
use ratatui::style::Style;
use ratatui::text::{Line, Span};

use super::Scene;
use crate::device::Product;
use crate::monitor::Channel;
use crate::time::Instant;
use crate::tui::action::Action;
use crate::tui::keymap::{Binding, Cmd, Press};
use crate::tui::popup::Question;
use crate::tui::view::{LinkState, View};
use crate::tui::visible;
use crate::tui::widgets::{format, lines};
use crate::wire::stream::Source;

/// Name on the tab.
pub const TITLE: &str = "Bench";

/// Keys of the screen.
pub const BINDINGS: &[Binding] = &[
    Binding { keys: &[Press::Plain(KeyCode::Up)], cmd: Cmd::Up, short: "", long: "input above" },
    Binding { keys: &[Press::Plain(KeyCode::Down)], cmd: Cmd::Down, short: "input", long: "input below" },
    Binding { keys: &[Press::Plain(KeyCode::Left)], cmd: Cmd::Left, short: "", long: "10 °C colder" },
    Binding { keys: &[Press::Plain(KeyCode::Right)], cmd: Cmd::Right, short: "10 °C", long: "10 °C warmer" },
    Binding {
        keys: &[Press::Plain(KeyCode::Enter)],
        cmd: Cmd::Accept,
        short: "set",
        long: "type the temperature of the chosen input's sensor",
    },
    Binding {
        keys: &[Press::Plain(KeyCode::Char('o'))],
        cmd: Cmd::OpenWire,
        short: "open",
        long: "break the sensor's wire",
    },
    Binding {
        keys: &[Press::Plain(KeyCode::Char('h'))],
        cmd: Cmd::ShortWire,
        short: "short",
        long: "short the sensor",
    },
    Binding {
        keys: &[Press::Plain(KeyCode::Char('r'))],
        cmd: Cmd::Repair,
        short: "repair",
        long: "make its wires whole again",
    },
    Binding {
        keys: &[Press::Plain(KeyCode::Char('p'))],
        cmd: Cmd::Power,
        short: "power",
        long: "pull the power for a second",
    },
    Binding {
        keys: &[Press::Plain(KeyCode::Char('/'))],
        cmd: Cmd::Type,
        short: "order",
        long: "type an order to the unit; the box says which there are",
    },
];

/// What the footer shows once the unit is gone with its link: nothing can be done to it any more.
const LOST_KEYS: &[Binding] =
    &[Binding { keys: &[Press::Plain(KeyCode::Char('c'))], cmd: Cmd::Reconnect, short: "new unit", long: "" }];

/// What an arrow changes.
const STEP: f64 = 10.0;
/// Where a sensor begins whose temperature nobody knows.
const ROOM_TEMPERATURE: f64 = 20.0;
/// Columns of an order beside its answer.
const ORDER_COLUMNS: usize = 28;
/// What there is to do where nothing is emulated.
pub const NO_UNIT: &str = "No emulated unit is connected: press 1 and choose one.";
/// What there is to do once the unit is gone with its link.
const GONE: &str = "The emulated unit is gone with its link: C starts a new one.";
/// Orders that are remembered.
const KEPT_ORDERS: usize = 100;

/// The page.
#[derive(Debug, Default)]
pub struct Bench {
    input: usize,
    /// What was last done to each input, in its order.
    inputs: Vec<Input>,
    /// Orders and their answers, newest last.
    orders: VecDeque<Order>,
}

#[derive(Clone, Debug, Default)]
struct Input {
    temperature: Option<f64>,
    wire: Wire,
}

#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
enum Wire {
    #[default]
    Whole,
    Open,
    Shorted,
}

#[derive(Debug)]
struct Order {
    at: Instant,
    line: String,
    answer: Option<Result<Option<String>, String>>,
}

impl Bench {
    /// Another link: another bench.
    pub fn begin_link(&mut self) {
        *self = Bench::default();
    }

    /// An order goes to the unit.
    pub fn ordered(&mut self, at: Instant, line: String) {
        self.orders.push_back(Order { at, line, answer: None });
        if self.orders.len() > KEPT_ORDERS {
            self.orders.pop_front();
        }
    }

    /// What came of it.
    pub fn answered(&mut self, line: &str, answer: Result<Option<String>, String>) {
        if let Some(order) = self.orders.iter_mut().find(|order| order.line == line && order.answer.is_none()) {
            let done = answer.is_ok();
            order.answer = Some(answer);
            if done {
                self.remember(line);
            }
        }
    }

    /// What a command does here.
    pub fn on(&mut self, cmd: Cmd, view: &View) -> Option<Action> {
        let Some(product) = view.emulated() else { return Some(Action::Tell(NO_UNIT.to_owned())) };
        if !view.can_send() && !matches!(cmd, Cmd::Up | Cmd::Down) {
            return Some(Action::Tell(GONE.to_owned()));
        }
        let last = usize::from(product.measurement.channels).saturating_sub(1);
        let number = self.input + 1;
        let warmer = |by: f64| {
            let set = self.inputs.get(self.input).and_then(|input| input.temperature);
            // Keys may be faster than the unit.
            let present = self.ordered_temperature(number).or(set);
            let present = present.or_else(|| streamed(view, product, self.input)).unwrap_or(ROOM_TEMPERATURE);
            Some(Action::Order(format!("set {number} temperature {:.1}", present + by)))
        };
        match cmd {
            Cmd::Up => self.input = self.input.saturating_sub(1),
            Cmd::Down => self.input = (self.input + 1).min(last),
            Cmd::Left => return warmer(-STEP),
            Cmd::Right => return warmer(STEP),
            Cmd::Accept => return Some(Action::Ask(Question::temperature(number))),
            Cmd::OpenWire => return Some(Action::Order(format!("open {number}"))),
            Cmd::ShortWire => return Some(Action::Order(format!("short {number}"))),
            Cmd::Repair => return Some(Action::Order(format!("repair {number}"))),
            Cmd::Power => return Some(Action::Order("power cycle 1".into())),
            Cmd::Type => return Some(Action::Ask(Question::order())),
            _ => {}
        }
        None
    }

    /// The keys that mean something now, for the footer.
    pub fn footer(view: &View) -> Vec<Binding> {
        match view.link.state {
            LinkState::Lost(_) => LOST_KEYS.to_vec(),
            LinkState::Closed | LinkState::Opening | LinkState::Open => BINDINGS.to_vec(),
        }
    }

    /// What the newest order that has not been answered yet sets an input to.
    fn ordered_temperature(&self, number: usize) -> Option<f64> {
        let open = self.orders.iter().rev().take_while(|order| order.answer.is_none());
        let mut of_input = open.filter_map(|order| {
            order.line.strip_prefix(&format!("set {number} temperature "))?.trim().parse::<f64>().ok()
        });
        of_input.next()
    }

    /// What an order has changed about an input, to show it beside the input.
    fn remember(&mut self, line: &str) {
        let words: Vec<&str> = line.split_whitespace().collect();
        let number =
            words.get(1).and_then(|word| word.parse::<usize>().ok()).filter(|&number| (1..=64).contains(&number));
        let Some(place) = number.map(|number| number - 1) else { return };
        if self.inputs.len() <= place {
            self.inputs.resize(place + 1, Input::default());
        }
        let Some(input) = self.inputs.get_mut(place) else { return };
        match words.as_slice() {
            ["set", _, "temperature", value] => input.temperature = value.parse().ok().or(input.temperature),
            ["process", _] => input.temperature = None,
            ["open", ..] => input.wire = Wire::Open,
            ["short", _] => input.wire = Wire::Shorted,
            ["repair", _] => input.wire = Wire::Whole,
            _ => {}
        }
    }

    /// The picture.
    pub fn draw(&self, scene: Scene, area: Rect, frame: &mut Frame) {
        let theme = scene.theme;
        let Some(product) = scene.view.emulated() else {
            let texts = ["Here the sensors, the cable and the power of an emulated unit are in your hands.", NO_UNIT];
            let mut rows = vec![lines::rule(theme, area.width, "Bench", "")];
            rows.extend(texts.iter().flat_map(|text| lines::paragraph(text, usize::from(area.width), Style::new())));
            return lines::draw(frame, area, rows);
        };
        let newest = scene.view.unit.monitor.stream.newest.map(|at| format::time_of_day(scene.start_of_day, at));
        let newest = newest.map(|time| format!(", newest row {time}")).unwrap_or_default();
        let remark = format!("of this emulated {}{newest}", product.name);
        let mut rows = vec![lines::rule(theme, area.width, "Sensors", &remark)];
        let heads = format!("    {:<8}{:<20}{:<10}{:>16}   {}", "Input", "Set to", "Wire", "The unit says", "State");
        rows.push(Line::styled(heads, theme.quiet()));
        rows.extend((0..usize::from(product.measurement.channels)).map(|place| self.row(scene, product, place)));
        rows.push(Line::styled(
            scene.view.why_old().map(|why| format!("  {}", why.text())).unwrap_or_default(),
            theme.warning(),
        ));
        let (upper, rest) = lines::split(area, rows.len() as u16);
        lines::draw(frame, upper, rows);
        let (heading, log) = lines::split(rest, 1);
        lines::draw(frame, heading, [lines::rule(theme, area.width, "Orders", "and what came of them")]);
        if self.orders.is_empty() {
            let text = "  None yet. Without orders the sensors follow the emulator's default process.";
            return lines::draw(frame, log, [Line::styled(text, theme.quiet())]);
        }
        let room = usize::from(log.height);
        let newest = self.orders.iter().skip(self.orders.len().saturating_sub(room));
        let rows: Vec<Line> = newest.flat_map(|order| order_rows(scene, order, area.width)).collect();
        let above = rows.len().saturating_sub(room);
        lines::draw(frame, log, rows.into_iter().skip(above));
    }

    fn row(&self, scene: Scene, product: &Product, place: usize) -> Line<'static> {
        let theme = scene.theme;
        let input = self.inputs.get(place).cloned().unwrap_or_default();
        let is_chosen = place == self.input;
        let set = match input.temperature {
            Some(value) => format!("{value:.1} °C"),
            None => "default process".into(),
        };
        let (wire, style) = match input.wire {
            Wire::Whole => ("whole", Style::new()),
            Wire::Open => ("broken", theme.bad()),
            Wire::Shorted => ("shorted", theme.bad()),
        };
        let channel = channel_of(scene.view, product, place);
        let decimals = scene.view.unit.monitor.stream.decimals;
        let says = format::decimal(channel.and_then(|channel| channel.reading.value()), decimals);
        let words = channel.map_or("", Channel::words);
        let says_style = if scene.view.why_old().is_some() { theme.quiet() } else { Style::new() };
        let name = format!("  {} {:<8}", if is_chosen { "›" } else { " " }, place + 1);
        Line::from(vec![
            Span::styled(name, if is_chosen { theme.strong() } else { Style::new() }),
            Span::raw(format!("{set:<20}")),
            Span::styled(format!("{wire:<10}"), style),
            Span::styled(format!("{says:>16}   {words}"), says_style),
        ])
    }
}

/// The stream's channel of an input: a unit may send its cold junction in front.
fn channel_of<'a>(view: &'a View, product: &Product, place: usize) -> Option<&'a Channel> {
    let channels = &view.unit.monitor.stream.channels;
    let in_front = channels.len().checked_sub(usize::from(product.measurement.channels))?;
    channels.get(in_front + place)
}

fn streamed(view: &View, product: &Product, place: usize) -> Option<f64> {
    let is_temperature = view.unit.monitor.stream.source == Some(Source::FieldValue);
    channel_of(view, product, place).filter(|_| is_temperature)?.reading.value()
}

/// An order and its answer side by side, each in as many lines as it needs: what is refused says why at its end.
fn order_rows(scene: Scene, order: &Order, columns: u16) -> Vec<Line<'static>> {
    let theme = scene.theme;
    let time = format::time_of_day(scene.start_of_day, order.at);
    let (answer, style) = match &order.answer {
        None => ("...".to_owned(), theme.quiet()),
        Some(Ok(None)) => ("done".into(), theme.good()),
        Some(Ok(Some(text))) => (visible::text(text), Style::new()),
        Some(Err(why)) => (format!("refused: {}", visible::text(why)), theme.bad()),
    };
    let asked = format::wrap(&visible::text(&order.line), ORDER_COLUMNS);
    let room = usize::from(columns).saturating_sub(ORDER_COLUMNS + 14);
    let answered = format::wrap(&answer, room);
    let row = |number: usize| {
        let text = |lines: &[String]| lines.get(number).cloned().unwrap_or_default();
        let time = if number == 0 { time.as_str() } else { "" };
        Line::from(vec![
            Span::styled(format!("  {time:<8}  "), theme.quiet()),
            Span::raw(format!("{}  ", format::left(&text(&asked), ORDER_COLUMNS))),
            Span::styled(text(&answered), style),
        ])
    };
    (0..asked.len().max(answered.len())).map(row).collect()
}
