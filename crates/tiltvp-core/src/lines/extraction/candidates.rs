//! Ridge pixels whose great circles pass close to the vertical, sorted by azimuth: what lines are made of.

use std::f64::consts::{PI, TAU};

use multiversion::multiversion;
use nalgebra::Matrix3;

use crate::edges::RidgePixels;
use crate::lines::angles::atan2;
use crate::lines::tables::LineTables;
use crate::robust::Rows;

/// Pixels that may be on vertical lines, in structure-of-arrays form, sorted by bins of azimuth.
#[derive(Debug, Clone, Default)]
pub(crate) struct Candidates {
    pub(crate) pixels: Vec<Candidate>,
    /// `starts[b]..starts[b + 1]` are the pixels of bin `b`.
    pub(crate) starts: Vec<u32>,
    unsorted: Vec<Candidate>,
    rows: Rows<f32>,
    weights: Vec<f32>,
    slots: Vec<u32>,
    /// Places among the ridge pixels.
    numbers: Vec<u32>,
    block: Box<CandidateBlock>,
}

/// A pixel that may be on a vertical line.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct Candidate {
    /// Azimuth of the edge in the upright frame, radians.
    pub(crate) azimuth: f32,
    /// How far the azimuth turns for one pixel across the edge, radians, positive.
    pub(crate) per_px: f32,
    /// One over that.
    pub(crate) px_per_rad: f32,
    /// Tangent of the elevation.
    pub(crate) slope: f32,
    /// Whether it is brighter towards greater azimuth.
    pub(crate) rising: bool,
    /// Whether a line has it.
    pub(crate) taken: bool,
}

impl Candidates {
    /// Keeps the ridge pixels that agree with the vertical, finds the azimuths of their edges between the pixels, and sorts.
    pub(crate) fn refill(
        &mut self,
        tables: &LineTables,
        ridge: &RidgePixels,
        robot_from_upright: &Matrix3<f64>,
        plane_max_rad: f64,
        bins: usize,
    ) {
        let up = robot_from_upright.column(2).into_owned();
        let lean = up.xy().norm().atan2(up.z);
        let reach = (plane_max_rad + lean).min(PI / 2.0).sin();
        tables.lift.lift(&ridge.edges, reach, &mut self.rows, &mut self.weights, &mut self.slots, &mut self.numbers);
        let limit = plane_max_rad.sin();
        let turn: [[f32; 3]; 3] = std::array::from_fn(|i| std::array::from_fn(|j| robot_from_upright[(j, i)] as f32));
        let (gx, gy) = (ridge.edges.gx(), ridge.edges.gy());
        let place = |number: u32| {
            let place = ridge.edges.place()[number as usize];
            ((place & 0xffff) as usize, (place >> 16) as usize)
        };
        // The pixel beside, on whose side the edge is.
        let beside = |number: u32| {
            let ((u, v), number) = (place(number), number as usize);
            let step = |at: usize| if ridge.shift_px()[number] < 0.0 { at.saturating_sub(1) } else { at + 1 };
            if gx[number].abs() >= gy[number].abs() { (step(u), v) } else { (u, step(v)) }
        };
        self.unsorted.clear();
        let (block, mut n) = (&mut self.block, 0);
        for (k, (row, number)) in self.rows.iter().zip(&self.numbers).enumerate() {
            if let Some(later) = self.numbers.get(k + AHEAD) {
                tables.expect(place(*later).0, place(*later).1, beside(*later).1);
            }
            if row.dot(&up).abs() > limit {
                continue;
            }
            let ((u, v), (nu, nv)) = (place(*number), beside(*number));
            let (Some(here), Some(next)) = (tables.ray(u, v), tables.ray(nu, nv)) else { continue };
            for i in 0..3 {
                (block.here[i][n], block.next[i][n], block.normal[i][n]) = (here[i], next[i], row[i] as f32);
            }
            block.share[n] = ridge.shift_px()[*number as usize].abs();
            n += 1;
            if n == BLOCK {
                place_edges(block, &turn);
                block.append(n, &mut self.unsorted);
                n = 0;
            }
        }
        place_edges(block, &turn);
        block.append(n, &mut self.unsorted);
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

/// Ridge pixels whose edges are placed together, in registers. Answers do not depend on it.
const BLOCK: usize = 64;

/// How many pixels ahead rays are asked for: the latency of memory. Answers do not depend on it.
const AHEAD: usize = 12;

/// Ridge pixels: rays of each and of one beside, how far the edge is from the one to the other, and the normals of their great
/// circles; and what follows from it.
#[derive(Debug, Clone)]
struct CandidateBlock {
    here: [[f32; BLOCK]; 3],
    next: [[f32; BLOCK]; 3],
    normal: [[f32; BLOCK]; 3],
    share: [f32; BLOCK],
    azimuth: [f32; BLOCK],
    /// Zero where the azimuth is not known.
    per_px: [f32; BLOCK],
    slope: [f32; BLOCK],
    /// Above zero where it is brighter towards greater azimuth.
    rise: [f32; BLOCK],
}

impl Default for CandidateBlock {
    fn default() -> Self {
        let (none, three) = ([0.0; BLOCK], [[0.0; BLOCK]; 3]);
        Self {
            here: three,
            next: three,
            normal: three,
            share: none,
            azimuth: none,
            per_px: none,
            slope: none,
            rise: none,
        }
    }
}

impl CandidateBlock {
    /// Appends those of the first `n` pixels whose azimuth is known.
    fn append(&self, n: usize, out: &mut Vec<Candidate>) {
        let known = (0..n).filter(|k| self.per_px[*k] > 0.0);
        out.extend(known.map(|k| Candidate {
            azimuth: self.azimuth[k],
            per_px: self.per_px[k],
            px_per_rad: 1.0 / self.per_px[k],
            slope: self.slope[k],
            rising: self.rise[k] > 0.0,
            taken: false,
        }));
    }
}

/// Places the edges of a block between their pixels, in the upright frame, whose axes are the rows of `turn`.
#[multiversion(targets("x86_64+avx512f+avx512vl", "x86_64+avx2"))]
fn place_edges(block: &mut CandidateBlock, turn: &[[f32; 3]; 3]) {
    let CandidateBlock { here, next, normal, share, azimuth, per_px, slope, rise } = block;
    let upright = |axis: usize, [x, y, z]: &[[f32; BLOCK]; 3], k: usize| {
        let [a, b, c] = turn[axis];
        a * x[k] + b * y[k] + c * z[k]
    };
    for k in 0..BLOCK {
        let (ax, ay, az) = (upright(0, here, k), upright(1, here, k), upright(2, here, k));
        let (bx, by, bz) = (upright(0, next, k), upright(1, next, k), upright(2, next, k));
        let flat = ax * ax + ay * ay;
        let turned = (ax * by - ay * bx) / flat.max(1e-6);
        let share = share[k];
        let (x, y, z) = (ax + share * (bx - ax), ay + share * (by - ay), az + share * (bz - az));
        azimuth[k] = atan2(ay, ax) + share * turned;
        let known = turned.abs() >= 1e-6 && flat >= 1e-4;
        per_px[k] = if known { turned.abs() } else { 0.0 };
        slope[k] = z / (x * x + y * y).sqrt();
        rise[k] = upright(1, normal, k) * ax - upright(0, normal, k) * ay;
    }
}

/// The bin of an azimuth.
pub(crate) fn bin_of(azimuth: f64, bins: usize) -> usize {
    let turn = (azimuth + PI) / TAU;
    (((turn - turn.floor()) * bins as f64) as usize).min(bins - 1)
}
