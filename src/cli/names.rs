//! What products and loaders are called on the command line.

use crate::device::{LoaderKind, Product};

/// A product by its name, in any case.
///
/// # Errors
/// If there is no such name; the message lists those there are.
pub fn product(name: &str) -> Result<&'static Product, String> {
    Product::named(name).ok_or_else(|| {
        let known: Vec<String> = Product::all().iter().map(|product| product.name.to_lowercase()).collect();
        format!("there is no such product; there is {}", known.join(", "))
    })
}

/// A loader by its name, in any case.
///
/// # Errors
/// If there is no such name; the message lists those there are.
pub fn loader(name: &str) -> Result<LoaderKind, String> {
    LoaderKind::ALL.into_iter().find(|kind| kind.name().eq_ignore_ascii_case(name)).ok_or_else(|| {
        let known = LoaderKind::ALL.map(LoaderKind::name).join(", ");
        format!("there is no such loader; there is {known}")
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_name_is_found_in_any_case_and_a_wrong_one_is_answered_with_the_right_ones() {
        for known in Product::all() {
            assert_eq!(product(&known.name.to_lowercase()).map(|product| &product.name), Ok(&known.name));
        }
        for known in LoaderKind::ALL {
            assert_eq!(loader(&known.name().to_uppercase()), Ok(known));
        }
        let refused = product("toaster").map(|product| &product.name).expect_err("none");
        assert!(refused.starts_with("there is no such product; there is axtc4co, "), "{refused}");
        assert_eq!(loader("g4"), Err("there is no such loader; there is g1, g2, g3, g3-1.3".into()));
    }
}
