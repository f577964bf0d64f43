//! Rewrites a source file with each mutant behind its switch.

use std::cmp::Reverse;
use std::ops::Range;

use crate::find::{Mutant, Places, Shape};

/// A file with switches.
#[derive(Debug, Default)]
pub struct Schema {
    pub text: String,
    /// Where in the text each mutant is.
    pub branches: Vec<Branch>,
}

/// What one mutant has put into the text.
#[derive(Debug)]
pub struct Branch {
    pub number: u32,
    /// The text that is only run when it is on.
    pub own: Range<usize>,
    /// With what it replaces.
    pub whole: Range<usize>,
}

/// A place with the mutants that are still in use, by their numbers.
type Kept<'a> = (usize, usize, Shape, Vec<(u32, &'a Mutant)>);

/// Writes the mutants of a file, numbered from `first` in their order, but for the dropped ones.
pub fn write(source: &str, places: &Places, first: u32, is_dropped: impl Fn(u32) -> bool) -> Schema {
    let mut number = first;
    let mut kept: Vec<Kept> = Vec::new();
    for (&(start, Reverse(end), shape), mutants) in places {
        let numbered = (number..).zip(mutants);
        number += mutants.len() as u32;
        let mutants: Vec<_> = numbered.filter(|&(number, _)| !is_dropped(number)).collect();
        if !mutants.is_empty() {
            kept.push((start, end, shape, mutants));
        }
    }
    let mut schema = Schema::default();
    let mut rest = kept.as_slice();
    schema.part(source, 0..source.len(), &mut rest);
    schema
}

impl Schema {
    /// Writes a part of the source, with the places within it.
    fn part(&mut self, source: &str, part: Range<usize>, rest: &mut &[Kept<'_>]) {
        let mut at = part.start;
        while let Some(((start, end, shape, mutants), after)) = rest.split_first() {
            // What is inserted after a pattern does not belong to an expression that ends there.
            if *start > part.end || *end > part.end || (*start == part.end && part.end < source.len()) {
                break;
            }
            *rest = after;
            self.text.push_str(&source[at..*start]);
            at = *end;
            let begun = self.text.len();
            match shape {
                Shape::Expression => {
                    self.text.push('(');
                    self.alternatives(mutants);
                    self.text.push_str(" else { ");
                    self.part(source, *start..*end, rest);
                    self.text.push_str(" })");
                }
                Shape::Entry => {
                    self.alternatives(mutants);
                    self.text.push(' ');
                }
                Shape::Arm => {
                    for (number, _) in mutants {
                        let own = self.text.len();
                        self.text.push_str(&format!(" if !crate::mutant::on({number})"));
                        self.branches.push(Branch { number: *number, own: own..self.text.len(), whole: 0..0 });
                    }
                }
            }
            let whole = begun..self.text.len();
            for branch in self.branches.iter_mut().rev() {
                if mutants.iter().any(|&(number, _)| number == branch.number) {
                    branch.whole = whole.clone();
                }
            }
        }
        self.text.push_str(&source[at..part.end]);
    }

    fn alternatives(&mut self, mutants: &[(u32, &Mutant)]) {
        for (place, (number, mutant)) in mutants.iter().enumerate() {
            let separator = if place == 0 { "" } else { " else " };
            self.text.push_str(&format!("{separator}if crate::mutant::on({number}) {{ "));
            let own = self.text.len();
            self.text.push_str(&mutant.text);
            self.branches.push(Branch { number: *number, own: own..self.text.len(), whole: 0..0 });
            self.text.push_str(" }");
        }
    }
}
