//! What was found in a file, what speaks against sending it, and what will happen.

use std::path::Path;

use ratatui::layout::Rect;
use ratatui::text::{Line, Span};

use super::file_name;
use crate::device::{LoaderKind, Product};
use crate::image::{DefectId, Misfit, Software};
use crate::session::UnitState;
use crate::time::Duration;
use crate::tui::image_facts::{Amount, ImageFacts};
use crate::tui::screens::Scene;
use crate::tui::theme::{Palette, Theme};
use crate::tui::view::View;
use crate::tui::visible;
use crate::tui::widgets::{format, lines};
use crate::version::Version;

/// Lines of findings shown at once on a small screen before the plan takes its place.
const LEAST_DEFECT_ROWS: usize = 3;
/// Lines that say what the file is, with their heading.
const REPORT_ROWS: usize = 5;

/// What speaks against sending this image to the unit that is there, besides that it may be another product.
pub(super) fn misfits(facts: &ImageFacts, view: &View, loader: Option<LoaderKind>) -> Vec<Misfit> {
    let noted = || view.noted().and_then(|noted| Product::named(&noted.product));
    let Some((image, product)) = facts.checked.as_ref().zip(view.product().or_else(noted)) else { return Vec::new() };
    let target = product.target_with(loader.unwrap_or(product.loader.kind));
    let is_said = view.facts.version.is_some();
    let software = view.ran().map(if is_said { Software::Runs } else { Software::Ran });
    let stands = |misfit: &Misfit| misfit.id != DefectId::WrongProduct && !facts.allowed.contains(&misfit.id);
    image.misfits(&target, software).into_iter().filter(stands).collect()
}

/// What speaks against sending this image now, one sentence each.
pub(super) fn objections(facts: &ImageFacts, view: &View, loader: Option<LoaderKind>) -> Vec<String> {
    let mut against = Vec::new();
    if facts.is_nameless() {
        against.push("the file does not say what it is. O sends it all the same.".to_owned());
    } else if !facts.ok || facts.checked.is_none() {
        against.push("the file has errors and must not be sent.".to_owned());
    }
    if !view.can_send() {
        against.push("no unit is connected. Press 1 to choose a link.".to_owned());
    }
    if let (Some(unit), Some(image)) = (&view.facts.product, &facts.product)
        && !unit.value.eq_ignore_ascii_case(image)
    {
        let (image, unit) = (visible::text(image), visible::text(&unit.value));
        against.push(format!("the file is for an {image}, the unit is an {unit}. Esc chooses another."));
    }
    if let (Some(noted), Some(image)) = (view.noted(), &facts.product)
        && !noted.product.eq_ignore_ascii_case(image)
    {
        let (image, unit) = (visible::text(image), visible::text(&noted.product));
        against.push(format!(
            "the file is for an {image}, our note says {unit}. Esc chooses another, N if the unit is another."
        ));
    }
    let misfits = misfits(facts, view, loader).into_iter();
    against.extend(misfits.map(|misfit| format!("{}. O sends it all the same.", misfit.message)));
    if let Some(busy) = view.busy() {
        against.push(format!("{busy}."));
    }
    against
}

/// Everything about the file, what speaks against it, and what will happen.
pub(super) fn report(
    scene: Scene,
    facts: &ImageFacts,
    (packed, loader): (bool, Option<LoaderKind>),
    scrolled: usize,
    area: Rect,
) -> Vec<Line<'static>> {
    let theme = scene.theme;
    let version = facts.version.map(|version| format!(" {version}")).unwrap_or_default();
    let product = facts.product.as_deref().map_or("does not say what it is".into(), visible::text);
    let mut rows = vec![
        lines::rule(theme, area.width, "Image", &file_name(&facts.path)),
        lines::labelled(theme, "Software", format!("{product}{version}")),
        lines::labelled(theme, "To send", to_send(facts, packed)),
        lines::labelled(theme, "Check", check_word(theme, facts)),
        loader_line(theme, facts, loader),
    ];
    let plan = plan(theme, scene.view, facts, (packed, loader), area.width);
    if !facts.defects.is_empty() {
        let all = findings(facts, area.width);
        let room = room_beside(&plan, area).min(all.len());
        let first = scrolled.min(all.len() - room);
        let below = all.len() - first - room;
        let range = if below > 0 { format!("↓ {}", format::counted(below, "more line")) } else { String::new() };
        rows.push(lines::rule(theme, area.width, "Findings", &range));
        rows.extend(all.into_iter().skip(first).take(room).map(Line::raw));
    }
    rows.extend(plan);
    rows
}

/// What will be sent: the file's own records, or the same words in others.
fn amount(facts: &ImageFacts, packed: bool) -> Amount {
    if packed && facts.ok { facts.packed } else { facts.own }
}

fn to_send(facts: &ImageFacts, packed: bool) -> String {
    let Amount { records, characters, .. } = amount(facts, packed);
    let told = format!("{}, {}", format::counted(records, "record"), format::counted(characters, "character"));
    if packed && facts.ok { format!("{told}, packed from {}", format::grouped(facts.own.characters)) } else { told }
}

/// Which loader the unit has, and who says so.
fn loader_line(theme: Theme, facts: &ImageFacts, chosen: Option<LoaderKind>) -> Line<'static> {
    let assumed = facts.product.as_deref().and_then(Product::named);
    let text = match (chosen, assumed) {
        (Some(kind), _) => format!("{}, as chosen; ", kind.name()),
        (None, Some(product)) => format!("{}, assumed for every {}; ", product.loader.kind.name(), product.name),
        (None, None) => "as assumed for the product; ".to_owned(),
    };
    let mut line = lines::labelled(theme, "Loader", text);
    line.push_span(Span::styled("G", theme.key()));
    line.push_span(Span::raw(" if the unit has another"));
    line
}

/// Every finding, in as many lines as it needs.
pub(super) fn findings(facts: &ImageFacts, columns: u16) -> Vec<String> {
    let room = usize::from(columns).saturating_sub(6).max(1);
    let lines = |defect: &String| {
        let broken = format::wrap(&visible::text(defect), room);
        broken
            .into_iter()
            .enumerate()
            .map(|(number, line)| format!("{}{line}", if number == 0 { "  " } else { "    " }))
    };
    facts.defects.iter().flat_map(lines).collect()
}

/// How many lines of the findings there are, and how many of them are shown at once beside the plan.
pub(super) fn findings_shown(
    facts: &ImageFacts,
    view: &View,
    sending: (bool, Option<LoaderKind>),
    area: Rect,
) -> (usize, usize) {
    let all = findings(facts, area.width).len();
    let plan = plan(Theme::new(Palette::Mono), view, facts, sending, area.width);
    (all, room_beside(&plan, area).min(all))
}

/// Lines of findings that have room beside the plan.
fn room_beside(plan: &[Line], area: Rect) -> usize {
    usize::from(area.height).saturating_sub(REPORT_ROWS + 1 + plan.len()).max(LEAST_DEFECT_ROWS)
}

fn check_word(theme: Theme, facts: &ImageFacts) -> Span<'static> {
    let findings = match facts.defects.len() {
        0 => String::new(),
        1 => ", one finding".into(),
        count => format!(", {} findings", format::grouped(count)),
    };
    if facts.ok && facts.allowed.is_empty() {
        Span::styled(format!("passed{findings}"), theme.good())
    } else if facts.ok {
        let names: Vec<&str> = facts.allowed.iter().map(|id| id.name()).collect();
        Span::styled(format!("passed in spite of {}{findings}", names.join(", ")), theme.warning())
    } else if facts.is_nameless() {
        Span::styled(format!("passed as a file, but it has no name{findings}"), theme.warning())
    } else {
        Span::styled(format!("failed{findings}"), theme.bad())
    }
}

/// What is going to happen, and what speaks against it or how it is begun.
fn plan(
    theme: Theme,
    view: &View,
    facts: &ImageFacts,
    (packed, loader): (bool, Option<LoaderKind>),
    columns: u16,
) -> Vec<Line<'static>> {
    let room = usize::from(columns).saturating_sub(2);
    let mut rows = vec![lines::rule(theme, columns, "Plan", "")];
    if facts.ok {
        for (number, step) in (1..).zip(steps(view, facts, packed)) {
            rows.extend(hanging(Span::raw(format!("  {number}. ")), &step, room));
        }
        rows.extend(versions(theme, view, facts, room));
    }
    let against = objections(facts, view, loader);
    if against.is_empty() {
        rows.push(Line::from(vec![
            Span::styled("  Enter", theme.key()),
            Span::raw(match (view.needs_label(), view.facts.state) {
                _ if view.noted().is_some() => " asks whether it is that unit. Keep the unit powered meanwhile.",
                (true, UnitState::Loader) => " asks what the label says and starts. Keep the unit powered meanwhile.",
                (false, UnitState::Loader) => " starts. Keep the unit powered meanwhile.",
                _ => " asks for the password and starts. Keep the unit powered meanwhile.",
            }),
        ]));
    } else {
        let refused = |objection: String| hanging(Span::styled("  Cannot start: ", theme.bad()), &objection, room);
        rows.extend(against.into_iter().flat_map(refused));
    }
    rows
}

/// What will be done, one sentence each.
fn steps(view: &View, facts: &ImageFacts, packed: bool) -> [String; 4] {
    let product = facts.product.as_deref().map(visible::text);
    let Amount { characters, time, .. } = amount(facts, packed);
    let time = format::minutes(Duration::from_secs_f64(time.as_secs_f64().ceil()));
    let records = if packed { ", in records of another length" } else { "" };
    let unit = product.as_ref().map_or("the right product".to_owned(), |name| format!("an {name}"));
    let expected = match (product, facts.version) {
        (Some(product), Some(version)) => format!("name {product} {version}"),
        _ => "name what the file holds".to_owned(),
    };
    [
        format!("Make sure that the unit is {unit}."),
        match view.facts.state {
            UnitState::Loader => "Send neither L nor a password: the unit waits in its loader already.".to_owned(),
            _ => "Send L and the password; the unit resets into its loader.".to_owned(),
        },
        format!("Send {} characters{records}: some {time} with what the loader needs.", format::grouped(characters)),
        format!("Wait for the banner of the new software: it must {expected}."),
    ]
}

/// What the unit runs, or ran, and what it will run, in lines of `room` columns.
fn versions(theme: Theme, view: &View, facts: &ImageFacts, room: usize) -> Vec<Line<'static>> {
    let mut rows = vec![lines::labelled(theme, "Unit now", unit_version(view))];
    // The unit that was left in the middle still waits somewhere, though it is not the one that is there now.
    if let Some(noted) = view.link.noted.as_ref().filter(|_| view.facts.state == UnitState::Application) {
        let image = file_name(Path::new(&noted.image));
        let product = visible::text(&noted.product);
        let note = format!("{image} was begun here for an {product}, {}", visible::text(&noted.begun));
        let note = format::keep_start(&note, room.saturating_sub(lines::LABEL_COLUMNS));
        rows.push(lines::labelled(theme, "Our note", note));
    }
    let change = Change::of(view, facts);
    rows.push(lines::labelled(theme, "Afterwards", format!("{} ({})", expected_version(facts), change.words())));
    rows.extend(change.remark().map(|remark| lines::labelled(theme, "Note", Span::styled(remark, theme.warning()))));
    rows
}

/// A text after a label, broken where it has to be: its end may be what there is to do.
fn hanging(label: Span<'static>, text: &str, columns: usize) -> Vec<Line<'static>> {
    let indent = " ".repeat(label.width());
    let broken = format::wrap(text, columns.saturating_sub(label.width())).into_iter().enumerate();
    broken
        .map(|(number, line)| {
            let before = if number == 0 { label.clone() } else { Span::raw(indent.clone()) };
            Line::from(vec![before, Span::raw(line)])
        })
        .collect()
}

fn unit_version(view: &View) -> String {
    let product = view.facts.product.as_ref().map(|known| visible::text(&known.value));
    let version = view.facts.version.as_ref().map(|known| known.value.to_string());
    match (product, version) {
        (Some(product), Some(version)) => format!("{product} {version}"),
        // What the plan compares with is what it names.
        (Some(product), None) => match view.ran() {
            Some(ran) => format!("{product}, ran {ran} before the upload that was begun"),
            None => format!("{product}, version not known"),
        },
        (None, _) => match view.noted() {
            Some(noted) => {
                let image = file_name(Path::new(&noted.image));
                let ran = noted.ran.map(|ran| format!(" {ran}")).unwrap_or_default();
                format!("{}{ran} by our note, before {image} was begun", visible::text(&noted.product))
            }
            None if view.facts.state == UnitState::Loader => "not known; its label says which product it is".into(),
            None => "not known; the unit is asked first".into(),
        },
    }
}

fn expected_version(facts: &ImageFacts) -> String {
    let product = facts.product.as_deref().map_or("what the file holds".into(), visible::text);
    facts.version.map_or_else(|| product.clone(), |version| format!("{product} {version}"))
}

/// What the file is against what the unit runs, or ran before an upload that was left in the middle.
enum Change {
    Newer,
    Same,
    Older,
    /// Of another product, or of a unit that has not said what it is.
    OtherUnit,
    /// Nobody knows what the unit runs.
    UnitUnknown,
    /// The file does not say what it is.
    FileUnknown,
}

impl Change {
    fn of(view: &View, facts: &ImageFacts) -> Change {
        let said = view.facts.product.as_ref().map(|known| known.value.as_str());
        let unit = said.or(view.noted().map(|noted| noted.product.as_str()));
        let is_of_unit = |file: &String| unit.is_some_and(|unit| unit.eq_ignore_ascii_case(file));
        match (&facts.product, view.ran(), facts.version) {
            // Its label will say which product it is, and nothing which version.
            (Some(_), None, Some(_)) if view.needs_label() => Change::UnitUnknown,
            (Some(file), ..) if !is_of_unit(file) => Change::OtherUnit,
            (None, ..) if unit.is_none() => Change::OtherUnit,
            (None, ..) | (_, _, None) => Change::FileUnknown,
            (_, None, _) => Change::UnitUnknown,
            (_, Some(now), Some(then)) => Change::between(now, then),
        }
    }

    fn between(now: Version, then: Version) -> Change {
        match then.cmp(&now) {
            std::cmp::Ordering::Greater => Change::Newer,
            std::cmp::Ordering::Equal => Change::Same,
            std::cmp::Ordering::Less => Change::Older,
        }
    }

    fn words(&self) -> &'static str {
        match self {
            Change::Newer => "newer",
            Change::Same => "the same version again",
            Change::Older => "older: a downgrade",
            Change::OtherUnit | Change::UnitUnknown | Change::FileUnknown => "cannot be compared",
        }
    }

    /// What nobody can find out before the file is sent.
    fn remark(&self) -> Option<&'static str> {
        match self {
            Change::UnitUnknown => Some("Nobody knows which version the unit has: the file may be older."),
            Change::FileUnknown => Some("The file does not say its version: it may be older than the unit's."),
            Change::Newer | Change::Same | Change::Older | Change::OtherUnit => None,
        }
    }
}
