//! The cheapest assignment of rows to columns (Kuhn 1955, in the shortest-augmenting-path form of Jonker and
//! Volgenant 1987), for the handful of bodies and people of one room.

/// Working memory, kept between calls.
#[derive(Clone, Debug, Default)]
pub(crate) struct Hungarian {
    row_price: Vec<f64>,
    column_price: Vec<f64>,
    row_of: Vec<usize>,
    came_from: Vec<usize>,
    slack: Vec<f64>,
    done: Vec<bool>,
    column_of: Vec<usize>,
}

impl Hungarian {
    /// For each row the column it gets. `cost` is row-major, finite, with at least as many columns as rows.
    pub(crate) fn solve(&mut self, cost: &[f64], rows: usize, columns: usize) -> &[usize] {
        debug_assert!(rows <= columns && cost.len() == rows * columns);
        self.reset(rows, columns);
        for row in 1..=rows {
            self.insert(cost, row, columns);
        }
        for column in 1..=columns {
            if self.row_of[column] > 0 {
                self.column_of[self.row_of[column] - 1] = column - 1;
            }
        }
        &self.column_of
    }

    /// Entry 0 of each list is a sentinel.
    fn reset(&mut self, rows: usize, columns: usize) {
        let clear = |list: &mut Vec<f64>, len: usize| {
            list.clear();
            list.resize(len, 0.0);
        };
        clear(&mut self.row_price, rows + 1);
        clear(&mut self.column_price, columns + 1);
        clear(&mut self.slack, columns + 1);
        self.row_of.clear();
        self.row_of.resize(columns + 1, 0);
        self.came_from.clear();
        self.came_from.resize(columns + 1, 0);
        self.done.clear();
        self.done.resize(columns + 1, false);
        self.column_of.clear();
        self.column_of.resize(rows, 0);
    }

    /// Gives `row` a column along the cheapest chain of re-assignments.
    fn insert(&mut self, cost: &[f64], row: usize, columns: usize) {
        self.row_of[0] = row;
        self.slack.fill(f64::INFINITY);
        self.done.fill(false);
        let mut column = 0;
        while self.row_of[column] != 0 {
            column = self.widen(cost, column, columns);
        }
        while column != 0 {
            let previous = self.came_from[column];
            self.row_of[column] = self.row_of[previous];
            column = previous;
        }
    }

    /// Adds `column` to the tree and gives the next nearest one.
    fn widen(&mut self, cost: &[f64], column: usize, columns: usize) -> usize {
        self.done[column] = true;
        let row = self.row_of[column];
        let (mut least, mut next) = (f64::INFINITY, 0);
        for j in 1..=columns {
            if self.done[j] {
                continue;
            }
            let reduced =
                cost[(row - 1) * columns + j - 1] - self.row_price[row] - self.column_price[j];
            if reduced < self.slack[j] {
                self.slack[j] = reduced;
                self.came_from[j] = column;
            }
            if self.slack[j] < least {
                least = self.slack[j];
                next = j;
            }
        }
        for j in 0..=columns {
            if self.done[j] {
                self.row_price[self.row_of[j]] += least;
                self.column_price[j] -= least;
            } else {
                self.slack[j] -= least;
            }
        }
        next
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    /// Tries every assignment.
    fn best(cost: &[f64], rows: usize, columns: usize, row: usize, used: u32) -> f64 {
        if row == rows {
            return 0.0;
        }
        (0..columns)
            .filter(|c| used & (1 << c) == 0)
            .map(|c| cost[row * columns + c] + best(cost, rows, columns, row + 1, used | 1 << c))
            .fold(f64::INFINITY, f64::min)
    }

    proptest! {
        #[test]
        fn finds_what_trying_everything_finds(rows in 1usize..5, extra in 0usize..3, seed in prop::collection::vec(0.0..10.0f64, 35)) {
            let columns = rows + extra;
            let cost = &seed[..rows * columns];
            let mut hungarian = Hungarian::default();
            let chosen = hungarian.solve(cost, rows, columns);
            let mut sorted = chosen.to_vec();
            sorted.sort_unstable();
            sorted.dedup();
            prop_assert_eq!(sorted.len(), rows);
            let sum: f64 = chosen.iter().enumerate().map(|(r, c)| cost[r * columns + c]).sum();
            prop_assert!((sum - best(cost, rows, columns, 0, 0)).abs() < 1e-9);
        }
    }
}
