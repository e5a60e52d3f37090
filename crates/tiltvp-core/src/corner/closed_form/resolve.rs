//! Which of the attitudes that single features admit is the true one: by several views, by parallel features, by priors.

use nalgebra::{Matrix3, Rotation3, Vector3};

use super::attitude::{CornerAttitude, CornerAttitudes};
use super::prior::{AttitudePrior, ROUNDING, gaussian, rotation_vector};
use crate::error::Result;
use crate::filter::{restored, symmetric};
use crate::geometry::validate_rotation;

/// The attitudes that one feature admits, and where its camera looks.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct View<'a> {
    /// What [`corner_attitudes`](crate::corner::corner_attitudes) found.
    pub attitudes: &'a CornerAttitudes,
    /// The rotation from the feature's camera to the frame that all views share; the priors are in that frame.
    pub common_from_camera: Matrix3<f64>,
}

/// How the frames of the features' objects stand to each other.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
pub enum Alignment {
    /// The same object, or parallel frames with edges named alike.
    #[default]
    Same,
    /// Horizontal edges along the same two perpendicular directions, whichever is called x and wherever edges point: the
    /// corners of one room or building with right angles.
    Manhattan,
    /// Only the vertical is shared.
    Vertical,
}

impl Alignment {
    /// Every alignment.
    pub const ALL: [Self; 3] = [Self::Same, Self::Manhattan, Self::Vertical];

    /// Its name: `"same"`, `"manhattan"` or `"vertical"`.
    pub fn name(self) -> &'static str {
        match self {
            Self::Same => "same",
            Self::Manhattan => "manhattan",
            Self::Vertical => "vertical",
        }
    }
}

/// One attitude that all features agree on, with how likely it is among all such.
#[derive(Debug, Clone, PartialEq)]
pub struct ResolvedAttitude {
    /// The rotation from the first feature's object to the common frame.
    pub common_from_object: Matrix3<f64>,
    /// Covariance of the rotation vector, common frame, of its error, square radians: that of all views together.
    pub covariance: Matrix3<f64>,
    /// The probability that it is this one and none of the others, in [0, 1].
    pub probability: f64,
    /// Which attitude of each view it is.
    pub choice: Vec<usize>,
    /// How far the views are apart: chi-square of three degrees of freedom per view after the first (two where only the
    /// vertical is shared).
    pub chi_square: f64,
}

/// Joint hypotheses whose log-likelihood is this far below the best one are dropped: e^-50 = 2e-22, less than the
/// rounding of a probability.
const NEGLIGIBLE: f64 = -50.0;

/// Joint hypotheses that are kept at once, which bounds the work: four attitudes of each of many views would multiply.
/// Three views have at most 64.
const FOLLOWED_MAX: usize = 128;

/// The least probability of an attitude that is returned: what lies below it cannot matter to a decision.
const PROBABILITY_MIN: f64 = 1e-9;

/// Variance of a direction about which nothing is known, square radians: that of an angle uniform in (-pi, pi].
const UNKNOWN: f64 = std::f64::consts::PI * std::f64::consts::PI / 3.0;

/// A joint hypothesis about the views up to now.
#[derive(Debug, Clone)]
struct Joint {
    rotation: Matrix3<f64>,
    covariance: Matrix3<f64>,
    ln_likelihood: f64,
    chi_square: f64,
    choice: Vec<usize>,
}

/// Every attitude that can be had from one attitude of each view, the likeliest first; their probabilities add up to 1, but for those
/// below 1e-9 that are left out.
///
/// Before the views are compared all attitudes are alike, so that the likelihood of a joint hypothesis is what the rays'
/// densities leave when the attitude is integrated out (Laplace): for each view the volume of attitudes per volume of rays,
/// for each view after the first the normal density of its disagreement with those before. Where the object
/// is known, `right_handed` is whether its edges x, y, z are a right-handed triple, which separates the two interpretations.
///
/// Empty where a view has no attitude of that hand.
///
/// # Errors
/// [`Error::InvalidArgument`](crate::Error::InvalidArgument) for priors that are none and for mountings that are no
/// rotations.
pub fn resolve(
    views: &[View<'_>],
    alignment: Alignment,
    right_handed: Option<bool>,
    priors: &[AttitudePrior],
) -> Result<Vec<ResolvedAttitude>> {
    for prior in priors {
        prior.validate()?;
    }
    let mut joints: Vec<Joint> = Vec::new();
    for (place, view) in views.iter().enumerate() {
        validate_rotation(&view.common_from_camera)?;
        let mut next = Vec::new();
        for (index, attitude) in view.attitudes.iter().enumerate() {
            if right_handed.is_some_and(|right| right != attitude.is_right_handed()) {
                continue;
            }
            let single = single(attitude, &view.common_from_camera, index);
            if place == 0 {
                let prior: f64 = priors.iter().map(|p| p.ln_likelihood(&single.rotation, &single.covariance)).sum();
                next.push(Joint { ln_likelihood: single.ln_likelihood + prior, ..single });
            } else {
                next.extend(joints.iter().map(|joint| extended(joint, &single, alignment)));
            }
        }
        joints = kept(next);
    }
    let best = joints.first().map_or(0.0, |joint| joint.ln_likelihood);
    let total: f64 = joints.iter().map(|joint| (joint.ln_likelihood - best).exp()).sum();
    let resolved = joints.into_iter().map(|joint| ResolvedAttitude {
        common_from_object: joint.rotation,
        covariance: joint.covariance,
        probability: (joint.ln_likelihood - best).exp() / total,
        choice: joint.choice,
        chi_square: joint.chi_square,
    });
    Ok(resolved.filter(|resolved| resolved.probability >= PROBABILITY_MIN).collect())
}

/// A hypothesis about one view alone.
fn single(attitude: &CornerAttitude, common_from_camera: &Matrix3<f64>, index: usize) -> Joint {
    let known = attitude.covariance.iter().all(|x| x.is_finite()) && attitude.ln_volume.is_finite();
    let own = if known { attitude.covariance } else { Matrix3::from_diagonal_element(UNKNOWN) };
    // Where rounding has taken a little more than there was, two views that contradict each other would show it alone.
    let own = own + Matrix3::from_diagonal_element(ROUNDING * own.trace());
    Joint {
        rotation: common_from_camera * attitude.camera_from_object,
        covariance: common_from_camera * own * common_from_camera.transpose(),
        ln_likelihood: if known { attitude.ln_volume } else { 0.0 },
        chi_square: 0.0,
        choice: vec![index],
    }
}

/// A joint hypothesis with one more view.
fn extended(joint: &Joint, single: &Joint, alignment: Alignment) -> Joint {
    let mut spread = single.covariance;
    let mut off = Vector3::zeros();
    let mut least = f64::INFINITY;
    let mut consider = |turned: Matrix3<f64>| {
        let step = rotation_vector(&(turned * joint.rotation.transpose()));
        if step.norm() < least {
            (least, off) = (step.norm(), step);
        }
    };
    match alignment {
        Alignment::Same => consider(single.rotation),
        Alignment::Manhattan => namings().for_each(|naming| consider(single.rotation * naming)),
        Alignment::Vertical => {
            let vertical = joint.rotation.column(1).into_owned();
            let own = single.rotation.column(1) * single.rotation.column(1).dot(&vertical).signum();
            // The shortest way from the one vertical to the other, whatever the heading.
            let axis = vertical.cross(&own);
            let angle = axis.norm().atan2(vertical.dot(&own));
            off = axis.try_normalize(f64::MIN_POSITIVE).map_or(Vector3::zeros(), |axis| axis * angle);
            spread += vertical * vertical.transpose() * UNKNOWN;
        }
    }
    let sum = joint.covariance + spread;
    let (chi_square, ln_density) = gaussian(&off, &sum);
    // Joseph's form: what rounding has done to the gain leaves the covariance one, unless the gain is many times one.
    let gain = sum.cholesky().map_or_else(Matrix3::zeros, |factor| factor.solve(&joint.covariance).transpose());
    let keep = Matrix3::identity() - gain;
    let covariance = keep * joint.covariance * keep.transpose() + gain * spread * gain.transpose();
    let mut choice = joint.choice.clone();
    choice.extend_from_slice(&single.choice);
    Joint {
        rotation: Rotation3::new(gain * off).matrix() * joint.rotation,
        covariance: restored(&symmetric(&covariance)),
        ln_likelihood: joint.ln_likelihood + single.ln_likelihood + ln_density,
        chi_square: joint.chi_square + chi_square,
        choice,
    }
}

/// The eight namings of a corner with right angles: quarter turns about the vertical, and the vertical up or down.
pub(crate) fn namings() -> impl Iterator<Item = Matrix3<f64>> {
    let quarter = |k: i32| Rotation3::from_axis_angle(&Vector3::y_axis(), f64::from(k) * std::f64::consts::FRAC_PI_2);
    let over = [Matrix3::identity(), Matrix3::from_diagonal(&Vector3::new(1.0, -1.0, -1.0))];
    (0..4).flat_map(move |k| over.map(|over| quarter(k).matrix() * over))
}

/// The likeliest first, without the negligible.
fn kept(mut joints: Vec<Joint>) -> Vec<Joint> {
    joints.retain(|joint| joint.ln_likelihood.is_finite());
    joints.sort_by(|a, b| b.ln_likelihood.total_cmp(&a.ln_likelihood));
    let best = joints.first().map_or(0.0, |joint| joint.ln_likelihood);
    joints.retain(|joint| joint.ln_likelihood - best >= NEGLIGIBLE);
    joints.truncate(FOLLOWED_MAX);
    joints
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::filter::positive_semidefinite;

    /// Views of which each knows another direction 1e5 times as well as the rest.
    #[test]
    fn covariances_of_very_different_views_stay_covariances() {
        let joint = |axis: Vector3<f64>, large: f64, small: f64| Joint {
            rotation: Matrix3::identity(),
            covariance: Matrix3::identity() * large + axis * axis.transpose() * (small - large),
            ln_likelihood: 0.0,
            chi_square: 0.0,
            choice: vec![0],
        };
        for k in 0..500 {
            let turn = |k: f64| Rotation3::new(Vector3::new(k, 0.7 * k, -0.3 * k)) * Vector3::z();
            let (first, second) = (turn(0.01 * f64::from(k)), turn(0.02 * f64::from(k) + 1.0));
            let joined = extended(&joint(first, 1.0, 1e-10), &joint(second, 1e-3, 1e-13), Alignment::Same);
            assert!(positive_semidefinite(&joined.covariance), "{k}: {}", joined.covariance);
            let along = |axis: Vector3<f64>| axis.dot(&(joined.covariance * axis));
            assert!(along(first) <= 1.1e-10 && along(second) <= 1.1e-13, "{k}: {}", joined.covariance);
            let thin = extended(&joint(first, 1.0, 1e-14), &joint(second, 1e-10, 1e-24), Alignment::Same);
            assert!(positive_semidefinite(&thin.covariance), "{k}: {}", thin.covariance);
        }
    }
}
