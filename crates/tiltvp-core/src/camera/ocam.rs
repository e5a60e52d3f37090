//! The omnidirectional camera of Scaramuzza's OCamCalib, with the exact inverse of its polynomial.

use nalgebra::{Matrix2, Matrix2x3, Matrix3x2, Vector2, Vector3};

use super::grid::{self, PixelGrid};
use super::lens::Lens;
use super::polynomial::{evaluate, first_fall, product, root_bound, sum};
use super::rim::FOLD;
use super::schema::{CX, CY, Kind, LensSchema, Parameter, ParameterSchema, Resize, scalars, too_many};
use super::solve;
use super::table::Table;
use super::values::{Parametric, Values};
use crate::error::{Error, Result};

const NAME: &str = "ocam";

/// OCamCalib: the pixel of a point `(x, y)` is row `c x + d y + cy`, column `e x + y + cx`; its ray is `(x, y, f(rho))`
/// with `f = a0 + a1 rho + a2 rho^2 + ..` and `rho = |(x, y)|`.
///
/// OCamCalib's `x` grows with the rows, `y` with the columns, so its right-handed `z` points out of the back of the
/// camera; the bearing here is `(y, x, -f(rho))`. For `a0 < 0` the centre looks along `+z`; for `a0 > 0` (a mirror in its
/// physical frame) along `-z`, and angles are measured from there.
///
/// The valid disc ends where the angle of the ray stops growing with `rho`. The projection solves
/// `f(rho) t + rho z = 0`, `t = |(x, y)|` of the bearing, exactly; the polynomial of the file for this direction is kept
/// for those who write the file, and [`inverse_polynomial_error_px`](Self::inverse_polynomial_error_px) judges it
/// (Scaramuzza et al. 2006).
#[derive(Debug, Clone, PartialEq)]
pub struct Ocam {
    grid: PixelGrid,
    /// Depth along the central ray in powers of `rho`: positive on the axis.
    depth: Vec<f64>,
    /// `z` of the central ray.
    sign: f64,
    inverse_polynomial: Vec<f64>,
    max_theta: f64,
    /// `rho` over the angle from the central ray, up to the radius of the valid disc.
    table: Table,
}

impl Parametric for Ocam {
    const SCHEMA: LensSchema = LensSchema {
        name: NAME,
        doc: "Scaramuzza's OCam: row = c x + d y + cy, column = e x + y + cx, bearing (y, x, -f(rho)), in OCamCalib's sign.",
        parameters: &[
            ParameterSchema {
                name: "polynomial",
                kind: Kind::RequiredList,
                resize: Resize::Polynomial,
                doc: "f in powers of rho in pixels, lowest first",
            },
            CX,
            CY,
            ParameterSchema::optional("c", 1.0, Resize::Fixed, "rows per x"),
            ParameterSchema::coefficient("d", "rows per y"),
            ParameterSchema::coefficient("e", "columns per x"),
            ParameterSchema {
                name: "inverse_polynomial",
                kind: Kind::OptionalList,
                resize: Resize::Length,
                doc: "rho in powers of atan(f / rho), lowest first; kept for files, not used",
            },
        ],
    };

    fn build(given: &Values<'_>) -> Result<Self> {
        let ([cx, cy, c, d, e], [polynomial, inverse]) = (given.numbers(), given.lists());
        Self::new(polynomial, [c, d, e], [cx, cy], inverse)
    }

    fn values(&self) -> Vec<Parameter> {
        let ([c, d, e], [_, _, cx, cy]) = (self.affine(), self.grid.focal_and_centre());
        let mut values = vec![Parameter::List(self.polynomial())];
        values.extend(scalars(&[&[cx, cy, c, d, e]]));
        values.push(Parameter::List(self.inverse_polynomial.clone()));
        values
    }
}

impl Ocam {
    /// A camera of polynomial `[a0, a1, ..]`, affine map `[c, d, e]` and centre `[cx, cy]` (column, row) in pixels, in
    /// OCamCalib's own order and sign, with the inverse polynomial of the file or none.
    ///
    /// # Errors
    /// [`Error::InvalidCamera`] if a list has more than [`MOST_COEFFICIENTS`](super::MOST_COEFFICIENTS) numbers, a number is not
    /// finite, `a0` is zero, `c - d e` is not positive, or the angle does not
    /// grow with the radius.
    pub fn new(polynomial: &[f64], affine: [f64; 3], centre_px: [f64; 2], inverse_polynomial: &[f64]) -> Result<Self> {
        too_many(NAME, "polynomial", polynomial)?;
        too_many(NAME, "inverse_polynomial", inverse_polynomial)?;
        let all_finite = |c: &[f64]| c.iter().all(|x| x.is_finite());
        let a0 = polynomial.first().copied().unwrap_or(0.0);
        if a0 == 0.0 || !all_finite(polynomial) {
            return Err(Error::camera(
                NAME,
                "polynomial",
                format!("{polynomial:?}"),
                "finite numbers, the first not zero",
            ));
        }
        if !all_finite(inverse_polynomial) {
            return Err(Error::camera(NAME, "inverse_polynomial", format!("{inverse_polynomial:?}"), "finite numbers"));
        }
        grid::finite(NAME, ["c", "d", "e"], affine)?;
        let [c, d, e] = affine;
        let grid = PixelGrid::affine(NAME, Matrix2::new(1.0, e, d, c), centre_px)?;
        let sign = -a0.signum();
        let depth: Vec<f64> = polynomial.iter().map(|a| -sign * a).collect();
        let refused =
            || Error::camera(NAME, "polynomial", format!("{polynomial:?}"), "rays that leave the axis as rho grows");
        let radius = disc(&depth).ok_or_else(refused)?;
        let max_theta = radius.atan2(evaluate(&depth, radius).0);
        let table = Table::new(max_theta, |theta| {
            let (t, z) = theta.sin_cos();
            let rho = if theta < max_theta { root(&depth, 0.0, radius, 0.5 * radius, t, z) } else { radius };
            let (z, slope) = evaluate(&depth, rho);
            (rho, (rho * rho + z * z) / (z - rho * slope))
        });
        // Where the polynomial is beyond the floats within its own disc.
        if !table.is_finite() {
            return Err(refused());
        }
        Ok(Self { grid, depth, sign, inverse_polynomial: inverse_polynomial.to_vec(), max_theta, table })
    }

    /// `[a0, a1, ..]` as OCamCalib writes it.
    pub fn polynomial(&self) -> Vec<f64> {
        self.depth.iter().map(|a| -self.sign * a).collect()
    }

    /// The inverse polynomial of the file, empty if there was none.
    pub fn inverse_polynomial(&self) -> &[f64] {
        &self.inverse_polynomial
    }

    /// `[c, d, e]`.
    pub fn affine(&self) -> [f64; 3] {
        let m = self.grid.matrix();
        [m.m22, m.m21, m.m12]
    }

    /// Radius of the valid disc in pixels.
    pub fn max_rho_px(&self) -> f64 {
        self.table.last()
    }

    /// The largest error in pixels, up to the angle `theta_rad` from the central ray, of the inverse polynomial of the
    /// file, which other programs project with; `None` if there is none.
    ///
    /// OCamCalib evaluates it at `atan2(z, t)` of its own frame: `theta - pi/2` for `a0 < 0`.
    pub fn inverse_polynomial_error_px(&self, theta_rad: f64) -> Option<f64> {
        if self.inverse_polynomial.is_empty() {
            return None;
        }
        let end = theta_rad.clamp(0.0, self.max_theta);
        let error = |i: i32| {
            let theta = end * f64::from(i) / 512.0;
            let (t, z) = theta.sin_cos();
            let elevation = self.sign * (theta - std::f64::consts::FRAC_PI_2);
            (evaluate(&self.inverse_polynomial, elevation).0 - self.rho(t, z).unwrap_or(self.table.last())).abs()
        };
        Some((0..=512).map(error).fold(0.0, f64::max))
    }

    /// `rho` of a ray at distance `t` from the axis and `z` along the central ray; `None` outside the valid disc.
    #[inline]
    fn rho(&self, t: f64, z: f64) -> Option<f64> {
        let theta = t.atan2(z);
        if theta > self.max_theta {
            return None;
        }
        let (low, high, start) = self.table.around(theta);
        Some(root(&self.depth, low, high, start, t, z))
    }
}

/// The root in a bracket of `rho z - depth(rho) t`, which grows through it.
#[inline]
fn root(depth: &[f64], low: f64, high: f64, start: f64, t: f64, z: f64) -> f64 {
    solve::increasing(low, high, start, |rho| {
        let (depth, slope) = evaluate(depth, rho);
        (rho * z - depth * t, z - slope * t)
    })
}

/// The radius of the disc where `theta(rho) = atan2(rho, depth(rho))` grows by at least [`FOLD`] of its growth at 0.
///
/// `theta' = (depth - rho depth') / (rho^2 + depth^2)`, so this is a polynomial that falls to zero; in units of `depth(0)`.
fn disc(depth: &[f64]) -> Option<f64> {
    let unit = depth.first().copied()?;
    let scaled: Vec<f64> = depth.iter().enumerate().map(|(i, a)| a / unit * unit.powi(i as i32)).collect();
    let growth: Vec<f64> = scaled.iter().enumerate().map(|(i, a)| (1.0 - i as f64) * a).collect();
    let length = sum(&[0.0, 0.0, 1.0], 1.0, &product(&scaled, &scaled));
    let excess = sum(&growth, -FOLD, &length);
    if excess.iter().any(|c| !c.is_finite()) {
        return None;
    }
    let radius = first_fall(&excess, root_bound(&excess))? * unit;
    (radius.is_finite() && radius > 1e-6 * unit).then_some(radius)
}

impl Lens for Ocam {
    fn grid(&self) -> &PixelGrid {
        &self.grid
    }

    #[inline]
    fn point(&self, bearing: &Vector3<f64>) -> Option<Vector2<f64>> {
        let xy = bearing.xy();
        let t = xy.norm();
        let rho = self.rho(t, self.sign * bearing.z)?;
        Some(if t > 0.0 { xy * (rho / t) } else { xy })
    }

    /// With `g = rho z - depth t`: `d rho = (depth dt - rho dz) / (z - depth' t)`.
    #[inline]
    fn point_jacobian(&self, bearing: &Vector3<f64>) -> Option<(Vector2<f64>, Matrix2x3<f64>)> {
        let xy = bearing.xy();
        let (t, z) = (xy.norm(), self.sign * bearing.z);
        let rho = self.rho(t, z)?;
        let mut jacobian = Matrix2x3::zeros();
        if t == 0.0 {
            jacobian[(0, 0)] = self.depth.first()? / z;
            jacobian[(1, 1)] = jacobian[(0, 0)];
            return Some((xy, jacobian));
        }
        let (depth, slope) = evaluate(&self.depth, rho);
        let by_g = 1.0 / (z - slope * t);
        let e = xy / t;
        let outer = e * e.transpose();
        let plane = outer * (depth * by_g) + (Matrix2::identity() - outer) * (rho / t);
        jacobian.fixed_view_mut::<2, 2>(0, 0).copy_from(&plane);
        jacobian.set_column(2, &(e * (-self.sign * rho * by_g)));
        Some((e * rho, jacobian))
    }

    #[inline]
    fn bearing(&self, point: &Vector2<f64>) -> Option<Vector3<f64>> {
        let rho = point.norm();
        (rho <= self.max_rho_px())
            .then(|| Vector3::new(point.x, point.y, self.sign * evaluate(&self.depth, rho).0).normalize())
    }

    #[inline]
    fn bearing_jacobian(&self, point: &Vector2<f64>) -> Option<(Vector3<f64>, Matrix3x2<f64>)> {
        let rho = point.norm();
        if rho > self.max_rho_px() {
            return None;
        }
        let (depth, slope) = evaluate(&self.depth, rho);
        let ray = Vector3::new(point.x, point.y, self.sign * depth);
        let (length, unit) = (ray.norm(), ray.normalize());
        let rise = if rho > 0.0 { point * (self.sign * slope / rho) } else { Vector2::zeros() };
        let jacobian = Matrix3x2::new(1.0, 0.0, 0.0, 1.0, rise.x, rise.y);
        Some((unit, (jacobian - unit * (unit.transpose() * jacobian)) / length))
    }

    fn rim_rad(&self) -> f64 {
        self.max_theta
    }

    fn axis_z(&self) -> f64 {
        self.sign
    }
}
