//! The floor that matters, in cells.

use std::ops::RangeInclusive;

/// A rectangle of the floor, in square cells. The last cells may reach over its edge.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Area {
    /// Smallest x and y, metres.
    pub min: [f64; 2],
    /// Largest x and y, metres.
    pub max: [f64; 2],
    /// Edge of a cell, metres.
    pub cell_m: f64,
    /// Cells along x.
    pub columns: usize,
    /// Cells along y.
    pub rows: usize,
}

/// Why this is no area.
#[derive(Clone, Debug, PartialEq)]
pub struct AreaError(String);

impl std::fmt::Display for AreaError {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        self.0.fmt(f)
    }
}

impl std::error::Error for AreaError {}

/// Lengths that an area may have, metres.
const SIDE_M: RangeInclusive<f64> = 0.5..=50.0;
/// The usual edge of a cell, metres.
const CELL_M: f64 = 0.25;
/// Most cells along a side; a larger area has larger cells.
const MOST: f64 = 64.0;
/// An area without a wish is so long and wide, metres.
const USUAL_M: f64 = 4.0;

impl Area {
    /// The rectangle between two corners.
    pub fn new(min: [f64; 2], max: [f64; 2]) -> Result<Self, AreaError> {
        let side = |axis: usize| max[axis] - min[axis];
        let near = min.iter().chain(&max).all(|v| v.abs() <= 1000.0);
        if !near || !SIDE_M.contains(&side(0)) || !SIDE_M.contains(&side(1)) {
            return Err(AreaError(format!(
                "an area's sides are {} to {} m long within 1 km of the origin, this one goes from {min:?} to {max:?}",
                SIDE_M.start(),
                SIDE_M.end()
            )));
        }
        let cell_m = CELL_M.max(side(0).max(side(1)) / MOST);
        // A hair's breadth over is no further cell.
        let cells = |length: f64| (length / cell_m - 1e-9).ceil().max(1.0) as usize;
        Ok(Self {
            min,
            max,
            cell_m,
            columns: cells(side(0)),
            rows: cells(side(1)),
        })
    }

    /// 4 m by 4 m about a place.
    pub fn about(x: f64, y: f64) -> Result<Self, AreaError> {
        let half = USUAL_M / 2.0;
        Self::new([x - half, y - half], [x + half, y + half])
    }

    /// Its middle.
    pub fn middle(&self) -> [f64; 2] {
        [0, 1].map(|axis| (self.min[axis] + self.max[axis]) / 2.0)
    }

    /// The middles of the cells, along x first.
    pub fn cells(&self) -> impl Iterator<Item = [f64; 2]> + '_ {
        let at = |from: f64, index: usize| from + (index as f64 + 0.5) * self.cell_m;
        (0..self.rows).flat_map(move |row| {
            (0..self.columns).map(move |column| [at(self.min[0], column), at(self.min[1], row)])
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn cells_fill_the_area_and_their_number_is_bounded() {
        let area = Area::new([-1.0, 0.0], [1.0, 1.0]).unwrap();
        assert_eq!((area.columns, area.rows, area.cell_m), (8, 4, 0.25));
        let cells: Vec<_> = area.cells().collect();
        assert_eq!(
            (cells.len(), cells[0], cells[1]),
            (32, [-0.875, 0.125], [-0.625, 0.125])
        );
        let hall = Area::new([0.0, 0.0], [50.0, 20.0]).unwrap();
        assert!(hall.columns <= 64 && hall.rows <= 64, "{hall:?}");
    }

    #[test]
    fn what_is_no_area_is_refused() {
        for (min, max) in [
            ([0.0, 0.0], [0.0, 4.0]),
            ([2.0, 0.0], [-2.0, 4.0]),
            ([0.0, 0.0], [f64::NAN, 4.0]),
            ([0.0, 0.0], [51.0, 4.0]),
            ([1e9, 0.0], [1e9 + 4.0, 4.0]),
        ] {
            assert!(Area::new(min, max).is_err(), "{min:?} {max:?}");
        }
    }
}
