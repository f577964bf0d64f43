//! A channel's curve as a picture in the page (SVG).

use super::page::escaped;
use crate::time::Instant;

/// Size of the picture and of the margin for its scale, in pixels.
const SIZE: (f64, f64) = (900.0, 160.0);
const MARGIN: (f64, f64) = (70.0, 20.0);
/// Smallest span of the scale: less than this is noise.
const LEAST_SPAN: f64 = 1.0;

/// Draws samples, oldest first; `None` is a gap. Nothing is drawn where nothing was measured.
pub fn draw(name: &str, samples: &[(Instant, Option<f64>)], time: impl Fn(Instant) -> String) -> Option<String> {
    let values = || samples.iter().filter_map(|sample| sample.1);
    let (low, high) = values().fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), v| (low.min(v), high.max(v)));
    let (first, last) = (samples.first()?.0, samples.last()?.0);
    if low > high || first == last {
        return None;
    }
    let spare = (LEAST_SPAN - (high - low)).max((high - low) * 0.1) / 2.0;
    let (low, high) = (low - spare, high + spare);
    let x =
        |at: Instant| MARGIN.0 + at.since(first).as_secs_f64() / last.since(first).as_secs_f64() * (SIZE.0 - MARGIN.0);
    let y = |value: f64| (high - value) / (high - low) * (SIZE.1 - MARGIN.1);
    let mut picture = format!(
        "<svg viewBox=\"0 0 {} {}\" width=\"{}\" role=\"img\" aria-label=\"{name}\">",
        SIZE.0,
        SIZE.1,
        SIZE.0,
        name = escaped(name),
    );
    for value in [low, (low + high) / 2.0, high] {
        let y = y(value);
        picture.push_str(&format!(
            "<line x1=\"{}\" y1=\"{y:.1}\" x2=\"{}\" y2=\"{y:.1}\" stroke=\"#ddd\"/>\
             <text x=\"0\" y=\"{:.1}\">{value:.1}</text>",
            MARGIN.0,
            SIZE.0,
            y.max(10.0)
        ));
    }
    for stretch in samples.split(|sample| sample.1.is_none()).filter(|stretch| !stretch.is_empty()) {
        let points: Vec<String> =
            stretch.iter().filter_map(|&(at, value)| Some(format!("{:.1},{:.1}", x(at), y(value?)))).collect();
        picture.push_str(&format!(
            "<polyline points=\"{}\" fill=\"none\" stroke=\"#1565a0\" stroke-width=\"1.5\"/>",
            points.join(" ")
        ));
    }
    picture.push_str(&format!(
        "<text x=\"{}\" y=\"{}\">{}</text><text x=\"{}\" y=\"{}\" text-anchor=\"end\">{}, {}</text></svg>",
        MARGIN.0,
        SIZE.1 - 5.0,
        escaped(&time(first)),
        SIZE.0,
        SIZE.1 - 5.0,
        escaped(name),
        escaped(&time(last)),
    ));
    Some(picture)
}
