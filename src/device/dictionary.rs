//! A product's object dictionary as its manual prints it: names, types, access, limits, defaults, meanings.
//!
//! What is here is the same for every unit of a product. It holds no unit's present values: those are with whoever reads
//! them from a unit, and in the emulated unit itself.

use crate::canopen::{DataType, ObjectAddress, Value};

/// All objects of a product, by index.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Dictionary {
    objects: Vec<Object>,
}

/// An object.
#[derive(Clone, Debug, PartialEq)]
pub struct Object {
    /// Index.
    pub index: u16,
    /// Name as the manual prints it.
    pub name: String,
    /// Its shape.
    pub kind: ObjectKind,
    /// Section of the manual that describes it.
    pub section: String,
    /// Its entries by sub-index; a variable has one, at sub-index 0.
    pub entries: Vec<Entry>,
}

/// Shape of an object (CiA 301, section 7.4.3).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ObjectKind {
    /// One value.
    Var,
    /// Entries of one type after sub-index 0, which counts them.
    Array,
    /// Entries of different types after sub-index 0, which counts them.
    Record,
}

/// An entry of an object.
#[derive(Clone, Debug, PartialEq)]
pub struct Entry {
    /// Sub-index.
    pub sub: u8,
    /// Name.
    pub name: String,
    /// Type.
    pub data_type: DataType,
    /// What a network master may do with it.
    pub access: Access,
    /// Whether a PDO may carry it.
    pub mappable: bool,
    /// Its value from the factory; `None` where the unit itself supplies it: measurements, versions, serial number.
    pub default: Option<FactoryValue>,
    /// Which values it takes, within its type.
    pub limits: Limits,
    /// Unit of its value, e.g. `°C`.
    pub unit: Option<String>,
    /// What its values mean, where they are not numbers of something.
    pub meanings: Vec<Meaning>,
    /// What it is for, in a sentence or two.
    pub description: Option<String>,
}

/// Access as an EDS names it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Access {
    /// `ro`
    ReadOnly,
    /// `rw`
    ReadWrite,
}

/// A factory value.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct FactoryValue {
    /// The value, without the node-ID.
    pub value: Value,
    /// Whether the node-ID is added to it: COB-IDs.
    pub plus_node_id: bool,
}

/// Which values an entry takes: those from `low` to `high`, and the `values` besides. Without bounds and values: all of
/// its type. With values and without bounds: only these.
#[derive(Clone, Debug, PartialEq, Default)]
pub struct Limits {
    /// The lowest.
    pub low: Option<Bound>,
    /// The highest.
    pub high: Option<Bound>,
    /// Single values.
    pub values: Vec<Value>,
}

/// One end of a range.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Bound {
    /// This value.
    Value(Value),
    /// The present value of another entry, plus a number.
    Entry {
        /// The other entry.
        at: ObjectAddress,
        /// What is added to it.
        offset: i64,
    },
}

/// What a value means.
#[derive(Clone, Debug, PartialEq)]
pub struct Meaning {
    /// The value.
    pub value: Value,
    /// In words.
    pub text: String,
}

/// Which parameters belong together when they are stored or restored (1010h and 1011h).
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Group {
    /// 1000h-1FFFh, sub-index 2.
    Communication,
    /// 6000h-9FFFh, sub-index 3.
    Application,
    /// 2000h-5FFFh, sub-index 4.
    Manufacturer,
}

impl Dictionary {
    /// A dictionary of these objects, in any order.
    pub fn new(mut objects: Vec<Object>) -> Self {
        objects.sort_by_key(|object| object.index);
        Dictionary { objects }
    }

    /// The objects by index.
    pub fn objects(&self) -> &[Object] {
        &self.objects
    }

    /// The object at an index.
    pub fn object(&self, index: u16) -> Option<&Object> {
        let place = self.objects.binary_search_by_key(&index, |object| object.index).ok()?;
        self.objects.get(place)
    }

    /// An entry.
    pub fn entry(&self, at: ObjectAddress) -> Option<&Entry> {
        self.object(at.index)?.entry(at.sub)
    }

    /// All entries with their places, in order.
    pub fn entries(&self) -> impl Iterator<Item = (ObjectAddress, &Object, &Entry)> {
        self.objects.iter().flat_map(|object| {
            object.entries.iter().map(move |entry| (ObjectAddress::new(object.index, entry.sub), object, entry))
        })
    }
}

impl Object {
    /// The entry at a sub-index.
    pub fn entry(&self, sub: u8) -> Option<&Entry> {
        self.entries.iter().find(|entry| entry.sub == sub)
    }
}

impl FactoryValue {
    /// The value on a unit with this node-ID.
    pub fn on_node(self, node_id: u8) -> Value {
        match self.value {
            Value::Unsigned32(value) if self.plus_node_id => Value::Unsigned32(value + u32::from(node_id)),
            value => value,
        }
    }
}

impl Limits {
    /// Whether a value is within the limits, as far as they depend on no other entry.
    pub fn admit_alone(&self, value: Value) -> bool {
        if self.values.contains(&value) {
            return true;
        }
        let number = value.as_f64();
        let above = |bound: Bound| matches!(bound, Bound::Value(low) if number < low.as_f64());
        let below = |bound: Bound| matches!(bound, Bound::Value(high) if number > high.as_f64());
        match (self.low, self.high) {
            (None, None) => self.values.is_empty(),
            (low, high) => !low.is_some_and(above) && !high.is_some_and(below),
        }
    }
}

impl Entry {
    /// What a value means.
    pub fn meaning(&self, value: Value) -> Option<&str> {
        self.meanings.iter().find(|meaning| meaning.value == value).map(|meaning| meaning.text.as_str())
    }
}

impl Group {
    /// The group of an object; `None` for the data types below 1000h.
    pub fn of(index: u16) -> Option<Group> {
        match index {
            0x1000..=0x1FFF => Some(Group::Communication),
            0x2000..=0x5FFF => Some(Group::Manufacturer),
            0x6000..=0x9FFF => Some(Group::Application),
            _ => None,
        }
    }
}
