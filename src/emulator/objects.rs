//! The unit's live object dictionary: every entry's present value, what may be written to it, and what a write brings
//! about.
//!
//! Two doors: [`read`](Objects::read) and [`write`](Objects::write) are the network's, with a refusal for each
//! violation; [`get`](Objects::get) and [`set`](Objects::set) are the firmware's own, which knows its entries.

use crate::canopen::{Abort, ObjectAddress, Value};
use crate::device::Product;

/// Present values of all entries.
#[derive(Clone, Debug)]
pub struct Objects {
    product: &'static Product,
    /// By place in the product's dictionary.
    values: Vec<(ObjectAddress, Value)>,
}

impl Objects {
    /// As the product leaves the factory.
    pub fn factory(product: &'static Product, node_id: u8) -> Self {
        let values = product
            .dictionary
            .entries()
            .map(|(at, _, entry)| {
                let zero = entry.data_type.decode(&vec![0; entry.data_type.bytes()]).expect("as long as the type");
                (at, entry.default.map_or(zero, |default| default.on_node(node_id)))
            })
            .collect();
        Objects { product, values }
    }

    /// The firmware reads an entry.
    ///
    /// # Panics
    /// If the product has no such entry.
    pub fn get(&self, index: u16, sub: u8) -> Value {
        let at = ObjectAddress::new(index, sub);
        let place = self.place(at).unwrap_or_else(|| panic!("{} has no entry {at}", self.product.name));
        self.values[place].1
    }

    /// The firmware reads a whole number.
    ///
    /// # Panics
    /// If the product has no such entry, or it is a REAL32.
    pub fn integer(&self, index: u16, sub: u8) -> i64 {
        self.get(index, sub).as_integer().unwrap_or_else(|| panic!("{index:04X}h is no whole number"))
    }

    /// The firmware reads a number.
    ///
    /// # Panics
    /// If the product has no such entry.
    pub fn number(&self, index: u16, sub: u8) -> f64 {
        self.get(index, sub).as_f64()
    }

    /// The firmware sets an entry, whatever its access and limits.
    ///
    /// # Panics
    /// If the product has no such entry, or it is of another type.
    pub fn set(&mut self, index: u16, sub: u8, value: Value) {
        let at = ObjectAddress::new(index, sub);
        let place = self.place(at).unwrap_or_else(|| panic!("{} has no entry {at}", self.product.name));
        assert_eq!(self.values[place].1.data_type(), value.data_type(), "{at}");
        self.values[place].1 = value;
    }

    /// The network reads an entry.
    ///
    /// # Errors
    /// If there is no such object or entry.
    pub fn read(&self, at: ObjectAddress) -> Result<Value, Abort> {
        match self.place(at) {
            Some(place) => Ok(self.values[place].1),
            None if self.product.dictionary.object(at.index).is_none() => Err(Abort::NoSuchObject),
            None => Err(Abort::NoSuchEntry),
        }
    }

    fn place(&self, at: ObjectAddress) -> Option<usize> {
        self.values.binary_search_by_key(&at, |(at, _)| *at).ok()
    }
}
