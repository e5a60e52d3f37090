//! The common direction of great circles that a user brings: the same robust core on normals of any origin.

use std::f64::consts::{FRAC_PI_2, PI};

use nalgebra::{Matrix2, Rotation3, Unit, Vector3};

use super::confidence::inverse_of_positive;
use super::methods::subsample::Subsample;
use super::methods::{RefineOptions, refine};
use crate::error::{Error, Result};
use crate::geometry::tangent_basis;
use crate::options;
use crate::options::Between;
use crate::robust::{Gate, Rows, Stop};

options! {
    /// Options of [`common_direction`].
    #[derive(Copy)]
    pub struct CommonDirectionOptions {
        /// How far in radians the great circles of inliers stray from the direction.
        sigma_rad: f64 = 1f64.to_radians() => Between(0.0, 1.0), "an angle strictly between 0 and 1 radian";
        /// A direction near which the answer lies.
        prior: Vector3<f64> = Vector3::z();
        /// Largest angle in radians between the prior and the answer.
        max_angle_rad: f64 = 20f64.to_radians() => Between(0.0, FRAC_PI_2), "an angle strictly between 0 and pi/2";
    }
    check prior_is_a_direction
}

fn prior_is_a_direction(options: &CommonDirectionOptions) -> Result<()> {
    unit_prior(options).map(drop)
}

fn unit_prior(options: &CommonDirectionOptions) -> Result<Vector3<f64>> {
    unit(&options.prior)
        .ok_or_else(|| Error::argument("prior", format!("{:?}", options.prior), "a finite vector that is not zero"))
}

/// A direction orthogonal to most of the normals.
#[derive(Debug, Clone, PartialEq)]
pub struct CommonDirection {
    /// Unit direction on the prior's side, `None` if the normals do not determine one, with a finite covariance.
    pub direction: Option<Vector3<f64>>,
    /// Covariance in squared radians in the tangent plane, in the basis of [`tangent_basis`]; infinite without a direction.
    pub covariance_rad2: Matrix2<f64>,
    /// For each normal whether its great circle passes within three `sigma_rad` of the direction.
    pub inliers: Vec<bool>,
    /// Root mean square residual in radians; NaN without a direction.
    pub residual_rms_rad: f64,
    /// Refits done.
    pub iterations: u32,
    /// Why the fit stopped.
    pub stop: Stop,
}

/// Finds the direction that is most nearly orthogonal to the great-circle normals (of any length but zero).
///
/// Normals whose great circles do not pass within `max_angle_rad` of the prior cannot agree with an answer there and are
/// left out first. The answer is independent of the signs of the normals and turns with them. Where no more agree than would by
/// chance there is none; of two normals the direction that they always have in common is one.
///
/// # Errors
/// [`Error::InvalidArgument`] if a normal or weight is not finite, a normal is zero, a weight negative, or their numbers differ;
/// [`Error::InvalidOption`] if an option is out of its domain.
pub fn common_direction(
    normals: &[Vector3<f64>],
    weights: Option<&[f64]>,
    options: &CommonDirectionOptions,
) -> Result<CommonDirection> {
    let prior = validate(normals, weights, options)?;
    let upright_from_user = Rotation3::rotation_between(&prior, &Vector3::z())
        .unwrap_or_else(|| Rotation3::from_axis_angle(&Unit::new_unchecked(Vector3::x()), PI));
    let limit = options.max_angle_rad.sin();
    // Weights such as likelihoods may all be smaller than single precision knows.
    let heaviest = weights.map_or(1.0, |weights| weights.iter().copied().fold(f64::MIN_POSITIVE, f64::max));
    let mut rows = Rows::<f64>::with_capacity(normals.len());
    let mut kept = Vec::with_capacity(normals.len());
    let mut row_weights = Vec::with_capacity(normals.len());
    for (i, normal) in normals.iter().enumerate() {
        let row = upright_from_user * unit(normal).unwrap_or_default();
        let weight = weights.map_or(1.0, |weights| weights[i] / heaviest) as f32;
        if row.z.abs() <= limit && weight > 0.0 {
            rows.push(row.x, row.y, row.z);
            row_weights.push(weight);
            kept.push(row);
        }
    }
    let refining = RefineOptions {
        scale_rad: options.sigma_rad,
        tolerance_rad: 1e-10,
        max_iterations: 50,
        ..RefineOptions::default()
    };
    let report = refine(&rows, &refining, &mut row_weights, &mut Subsample::default());
    let found = report.model.filter(|o| o.z >= options.max_angle_rad.cos());
    let reach = (3.0 * options.sigma_rad).min(FRAC_PI_2).sin();
    // Where residuals curve nowhere to a minimum, or as many agree by chance, there is no answer, however the descent ended.
    let told = found.and_then(|upright| {
        let direction = upright_from_user.inverse() * upright;
        let agrees = |normal: &Vector3<f64>| unit(normal).unwrap_or_default().dot(&direction).abs() <= reach;
        let inliers: Vec<bool> = normals.iter().map(agrees).collect();
        let counts = |i: &usize| weights.is_none_or(|weights| weights[*i] > 0.0);
        let of = (0..normals.len()).filter(counts).count();
        let agreeing = (0..normals.len()).filter(counts).filter(|i| inliers[*i]).count();
        if agreeing < of && by_chance(agreeing, of, reach, options.max_angle_rad) > BY_CHANCE {
            return None;
        }
        let covariance = covariance(&kept, &row_weights, &upright, &upright_from_user, options.sigma_rad);
        covariance.iter().all(|x| x.is_finite()).then_some((direction, inliers, covariance))
    });
    let stop = match (report.model, found, &told) {
        (Some(o), None, _) => {
            Stop::OutOfReach { angle_rad: o.xy().norm().atan2(o.z), limit_rad: options.max_angle_rad }
        }
        (_, Some(_), None) => Stop::Undetermined { agreeing: report.inliers },
        _ => report.stop,
    };
    let Some((direction, inliers, covariance_rad2)) = told else {
        return Ok(CommonDirection {
            direction: None,
            covariance_rad2: Matrix2::repeat(f64::INFINITY),
            inliers: vec![false; normals.len()],
            residual_rms_rad: f64::NAN,
            iterations: report.iterations,
            stop,
        });
    };
    Ok(CommonDirection {
        direction: Some(direction),
        covariance_rad2,
        inliers,
        residual_rms_rad: report.rms,
        iterations: report.iterations,
        stop,
    })
}

/// So many directions that unrelated normals agree on, at most, leave an answer to be one: of 3, 10, 30 and 100 random normals 11, 53, 88
/// and 96 % had an answer that was wrong by more than its covariance says, now less than 1 % (`random_normals_have_no_direction`).
const BY_CHANCE: f64 = 0.1;

/// How many directions near the prior are to be expected on which so many of unrelated normals agree, within an angle of that sine.
///
/// Each pair has a direction, and great circles at random pass so near to it with the probability of that sine; for the rest it is
/// Hoeffding's bound of the binomial distribution (1963).
fn by_chance(agreeing: usize, of: usize, reach: f64, max_angle_rad: f64) -> f64 {
    let (rest, also) = (of as f64 - 2.0, agreeing as f64 - 2.0);
    let share = also / rest;
    let apart = |a: f64, b: f64| if a > 0.0 { a * (a / b).ln() } else { 0.0 };
    let tail =
        if share > reach { (-rest * (apart(share, reach) + apart(1.0 - share, 1.0 - reach))).exp() } else { 1.0 };
    0.5 * (rest + 2.0) * (rest + 1.0) * (1.0 - max_angle_rad.cos()) * tail
}

/// How many residuals the stated standard deviation counts as. With two, of 1,000 directions from 3, 4 and 8 normals that stray by half of
/// what is stated 100, 100 and 97 % are in their 90 % region; of as many from normals that stray by all of it, where the gate takes some
/// for outliers, 84, 70 and 58 %.
const STATED: f64 = 2.0;

/// The covariance of a direction in its tangent plane, from rows about the vertical. Each row errs on its own: the user's normals
/// are whole edges, not pixels.
fn covariance(
    rows: &[Vector3<f64>],
    weights: &[f32],
    upright: &Vector3<f64>,
    upright_from_user: &Rotation3<f64>,
    sigma_rad: f64,
) -> Matrix2<f64> {
    let gate = Gate::Soft { scale: sigma_rad };
    let held = rows.iter().filter(|row| gate.weight(row.dot(upright)) > 0.0).count();
    let [mut information, mut spread, mut stated] = [Matrix2::zeros(); 3];
    let basis = tangent_basis(&(upright_from_user.inverse() * upright));
    for (row, weight) in rows.iter().zip(weights) {
        let d = row.dot(upright);
        let own = f64::from(*weight);
        let weight = own * gate.weight(d);
        let xy = basis.transpose() * (upright_from_user.inverse() * row);
        information += xy * xy.transpose() * (own * gate.slope(d));
        spread += xy * xy.transpose() * (weight * d).powi(2);
        stated += xy * xy.transpose() * (weight * sigma_rad).powi(2);
    }
    if held <= 2 {
        // Two great circles always meet: their residuals are zero and tell nothing.
        spread = stated;
    } else {
        // Few residuals hardly tell how far normals stray: what is stated counts as `STATED` of them.
        let free = held as f64 - 2.0;
        spread = (spread * held as f64 + stated * STATED) / (free + STATED);
    }
    inverse_of_positive(&information).map_or(Matrix2::repeat(f64::INFINITY), |inverse| inverse * spread * inverse)
}

/// Checks all inputs and returns the unit prior.
fn validate(
    normals: &[Vector3<f64>],
    weights: Option<&[f64]>,
    options: &CommonDirectionOptions,
) -> Result<Vector3<f64>> {
    for (i, normal) in normals.iter().enumerate() {
        if unit(normal).is_none() {
            return Err(Error::argument(
                "normals",
                format!("{normal:?} in row {i}"),
                "finite vectors that are not zero",
            ));
        }
    }
    if let Some(weights) = weights {
        if weights.len() != normals.len() {
            return Err(Error::argument(
                "weights",
                format!("{} values", weights.len()),
                format!("{} values", normals.len()),
            ));
        }
        if let Some(i) = weights.iter().position(|w| !(w.is_finite() && *w >= 0.0)) {
            return Err(Error::argument(
                "weights",
                format!("{} in row {i}", weights[i]),
                "finite weights, zero or more",
            ));
        }
    }
    options.validate()?;
    unit_prior(options)
}

/// The unit vector of any finite vector but zero, however large or small.
fn unit(vector: &Vector3<f64>) -> Option<Vector3<f64>> {
    let largest = vector.amax();
    (vector.iter().all(|x| x.is_finite()) && largest > 0.0).then(|| (vector / largest).normalize())
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::{prop_assert, prop_assume, proptest};
    use rand::Rng as _;
    use rand_chacha::ChaCha8Rng;
    use rand_chacha::rand_core::SeedableRng as _;

    fn normals(direction: &Vector3<f64>, count: usize) -> Vec<Vector3<f64>> {
        let basis = tangent_basis(direction);
        (0..count)
            .map(|i| {
                let t = 2.4 * i as f64;
                basis.column(0) * t.cos() + basis.column(1) * t.sin() + direction * (0.01 * (7.0 * t).sin())
            })
            .collect()
    }

    proptest! {
        #[test]
        fn finds_any_direction_near_its_prior(x in -1.0..1.0f64, y in -1.0..1.0f64, z in -1.0..1.0f64, lean in 0.0..0.15f64) {
            prop_assume!(x * x + y * y + z * z > 0.01);
            let truth = Vector3::new(x, y, z).normalize();
            let prior = truth + tangent_basis(&truth).column(0) * lean;
            let options = CommonDirectionOptions { prior, ..CommonDirectionOptions::default() };
            let found = common_direction(&normals(&truth, 300), None, &options).unwrap();
            prop_assert!((found.direction.unwrap() - truth).norm() < 2e-3);
            prop_assert!(found.inliers.iter().all(|inlier| *inlier));
        }

        #[test]
        fn never_panics(values in proptest::collection::vec(-1e3..1e3f64, 0..60)) {
            let normals: Vec<_> = values.chunks_exact(3).map(|c| Vector3::new(c[0], c[1], c[2])).collect();
            let _ = common_direction(&normals, None, &CommonDirectionOptions::default());
        }
    }

    #[test]
    fn options_without_a_direction_are_none() {
        for prior in [Vector3::new(-3.0, f64::NAN, -2.9), Vector3::new(f64::INFINITY, 0.0, 1.0), Vector3::zeros()] {
            let error = CommonDirectionOptions { prior, ..CommonDirectionOptions::default() }.validate().unwrap_err();
            assert!(error.to_string().contains("a finite vector that is not zero"), "{error}");
        }
    }

    #[test]
    fn covariance_matches_the_scatter_of_repeated_fits() {
        let truth = Vector3::new(0.02, 0.03, 1.0).normalize();
        let options = CommonDirectionOptions::default();
        let (mut scatter, mut predicted, runs) = (Matrix2::zeros(), Matrix2::zeros(), 2000);
        let mut generator = ChaCha8Rng::seed_from_u64(4);
        for _ in 0..runs {
            let noisy: Vec<_> = normals(&truth, 80)
                .iter()
                .map(|n| {
                    let noise = f64::from(generator.next_u32()) / f64::from(u32::MAX) - 0.5;
                    n - truth * n.dot(&truth) + truth * (0.03 * noise)
                })
                .collect();
            let found = common_direction(&noisy, None, &options).unwrap();
            let error = tangent_basis(&truth).transpose() * found.direction.unwrap();
            scatter += error * error.transpose() / f64::from(runs);
            predicted += found.covariance_rad2 / f64::from(runs);
        }
        assert!((predicted.trace() / scatter.trace() - 1.0).abs() < 0.1, "{predicted} against {scatter}");
    }

    /// Three great circles nearly meet by chance: how little they miss each other by tells nothing.
    #[test]
    fn few_normals_know_a_direction_no_better_than_is_stated() {
        let options = CommonDirectionOptions::default();
        let mut generator = ChaCha8Rng::seed_from_u64(5);
        let mut uniform = || f64::from(generator.next_u32()) / f64::from(u32::MAX);
        for (count, share, at_least) in [(2, 1.0, 0.9), (3, 1.0, 0.8), (3, 0.5, 0.9), (4, 0.5, 0.9), (8, 0.5, 0.9)] {
            let (mut inside, mut all) = (0.0, 0.0);
            for _ in 0..1000 {
                let rows: Vec<Vector3<f64>> = (0..count)
                    .map(|_| {
                        let turn = 2.0 * PI * uniform();
                        // Uniform noise of that share of the stated standard deviation.
                        let off = share * options.sigma_rad * 12f64.sqrt() * (uniform() - 0.5);
                        Vector3::new(turn.cos(), turn.sin(), off)
                    })
                    .collect();
                let found = common_direction(&rows, None, &options).unwrap();
                let Some(direction) = found.direction else { continue };
                let error = tangent_basis(&direction).transpose() * Vector3::z();
                let inverse = found.covariance_rad2.try_inverse().unwrap();
                inside += f64::from(u8::from(error.dot(&(inverse * error)) <= 4.605));
                all += 1.0;
            }
            assert!(inside >= at_least * all, "{inside} of {all} by {count}");
        }
        let rows = [Vector3::new(1.0, 0.0, 0.01), Vector3::new(0.0, 1.0, 0.01), Vector3::new(1.0, 1.0, 0.02)];
        let exact = common_direction(&rows, None, &options).unwrap();
        assert!(exact.covariance_rad2.symmetric_eigenvalues().min().sqrt() > 0.5 * options.sigma_rad);
    }

    #[test]
    fn random_normals_have_no_direction() {
        let options = CommonDirectionOptions::default();
        let mut generator = ChaCha8Rng::seed_from_u64(6);
        let mut uniform = || 2.0 * f64::from(generator.next_u32()) / f64::from(u32::MAX) - 1.0;
        let mut ball =
            || std::iter::repeat_with(|| Vector3::new(uniform(), uniform(), uniform())).find(|v| v.norm() < 1.0);
        for count in [3, 5, 10, 30, 100] {
            let answers = (0..1000).filter(|_| {
                let rows: Vec<_> = (0..count).filter_map(|_| ball()).collect();
                common_direction(&rows, None, &options).unwrap().direction.is_some()
            });
            let answers = answers.count();
            assert!(answers <= 10, "{answers} of 1000 by {count}");
        }
        // Half of ten are another matter, and so is what nothing speaks against.
        let mut half = normals(&Vector3::z(), 5);
        half.extend((0..5).filter_map(|_| ball()));
        assert!(common_direction(&half, None, &options).unwrap().direction.is_some());
        assert!(common_direction(&half[..2], None, &options).unwrap().direction.is_some());
    }

    #[test]
    fn says_why_there_is_no_answer() {
        let options = CommonDirectionOptions::default();
        let none = common_direction(&[], None, &options).unwrap();
        assert!(none.direction.is_none() && none.stop == Stop::TooFew { have: 0, need: 2 });
        let same = common_direction(&[Vector3::x(); 5], None, &options).unwrap();
        assert!(same.direction.is_none() && matches!(same.stop, Stop::NoModel { .. }));
        assert!(common_direction(&[Vector3::zeros()], None, &options).is_err());
        assert!(common_direction(&[Vector3::x()], Some(&[1.0, 2.0]), &options).is_err());
        assert!(none.covariance_rad2[(0, 0)].is_infinite());
    }
}
