//! Whether the attitude that most straight edges have in common may be that of a thing which hangs askew.

use nalgebra::Matrix3;

use super::common_attitude::{CommonAttitude, HALF_SIGMAS, REACH_SINE, StraightEdge};

/// Lines that miss their axis by more than this many standard deviations are not along it.
const ALONG_SIGMAS: f64 = 4.0;

/// The share of the lines that makes a turn of the attitude worth a doubt. Of 29 rendered rooms of seeds
/// 11100 to 11129 three were seen with as many; in two of these the attitude is 1.5 and 1.6 degrees off the room's, in one a picture's.
const ASKEW_SHARE: f64 = 0.1;

/// How likely the attitude is the one that is turned, where it is worth a doubt. A thing has many lines, so that their share tells little.
const ASKEW_PROBABILITY: f64 = 0.5;

/// The covariance of an attitude that another one may be meant by: a picture that hangs askew may have more of the lines than its room.
/// The lines that are not along the axes vote for a turn about one of these; with how many of them agree on one, its share of all.
pub(super) fn askew(lines: &[StraightEdge], common: &CommonAttitude) -> Matrix3<f64> {
    let rotation = &common.camera_from_object;
    let mut covariance = Matrix3::zeros();
    for about in 0..3 {
        let turn_axis = rotation.column(about);
        let (mut along, mut turns) = (0.0, Vec::new());
        for line in lines {
            let (axis, miss) = line.missed(rotation);
            if axis == about {
                continue;
            }
            if miss.abs() <= ALONG_SIGMAS * line.sigma_rad * common.scatter {
                along += 1.0;
                continue;
            }
            // Turning the axis a about b by t changes normal . a by t normal . (b x a); the sense of all turns does not matter.
            let by_turn = line.normal.dot(&turn_axis.cross(&rotation.column(axis)));
            let turn_rad = miss / by_turn;
            if turn_rad.abs() <= REACH_SINE {
                turns.push((turn_rad, line.sigma_rad / by_turn.abs()));
            }
        }
        let agreeing = |turn_rad: f64| -> f64 {
            let miss = |(other_rad, sigma_rad): &(f64, f64)| (turn_rad - other_rad) / (HALF_SIGMAS * sigma_rad);
            turns.iter().map(|other| (1.0 + miss(other).powi(2)).recip()).sum()
        };
        let voted = turns.iter().map(|(turn_rad, _)| (agreeing(*turn_rad), *turn_rad));
        let Some((votes, turn_rad)) = voted.max_by(|a, b| a.0.total_cmp(&b.0)) else { continue };
        let share = votes / (along + votes);
        if share >= ASKEW_SHARE {
            covariance += turn_axis * turn_axis.transpose() * (ASKEW_PROBABILITY * turn_rad * turn_rad);
        }
    }
    covariance
}

#[cfg(test)]
mod tests {
    use nalgebra::{Rotation3, Vector3};

    use super::super::common_attitude::common_attitude;
    use super::super::common_attitude::tests::lines;
    use super::*;

    #[test]
    fn a_turn_that_a_tenth_of_the_lines_have_is_a_doubt_about_its_axis_alone() {
        let attitude = *Rotation3::from_euler_angles(0.5, -0.3, 0.2).matrix();
        let turn_rad = 0.027;
        let room = attitude * Rotation3::from_axis_angle(&Vector3::z_axis(), turn_rad).matrix();
        let picture = lines(&attitude, 14, &[0.0005, -0.0005]);
        let added = |others: usize, other: &Matrix3<f64>| {
            // Those along the first two axes: the third is that of the turn.
            let others = lines(other, 4, &[0.0]).into_iter().take(others);
            let both: Vec<StraightEdge> = picture.iter().copied().chain(others).collect();
            askew(&both, &common_attitude(&both, &attitude).unwrap())
        };
        let in_doubt = attitude.transpose() * added(8, &room) * attitude;
        assert!((in_doubt[(2, 2)].sqrt() / (turn_rad * ASKEW_PROBABILITY.sqrt()) - 1.0).abs() < 0.05, "{in_doubt}");
        assert!(in_doubt.diagonal().xy().amax() < 1e-3 * in_doubt[(2, 2)], "{in_doubt}");
        assert_eq!(added(2, &room), Matrix3::zeros());
        // As many lines of another thing, further off.
        let desk = attitude * Rotation3::from_axis_angle(&Vector3::z_axis(), 0.3).matrix();
        assert_eq!(added(8, &desk), Matrix3::zeros());
        // As many lines that agree on no turn.
        let stray = |k: usize| {
            let turned = attitude * Rotation3::from_axis_angle(&Vector3::z_axis(), 0.006 * (k as f64 - 3.5)).matrix();
            lines(&turned, 1, &[0.0])[0]
        };
        let all: Vec<StraightEdge> = picture.iter().copied().chain((0..8).map(stray)).collect();
        assert_eq!(askew(&all, &common_attitude(&all, &attitude).unwrap()), Matrix3::zeros());
    }
}
