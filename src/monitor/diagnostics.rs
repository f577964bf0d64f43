//! The unit's diagnostics: the newest page as printed, and what its numbers have been since the first.

use crate::time::Instant;
use crate::wire::diagnostics::{self, Quantity};
use crate::wire::{Text, visible};

/// Numbers of a page that are followed at most.
const MOST_TRACKED: usize = 200;

/// The pages so far.
#[derive(Debug, Default)]
pub struct Diagnostics {
    /// Lines of the newest page, as printed.
    pub lines: Vec<String>,
    /// When it came.
    pub at: Option<Instant>,
    /// Pages so far.
    pub pages: u64,
    /// The numbers found on them, in the page's order.
    pub found: Vec<Tracked>,
}

/// A number on the pages, with what it has been.
#[derive(Clone, Debug, PartialEq)]
pub struct Tracked {
    /// What the page calls it.
    pub label: String,
    /// As printed, where there is one.
    pub unit: Option<String>,
    /// Digits after the point, as printed.
    pub decimals: usize,
    /// On the newest page; `None` if it is not there any more.
    pub value: Option<f64>,
    /// Smallest since the first page.
    pub min: f64,
    /// Largest since the first page.
    pub max: f64,
}

impl Tracked {
    /// As it stands on its first page; `None` if its value is not certain.
    pub fn first(quantity: Quantity) -> Option<Self> {
        let Quantity { label, value, decimals, unit } = quantity;
        let value = value?;
        Some(Tracked { label, unit, decimals, value: Some(value), min: value, max: value })
    }
}

impl Diagnostics {
    pub(super) fn page(&mut self, at: Instant, lines: &[Text]) {
        self.lines = lines.iter().map(|line| visible::line(line.text.trim_end().as_bytes())).collect();
        self.at = Some(at);
        self.pages += 1;
        self.found.iter_mut().for_each(|tracked| tracked.value = None);
        let found: Vec<_> = self.lines.iter().flat_map(|line| diagnostics::quantities(line)).collect();
        for quantity in found {
            let Some(value) = quantity.value else { continue };
            let same = |tracked: &Tracked| {
                // Two with one name are on a page one after the other.
                tracked.value.is_none() && tracked.label == quantity.label && tracked.unit == quantity.unit
            };
            match self.found.iter().position(same) {
                Some(place) => {
                    let tracked = &mut self.found[place];
                    tracked.decimals = tracked.decimals.max(quantity.decimals);
                    tracked.value = Some(value);
                    tracked.min = tracked.min.min(value);
                    tracked.max = tracked.max.max(value);
                }
                None if self.found.len() < MOST_TRACKED => self.found.extend(Tracked::first(quantity)),
                None => {}
            }
        }
    }
}

impl Tracked {
    /// One of its numbers, as finely as the page prints them.
    pub fn text(&self, value: f64) -> String {
        let decimals = self.decimals;
        let text = format!("{value:.decimals$}");
        match text.strip_prefix('-') {
            // Nothing is less than nothing.
            Some(digits) if !digits.contains(|digit| matches!(digit, '1'..='9')) => digits.to_owned(),
            _ => text,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::record::Span;

    fn page(lines: &[&str]) -> Vec<Text> {
        lines.iter().map(|line| Text { text: (*line).to_owned(), span: Span::default() }).collect()
    }

    #[test]
    fn numbers_are_followed_from_page_to_page() {
        let mut diagnostics = Diagnostics::default();
        for supply in [24.1, 23.0, 24.0] {
            diagnostics.page(Instant::ZERO, &page(&[&format!("Supply: {supply} V"), "Input 5 uV", "Input 7 uV"]));
        }
        let supply = &diagnostics.found[0];
        assert_eq!((supply.value, supply.min, supply.max), (Some(24.0), 23.0, 24.1));
        assert_eq!(supply.text(supply.min), "23.0", "as finely as any page has printed it");
        assert_eq!(
            diagnostics.found.iter().map(|found| found.value).collect::<Vec<_>>(),
            [Some(24.0), Some(5.0), Some(7.0)]
        );
        let ohm = Tracked { decimals: 2, ..supply.clone() };
        let below = [-0.001, -0.004, -0.006].map(|value| ohm.text(value));
        assert_eq!(below, ["0.00", "0.00", "-0.01"], "nothing is less than nothing");
        diagnostics.page(Instant::ZERO, &page(&["Supply: 24,061 V"]));
        assert_eq!((diagnostics.found[0].value, diagnostics.found.len()), (None, 3), "no number that is not certain");
        diagnostics.page(Instant::ZERO, &page(&["nothing of that"]));
        assert!(diagnostics.found.iter().all(|found| found.value.is_none()));
        assert_eq!((diagnostics.pages, diagnostics.lines.len()), (5, 1));
    }
}
