//! The turn by which lines go on where the motion that was told explains few of them: a camera that was bumped, wheels that slipped.

use std::f64::consts::TAU;

use crate::lines::angles::wrap;

/// Lines that have to go on by a jump. Of two frames of 50 lines that have nothing in common one turn makes two or three alike.
pub(crate) const JUMP_LINES: usize = 5;

/// The middle of the `width` in which most of some angles are, radians; NaN without any.
pub(crate) fn densest(angles: &mut Vec<f64>, width: f64) -> f64 {
    angles.sort_unstable_by(f64::total_cmp);
    let count = angles.len();
    angles.extend_from_within(..);
    angles[count..].iter_mut().for_each(|angle| *angle += TAU);
    let (mut best, mut end) = (0..0, 0);
    for start in 0..count {
        while end < start + count && angles[end] <= angles[start] + width {
            end += 1;
        }
        if end - start > best.len() {
            best = start..end;
        }
    }
    angles.get(best.start + best.len() / 2).map_or(f64::NAN, |middle| wrap(*middle))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn most_angles_may_lie_across_half_a_turn() {
        let mut angles = vec![0.3, 3.12, -3.12, 3.13, 1.0, -2.0];
        assert!((densest(&mut angles, 0.1) - 3.13).abs() < 1e-12);
        assert!(densest(&mut Vec::new(), 0.1).is_nan());
    }
}
