//! What V shows: first the PDO communication and mapping parameters, then object by object (manuals, section 4.1.1), all
//! with their active values. How a line looks is the dialect's business.

use crate::canopen::ObjectAddress;
use crate::device::Product;
use crate::device::dictionary::Object;
use crate::emulator::dialect::ViewEntry;
use crate::emulator::objects::Objects;

/// Objects of the first block: all PDO communication and mapping parameters.
pub fn pdo_block(product: &'static Product) -> impl Iterator<Item = &'static Object> {
    product.dictionary.objects().iter().filter(|object| is_pdo(object))
}

/// The object at this place of the walk that follows the block, `None` after the last.
pub fn object(product: &'static Product, place: usize) -> Option<&'static Object> {
    product.dictionary.objects().iter().filter(|object| !is_pdo(object)).nth(place)
}

/// An object's entries with their present values.
pub fn entries<'a>(object: &'static Object, objects: &'a Objects) -> impl Iterator<Item = ViewEntry> + 'a {
    object.entries.iter().map(|entry| {
        let value = objects.read(ObjectAddress::new(object.index, entry.sub)).expect("an entry of the product");
        ViewEntry { entry, value }
    })
}

fn is_pdo(object: &Object) -> bool {
    matches!(object.index, 0x1400..=0x1BFF)
}
