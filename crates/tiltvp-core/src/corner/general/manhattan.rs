//! An attitude along whose axes most straight edges run, found without a start but a rough vertical.

use nalgebra::{Matrix3, Vector3};

use super::common_attitude::StraightEdge;

/// How far the vertical may be from what is told of it: the sine of 20 degrees, a little more than the 15 that
/// `down_sigma_rad` says where nobody does.
const DOWN_SINE: f64 = 0.342;

/// How many lines, the longest, are tried with one another for the vertical and for a level axis. They have the least errors; of 40 four
/// are along an axis that a tenth of the lines has.
const TRIED: usize = 40;

/// How far lines may pass from a direction that two others of them have, to count half, radians: 0.25 degrees, what two of
/// 100 pixels tell. The attitude is refined afterwards.
const NEAR_RAD: f64 = 0.004_36;

/// The attitude whose second axis is the direction near `down` along which most lines run, and whose others are those level ones.
pub(super) fn manhattan(lines: &[StraightEdge], down: &Vector3<f64>) -> Option<Matrix3<f64>> {
    let down = down.normalize();
    let longest = longest_first(lines);
    let upright: Vec<Voter> =
        longest.iter().filter(|line| line.normal.dot(&down).abs() <= DOWN_SINE).copied().collect();
    let tried = &upright[..upright.len().min(TRIED)];
    let meetings = tried.iter().enumerate().flat_map(|(k, line)| {
        tried[..k].iter().filter_map(|other| line.normal.cross(&other.normal).try_normalize(NEAR_RAD))
    });
    let verticals = meetings
        .map(|meeting| meeting * meeting.dot(&down).signum())
        .filter(|vertical| vertical.cross(&down).norm() <= DOWN_SINE);
    let vertical = most_voted(verticals, |vertical| upright.iter().map(|line| line.vote(vertical)).sum())?;
    about(&longest, &vertical)
}

/// The attitude about a vertical that is known, along whose level axes most straight edges run.
pub(super) fn manhattan_about(lines: &[StraightEdge], vertical: &Vector3<f64>) -> Option<Matrix3<f64>> {
    about(&longest_first(lines), vertical)
}

/// A line that votes for directions.
#[derive(Debug, Clone, Copy)]
struct Voter {
    normal: Vector3<f64>,
    /// The sine of the angle by which it misses a direction for which it has half a vote.
    half: f64,
}

impl Voter {
    /// How much it says for a direction, from 0 to 1.
    fn vote(&self, direction: &Vector3<f64>) -> f64 {
        (1.0 + (self.normal.dot(direction) / self.half).powi(2)).recip()
    }
}

fn longest_first(lines: &[StraightEdge]) -> Vec<Voter> {
    let mut longest = lines.to_vec();
    longest.sort_by(|a, b| b.length_px.total_cmp(&a.length_px));
    let voter = |line: &StraightEdge| Voter { normal: line.normal, half: NEAR_RAD.hypot(line.sigma_rad) };
    longest.iter().map(voter).collect()
}

fn about(longest: &[Voter], vertical: &Vector3<f64>) -> Option<Matrix3<f64>> {
    let level: Vec<Voter> =
        longest.iter().filter(|line| line.normal.dot(vertical).abs() > 2.0 * NEAR_RAD).copied().collect();
    let axes = level.iter().take(TRIED).filter_map(|line| vertical.cross(&line.normal).try_normalize(NEAR_RAD));
    let axis = most_voted(axes, |axis| {
        let other = axis.cross(vertical);
        level.iter().map(|line| line.vote(axis).max(line.vote(&other))).sum()
    })?;
    Some(Matrix3::from_columns(&[axis, *vertical, axis.cross(vertical)]))
}

fn most_voted(
    directions: impl Iterator<Item = Vector3<f64>>,
    votes: impl Fn(&Vector3<f64>) -> f64,
) -> Option<Vector3<f64>> {
    let voted = directions.map(|direction| (votes(&direction), direction));
    voted.max_by(|a, b| a.0.total_cmp(&b.0)).map(|(_, direction)| direction)
}

#[cfg(test)]
mod tests {
    use nalgebra::Rotation3;

    use super::super::common_attitude::tests::{lines, off_in_any_naming_rad};
    use super::*;

    #[test]
    fn lines_of_a_rough_vertical_tell_their_attitude_among_those_of_other_things() {
        for heading_rad in [0.0, 0.3, 0.8, 1.4] {
            let attitude = *Rotation3::from_euler_angles(0.5, heading_rad, 0.2).matrix();
            let others = [0.5, 1.1].map(|turn| *Rotation3::from_euler_angles(0.9 * turn, turn, -0.3).matrix());
            let all = [
                lines(&attitude, 9, &[0.001, -0.001, 0.0]),
                lines(&others[0], 4, &[0.0]),
                lines(&others[1], 4, &[0.0]),
            ];
            let down = Rotation3::from_euler_angles(0.2, 0.0, -0.2) * attitude.column(1);
            let found = manhattan(&all.concat(), &down).unwrap();
            assert!((found.determinant() - 1.0).abs() < 1e-9);
            let off_rad = off_in_any_naming_rad(&found, &attitude);
            assert!(off_rad < 0.01, "{off_rad} at {heading_rad}");
        }
    }

    #[test]
    fn too_few_lines_tell_none() {
        let attitude = Matrix3::identity();
        let all = lines(&attitude, 3, &[0.0]);
        let upright: Vec<StraightEdge> = all[3..6].to_vec();
        assert!(manhattan(&[], &Vector3::y()).is_none());
        assert!(manhattan(&upright[..1], &Vector3::y()).is_none());
        // Nothing level.
        assert!(manhattan(&upright, &Vector3::y()).is_none());
    }
}
