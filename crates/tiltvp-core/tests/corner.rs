//! Corners at known poses: the truth among the attitudes, in every case, and errors as large as the covariance says.

#![allow(clippy::unwrap_used)]

use std::f64::consts::{FRAC_PI_2, PI};

use nalgebra::{Matrix3, Rotation3, UnitQuaternion, Vector3, Vector4};
use proptest::prelude::*;
use tiltvp_core::corner::{
    Alignment, AttitudePrior, CornerAttitude, CornerCase, CornerFeature, Edge, IncludedAngle, Screening, StandardType,
    VerticalSense, corner_attitudes, included_angle, resolve,
};
use tiltvp_core::geometry::angle_between;

/// A corner before a camera: its attitude, the line of sight to its vertex, and its edges.
#[derive(Debug, Clone)]
struct Truth {
    camera_from_object: Matrix3<f64>,
    vertex: Vector3<f64>,
    edges: [Vector3<f64>; 3],
    gamma_rad: f64,
}

impl Truth {
    fn new(camera_from_object: Matrix3<f64>, vertex: Vector3<f64>, gamma_rad: f64, right_handed: bool) -> Self {
        let side = if right_handed { 1.0 } else { -1.0 };
        let z = Vector3::new(gamma_rad.cos(), 0.0, side * gamma_rad.sin());
        let edges = [Vector3::x(), Vector3::y(), z].map(|edge| camera_from_object * edge);
        Self { camera_from_object, vertex, edges, gamma_rad }
    }

    fn feature(&self) -> CornerFeature {
        let toward = self.edges.map(|edge| self.vertex * 2.0 + edge);
        CornerFeature::from_bearings(&self.vertex, &toward).unwrap()
    }

    fn angle(&self) -> IncludedAngle {
        IncludedAngle::exact(self.gamma_rad)
    }
}

fn rotation_between(a: &Matrix3<f64>, b: &Matrix3<f64>) -> f64 {
    let off = a * b.transpose();
    let sine =
        0.5 * Vector3::new(off[(2, 1)] - off[(1, 2)], off[(0, 2)] - off[(2, 0)], off[(1, 0)] - off[(0, 1)]).norm();
    sine.atan2(0.5 * (off.trace() - 1.0))
}

fn nearest(truth: &Truth) -> Option<(CornerAttitude, f64)> {
    let found = corner_attitudes(&truth.feature(), &truth.angle()).unwrap();
    let error = |a: &CornerAttitude| rotation_between(&a.camera_from_object, &truth.camera_from_object);
    found.iter().map(|a| (*a, error(a))).min_by(|a, b| a.1.total_cmp(&b.1))
}

/// What rounding of the bearings, some 1e-16 each, may do to an attitude.
fn rounding(attitude: &CornerAttitude) -> f64 {
    1e-14 + 2e-15 * attitude.sensitivity
}

fn unit() -> impl Strategy<Value = Vector3<f64>> {
    (-1.0..1.0f64, -1.0..1.0f64, -1.0..1.0f64).prop_filter_map("not in the ball", |(x, y, z)| {
        let v = Vector3::new(x, y, z);
        (v.norm() < 1.0).then(|| v.try_normalize(1e-3)).flatten()
    })
}

fn rotation() -> impl Strategy<Value = Matrix3<f64>> {
    (-1.0..1.0f64, -1.0..1.0f64, -1.0..1.0f64, -1.0..1.0f64).prop_filter_map("not in the ball", |(x, y, z, w)| {
        let q = Vector4::new(x, y, z, w);
        (q.norm() < 1.0 && q.norm() > 1e-2)
            .then(|| *UnitQuaternion::from_quaternion(nalgebra::Quaternion::from(q)).to_rotation_matrix().matrix())
    })
}

fn truth() -> impl Strategy<Value = Truth> {
    let gamma = prop_oneof![17.0f64.to_radians()..160.0f64.to_radians(), Just(FRAC_PI_2)];
    (rotation(), unit(), gamma, any::<bool>()).prop_map(|(r, v, gamma, right)| Truth::new(r, v, gamma, right))
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(4096))]

    #[test]
    fn the_truth_is_among_the_attitudes(truth in truth()) {
        let (found, error) = nearest(&truth).expect("an attitude");
        prop_assert!(error < rounding(&found).max(1e-12), "{error:.3e} with sensitivity {:.3e}", found.sensitivity);
        prop_assert!(Screening::of(&truth.feature(), &truth.angle()).unwrap().passes());
    }

    #[test]
    fn every_attitude_looks_like_the_rays(truth in truth()) {
        let feature = truth.feature();
        for attitude in corner_attitudes(&feature, &truth.angle()).unwrap().iter() {
            let r = attitude.camera_from_object;
            let allowed = rounding(attitude).max(1e-12);
            prop_assert!((r.transpose() * r - Matrix3::identity()).norm() < 1e-12 && r.determinant() > 0.0);
            prop_assert!((r.column(1) - attitude.edge(Edge::Y)).norm() < 1e-12);
            prop_assert!((r.column(0) - attitude.edge(Edge::X)).norm() < 1e-12);
            prop_assert!((angle_between(&attitude.edges[0], &attitude.edges[2]) - truth.gamma_rad).abs() < allowed);
            prop_assert!((angle_between(&attitude.edges[1], &feature.vertex()) - attitude.alpha_rad).abs() < 1e-7);
            for (edge, ray) in attitude.edges.iter().zip(feature.rays()) {
                prop_assert!(edge.dot(&ray.normal).abs() < allowed, "{:.3e}", edge.dot(&ray.normal));
                prop_assert!(edge.dot(&ray.normal.cross(&feature.vertex())) > 0.0);
            }
        }
    }

    #[test]
    fn interpretations_come_in_pairs_of_either_hand(truth in truth()) {
        let found: Vec<_> = corner_attitudes(&truth.feature(), &truth.angle()).unwrap().iter().copied().collect();
        prop_assert!(found.len() == 2 || found.len() == 4);
        for pair in found.chunks(2) {
            prop_assert!(!pair[0].mirrored && pair[1].mirrored);
            prop_assert!(pair[0].is_right_handed() != pair[1].is_right_handed());
            prop_assert!((pair[0].alpha_rad + pair[1].alpha_rad - PI).abs() < 1e-9);
            let upright = StandardType::of(&truth.feature(), truth.gamma_rad).flipped != Some(Edge::Y);
            prop_assert_eq!(pair[0].alpha_rad < FRAC_PI_2, upright);
        }
        if found.len() == 4 {
            let standard = StandardType::of(&truth.feature(), truth.gamma_rad);
            prop_assert!(standard.gamma_rad > FRAC_PI_2 && standard.case == CornerCase::OneToward);
            prop_assert!(found[2].alpha_rad >= found[0].alpha_rad || standard.flipped == Some(Edge::Y));
        }
    }

    #[test]
    fn no_root_is_missed(truth in truth()) {
        // The sign changes of the equation before squaring, over a grid of angles.
        let feature = truth.feature();
        let d = [0, 1, 2].map(|i: usize| feature.rays()[i].normal.cross(&feature.vertex()));
        let (a, b, c) = (d[0].dot(&d[1]), d[2].dot(&d[1]), d[0].dot(&d[2]));
        let f = |alpha: f64| {
            let t = alpha.tan().powi(2);
            (c + t * a * b) / ((1.0 + t * a * a) * (1.0 + t * b * b)).sqrt() - truth.gamma_rad.cos()
        };
        let grid: Vec<f64> = (0..=2000).map(|i| f(1e-4 + (FRAC_PI_2 - 2e-4) * f64::from(i) / 2000.0)).collect();
        let changes = grid.windows(2).filter(|pair| (pair[0] < 0.0) != (pair[1] < 0.0)).count();
        let found = corner_attitudes(&feature, &truth.angle()).unwrap();
        let inside = |a: &&CornerAttitude| {
            let alpha = a.alpha_rad.min(PI - a.alpha_rad);
            !a.mirrored && alpha > 2e-4 && alpha < FRAC_PI_2 - 2e-4
        };
        let roots: Vec<_> = found.iter().filter(inside).collect();
        // Two roots within one cell of the grid change no sign; its ends are not those of the filter.
        let plain: Vec<_> = found.iter().filter(|a| !a.mirrored).collect();
        let close = plain.len() == 2 && (plain[0].alpha_rad - plain[1].alpha_rad).abs() < 1e-3;
        prop_assert!(changes <= found.len() / 2, "{changes} changes of sign, {} attitudes", found.len());
        prop_assert!(roots.len() <= changes || close, "{} roots, {changes} changes of sign", roots.len());
    }

    #[test]
    fn the_standard_type_has_no_wide_gap(truth in truth()) {
        let standard = StandardType::of(&truth.feature(), truth.gamma_rad);
        let [x, z] = standard.vertical_rad;
        prop_assert!((x + z + standard.horizontal_rad - 2.0 * PI).abs() < 1e-9);
    }

    #[test]
    fn properties_of_the_standard_type(truth in truth()) {
        let standard = StandardType::of(&truth.feature(), truth.gamma_rad);
        let [x, z] = standard.vertical_rad;
        if standard.gamma_rad <= FRAC_PI_2 {
            prop_assert!(x > FRAC_PI_2 - 1e-9 && z > FRAC_PI_2 - 1e-9);
            prop_assert!(standard.case != CornerCase::OneToward);
        }
        prop_assert!(x > FRAC_PI_2 - 1e-9 || z > FRAC_PI_2 - 1e-9);
        if standard.case == CornerCase::AllAway {
            prop_assert!(standard.horizontal_rad > standard.gamma_rad - 1e-9);
        }
    }

    #[test]
    fn the_included_angle_of_a_known_attitude(truth in truth()) {
        let vertical = truth.camera_from_object.column(1).into_owned();
        prop_assume!(vertical.dot(&truth.vertex).abs() > 1e-4);
        for vertical in [vertical, -vertical] {
            let found = included_angle(&truth.feature(), &vertical, &Matrix3::zeros()).unwrap();
            prop_assert!((found.gamma_rad - truth.gamma_rad).abs() < 1e-10, "{}", found.gamma_rad - truth.gamma_rad);
            prop_assert!(found.sigma_rad < 1e-9);
        }
    }

    #[test]
    fn screens_what_no_corner_looks_like(truth in truth(), gamma in 0.3..2.8f64) {
        let feature = truth.feature();
        let angle = IncludedAngle::exact(gamma);
        let screened = Screening::of(&feature, &angle).unwrap();
        prop_assert_eq!(screened.passes(), !corner_attitudes(&feature, &angle).unwrap().is_empty());
        match screened {
            Screening::Passes => {}
            Screening::HorizontalAngle { projected_rad, least_rad }
            | Screening::VerticalAngle { projected_rad, least_rad } => prop_assert!(projected_rad <= least_rad),
            Screening::NoRoot { projected_rad } => prop_assert!(projected_rad < FRAC_PI_2),
        }
    }
}

/// A corner whose x edge is perpendicular to the line of sight and whose vertical makes the angle `alpha` with it.
fn perpendicular(alpha: f64, gamma: f64, turn: f64) -> Option<Truth> {
    // Line of sight along z; the vertical edge in the plane of z and some x, the x edge along y of that frame.
    let vertical = Vector3::new(alpha.sin(), 0.0, alpha.cos());
    let x = Vector3::y();
    let rotation = Matrix3::from_columns(&[x, vertical, x.cross(&vertical)]);
    let turned = Rotation3::new(Vector3::new(0.3, -0.2, 0.1)) * Rotation3::from_axis_angle(&Vector3::z_axis(), turn);
    [true, false]
        .into_iter()
        .map(|right| {
            let vertex = turned * Vector3::z();
            Truth::new(turned.matrix() * rotation, vertex, gamma, right)
        })
        .next()
}

#[test]
fn one_edge_perpendicular_to_the_line_of_sight() {
    for gamma_deg in [30.0f64, 60.0, 89.0, 91.0, 120.0, 150.0] {
        for alpha_deg in [5.0f64, 30.0, 60.0, 85.0, 120.0] {
            let truth = perpendicular(alpha_deg.to_radians(), gamma_deg.to_radians(), 0.7).unwrap();
            let (found, error) = nearest(&truth).unwrap();
            assert!(error < rounding(&found).max(1e-12), "{gamma_deg} {alpha_deg}: {error:.3e}");
            assert_eq!(found.case, CornerCase::OnePerpendicular);
        }
    }
}

#[test]
fn near_perpendicular_from_both_sides() {
    for nudge in [1e-3, 1e-6, 1e-9, 1e-12, 1e-15] {
        for side in [-1.0, 1.0] {
            let truth = perpendicular(0.9, 2.0, 0.7).unwrap();
            let lean = Rotation3::from_axis_angle(&nalgebra::Unit::new_normalize(truth.edges[1]), side * nudge);
            let truth = Truth::new(lean.matrix() * truth.camera_from_object, truth.vertex, 2.0, true);
            let (found, error) = nearest(&truth).unwrap();
            assert!(error < rounding(&found).max(1e-12), "{nudge} {side}: {error:.3e}");
        }
    }
}

#[test]
fn right_angles_and_almost_right_ones() {
    let rotation = *Rotation3::from_euler_angles(0.5, 0.4, 0.3).matrix();
    for off in [0.0, 1e-16, 1e-13, 1e-9, 1e-5] {
        for side in [-1.0, 1.0] {
            let truth = Truth::new(rotation, Vector3::new(0.1, -0.2, 1.0).normalize(), FRAC_PI_2 + side * off, true);
            let (found, error) = nearest(&truth).unwrap();
            assert!(error < rounding(&found).max(1e-12), "{off} {side}: {error:.3e}");
        }
    }
}

#[test]
fn vertical_edge_along_the_line_of_sight() {
    // Here both interpretations fall together: the error grows with the sensitivity, and not more.
    let vertex = Vector3::new(0.2, 0.1, 1.0).normalize();
    for lean in [1e-2, 1e-4, 1e-6, 1e-8] {
        let vertical = (vertex + Vector3::new(lean, 0.3 * lean, 0.0)).normalize();
        let x = vertical.cross(&Vector3::new(0.4, 1.0, 0.2)).normalize();
        let rotation = Matrix3::from_columns(&[x, vertical, x.cross(&vertical)]);
        let truth = Truth::new(rotation, vertex, 1.9, true);
        let (found, error) = nearest(&truth).unwrap();
        assert!(found.sensitivity > 0.1 / lean);
        assert!(error < 1e-12 + 1e-15 * found.sensitivity, "{lean}: {error:.3e}, {:.3e}", found.sensitivity);
    }
}

#[test]
fn angles_are_not_below_none_and_bearings_of_any_length() {
    // With the vertical edge along the line of sight the root is a zero, which had a sign.
    let toward = [[-1.0, -1.0, -1.0], [-0.75, -1.0, 1.0], [0.0, -1.0, 2.121_963_412e-314]].map(Vector3::from);
    let along = CornerFeature::from_bearings(&Vector3::new(5e-312, -1.0, -1.0), &toward).unwrap();
    let found = corner_attitudes(&along, &IncludedAngle::RIGHT).unwrap();
    assert!(!found.is_empty() && found.iter().all(|attitude| (0.0..=PI).contains(&attitude.alpha_rad)), "{found:?}");
    let truth = perpendicular(0.9, 2.0, 0.7).unwrap();
    let exact = truth.feature();
    for length in [1e-300, 1e-162, 1e200] {
        let toward = truth.edges.map(|edge| (truth.vertex * 2.0 + edge) * length);
        let same = CornerFeature::from_bearings(&(truth.vertex * length), &toward).unwrap();
        assert!((same.vertex() - exact.vertex()).norm() < 1e-15, "{length}");
        assert!((0..3).all(|i| (same.rays()[i].normal - exact.rays()[i].normal).norm() < 1e-14), "{length}");
    }
}

/// The vertical edge in the line of sight but for the last bits, a direction that underflows, and an included angle of which nothing
/// is known.
#[test]
fn what_rounding_decides_is_undetermined() {
    let corners = [
        (
            Vector3::new(0.0, 0.712_091_967_953_453_3, -0.702_086_197_824_866_9),
            [[-2.98e-160, -8.9e-161, 1.0], [-0.6897, 0.2206, 0.6897], [-1.0, 0.0, 0.0]],
            IncludedAngle::RIGHT,
        ),
        (
            Vector3::new(0.661_427_059_823_803_8, -0.750_009_496_295_105_8, 3.03e-307),
            [[1.0, 0.0, 0.0], [0.3535, 0.3574, 0.8645], [-7.98e-84, 0.0, 1.0]],
            IncludedAngle { gamma_rad: FRAC_PI_2, sigma_rad: 3e-4 },
        ),
        (
            Vector3::new(-0.577_062_938_375_109, -0.577_493_880_986_580_3, -0.577_493_880_986_580_3),
            [[-1.0, -1.0, -1.0], [-1.0, -1.0, -1.0], [-0.8958, -0.2933, 0.334]],
            IncludedAngle { gamma_rad: 0.0117, sigma_rad: 1e160 },
        ),
    ];
    for (vertex, toward, angle) in corners {
        let feature = CornerFeature::from_bearings(&vertex, &toward.map(Vector3::from)).unwrap();
        let found = corner_attitudes(&feature, &angle).unwrap();
        assert!(!found.is_empty());
        for attitude in found.iter() {
            assert!((0.0..=PI).contains(&attitude.alpha_rad), "{attitude:?}");
            assert!(attitude.sensitivity.is_infinite() && !attitude.ln_volume.is_nan(), "{attitude:?}");
            assert_eq!(attitude.covariance, Matrix3::from_diagonal_element(f64::INFINITY), "{attitude:?}");
        }
    }
}

#[test]
fn wrong_questions_are_errors() {
    let truth = perpendicular(0.9, 2.0, 0.7).unwrap();
    for gamma_rad in [0.0, PI, -1.0, f64::NAN, f64::INFINITY] {
        assert!(corner_attitudes(&truth.feature(), &IncludedAngle::exact(gamma_rad)).is_err());
        assert!(Screening::of(&truth.feature(), &IncludedAngle::exact(gamma_rad)).is_err());
    }
    for sigma_rad in [-1.0, f64::NAN, f64::INFINITY] {
        assert!(corner_attitudes(&truth.feature(), &IncludedAngle { gamma_rad: 1.0, sigma_rad }).is_err());
    }
    let vertex = Vector3::z();
    let good = [Vector3::new(1.0, 0.0, 1.0), Vector3::new(0.0, 1.0, 1.0), Vector3::new(-1.0, -1.0, 1.0)];
    assert!(CornerFeature::from_bearings(&vertex, &good).is_some());
    for bad in [Vector3::zeros(), Vector3::z(), -Vector3::z(), Vector3::repeat(f64::NAN), Vector3::x() * f64::INFINITY]
    {
        assert!(CornerFeature::from_bearings(&vertex, &[good[0], bad, good[2]]).is_none(), "{bad:?}");
    }
    assert!(CornerFeature::from_bearings(&Vector3::zeros(), &good).is_none());
}

#[test]
fn wrong_priors_are_errors() {
    let down = Vector3::y();
    let sense = VerticalSense::Either;
    let zero = Matrix3::zeros();
    let wrong = [
        AttitudePrior::Gravity { down: down * 2.0, sigma_rad: 0.1, sense },
        AttitudePrior::Gravity { down, sigma_rad: 0.0, sense },
        AttitudePrior::Elevation { elevation_rad: 2.0, sigma_rad: 0.1, sense },
        AttitudePrior::Elevation { elevation_rad: 0.0, sigma_rad: f64::NAN, sense },
        AttitudePrior::Attitude { camera_from_object: Matrix3::identity() * 1.1, covariance: Matrix3::identity() },
        AttitudePrior::Attitude { camera_from_object: Matrix3::identity(), covariance: zero },
    ];
    for prior in wrong {
        assert!(resolve(&[], Alignment::Same, None, &[prior]).is_err(), "{prior:?}");
    }
}
