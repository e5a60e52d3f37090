//! Does a calibrated camera keep its promises: inverse both ways and true Jacobians, from the axis to the rim.

use nalgebra::{Matrix2, SVector, Vector2, Vector3};

use super::calibrated::Camera;
use super::difference::{Derivative, derivative};
use crate::geometry::angle_between;
use crate::interrupt::check;

/// What [`conformance`] measured. A camera that is right has round trips of rounding error and Jacobians that differ from
/// the differences by about the error of these.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Conformance {
    /// Pixels inside the valid set that were tested.
    pub pixels_tested: usize,
    /// Pixels of a grid over the image that the camera has no bearing for.
    pub pixels_outside: usize,
    /// Tested pixels whose bearing has no pixel: 0 for a camera that is right, otherwise the round trips are infinite.
    pub pixels_lost: usize,
    /// Tested pixels without a Jacobian, as at the poles of a panorama.
    pub pixels_without_jacobian: usize,
    /// Largest distance between a pixel and the pixel of its bearing, in pixels.
    pub max_round_trip_px: f64,
    /// Largest angle between a bearing and the bearing of its pixel, in radians.
    pub max_round_trip_rad: f64,
    /// Largest departure of the length of a bearing from 1.
    pub max_length_error: f64,
    /// Largest difference between either Jacobian and central differences, relative to the norm of the Jacobian.
    pub max_jacobian_error_relative: f64,
    /// Largest departure of `(d pixel / d bearing) (d bearing / d pixel)` from the identity.
    pub max_inverse_error: f64,
    /// Largest estimated error of the differences themselves, relative to the norm of the Jacobian.
    pub max_difference_error_relative: f64,
    /// Largest angle from the central ray that was tested, in radians.
    pub rim_theta_rad: f64,
    /// The pixel `[u, v]` of the largest error of a Jacobian.
    pub worst_jacobian_px: [f64; 2],
}

/// Rows and columns of the grid over the image: odd, so that its middle is tested too.
const GRID: u32 = 33;
/// Directions from the centre of the lens in which the way to the rim is sampled: every 7.5 degrees, the axes and diagonals among
/// them.
const SPOKES: u32 = 48;
/// Even steps on the way to the rim: 4 degrees each for a fisheye of 190.
const EVEN: u32 = 24;
/// Parts of the way to the rim, close to it; Jacobians are compared on the first few, where differences have room.
const NEAR_RIM: [f64; 5] = [1e-2, 1e-3, 2e-4, 1e-6, 1e-9];
const NEAR_RIM_WITH_JACOBIAN: usize = 3;

/// How far the pixel moves, at most, in the differences of the projection; [`derivative`] halves it until rounding outweighs
/// what is gained.
const STEP_PX: f64 = 4.0;

/// Samples pixels over the image inside the valid set, densely near the rim, and compares pixel -> bearing -> pixel,
/// bearing -> pixel -> bearing, and both Jacobians with extrapolated central differences.
///
/// ```
/// use tiltvp_core::camera::{Camera, Equidistant, conformance};
/// let camera = Camera::new(640, 480, Equidistant::new(180.0, 319.5, 239.5)?.into())?;
/// let found = conformance(&camera);
/// assert!(found.max_round_trip_px < 1e-9 && found.max_jacobian_error_relative < 1e-8);
/// # Ok::<(), tiltvp_core::Error>(())
/// ```
pub fn conformance(camera: &Camera) -> Conformance {
    let (w, h) = (f64::from(camera.width()), f64::from(camera.height()));
    let middle = Vector2::new(w - 1.0, h - 1.0) * 0.5;
    let on_axis = [Vector3::z(), -Vector3::z()]
        .iter()
        .filter_map(|axis| camera.project(axis))
        .find(|pixel| camera.contains(pixel) && camera.unproject(pixel).is_some());
    let centre = on_axis.unwrap_or(middle);
    let mut test = Test::new(camera, &centre);
    for i in 0..GRID {
        check();
        for j in 0..GRID {
            let part = Vector2::new(f64::from(j), f64::from(i)) / f64::from(GRID - 1);
            test.pixel(&Vector2::new(part.x * (w - 1.0), part.y * (h - 1.0)), true);
        }
    }
    let seen = |pixel: &Vector2<f64>| camera.contains(pixel) && camera.unproject(pixel).is_some();
    if seen(&centre) {
        test.pixel(&centre, true);
        for spoke in 0..SPOKES {
            let (sin, cos) = (std::f64::consts::TAU * (f64::from(spoke) + 0.13) / f64::from(SPOKES)).sin_cos();
            let direction = Vector2::new(cos, sin);
            let edge = edge(w + h, |r| seen(&(centre + direction * r)));
            for step in 1..EVEN {
                test.pixel(&(centre + direction * (edge * f64::from(step) / f64::from(EVEN))), true);
            }
            for (i, part) in NEAR_RIM.iter().enumerate() {
                test.pixel(&(centre + direction * (edge * (1.0 - part))), i < NEAR_RIM_WITH_JACOBIAN);
            }
        }
    }
    test.found
}

/// The largest distance up to `end` that is `inside`, if nearer ones are.
fn edge(end: f64, inside: impl Fn(f64) -> bool) -> f64 {
    let (mut low, mut high) = (0.0, end);
    for _ in 0..60 {
        let middle = 0.5 * (low + high);
        if inside(middle) { low = middle } else { high = middle }
    }
    low
}

/// Largest of two, where "not a number" is the largest of all.
fn worse(a: f64, b: f64) -> f64 {
    if b.is_nan() { f64::INFINITY } else { a.max(b) }
}

struct Test<'a> {
    camera: &'a Camera,
    central: Vector3<f64>,
    found: Conformance,
}

impl<'a> Test<'a> {
    fn new(camera: &'a Camera, centre: &Vector2<f64>) -> Self {
        let central = camera.unproject(centre).unwrap_or_else(Vector3::z);
        let found = Conformance {
            pixels_tested: 0,
            pixels_outside: 0,
            pixels_lost: 0,
            pixels_without_jacobian: 0,
            max_round_trip_px: 0.0,
            max_round_trip_rad: 0.0,
            max_length_error: 0.0,
            max_jacobian_error_relative: 0.0,
            max_inverse_error: 0.0,
            max_difference_error_relative: 0.0,
            rim_theta_rad: 0.0,
            worst_jacobian_px: [centre.x, centre.y],
        };
        Self { camera, central, found }
    }

    fn pixel(&mut self, pixel: &Vector2<f64>, with_jacobian: bool) {
        let Some(bearing) = self.camera.unproject(pixel) else {
            self.found.pixels_outside += 1;
            return;
        };
        let found = &mut self.found;
        found.pixels_tested += 1;
        found.max_length_error = worse(found.max_length_error, (bearing.norm() - 1.0).abs());
        found.rim_theta_rad = worse(found.rim_theta_rad, angle_between(&self.central, &bearing));
        let back = self.camera.project(&bearing);
        let again = back.and_then(|back| self.camera.unproject(&back).map(|again| (back, again)));
        let Some((back, again)) = again else {
            found.pixels_lost += 1;
            found.max_round_trip_px = f64::INFINITY;
            found.max_round_trip_rad = f64::INFINITY;
            return;
        };
        found.max_round_trip_px = worse(found.max_round_trip_px, (back - pixel).norm());
        found.max_round_trip_rad = worse(found.max_round_trip_rad, angle_between(&bearing, &again));
        if with_jacobian {
            self.jacobians(pixel, &bearing);
        }
    }

    fn jacobians(&mut self, pixel: &Vector2<f64>, bearing: &Vector3<f64>) {
        let camera = self.camera;
        let Some(((_, by_bearing), (_, by_pixel))) =
            camera.project_jacobian(bearing).zip(camera.unproject_jacobian(pixel))
        else {
            self.found.pixels_without_jacobian += 1;
            return;
        };
        let inverse = (by_bearing * by_pixel - Matrix2::identity()).norm();
        self.found.max_inverse_error = worse(self.found.max_inverse_error, inverse);
        let scale = by_pixel.norm();
        for (axis, column) in [Vector2::x(), Vector2::y()].iter().zip(by_pixel.column_iter()) {
            let difference = derivative(0.02 / scale, |t| camera.unproject(&(pixel + axis * t)));
            self.compare(pixel, difference, column.into_owned(), scale);
        }
        let scale = by_bearing.norm();
        for (axis, column) in [Vector3::x(), Vector3::y(), Vector3::z()].iter().zip(by_bearing.column_iter()) {
            // Further away the ray may have stepped over a seam of the image, or over the ray opposite to the centre.
            let nearby = |there: &Vector2<f64>| (there - pixel).norm() < 4.0 * STEP_PX;
            let step = (STEP_PX / scale).min(0.05);
            let difference = derivative(step, |t| camera.project(&(bearing + axis * t)).filter(nearby));
            self.compare(pixel, difference, column.into_owned(), scale);
        }
    }

    fn compare<const N: usize>(
        &mut self,
        pixel: &Vector2<f64>,
        difference: Option<Derivative<N>>,
        column: SVector<f64, N>,
        scale: f64,
    ) {
        let (error, own) =
            difference.map_or((f64::INFINITY, f64::INFINITY), |d| ((d.value - column).norm() / scale, d.error / scale));
        let found = &mut self.found;
        if error.is_nan() || error > found.max_jacobian_error_relative {
            found.worst_jacobian_px = [pixel.x, pixel.y];
        }
        found.max_jacobian_error_relative = worse(found.max_jacobian_error_relative, error);
        found.max_difference_error_relative = worse(found.max_difference_error_relative, own);
    }
}
