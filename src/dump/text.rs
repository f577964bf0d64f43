//! Dumps as text.

use super::{Dump, DumpEntry};

impl Dump {
    /// For people: a line for each entry, `*` before what differs from the factory's, and what is missing.
    pub fn table(&self) -> String {
        let mut text = String::new();
        let compared = match self.product {
            Some(_) => match self.deviations() {
                1 => "1 differs from the factory's (*)".to_owned(),
                number => format!("{number} differ from the factory's (*)"),
            },
            None => "compared with nothing: the unit does not say which product it is".to_owned(),
        };
        for entry in &self.entries {
            let DumpEntry { name, unit, meaning, .. } = entry;
            let value = entry.shown();
            let unit =
                unit.as_deref().filter(|_| entry.value.is_some()).map(|unit| format!(" {unit}")).unwrap_or_default();
            let meaning = meaning.as_deref().map(|meaning| format!("  {meaning}")).unwrap_or_default();
            let (at, mark) = (entry.at(), if entry.deviates { "*" } else { " " });
            let factory = if entry.deviates { format!("  (factory {})", entry.shown_default()) } else { String::new() };
            text.push_str(&format!("{mark} {at}  {name:<58} {value:>14}{unit}{meaning}{factory}\n"));
        }
        let entries = if self.entries.len() == 1 { "entry" } else { "entries" };
        text.push_str(&format!("{} {entries}, {compared}\n", self.entries.len()));
        if !self.missing.is_empty() {
            let list: Vec<String> = self.missing.iter().map(|missing| missing.at().to_string()).collect();
            text.push_str(&format!("not shown by the unit: {}\n", list.join(", ")));
        }
        text
    }

    /// For spreadsheets, with a heading. A text that a spreadsheet would take for a formula gets a `'` in front; numbers
    /// never do.
    pub fn csv(&self) -> String {
        let mut text = String::from("index,subindex,name,value,unit,meaning,default,deviates,text,doubtful\n");
        for entry in &self.entries {
            let number =
                |number: &Option<serde_json::Number>| number.as_ref().map(ToString::to_string).unwrap_or_default();
            let fields = [
                format!("{:04X}", entry.index),
                entry.subindex.to_string(),
                quoted(&entry.name),
                number(&entry.value),
                quoted(entry.unit.as_deref().unwrap_or_default()),
                quoted(entry.meaning.as_deref().unwrap_or_default()),
                number(&entry.default),
                u8::from(entry.deviates).to_string(),
                quoted(&entry.text),
                u8::from(entry.doubtful).to_string(),
            ];
            text.push_str(&fields.join(","));
            text.push('\n');
        }
        text
    }
}

/// A text as a field that no spreadsheet evaluates: it comes from the unit, or from a dump that anybody may have edited.
fn quoted(text: &str) -> String {
    let is_formula = text.trim_start().starts_with(['=', '+', '-', '@']) && text.trim().parse::<f64>().is_err();
    let text = if is_formula { format!("'{text}") } else { text.to_owned() };
    if text.contains([',', '"', '\n', '\r']) { format!("\"{}\"", text.replace('"', "\"\"")) } else { text }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::device::Product;

    #[test]
    fn no_text_of_a_csv_is_a_formula_and_numbers_stay_numbers() {
        let mut dump = Dump::factory(Product::named("AXTC4CO").expect("built in"));
        dump.entries.truncate(1);
        let entry = &mut dump.entries[0];
        (entry.index, entry.name) = (0x100A, "+cmd|'/c calc'!A0".into());
        (entry.value, entry.default) = (serde_json::Number::from_f64(-4.5), Some((-1).into()));
        (entry.unit, entry.meaning) = (Some("-1+1".into()), Some("on".into()));
        for (text, field) in [
            ("=HYPERLINK(\"http://x\",\"y\")", "\"'=HYPERLINK(\"\"http://x\"\",\"\"y\"\")\""),
            ("-4.50", "-4.50"),
            ("- - -", "'- - -"),
            ("0x10", "0x10"),
        ] {
            dump.entries[0].text = text.into();
            let csv = dump.csv();
            let expected = format!("100A,0,'+cmd|'/c calc'!A0,-4.5,'-1+1,on,-1,0,{field},0");
            assert_eq!(csv.lines().nth(1), Some(expected.as_str()));
        }
    }

    #[test]
    fn bits_and_what_the_factory_makes_them_are_written_alike() {
        let mut dump = Dump::factory(Product::named("AXTC4CO").expect("built in"));
        dump.entries.truncate(1);
        let entry = &mut dump.entries[0];
        (entry.bits, entry.deviates) = (true, true);
        (entry.value, entry.default) = (Some(0x1FF.into()), Some(0x27F.into()));
        assert!(
            dump.table().contains("0x000001FF") && dump.table().contains("(factory 0x0000027F)"),
            "{}",
            dump.table()
        );
        assert!(dump.table().ends_with("\n1 entry, 1 differs from the factory's (*)\n"), "{}", dump.table());
    }
}
