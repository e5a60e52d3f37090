//! Pieces of one great circle and one polarity are one edge.

use nalgebra::Vector3;
use tiltvp_kernels::marks::{BEYOND, MARK, places};
use tiltvp_kernels::vectorised;

use super::segment::Segment;
use crate::interrupt::check;

/// Cosine of the largest angle between the normals of pieces of one edge, 14 degrees: short ones turn by noise.
const NORMALS_COS: f64 = 0.97;

/// By how much the cosine in single precision may be off: a hundred times its rounding.
const HAIR: f32 = 1e-5;

/// How far in pixels the ends of a piece may be from the circle of the longer one.
const APART_PX: f64 = 1.0;

/// Least and greatest length in radians by which gaps are measured: specks are as one of a degree, walls as one of 34.
const SCALE_RAD: [f64; 2] = [0.02, 0.6];

/// The greatest length of a joined segment in radians, 170 degrees: an arc is shorter than half a turn.
const LONGEST_RAD: f64 = 2.97;

/// Numbers of segments in groups.
#[derive(Debug, Clone, Default)]
pub(super) struct Groups {
    members: Vec<u32>,
    starts: Vec<usize>,
    order: Vec<u32>,
    /// Normals in that order in single precision, zero of those that are in a group.
    normals: [Vec<f32>; 3],
    /// Which of them are near one, and where.
    marks: Vec<u8>,
    near: Vec<u32>,
    taken: Vec<bool>,
    /// Ranks of segments on the circle of the longest, and the angles of their ends from its middle.
    candidates: Vec<(u32, f64, f64)>,
}

impl Groups {
    /// Groups the pieces greedily, the longest first: those of its circle with a gap of at most `gap_max` lengths.
    pub(super) fn join(&mut self, pieces: &[Segment], gap_max: f64) {
        let Self { members, starts, order, normals, marks, near, taken, candidates } = self;
        members.clear();
        starts.clear();
        starts.push(0);
        order.clear();
        order.extend(0..pieces.len() as u32);
        let length = |i: u32| pieces[i as usize].length_rad;
        order.sort_unstable_by(|a, b| length(*b).total_cmp(&length(*a)).then(a.cmp(b)));
        for (k, normals) in normals.iter_mut().enumerate() {
            normals.clear();
            normals.extend(order.iter().map(|i| pieces[*i as usize].normal[k] as f32));
        }
        marks.resize(pieces.len(), 0);
        near.resize(pieces.len() + BEYOND, 0);
        taken.clear();
        taken.resize(pieces.len(), false);
        for (rank, longest) in order.iter().enumerate() {
            if std::mem::replace(&mut taken[rank], true) {
                continue;
            }
            check();
            members.push(*longest);
            let base = &pieces[*longest as usize];
            if gap_max > 0.0 {
                candidates.clear();
                let marks = &mut marks[rank + 1..];
                let others = normals.each_ref().map(|normals| &normals[rank + 1..]);
                mark_near(others, base.normal.cast().into(), NORMALS_COS as f32 - HAIR, marks);
                let count = places(marks, near);
                for beyond in &near[..count] {
                    let at = rank + 1 + *beyond as usize;
                    let other = &pieces[order[at] as usize];
                    if base.normal.dot(&other.normal) > NORMALS_COS && on_circle(base, other) {
                        let [a, b] = other.ends.map(|end| angle(base, &end));
                        candidates.push((at as u32, a.min(b), a.max(b)));
                    }
                }
                let [mut low, mut high] = base.ends.map(|end| angle(base, &end));
                while let Some(k) = candidates.iter().position(|(_, a, b)| {
                    let gap = (a - high).max(low - b);
                    gap < gap_max * (high - low).clamp(SCALE_RAD[0], SCALE_RAD[1])
                        && high.max(*b) - low.min(*a) < LONGEST_RAD
                }) {
                    let (at, a, b) = candidates.remove(k);
                    (low, high) = (low.min(a), high.max(b));
                    taken[at as usize] = true;
                    for normals in &mut *normals {
                        normals[at as usize] = 0.0;
                    }
                    members.push(order[at as usize]);
                }
            }
            starts.push(members.len());
        }
    }

    /// The groups, each with its longest piece first.
    pub(super) fn iter(&self) -> impl Iterator<Item = &[u32]> {
        self.starts.windows(2).map(|ends| &self.members[ends[0]..ends[1]])
    }
}

vectorised! {
    /// Marks the unit normals whose cosine with another is above a limit.
    fn mark_near([x, y, z]: [&[f32]; 3], other: [f32; 3], limit: f32, marks: &mut [u8]) {
        let n = marks.len();
        let (x, y, z) = (&x[..n], &y[..n], &z[..n]);
        for i in 0..n {
            let cosine = x[i] * other[0] + y[i] * other[1] + z[i] * other[2];
            marks[i] = if cosine > limit { MARK } else { 0 };
        }
    }
}

/// Whether the ends of a piece are on the circle of another.
fn on_circle(base: &Segment, other: &Segment) -> bool {
    other.ends.iter().all(|end| base.normal.dot(end).abs() * other.px_per_rad < APART_PX)
}

/// Angle of a bearing along the circle of a segment from its middle.
fn angle(base: &Segment, bearing: &Vector3<f64>) -> f64 {
    base.along().dot(bearing).atan2(base.middle.dot(bearing))
}
