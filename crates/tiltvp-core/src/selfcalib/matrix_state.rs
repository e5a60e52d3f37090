//! Matrices of a state as they are read: none of a size whose product is more than a number holds, which nalgebra multiplies unasked.

use nalgebra::DMatrix;
use serde::de::Error;
use serde::{Deserialize, Deserializer};

/// A matrix as nalgebra writes it: its numbers column by column, then how many rows and columns there are.
pub(in crate::selfcalib) fn matrix<'de, D: Deserializer<'de>>(from: D) -> Result<DMatrix<f64>, D::Error> {
    let (numbers, rows, columns) = Deserialize::deserialize(from)?;
    of_parts(numbers, rows, columns).ok_or_else(|| D::Error::custom("a matrix of another size than it says"))
}

fn of_parts(numbers: Vec<f64>, rows: usize, columns: usize) -> Option<DMatrix<f64>> {
    (rows.checked_mul(columns) == Some(numbers.len())).then(|| DMatrix::from_vec(rows, columns, numbers))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sizes_are_multiplied_with_care() {
        let numbers = vec![1.0, 2.0, 3.0, 4.0, 5.0, 6.0];
        let whole = DMatrix::from_column_slice(3, 2, &numbers);
        assert_eq!(of_parts(numbers.clone(), 3, 2), Some(whole));
        assert_eq!(of_parts(numbers, 2, 2), None);
        // Whose product is zero where it is cut to 64 bits.
        assert_eq!(of_parts(Vec::new(), 1 << 32, 1 << 32), None);
    }
}
