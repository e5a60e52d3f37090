//! The azimuth of one line from the moments of its points.

use nalgebra::{Matrix2, Matrix3, Matrix3x2, Vector2, Vector3};

use crate::lines::angles::wrap;
use crate::lines::options::GreatCircleOptions;

/// Pixels that count as one against the prior of the slant: neighbours share the grid's phase and the edge's
/// crookedness.
const ERRING_TOGETHER: f64 = 8.0;

/// Pixels that count as one in the covariance: an edge beside the line pulls at most of its length.
const PULLED_TOGETHER: f64 = 40.0;

/// The least standard deviation of a pixel's place across the edge, in pixels, however well the pixels agree: that of
/// the interpolation of a ridge.
const PIXEL_SIGMA_MIN_PX: f64 = 0.06;

/// Standard deviation of the whole line, in pixels, which no pixel of it shows: blur and neighbouring edges pull all of
/// them.
const LINE_SIGMA_PX: f64 = 0.12;

/// Steps of least squares: the second leaves a millionth of what the first does, for turns below a tenth of a radian.
const STEPS: usize = 2;

/// What a great circle is fitted to: `sum w^2 b b^T` over unit bearings, with pixels per radian across the edge as weights.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Moments {
    squares: Matrix3<f64>,
    pub(super) support: u32,
    /// Sum of the radians of azimuth per pixel across the edge.
    wide: f64,
}

impl Moments {
    pub(super) fn add(&mut self, bearing: &Vector3<f64>, px_per_rad: f64) {
        let scaled = bearing * px_per_rad;
        self.squares += scaled * scaled.transpose();
        self.support += 1;
        self.wide += 1.0 / scaled.xy().norm().max(1e-9);
    }

    pub(super) fn join(&mut self, other: &Self) {
        self.squares += other.squares;
        self.support += other.support;
        self.wide += other.wide;
    }

    /// Root mean square distance in pixels from the great circle of a normal.
    pub(super) fn rms_px(&self, normal: &Vector3<f64>) -> f64 {
        (normal.dot(&(self.squares * normal)).max(0.0) / f64::from(self.support)).sqrt()
    }
}

/// A line under work.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct LineFit {
    pub(super) azimuth: f64,
    /// How the azimuth turns with the tangent of the elevation.
    slant: f64,
    pub(super) sigma: f64,
    /// Standard deviation of the pixels about the line, pixels.
    scatter_px: f64,
    /// How many pixels are on it.
    pub(super) support: u32,
    /// Whether it is brighter towards greater azimuth.
    pub(super) rising: bool,
    /// Lowest and highest elevation, radians.
    pub(super) ends: (f64, f64),
    /// Elevation that its pieces cover, radians.
    pub(super) length: f64,
    /// Radians of azimuth per pixel across the line, in the mean.
    pub(super) per_px: f64,
}

impl LineFit {
    /// The line of points near an azimuth: least squares of `azimuth + slant tan(elevation)`, with a prior on the slant. None where
    /// the points determine none.
    pub(super) fn of(points: &Moments, near: f64, options: &GreatCircleOptions) -> Option<Self> {
        let n = f64::from(points.support);
        let mut fit = Self { azimuth: near, support: points.support, per_px: points.wide / n, ..Self::default() };
        let prior = Matrix2::new(0.0, 0.0, 0.0, options.tilt_sigma_rad.powi(-2));
        let information = |fit: &Self, together: f64| {
            let ways = fit.ways();
            let known = 1.0 / (fit.scatter_px.powi(2) * together.min(n));
            (
                ways.transpose() * points.squares * ways * known + prior,
                ways.transpose() * points.squares * fit.normal() * known,
            )
        };
        fit.scatter_px = points.rms_px(&fit.normal()).max(PIXEL_SIGMA_MIN_PX);
        for _ in 0..STEPS {
            let (known, pull) = information(&fit, ERRING_TOGETHER);
            let step = known.try_inverse()? * (pull - prior * Vector2::new(0.0, fit.slant));
            fit.azimuth = wrap(fit.azimuth + step.x);
            fit.slant += step.y;
            fit.scatter_px = points.rms_px(&fit.normal()).max(PIXEL_SIGMA_MIN_PX);
        }
        let (known, _) = information(&fit, PULLED_TOGETHER);
        fit.sigma = (known.try_inverse()?[(0, 0)] + (LINE_SIGMA_PX * fit.per_px).powi(2)).sqrt();
        Some(fit)
    }

    /// Unit normal of its great circle, towards greater azimuth.
    pub(super) fn normal(&self) -> Vector3<f64> {
        let (sin, cos) = self.azimuth.sin_cos();
        Vector3::new(-sin, cos, -self.slant).normalize()
    }

    /// Minus the changes of the normal with the azimuth and with the slant.
    fn ways(&self) -> Matrix3x2<f64> {
        let (sin, cos) = self.azimuth.sin_cos();
        Matrix3x2::new(cos, 0.0, sin, 0.0, 0.0, 1.0)
    }

    /// Whether it is long enough, and one edge rather than two that blend or several short ones that happen to be in line.
    pub(super) fn is_one_line(&self, options: &GreatCircleOptions) -> bool {
        self.support >= options.support_min_px
            && self.length >= options.length_min_rad
            && self.length >= options.covered_min * (self.ends.1 - self.ends.0)
            && self.scatter_px <= options.scatter_max_px
    }
}
