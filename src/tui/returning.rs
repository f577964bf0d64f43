//! The unit that was there before its cable came out, until it is known who is there now.
//!
//! Another unit on the same cable looks the same up to its first answer. So what was known of the one before is put aside
//! when the link is back, what comes meanwhile waits, and the answer decides which of the two goes on.

use std::collections::VecDeque;

use crate::session::{Event, Facts, UnitState};

/// Rows and pages that wait for the answer at most: a fast stream for as long as asking takes.
const MOST_WAITING: usize = 4096;

/// What is put aside.
#[derive(Debug)]
pub struct Returning {
    /// What was known of the unit.
    before: Facts,
    /// What has come from the unit that is there now.
    waiting: VecDeque<Event>,
}

/// Who is there now.
#[derive(Debug, PartialEq)]
pub enum Who {
    /// All that the unit says of itself is as before.
    Same,
    /// It says something else: what it is, and what the one before was.
    Other {
        /// What it is.
        now: String,
        /// What the one before was.
        before: String,
    },
    /// It has not said enough to tell.
    Unknown,
}

impl Returning {
    /// The unit of which this was known.
    pub fn new(before: Facts) -> Self {
        Returning { before, waiting: VecDeque::new() }
    }

    /// Whether it was in its loader.
    pub fn was_in_loader(&self) -> bool {
        self.before.state == UnitState::Loader
    }

    /// Whether its version is known to be that of the unit there now.
    pub fn has_version_of(&self, now: &Facts) -> bool {
        let versions = self.before.version.as_ref().zip(now.version.as_ref());
        versions.is_some_and(|(before, now)| before.value == now.value)
    }

    /// Whether the unit there now has not said its version, while that of the one before is known.
    pub fn lacks_version(&self, now: &Facts) -> bool {
        self.before.version.is_some() && now.version.is_none()
    }

    /// Keeps a row or a page of the unit there now.
    pub fn keep(&mut self, event: Event) {
        if self.waiting.len() == MOST_WAITING {
            self.waiting.pop_front();
        }
        self.waiting.push_back(event);
    }

    /// What has come meanwhile, in its order.
    pub fn release(self) -> VecDeque<Event> {
        self.waiting
    }

    /// Which unit is there, going by what is known now. `None` until one has answered.
    pub fn who(&self, now: &Facts) -> Option<Who> {
        if now.state == UnitState::Silent {
            return None;
        }
        let (before, now) = (Identity::of(&self.before), Identity::of(now));
        Some(match before.agrees_with(&now) {
            false => Who::Other { now: now.words(), before: before.words() },
            // A loader, or a menu without a name, could be anybody's.
            true if before.product.is_none() || now.product.is_none() => Who::Unknown,
            true => Who::Same,
        })
    }
}

/// What a unit says of itself, as far as it has.
struct Identity {
    product: Option<String>,
    version: Option<String>,
    node_id: Option<u8>,
}

impl Identity {
    fn of(facts: &Facts) -> Self {
        Identity {
            product: facts.product.as_ref().map(|known| known.value.to_ascii_uppercase()),
            version: facts.version.as_ref().map(|known| known.value.to_string()),
            node_id: facts.node_id.as_ref().map(|known| known.value),
        }
    }

    /// Whether nothing that both say differs.
    fn agrees_with(&self, other: &Identity) -> bool {
        fn same<T: PartialEq>(one: &Option<T>, other: &Option<T>) -> bool {
            one.is_none() || other.is_none() || one == other
        }
        same(&self.product, &other.product)
            && same(&self.version, &other.version)
            && same(&self.node_id, &other.node_id)
    }

    /// `AXTC4CO 1.1.0, node 127`.
    fn words(&self) -> String {
        let product = self.product.clone().unwrap_or_else(|| "unit without a name".to_owned());
        let version = self.version.as_ref().map(|version| format!(" {version}")).unwrap_or_default();
        let node = self.node_id.map(|node| format!(", node {node}")).unwrap_or_default();
        format!("{product}{version}{node}")
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::record::Span;
    use crate::session::{Known, Origin};
    use crate::version::Version;

    fn facts(product: Option<&str>, version: Option<Version>, node_id: Option<u8>) -> Facts {
        fn known<T>(value: T) -> Known<T> {
            Known { value, origin: Origin::Menu, span: Span::default() }
        }
        Facts {
            state: UnitState::Application,
            product: product.map(|name| known(name.to_owned())),
            version: version.map(known),
            node_id: node_id.map(known),
            ..Facts::default()
        }
    }

    #[test]
    fn a_unit_is_the_same_only_if_it_says_so_and_contradicts_nothing() {
        let version = |patch| Some(Version::new(1, 1, patch));
        let before = || Returning::new(facts(Some("AXTC4CO"), version(0), Some(127)));
        let who = |product, version, node| before().who(&facts(product, version, node));
        assert_eq!(who(Some("axtc4co"), version(0), Some(127)), Some(Who::Same));
        assert_eq!(who(Some("AXTC4CO"), None, None), Some(Who::Same), "what is not said contradicts nothing");
        assert_eq!(who(None, version(0), Some(127)), Some(Who::Unknown));
        let other = |now: &str| Some(Who::Other { now: now.into(), before: "AXTC4CO 1.1.0, node 127".into() });
        assert_eq!(who(Some("AXRTD8CO"), version(0), None), other("AXRTD8CO 1.1.0"));
        assert_eq!(who(Some("AXTC4CO"), version(1), None), other("AXTC4CO 1.1.1"));
        assert_eq!(who(None, None, Some(5)), other("unit without a name, node 5"));
        assert_eq!(before().who(&Facts::default()), None, "nobody has answered");
        let nameless = Returning::new(facts(None, None, None));
        assert_eq!(nameless.who(&facts(Some("AXTC4CO"), version(0), None)), Some(Who::Unknown));
    }

    #[test]
    fn what_waits_is_bounded() {
        let mut returning = Returning::new(Facts::default());
        (0..MOST_WAITING + 5).for_each(|count| returning.keep(Event::EntriesRead(count)));
        let waited = returning.release();
        assert_eq!((waited.len(), waited.front()), (MOST_WAITING, Some(&Event::EntriesRead(5))));
    }
}
