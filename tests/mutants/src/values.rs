//! The obvious values of a type, as a lazy function would return them.

use syn::{GenericArgument, PathArguments, Type};

/// Expressions of this type. What is only guessed is dropped if it does not compile.
pub fn of(result: &Type) -> Vec<String> {
    let texts = |values: &[&str]| values.iter().map(|&value| value.to_owned()).collect();
    match result {
        Type::Tuple(tuple) if tuple.elems.is_empty() => vec![String::new()],
        Type::Path(path) => {
            let Some(last) = path.path.segments.last() else { return Vec::new() };
            let inner = || inner(&last.arguments);
            match last.ident.to_string().as_str() {
                "bool" => texts(&["true", "false"]),
                "u8" | "u16" | "u32" | "u64" | "usize" | "u128" => texts(&["0", "1"]),
                "i8" | "i16" | "i32" | "i64" | "isize" | "i128" => texts(&["0", "1", "-1"]),
                "f32" | "f64" => texts(&["0.0", "1.0", "-1.0"]),
                "String" => texts(&["String::new()", "String::from(\"xyzzy\")"]),
                "Vec" => texts(&["Vec::new()"]),
                "Option" => {
                    let some = inner().into_iter().flat_map(of).map(|value| format!("Some({})", filled(&value)));
                    std::iter::once("None".to_owned()).chain(some).collect()
                }
                "Result" => inner().into_iter().flat_map(of).map(|value| format!("Ok({})", filled(&value))).collect(),
                _ => texts(&["Default::default()"]),
            }
        }
        Type::Reference(reference) if reference.mutability.is_none() => match &*reference.elem {
            Type::Path(path) if path.path.is_ident("str") => texts(&["\"\"", "\"xyzzy\""]),
            Type::Slice(_) => texts(&["&[]"]),
            _ => Vec::new(),
        },
        Type::Tuple(_) | Type::Array(_) => texts(&["Default::default()"]),
        _ => Vec::new(),
    }
}

/// The first type between the brackets.
fn inner(arguments: &PathArguments) -> Option<&Type> {
    let PathArguments::AngleBracketed(arguments) = arguments else { return None };
    arguments.args.iter().find_map(|argument| match argument {
        GenericArgument::Type(found) => Some(found),
        _ => None,
    })
}

/// Nothing, as a value.
fn filled(value: &str) -> &str {
    if value.is_empty() { "()" } else { value }
}
