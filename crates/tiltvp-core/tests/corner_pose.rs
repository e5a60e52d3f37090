//! Poses from noisy rays: errors at the Cramer-Rao bound, covariances that are true, hypotheses told apart.

#![allow(clippy::unwrap_used)]

use std::f64::consts::FRAC_PI_2;

use nalgebra::{DMatrix, DVector, Matrix3, Rotation3, SVector, UnitQuaternion, Vector3};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use tiltvp_core::corner::{
    Alignment, AttitudePrior, CornerFeature, CornerOptions, CornerPose, FittedRay, IncludedAngle, VerticalSense, View,
    corner_attitudes, corner_poses, included_angle, resolve,
};
use tiltvp_core::filter::{ConsistencyBand, squared_mahalanobis};
use tiltvp_core::geometry::{RigidMotion, tangent_log};

/// Pixels of a ray, its length at this focal length, and the noise of each pixel across it.
const PIXELS: usize = 200;
const FOCAL_PX: f64 = 702.0;
const NOISE_PX: f64 = 0.3;
const SIGMA_RAD: f64 = NOISE_PX / FOCAL_PX;
const BASELINE_M: f64 = 0.12;

fn normal(rng: &mut ChaCha8Rng) -> f64 {
    let (a, b): (f64, f64) = (1.0 - rng.random::<f64>(), rng.random());
    (-2.0 * a.ln()).sqrt() * (std::f64::consts::TAU * b).cos()
}

/// A pose of a corner before the camera, and its edges in the object's frame.
#[derive(Debug, Clone)]
struct Truth {
    rotation: Matrix3<f64>,
    vertex_m: Vector3<f64>,
    gamma_rad: f64,
    side: f64,
}

impl Truth {
    fn random(rng: &mut ChaCha8Rng) -> Self {
        let quaternion = nalgebra::Quaternion::new(normal(rng), normal(rng), normal(rng), normal(rng));
        let rotation = *UnitQuaternion::from_quaternion(quaternion).to_rotation_matrix().matrix();
        let (x, y) = (rng.random::<f64>() - 0.5, 0.6 * (rng.random::<f64>() - 0.5));
        let distance = 1.0 + 2.0 * rng.random::<f64>();
        let gamma_rad = (17.0 + 143.0 * rng.random::<f64>()).to_radians();
        let side = if rng.random() { 1.0 } else { -1.0 };
        Self { rotation, vertex_m: Vector3::new(x, y, 1.0).normalize() * distance, gamma_rad, side }
    }

    fn edges(&self) -> [Vector3<f64>; 3] {
        let (sin, cos) = self.gamma_rad.sin_cos();
        [Vector3::x(), Vector3::y(), Vector3::new(cos, 0.0, self.side * sin)]
    }

    /// The edges and the vertex as a camera sees them, after a small rotation of the object and a small step of the vertex.
    fn seen(&self, camera: &RigidMotion, change: &SVector<f64, 6>) -> ([Vector3<f64>; 3], Vector3<f64>) {
        let turn = *Rotation3::new(change.fixed_rows::<3>(0).into_owned()).matrix();
        let edges = self.edges().map(|edge| camera.rotation * (turn * (self.rotation * edge)));
        (edges, camera.point(&(self.vertex_m + change.fixed_rows::<3>(3))))
    }

    /// Where the pixels of the rays are, without noise, and the planes' normals.
    fn pixels(&self, camera: &RigidMotion) -> [(Vec<Vector3<f64>>, Vector3<f64>); 3] {
        let (edges, vertex) = self.seen(camera, &SVector::zeros());
        let length = PIXELS as f64 / FOCAL_PX;
        edges.map(|edge| {
            let normal = vertex.cross(&edge).normalize();
            let (start, along) = (vertex.normalize(), normal.cross(&vertex.normalize()));
            let at = |i: usize| {
                let (sin, cos) = (length * (i as f64 + 0.5) / PIXELS as f64).sin_cos();
                start * cos + along * sin
            };
            ((0..PIXELS).map(at).collect(), normal)
        })
    }

    fn feature(&self, camera: &RigidMotion, rng: &mut ChaCha8Rng) -> Option<CornerFeature> {
        let mut rays = Vec::new();
        for (bearings, normal_) in self.pixels(camera) {
            let noisy: Vec<_> =
                bearings.iter().map(|b| (b + normal_ * (SIGMA_RAD * normal(rng))).normalize()).collect();
            rays.push(FittedRay::fit(&noisy, &[SIGMA_RAD; PIXELS], &bearings[PIXELS - 1])?);
        }
        CornerFeature::from_rays(rays.try_into().ok()?)
    }

    /// The Cramer-Rao bound of (rotation, vertex) from the pixels of some cameras, by central differences of each pixel's
    /// distance from its plane; `None` along the line of sight, which one camera says nothing of, is left out by the pseudo
    /// inverse.
    fn bound(&self, cameras: &[RigidMotion]) -> DMatrix<f64> {
        let mut rows = Vec::new();
        for camera in cameras {
            let pixels = self.pixels(camera);
            let step = 1e-6;
            let normals = |change: &SVector<f64, 6>| {
                let (edges, vertex) = self.seen(camera, change);
                edges.map(|edge| vertex.cross(&edge).normalize())
            };
            let mut by: [Vec<Vector3<f64>>; 3] = Default::default();
            for k in 0..6 {
                let change = SVector::<f64, 6>::from_fn(|i, _| if i == k { step } else { 0.0 });
                let (plus, minus) = (normals(&change), normals(&-change));
                for i in 0..3 {
                    by[i].push((plus[i] - minus[i]) / (2.0 * step));
                }
            }
            for i in 0..3 {
                for bearing in &pixels[i].0 {
                    rows.push(DVector::from_fn(6, |k, _| by[i][k].dot(bearing) / SIGMA_RAD));
                }
            }
        }
        let mut information = DMatrix::zeros(6, 6);
        for row in rows {
            information += &row * row.transpose();
        }
        information.pseudo_inverse(1e-6).unwrap()
    }
}

fn rotation_error(estimate: &Matrix3<f64>, truth: &Matrix3<f64>) -> Vector3<f64> {
    UnitQuaternion::from_matrix(&(truth * estimate.transpose())).scaled_axis()
}

fn right_camera() -> (RigidMotion, RigidMotion) {
    let left_from_right = RigidMotion::new(
        "left_from_right",
        *Rotation3::from_euler_angles(0.01, -0.02, 0.015).matrix(),
        Vector3::new(BASELINE_M, 0.001, -0.002),
    )
    .unwrap();
    (left_from_right, left_from_right.inverse())
}

#[test]
fn one_camera_reaches_the_bound_and_knows_it() {
    let mut rng = ChaCha8Rng::seed_from_u64(1);
    let (mut squares, mut bounds, mut nees, mut vertex_nees) = (0.0, 0.0, Vec::new(), Vec::new());
    let mut poses = 0;
    while poses < 400 {
        let truth = Truth::random(&mut rng);
        let exact = truth.seen(&RigidMotion::identity(), &SVector::zeros());
        let toward = exact.0.map(|edge| exact.1 + edge);
        let angle = IncludedAngle::exact(truth.gamma_rad);
        let clean = corner_attitudes(&CornerFeature::from_bearings(&exact.1, &toward).unwrap(), &angle).unwrap();
        // Where roots fall together errors are no longer linear in the noise.
        if clean.iter().any(|a| a.sensitivity > 10.0) {
            continue;
        }
        poses += 1;
        let bound = truth.bound(&[RigidMotion::identity()]);
        bounds += 5.0 * bound.view((0, 0), (3, 3)).trace();
        for _ in 0..5 {
            let feature = truth.feature(&RigidMotion::identity(), &mut rng).unwrap();
            let found = corner_attitudes(&feature, &angle).unwrap();
            let error = |a: &Matrix3<f64>| rotation_error(a, &truth.rotation);
            let best = found
                .iter()
                .min_by(|a, b| error(&a.camera_from_object).norm().total_cmp(&error(&b.camera_from_object).norm()))
                .unwrap();
            let off = error(&best.camera_from_object);
            squares += off.norm_squared();
            nees.push(squared_mahalanobis(&off, &best.covariance).unwrap());
            let miss = tangent_log(&feature.vertex(), &truth.vertex_m.normalize());
            vertex_nees.push(squared_mahalanobis(&miss, &feature.vertex_covariance()).unwrap());
        }
    }
    let ratio: f64 = f64::sqrt(squares / bounds);
    assert!(ratio < 1.1, "rms {ratio} times the bound");
    // One run in 10,000 leaves each band.
    let mean = |values: &[f64]| values.iter().sum::<f64>() / values.len() as f64;
    let band = ConsistencyBand::of_mean(0.9999, 3, 2000).unwrap();
    assert!(band.holds(mean(&nees)), "{} {band:?}", mean(&nees));
    let band = ConsistencyBand::of_mean(0.9999, 2, 2000).unwrap();
    assert!(band.holds(mean(&vertex_nees)), "{} {band:?}", mean(&vertex_nees));
}

#[test]
fn two_cameras_reach_the_bound_and_choose_rightly() {
    let mut rng = ChaCha8Rng::seed_from_u64(2);
    let (left_from_right, right_from_left) = right_camera();
    let cameras = [RigidMotion::identity(), right_from_left];
    let (mut squares, mut bounds, mut nees, mut chi) = ([0.0; 2], [0.0; 2], Vec::new(), Vec::new());
    let (mut told, mut expected, mut right, mut chi_apart) = (0.0, 0.0, 0.0, Vec::new());
    let mut poses = 0;
    while poses < 1000 {
        let truth = Truth::random(&mut rng);
        let (Some(left), Some(other)) = (truth.feature(&cameras[0], &mut rng), truth.feature(&cameras[1], &mut rng))
        else {
            continue;
        };
        let options = CornerOptions { angle: IncludedAngle::exact(truth.gamma_rad), ..CornerOptions::default() };
        let sound = |f: &CornerFeature| {
            let found = corner_attitudes(f, &options.angle).unwrap();
            !found.is_empty() && found.iter().all(|a| a.sensitivity < 10.0)
        };
        if !sound(&left) || !sound(&other) {
            continue;
        }
        let found = corner_poses(&left, &other, &left_from_right, &options).unwrap();
        poses += 1;
        let total: f64 = found.iter().map(|pose| pose.probability).sum();
        assert!((total - 1.0).abs() < 1e-6);
        let first = found[0];
        expected += first.probability;
        let best = found
            .iter()
            .min_by(|a, b| {
                let error = |m: &Matrix3<f64>| rotation_error(m, &truth.rotation).norm();
                error(&a.camera_from_object).total_cmp(&error(&b.camera_from_object))
            })
            .unwrap();
        right += f64::from(u8::from(best == &first));
        told += f64::from(u8::from(first.probability > 0.99));
        assert!(best.fused);
        let off = rotation_error(&best.camera_from_object, &truth.rotation);
        let away = truth.vertex_m - best.vertex_m;
        let bound = truth.bound(&cameras);
        squares[0] += off.norm_squared();
        squares[1] += away.norm_squared();
        bounds[0] += bound.view((0, 0), (3, 3)).trace();
        bounds[1] += bound.view((3, 3), (3, 3)).trace();
        let all = SVector::<f64, 6>::from_iterator(off.iter().chain(away.iter()).copied());
        nees.push(squared_mahalanobis(&all, &best.covariance).unwrap());
        chi.push(best.chi_square);
        let apart = corner_poses(&left, &other, &left_from_right, &CornerOptions { fuse: false, ..options }).unwrap();
        chi_apart.extend(apart.iter().find(|pose| pose.case == best.case).map(|pose| pose.chi_square));
        assert_eq!(best.right_handed, truth.side > 0.0);
    }
    for (squares, bounds) in squares.iter().zip(bounds) {
        let ratio: f64 = f64::sqrt(squares / bounds);
        assert!(ratio < 1.1, "rms {ratio} times the bound");
    }
    let mean = |values: &[f64]| values.iter().sum::<f64>() / values.len() as f64;
    let band = ConsistencyBand::of_mean(0.9999, 6, 1000).unwrap();
    assert!(band.holds(mean(&nees)), "nees {} {band:?}", mean(&nees));
    assert!(band.holds(mean(&chi)), "chi-square {} {band:?}", mean(&chi));
    // Of attitudes and vertices apart there are as many: three of the attitudes, one of each feature and one of the vertex.
    assert!(band.holds(mean(&chi_apart)), "chi-square apart {} {band:?}", mean(&chi_apart));
    // The probabilities are true: as often right as they say, within four standard deviations.
    let deviation = (expected * (1.0 - expected / 1000.0)).max(1.0).sqrt();
    assert!((right - expected).abs() < 4.0 * deviation + 1.0, "{right} right of {expected} expected, {told} told");
    assert!(told > 700.0, "{told}");
}

#[test]
fn an_angle_that_is_known_roughly_is_found_with_the_pose() {
    let mut rng = ChaCha8Rng::seed_from_u64(7);
    let (left_from_right, right_from_left) = right_camera();
    let (mut nees, mut chi) = (Vec::new(), Vec::new());
    while nees.len() < 1000 {
        let truth = Truth::random(&mut rng);
        let sigma_rad = 0.005;
        let guess = IncludedAngle { gamma_rad: truth.gamma_rad + sigma_rad * normal(&mut rng), sigma_rad };
        if guess.validate().is_err() {
            continue;
        }
        let (Some(left), Some(right)) =
            (truth.feature(&RigidMotion::identity(), &mut rng), truth.feature(&right_from_left, &mut rng))
        else {
            continue;
        };
        let sound = |f: &CornerFeature| {
            let found = corner_attitudes(f, &guess).unwrap();
            !found.is_empty() && found.iter().all(|a| a.sensitivity < 5.0)
        };
        if !sound(&left) || !sound(&right) {
            continue;
        }
        let options = CornerOptions { angle: guess, ..CornerOptions::default() };
        let found = corner_poses(&left, &right, &left_from_right, &options).unwrap();
        let error = |pose: &CornerPose| rotation_error(&pose.camera_from_object, &truth.rotation);
        let best = found.iter().min_by(|a, b| error(a).norm().total_cmp(&error(b).norm())).unwrap();
        let (off, away) = (error(best), truth.vertex_m - best.vertex_m);
        let all = SVector::<f64, 6>::from_iterator(off.iter().chain(away.iter()).copied());
        nees.push(squared_mahalanobis(&all, &best.covariance).unwrap());
        chi.push(best.chi_square);
    }
    let mean = |values: &[f64]| values.iter().sum::<f64>() / values.len() as f64;
    let band = ConsistencyBand::of_mean(0.9999, 6, 1000).unwrap();
    assert!(band.holds(mean(&nees)), "nees {} {band:?}", mean(&nees));
    assert!(band.holds(mean(&chi)), "chi-square {} {band:?}", mean(&chi));
}

#[test]
fn priors_choose() {
    let mut rng = ChaCha8Rng::seed_from_u64(3);
    let mut poses = 0;
    while poses < 200 {
        let truth = Truth::random(&mut rng);
        let Some(feature) = truth.feature(&RigidMotion::identity(), &mut rng) else { continue };
        let found = corner_attitudes(&feature, &IncludedAngle::exact(truth.gamma_rad)).unwrap();
        let leans =
            |a: &tiltvp_core::corner::CornerAttitude| (a.alpha_rad - FRAC_PI_2).abs() > 0.3 && a.sensitivity < 5.0;
        if found.len() != 2 || !found.iter().all(leans) {
            continue;
        }
        poses += 1;
        let views = [View { attitudes: &found, common_from_camera: Matrix3::identity() }];
        let undecided = resolve(&views, Alignment::Same, None, &[]).unwrap();
        assert!(undecided.len() == 2 && (undecided[0].probability - 0.5).abs() < 0.1);
        let (rotation, down) = (truth.rotation, truth.rotation.column(1).into_owned());
        let elevation = (-down.z).asin();
        let priors = [
            AttitudePrior::Gravity { down, sigma_rad: 0.03, sense: VerticalSense::Down },
            AttitudePrior::Gravity { down: -down, sigma_rad: 0.03, sense: VerticalSense::Up },
            AttitudePrior::Attitude { camera_from_object: rotation, covariance: Matrix3::identity() * 1e-3 },
        ];
        for prior in priors {
            let resolved = resolve(&views, Alignment::Same, None, &[prior]).unwrap();
            assert!(resolved[0].probability > 0.999, "{prior:?}");
            assert!(rotation_error(&resolved[0].common_from_object, &truth.rotation).norm() < 0.1);
        }
        let prior = AttitudePrior::Elevation { elevation_rad: elevation, sigma_rad: 0.02, sense: VerticalSense::Down };
        let resolved = resolve(&views, Alignment::Same, None, &[prior]).unwrap();
        let apart = found.iter().map(|a| (-a.edges[1].z).asin()).reduce(|a, b| (a - b).abs()).unwrap();
        if apart > 0.3 {
            assert!(rotation_error(&resolved[0].common_from_object, &truth.rotation).norm() < 0.1);
        }
        let known = resolve(&views, Alignment::Same, Some(truth.side > 0.0), &[]).unwrap();
        assert!(known.len() == 1 && known[0].probability == 1.0);
        assert!(rotation_error(&known[0].common_from_object, &truth.rotation).norm() < 0.1);
    }
}

#[test]
fn parallel_features_choose() {
    // Corners of one room, seen by one camera: named alike, with edges turned, or sharing the vertical only.
    let mut rng = ChaCha8Rng::seed_from_u64(4);
    let mut poses = 0;
    while poses < 100 {
        let mut truth = Truth::random(&mut rng);
        truth.gamma_rad = FRAC_PI_2;
        for alignment in Alignment::ALL {
            let places = [Vector3::new(-0.6, -0.3, 2.0), Vector3::new(0.6, 0.4, 1.5), Vector3::new(0.2, -0.5, 1.8)];
            let features: Vec<_> = places
                .iter()
                .enumerate()
                .map(|(i, place)| {
                    let turn = match alignment {
                        Alignment::Same => 0.0,
                        Alignment::Manhattan => i as f64 * FRAC_PI_2,
                        Alignment::Vertical => i as f64 * 0.7,
                    };
                    let turn = Rotation3::from_axis_angle(&Vector3::y_axis(), turn);
                    let one = Truth { vertex_m: *place, rotation: truth.rotation * turn.matrix(), ..truth.clone() };
                    let feature = one.feature(&RigidMotion::identity(), &mut rng).unwrap();
                    corner_attitudes(&feature, &IncludedAngle::RIGHT).unwrap()
                })
                .collect();
            if features
                .iter()
                .any(|f| f.is_empty() || f.iter().any(|a| a.sensitivity > 5.0 || (a.alpha_rad - FRAC_PI_2).abs() < 0.3))
            {
                continue;
            }
            poses += 1;
            let views: Vec<_> =
                features.iter().map(|f| View { attitudes: f, common_from_camera: Matrix3::identity() }).collect();
            let resolved = resolve(&views, alignment, None, &[]).unwrap();
            let first = &resolved[0];
            assert!(first.probability > 0.99, "{alignment:?} {resolved:?}");
            assert!(rotation_error(&first.common_from_object, &truth.rotation).norm() < 0.1, "{alignment:?}");
            assert_eq!(first.choice.len(), 3);
        }
    }
}

#[test]
fn the_included_angle_with_its_deviation() {
    let mut rng = ChaCha8Rng::seed_from_u64(5);
    let mut nees = Vec::new();
    while nees.len() < 1000 {
        let truth = Truth::random(&mut rng);
        let feature = truth.feature(&RigidMotion::identity(), &mut rng).unwrap();
        let sigma = 0.002;
        let error = Vector3::new(normal(&mut rng), normal(&mut rng), normal(&mut rng)) * sigma;
        let vertical = Rotation3::new(error).matrix() * truth.rotation.column(1);
        if vertical.dot(&feature.vertex()).abs() < 0.3 {
            continue;
        }
        let found = included_angle(&feature, &vertical, &(Matrix3::identity() * sigma * sigma)).unwrap();
        nees.push(((found.gamma_rad - truth.gamma_rad) / found.sigma_rad).powi(2));
    }
    let band = ConsistencyBand::of_mean(0.9999, 1, 1000).unwrap();
    let mean = nees.iter().sum::<f64>() / 1000.0;
    assert!(band.holds(mean), "{mean} {band:?}");
}
