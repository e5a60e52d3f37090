//! What is asked of the lens at every pixel: by cubics between the nodes of a coarse grid, where the lens is smooth.

use std::array;
use std::ops::Range;

use nalgebra::{Matrix3, SVector, Vector2, Vector3};

use super::Camera;
use crate::parallel;

/// Pixels from a node to the next.
pub(crate) const STEP: usize = 8;

/// By how much bearings may be off in the middle of a square, in radians; elsewhere in it lenses of the zoo are off by up to twice that,
/// a thousandth of a pixel where 1,000 are a radian.
const BEARING_RAD: f64 = 5e-7;

/// The unit bearings of a camera but for a millionth, also beyond its limit, in a frame that is turned by `rotation`.
pub(crate) fn bearings<'a>(
    camera: &'a Camera,
    rotation: &Matrix3<f64>,
) -> Interpolated<3, impl Fn(Vector2<f64>) -> Option<Vector3<f64>> + 'a> {
    let (size, rotation) = ([camera.width() as usize, camera.height() as usize], *rotation);
    Interpolated::new(size, BEARING_RAD, move |pixel| Some(rotation * camera.unproject_unlimited(&pixel)?))
}

/// An entry for each pixel of the image, in row order, of its number and its unit bearing but for a millionth, in a frame that is
/// turned by `rotation`; `None` outside the valid set.
pub(crate) fn bearing_table<T: Clone + Default + Send>(
    camera: &Camera,
    rotation: &Matrix3<f64>,
    of: impl Fn(usize, Option<Vector3<f64>>) -> T + Sync,
) -> Vec<T> {
    let size @ [width, _] = [camera.width() as usize, camera.height() as usize];
    let bearings = bearings(camera, rotation);
    let limit = camera.limit().map(|(axis, least)| (rotation * axis, least));
    let is_seen = |bearing: &Vector3<f64>| limit.is_none_or(|(axis, least)| axis.dot(bearing) >= least);
    parallel::rows(size, |v, row| {
        bearings.along(v, 0..width, |u, bearing| row[u] = of(v * width + u, bearing.filter(is_seen)));
    })
}

/// A function of the pixel that is smooth but for some places: asked at the nodes, and where cubics (of Lagrange, through four nodes
/// each way) do not reproduce it.
pub(crate) struct Interpolated<const N: usize, F> {
    exact: F,
    /// From one step before the image to two behind it, in row order.
    nodes: Vec<SVector<f64, N>>,
    across: usize,
    /// Whether the cubics reproduce the middle of each square of nodes, where they err most.
    smooth: Vec<bool>,
    /// Weights of the four nodes, for each pixel of a step.
    weights: [[f64; 4]; STEP],
}

impl<const N: usize, F: Fn(Vector2<f64>) -> Option<SVector<f64, N>> + Sync> Interpolated<N, F> {
    /// Of an image of `size`; `tolerance` is a share of the largest component at each place.
    pub(crate) fn new([width, height]: [usize; 2], tolerance: f64, exact: F) -> Self {
        let [squares, down] = [width, height].map(|side| side.div_ceil(STEP));
        let across = squares + 3;
        let mut made = Self {
            nodes: Vec::new(),
            across,
            smooth: Vec::new(),
            weights: array::from_fn(|k| cubic(k as f64 / STEP as f64)),
            exact,
        };
        let node = |number: usize| {
            let [u, v] = [number % across, number / across].map(|k| (k * STEP) as f64 - STEP as f64);
            (made.exact)(Vector2::new(u, v)).unwrap_or_else(|| SVector::repeat(f64::NAN))
        };
        let nodes = parallel::blocks(across * (down + 3), |own| own.map(node).collect::<Vec<_>>()).concat();
        made.nodes = nodes;
        let reproduces = |number: usize| {
            let [column, row] = [number % squares, number / squares];
            let middle = [column, row].map(|k| (k * STEP) as f64 + 0.5 * STEP as f64);
            let half = cubic(0.5);
            let columns = array::from_fn(|k| made.column(row, column + k, &half));
            (made.exact)(Vector2::from(middle))
                .is_some_and(|exact| (mix(&columns, &half) - exact).amax() <= tolerance * exact.amax())
        };
        let smooth = parallel::table(squares * down, reproduces);
        made.smooth = smooth;
        made
    }

    /// Tells the values of a part of a row, each with its number in that part.
    pub(crate) fn along(&self, v: usize, columns: Range<usize>, mut tell: impl FnMut(usize, Option<SVector<f64, N>>)) {
        let (row, down) = (v / STEP, &self.weights[v % STEP]);
        let first = columns.start / STEP;
        let mut four = array::from_fn(|k| self.column(row, first + k, down));
        for square in first..columns.end.div_ceil(STEP) {
            if square > first {
                four = [four[1], four[2], four[3], self.column(row, square + 3, down)];
            }
            let own = (square * STEP).max(columns.start)..((square + 1) * STEP).min(columns.end);
            let is_smooth = self.smooth[row * (self.across - 3) + square];
            for u in own {
                // Told in one place, where it is inlined.
                let value = if is_smooth {
                    Some(mix(&four, &self.weights[u % STEP]))
                } else {
                    (self.exact)(Vector2::new(u as f64, v as f64))
                };
                tell(u - columns.start, value);
            }
        }
    }

    /// The sixteen nodes, row by row, of which the cubics of a square are, of `STEP` pixels a side from number `[column, row]` on;
    /// `None` where these do not hold.
    pub(crate) fn around(&self, [column, row]: [usize; 2]) -> Option<[SVector<f64, N>; 16]> {
        let is_smooth = self.smooth[row * (self.across - 3) + column];
        is_smooth.then(|| array::from_fn(|k| self.nodes[(row + k / 4) * self.across + column + k % 4]))
    }

    /// The value between the nodes of a column, of the four from number `row` on.
    fn column(&self, row: usize, column: usize, weights: &[f64; 4]) -> SVector<f64, N> {
        mix(&array::from_fn(|k| self.nodes[(row + k) * self.across + column]), weights)
    }
}

/// The weights of four nodes at -1, 0, 1 and 2 for the cubic through them at `t`.
pub(crate) fn cubic(t: f64) -> [f64; 4] {
    let [before, after, last] = [t + 1.0, t - 1.0, t - 2.0];
    [-t * after * last / 6.0, before * after * last / 2.0, -before * t * last / 2.0, before * t * after / 6.0]
}

fn mix<const N: usize>(values: &[SVector<f64, N>; 4], weights: &[f64; 4]) -> SVector<f64, N> {
    values[0] * weights[0] + values[1] * weights[1] + values[2] * weights[2] + values[3] * weights[3]
}
