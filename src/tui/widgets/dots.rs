//! Lines as dots, eight to a character: two columns and four rows in each.

/// Where the dots of a braille pattern are in its bits, from the top to the bottom, left and right.
const BITS: [[u8; 2]; 4] = [[0x01, 0x08], [0x02, 0x10], [0x04, 0x20], [0x40, 0x80]];
/// The pattern without a dot.
const EMPTY: u32 = 0x2800;
/// Dots in a character, across and down.
pub const ACROSS: u16 = 2;
/// See [`ACROSS`].
pub const DOWN: u16 = 4;

/// No area goes so far, and a line from there is not drawn for long.
const FARTHEST: f64 = 32_767.0;

/// An area of characters to draw dots in.
pub struct Dots {
    columns: u16,
    rows: u16,
    cells: Vec<u8>,
}

impl Dots {
    /// An empty area of this many characters.
    pub fn new(columns: u16, rows: u16) -> Self {
        Dots { columns, rows, cells: vec![0; usize::from(columns) * usize::from(rows)] }
    }

    /// The last place across and down, as a number to scale with.
    pub fn last(&self) -> (f64, f64) {
        (f64::from((self.columns * ACROSS).max(1) - 1), f64::from((self.rows * DOWN).max(1) - 1))
    }

    /// A line through points, counted from the upper left corner; one point alone is a dot.
    pub fn line(&mut self, points: impl IntoIterator<Item = (f64, f64)>) {
        let mut before: Option<(i32, i32)> = None;
        for (x, y) in points {
            let place = |along: f64| along.round().clamp(-FARTHEST, FARTHEST) as i32;
            let here = (place(x), place(y));
            match before {
                None => self.dot(here.0, here.1),
                Some(there) => self.stroke(there, here),
            }
            before = Some(here);
        }
    }

    /// The character in a column and a row, where there is a dot in it.
    pub fn character(&self, column: u16, row: u16) -> Option<char> {
        let cell = *self.cells.get(self.cell(column, row)?)?;
        char::from_u32(EMPTY + u32::from(cell)).filter(|_| cell > 0)
    }

    fn stroke(&mut self, (x0, y0): (i32, i32), (x1, y1): (i32, i32)) {
        let steps = (x1 - x0).abs().max((y1 - y0).abs()).max(1);
        for step in 0..=steps {
            let along =
                |from: i32, to: i32| from + (f64::from(to - from) * f64::from(step) / f64::from(steps)).round() as i32;
            self.dot(along(x0, x1), along(y0, y1));
        }
    }

    fn dot(&mut self, x: i32, y: i32) {
        let (Ok(x), Ok(y)) = (u16::try_from(x), u16::try_from(y)) else { return };
        let Some(place) = self.cell(x / ACROSS, y / DOWN) else { return };
        self.cells[place] |= BITS[usize::from(y % DOWN)][usize::from(x % ACROSS)];
    }

    fn cell(&self, column: u16, row: u16) -> Option<usize> {
        let is_inside = column < self.columns && row < self.rows;
        is_inside.then(|| usize::from(row) * usize::from(self.columns) + usize::from(column))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn drawn(dots: &Dots) -> String {
        let row = |row| (0..dots.columns).map(|column| dots.character(column, row).unwrap_or(' ')).collect::<String>();
        (0..dots.rows).map(row).collect::<Vec<_>>().join("|")
    }

    #[test]
    fn lines_go_from_point_to_point_and_a_point_alone_is_a_dot() {
        let mut dots = Dots::new(3, 2);
        assert_eq!(dots.last(), (5.0, 7.0));
        dots.line([(0.0, 7.0), (5.0, 0.0)]);
        assert_eq!(drawn(&dots), " ⢀⠎|⡰⠁ ");
        let mut dots = Dots::new(2, 1);
        dots.line([(3.0, 3.0)]);
        assert_eq!(drawn(&dots), " ⢀");
    }

    #[test]
    fn what_lies_outside_is_left_out() {
        let mut dots = Dots::new(2, 1);
        dots.line([(-5.0, 0.0), (9.0, 0.0), (9.0, 50.0)]);
        assert_eq!(drawn(&dots), "⠉⠉");
        let mut none = Dots::new(0, 0);
        none.line([(0.0, 0.0)]);
        assert_eq!(none.character(0, 0), None);
    }
}
