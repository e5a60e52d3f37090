//! Ridge pixels whose great circles pass close to the vertical, sorted by azimuth: what lines are made of.

use std::f64::consts::{PI, TAU};

use nalgebra::Matrix3;

use super::arctan::atan2;
use super::sight::Sight;
use crate::edges::RidgePixels;
use crate::robust::Rows;

/// Pixels that may be on vertical lines, in structure-of-arrays form, sorted by bins of azimuth.
#[derive(Debug, Clone, Default)]
pub(super) struct Candidates {
    pub(super) pixels: Vec<Candidate>,
    /// `starts[b]..starts[b + 1]` are the pixels of bin `b`.
    pub(super) starts: Vec<u32>,
    unsorted: Vec<Candidate>,
    rows: Rows<f32>,
    weights: Vec<f32>,
    slots: Vec<u32>,
    places: Vec<u32>,
}

/// A pixel that may be on a vertical line.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Candidate {
    /// Azimuth of the edge in the upright frame, radians.
    pub(super) azimuth: f32,
    /// How far the azimuth turns for one pixel across the edge, radians, positive.
    pub(super) per_px: f32,
    /// One over that.
    pub(super) px_per_rad: f32,
    /// Tangent of the elevation.
    pub(super) slope: f32,
    /// Whether it is brighter towards greater azimuth.
    pub(super) rising: bool,
    /// Whether a line has it.
    pub(super) taken: bool,
}

impl Candidates {
    /// Keeps the ridge pixels that agree with the vertical, finds the azimuths of their edges between the pixels, and sorts.
    pub(super) fn refill(
        &mut self,
        sight: &Sight,
        ridge: &RidgePixels,
        robot_from_upright: &Matrix3<f64>,
        plane_max_rad: f64,
        bins: usize,
    ) {
        let up = robot_from_upright.column(2).into_owned();
        let lean = up.xy().norm().atan2(up.z);
        let reach = (plane_max_rad + lean).min(PI / 2.0).sin();
        sight.lift.lift(&ridge.edges, reach, &mut self.rows, &mut self.weights, &mut self.slots, &mut self.places);
        let limit = plane_max_rad.sin();
        let turn: [[f32; 3]; 3] = std::array::from_fn(|i| std::array::from_fn(|j| robot_from_upright[(j, i)] as f32));
        let upright = |[x, y, z]: [f32; 3]| {
            let row = |[a, b, c]: [f32; 3]| a * x + b * y + c * z;
            (row(turn[0]), row(turn[1]), row(turn[2]))
        };
        self.unsorted.clear();
        let (gx, gy) = (ridge.edges.gx(), ridge.edges.gy());
        for ((row, slot), place) in self.rows.iter().zip(&self.slots).zip(&self.places) {
            if row.dot(&up).abs() > limit {
                continue;
            }
            let place = *place as usize;
            let (u, v) = sight.region.place(*slot as usize);
            let (u, v) = (usize::from(u), usize::from(v));
            let shift = ridge.shift_px()[place];
            let step = |at: usize| if shift < 0.0 { at.saturating_sub(1) } else { at + 1 };
            let next = if gx[place].abs() >= gy[place].abs() { sight.ray(step(u), v) } else { sight.ray(u, step(v)) };
            let (Some(here), Some(next)) = (sight.ray(u, v), next) else { continue };
            let ((ax, ay, az), (bx, by, bz)) = (upright(here), upright(next));
            let flat = ax * ax + ay * ay;
            let per_px = (ax * by - ay * bx) / flat.max(1e-6);
            if per_px.abs() < 1e-6 || flat < 1e-4 {
                continue;
            }
            let share = shift.abs();
            let (x, y, z) = (ax + share * (bx - ax), ay + share * (by - ay), az + share * (bz - az));
            let (nx, ny, _) = upright([row.x as f32, row.y as f32, row.z as f32]);
            self.unsorted.push(Candidate {
                azimuth: atan2(ay, ax) + share * per_px,
                per_px: per_px.abs(),
                px_per_rad: 1.0 / per_px.abs(),
                slope: z / (x * x + y * y).sqrt(),
                rising: ny * ax - nx * ay > 0.0,
                taken: false,
            });
        }
        self.sort(bins);
    }

    /// A counting sort by bin.
    fn sort(&mut self, bins: usize) {
        self.starts.clear();
        self.starts.resize(bins + 1, 0);
        for pixel in &self.unsorted {
            self.starts[bin_of(f64::from(pixel.azimuth), bins) + 1] += 1;
        }
        for b in 0..bins {
            self.starts[b + 1] += self.starts[b];
        }
        self.pixels.clear();
        self.pixels.resize(self.unsorted.len(), Candidate::default());
        // Each start moves to its end while its bin fills.
        for pixel in &self.unsorted {
            let next = &mut self.starts[bin_of(f64::from(pixel.azimuth), bins)];
            self.pixels[*next as usize] = *pixel;
            *next += 1;
        }
        self.starts.rotate_right(1);
        self.starts[0] = 0;
    }
}

/// The bin of an azimuth.
pub(super) fn bin_of(azimuth: f64, bins: usize) -> usize {
    let turn = (azimuth + PI) / TAU;
    (((turn - turn.floor()) * bins as f64) as usize).min(bins - 1)
}

/// The difference of two angles of one turn in `[-pi, pi]`, without a division.
#[inline]
pub(super) fn difference(a: f64, b: f64) -> f64 {
    let turned = a - b;
    if turned > PI {
        turned - TAU
    } else if turned < -PI {
        turned + TAU
    } else {
        turned
    }
}

/// The angle in `(-pi, pi]`.
pub(super) fn wrap(angle: f64) -> f64 {
    let turned = angle - TAU * (angle / TAU).round();
    if turned <= -PI { turned + TAU } else { turned }
}
