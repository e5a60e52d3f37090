//! Corners beside the chosen one that it may as well be: the other edge of a board, of a joint, or of a strip.

use nalgebra::{Matrix3, Vector3};

use super::agreement::SAME_VERTEX_RAD;
use crate::corner::estimate::{CornerEstimate, Hypothesis};

/// The 99 % quantile of chi-square of 3: a vertex that is nearer is the chosen one, seen again.
const SAME_CHI_SQUARE: f64 = 11.3;

/// A pair of features, one of each image, that could have been chosen.
pub(super) struct Rival {
    pub(super) score: f64,
    pub(super) left: usize,
    pub(super) right: usize,
    pub(super) vertex_m: Vector3<f64>,
}

/// Adds to the vertex' covariance of each of the poses of the pair `[left, right]` how far its rivals are from it, each by its
/// share of the score: the second moment of what may be meant, about what is said. Rivals are next to the chosen vertex in both
/// images, where one thing has its edges twice; which of them is meant images do not tell, and from frame to frame the choice
/// may change. Corners farther away have other names.
pub(super) fn add_rivals(
    poses: &mut [Hypothesis],
    [left, right]: [usize; 2],
    rivals: &[Rival],
    estimate: &CornerEstimate,
) {
    let near = |side: usize, a: usize, b: usize| {
        let features = &estimate.features[side];
        a == b || features[a].vertex().angle(&features[b].vertex()) < SAME_VERTEX_RAD
    };
    let beside = || rivals.iter().filter(|rival| near(0, left, rival.left) && near(1, right, rival.right));
    let all: f64 = beside().map(|rival| rival.score).sum();
    for pose in poses {
        let Some(vertex_m) = pose.vertex_m else { continue };
        let mut block = pose.covariance.fixed_view_mut::<3, 3>(3, 3);
        let Some(information) = block.clone_owned().try_inverse() else { continue };
        let spread: Matrix3<f64> = beside()
            .map(|rival| (rival.vertex_m - vertex_m, rival.score / all))
            .filter(|(off_m, _)| off_m.dot(&(information * off_m)) > SAME_CHI_SQUARE)
            .map(|(off_m, share)| off_m * off_m.transpose() * share)
            .sum();
        block += spread;
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::corner::estimate::{CornerVerdict, PlaceVerdict};
    use crate::corner::feature::CornerFeature;
    use nalgebra::Matrix6;

    fn feature(vertex: Vector3<f64>) -> CornerFeature {
        CornerFeature::from_bearings(&vertex, &[Vector3::x(), Vector3::y(), -Vector3::x()].map(|to| vertex + to))
            .unwrap()
    }

    #[test]
    fn an_edge_that_is_there_twice_is_not_known_better_than_the_two_are_apart() {
        let places = [0.0, 0.01, 0.0005, 0.4].map(|y| Vector3::new(0.0, y, 2.0));
        let features = places.map(feature).to_vec();
        let estimate = CornerEstimate {
            hypotheses: Vec::new(),
            verdict: CornerVerdict::Found,
            features: [features.clone(), features],
            chosen_left: vec![0],
            chosen_right: Some(0),
            ends: [None; 3],
            corners: Vec::new(),
            place: PlaceVerdict::Told,
            followed: false,
            object: 1,
        };
        let rivals = |of: &[usize]| -> Vec<Rival> {
            of.iter().map(|k| Rival { score: 50.0, left: *k, right: *k, vertex_m: places[*k] }).collect()
        };
        let mut spread = Vec::new();
        for of in [&[0][..], &[0, 1], &[0, 2], &[0, 3]] {
            let mut pose = [Hypothesis {
                camera_from_object: Matrix3::identity(),
                edges: [Vector3::x(), Vector3::y(), -Vector3::x()],
                vertex_m: Some(places[0]),
                covariance: Matrix6::identity() * 1e-6,
                probability: 1.0,
                right_handed: true,
                misfit: 0.5,
            }];
            add_rivals(&mut pose, [0, 0], &rivals(of), &estimate);
            assert_eq!(pose[0].covariance[(3, 3)], 1e-6);
            spread.push(pose[0].covariance[(4, 4)]);
        }
        // Alone; a centimetre away, as good; the same again; elsewhere.
        assert!((spread[1] - 1e-6 - 0.5e-4).abs() < 1e-9);
        assert_eq!([spread[0], spread[2], spread[3]], [1e-6; 3]);
    }
}
