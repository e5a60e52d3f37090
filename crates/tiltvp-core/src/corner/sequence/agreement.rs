//! Which features of one image are corners of one upright world: those whose attitudes agree.

use nalgebra::Matrix3;

use crate::corner::closed_form::attitude::{CornerAttitude, CornerAttitudes, IncludedAngle, corner_attitudes};
use crate::corner::closed_form::prior::AttitudePrior;
use crate::corner::closed_form::resolve::{ResolvedAttitude, namings};
use crate::corner::feature::CornerFeature;
use crate::corner::general::common_attitude::PARALLEL_SIGMA_RAD;
use crate::error::Result;

/// Vertices whose bearings are closer than this are one, radians: some 7 pixels of the cameras that corners are looked
/// for with.
pub(crate) const SAME_VERTEX_RAD: f64 = 0.01;

/// How many pixels of support outweigh one unit of a prior's log-likelihood: a short edge against one standard
/// deviation and a half. It decides among sets of like support; between 15 and 60 the attitudes of a real cabinet and
/// of rendered rooms are the same.
const PIXELS_PER_NAT: f64 = 30.0;

/// By how many of their standard deviations the rays of one image are off where nothing tells, and as of how many numbers that is known.
/// Without it 30 of 67 attitudes from two and more corners in rooms of seeds 10400 to 10429 and 10600 to 10629 have an NEES above 16.3,
/// the 99.9 % of three degrees of freedom, and 10 of 24 from one corner; with it 3 and 4.
const SCATTER: f64 = 2.5;
const SCATTER_FREEDOM: f64 = 3.0;

/// The naming of an attitude that is nearest to another attitude.
pub(crate) fn renamed(attitude: &Matrix3<f64>, near: &Matrix3<f64>) -> Matrix3<f64> {
    let cosine = |turned: &Matrix3<f64>| (near.transpose() * turned).trace();
    namings().map(|naming| attitude * naming).max_by(|a, b| cosine(a).total_cmp(&cosine(b))).unwrap_or(*attitude)
}

/// Whether the rays are images of edges along the three axes of an attitude, one each, within `most_rad`.
pub(crate) fn fits(feature: &CornerFeature, attitude: &Matrix3<f64>, most_rad: f64) -> bool {
    let nearest = feature.rays().map(|ray| {
        let sines = attitude.tr_mul(&ray.normal).abs();
        (sines.imin(), sines.min())
    });
    let [x, y, z] = nearest.map(|(axis, _)| axis);
    x != y && y != z && z != x && nearest.iter().all(|(_, sine)| *sine <= most_rad.sin())
}

/// The angle between two attitudes, radians.
pub(crate) fn apart(a: &Matrix3<f64>, b: &Matrix3<f64>) -> f64 {
    // |a - b| = 2 sqrt 2 sin(angle / 2), exact for small angles.
    2.0 * ((a - b).norm() / 8f64.sqrt()).min(1.0).asin()
}

/// The attitude of a feature that is nearest to another attitude, however its edges are named; none farther away than `most_rad`.
pub(crate) fn attitude_near(
    feature: &CornerFeature,
    angle: &IncludedAngle,
    attitude: &Matrix3<f64>,
    most_rad: f64,
) -> Option<CornerAttitude> {
    let off = |own: &CornerAttitude| apart(&renamed(&own.camera_from_object, attitude), attitude);
    let found = corner_attitudes(feature, angle).ok()?;
    found.iter().min_by(|a, b| off(a).total_cmp(&off(b))).filter(|near| off(near) <= most_rad).copied()
}

/// The features that agree, the best supported one first, and the attitudes of each.
pub(crate) struct Agreement {
    pub(crate) members: Vec<usize>,
    pub(crate) attitudes: Vec<CornerAttitudes>,
}

/// The set of features with the most support of which each has an attitude within `agree_max_rad` of a common one, their
/// edges at right angles and parallel but named at will; `priors` add to the support. Where the angle is not right, the
/// best feature alone.
pub(crate) fn agreement(
    features: &[CornerFeature],
    angle: &IncludedAngle,
    agree_max_rad: f64,
    priors: &[AttitudePrior],
) -> Result<Option<Agreement>> {
    let found = features.iter().map(|feature| corner_attitudes(feature, angle)).collect::<Result<Vec<_>>>()?;
    let alone = angle.gamma_rad != std::f64::consts::FRAC_PI_2;
    let mut best: Option<(f64, Vec<usize>)> = None;
    for (i, own) in found.iter().enumerate() {
        for reference in own.iter() {
            let ln_likelihood =
                |prior: &AttitudePrior| prior.ln_likelihood(&reference.camera_from_object, &reference.covariance);
            let prior = priors.iter().map(ln_likelihood).sum::<f64>();
            let mut members = vec![i];
            for (j, others) in found.iter().enumerate() {
                let agrees = others.iter().any(|other| {
                    let turned = renamed(&other.camera_from_object, &reference.camera_from_object);
                    apart(&turned, &reference.camera_from_object) <= agree_max_rad
                });
                if !alone && j != i && agrees {
                    members.push(j);
                }
            }
            let score = members.iter().map(|j| features[*j].support_score()).sum::<f64>() + PIXELS_PER_NAT * prior;
            if best.as_ref().is_none_or(|(most, _)| score > *most) {
                best = Some((score, members));
            }
        }
    }
    Ok(best.map(|(_, mut members)| {
        members.sort_by(|a, b| features[*b].support_score().total_cmp(&features[*a].support_score()).then(a.cmp(b)));
        let attitudes = members.iter().map(|j| found[*j]).collect();
        Agreement { members, attitudes }
    }))
}

/// The covariance of an attitude on which so many corners of one image agree. Rays miss one another by more than they say, and corners that
/// share an edge share its error.
pub(crate) fn as_scattered(resolved: &ResolvedAttitude, corners: usize) -> Matrix3<f64> {
    let told = 3.0 * corners.saturating_sub(1) as f64;
    let scale = (SCATTER_FREEDOM * SCATTER.powi(2) + resolved.chi_square) / (SCATTER_FREEDOM + told);
    resolved.covariance * scale.max(1.0) + Matrix3::from_diagonal_element(PARALLEL_SIGMA_RAD.powi(2))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Standard deviation in those of the rays alone, where parallel edges tell far more than rays do.
    fn scale(chi_square: f64, corners: usize) -> f64 {
        let resolved = ResolvedAttitude {
            common_from_object: Matrix3::identity(),
            covariance: Matrix3::identity(),
            probability: 1.0,
            choice: Vec::new(),
            chi_square,
        };
        as_scattered(&resolved, corners)[(0, 0)].sqrt()
    }

    #[test]
    fn an_attitude_is_known_as_well_as_its_corners_agree_and_no_better_than_its_rays() {
        assert!((scale(0.0, 1) - SCATTER).abs() < 1e-6);
        // Five corners that are apart by as much as their rays say, by four times as much, and not at all.
        let [usual, apart, together] = [12.0, 16.0 * 12.0, 0.0].map(|chi_square| scale(chi_square, 5));
        assert!((1.0..SCATTER).contains(&usual) && (3.0..4.0).contains(&apart) && together >= 1.0, "{usual} {apart}");
    }
}
