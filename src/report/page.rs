//! HTML, as little of it as a report needs.

use super::{Cell, Look};

/// A page being written.
pub struct Page {
    html: String,
}

const STYLE: &str = "body{font:15px/1.4 system-ui,sans-serif;max-width:70em;margin:2em auto;padding:0 1em;color:#222}\
h1{font-size:1.5em}h2{font-size:1.15em;border-bottom:1px solid #999;margin-top:2em}\
table{border-collapse:collapse}td,th{padding:.15em .8em .15em 0;text-align:left;vertical-align:top}\
th{color:#666;font-weight:normal}td.n{text-align:right;font-variant-numeric:tabular-nums}\
td.bad{color:#a00;font-weight:bold}td.mark{background:#fff3c4;font-weight:bold}.remark{color:#a00}\
pre{white-space:pre-wrap;overflow-wrap:anywhere;font-size:13px;background:#f6f6f6;padding:.8em}\
svg{display:block;margin:1em 0}svg text{font-size:11px;fill:#666}@media print{pre{background:none;padding:0}}";

impl Page {
    /// A page with this title.
    pub fn new(title: &str) -> Self {
        let title = escaped(title);
        let html = format!(
            "<!DOCTYPE html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\">\n<title>{title}</title>\n\
             <style>{STYLE}</style>\n</head>\n<body>\n<h1>{title}</h1>\n"
        );
        Page { html }
    }

    /// A heading.
    pub fn section(&mut self, heading: &str) {
        self.html.push_str(&format!("<h2>{}</h2>\n", escaped(heading)));
    }

    /// A paragraph.
    pub fn paragraph(&mut self, text: &str) {
        self.html.push_str(&format!("<p>{}</p>\n", escaped(text)));
    }

    /// A paragraph that should not be overlooked.
    pub fn remark(&mut self, text: &str) {
        self.html.push_str(&format!("<p class=\"remark\">{}</p>\n", escaped(text)));
    }

    /// A table.
    pub fn table<const COLUMNS: usize>(
        &mut self,
        heads: &[&str; COLUMNS],
        rows: impl IntoIterator<Item = [Cell; COLUMNS]>,
    ) {
        let heads: String = heads.iter().map(|head| format!("<th>{}</th>", escaped(head))).collect();
        self.html.push_str(&format!("<table>\n<tr>{heads}</tr>\n"));
        for row in rows {
            let cells: String = row
                .iter()
                .map(|cell| {
                    // The classes of the page's style.
                    let class = match cell.look {
                        Look::Plain => "",
                        Look::Bad => " class=\"bad\"",
                        Look::Marked => " class=\"mark\"",
                        Look::Number => " class=\"n\"",
                    };
                    format!("<td{class}>{}</td>", escaped(&cell.text))
                })
                .collect();
            self.html.push_str(&format!("<tr>{cells}</tr>\n"));
        }
        self.html.push_str("</table>\n");
    }

    /// Text as it came, line by line.
    pub fn text<'a>(&mut self, lines: impl IntoIterator<Item = &'a str>) {
        self.html.push_str("<pre>");
        for line in lines {
            self.html.push_str(&escaped(line));
            self.html.push('\n');
        }
        self.html.push_str("</pre>\n");
    }

    /// A picture, escaped already.
    pub fn picture(&mut self, svg: &str) {
        self.html.push_str(svg);
        self.html.push('\n');
    }

    /// The page as it is written.
    pub fn end(mut self) -> String {
        self.html.push_str("</body>\n</html>\n");
        self.html
    }
}

/// Text that is text and nothing else; control characters become visible signs.
pub fn escaped(text: &str) -> String {
    let mut safe = String::with_capacity(text.len());
    for character in text.chars() {
        match character {
            '&' => safe.push_str("&amp;"),
            '<' => safe.push_str("&lt;"),
            '>' => safe.push_str("&gt;"),
            '"' => safe.push_str("&quot;"),
            '\'' => safe.push_str("&#39;"),
            control if control.is_control() => safe.push(char::REPLACEMENT_CHARACTER),
            character => safe.push(character),
        }
    }
    safe
}
