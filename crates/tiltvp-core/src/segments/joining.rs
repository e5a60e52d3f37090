//! Pieces of one great circle and one polarity are one edge.

use nalgebra::Vector3;

use super::segment::Segment;

/// Cosine of the largest angle between the normals of pieces of one edge, 14 degrees: short ones turn by noise.
const NORMALS_COS: f64 = 0.97;

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
    /// Normals in that order, side by side.
    normals: Vec<Vector3<f64>>,
    taken: Vec<bool>,
    /// Segments on the circle of the longest, and the angles of their ends from its middle.
    candidates: Vec<(u32, f64, f64)>,
}

impl Groups {
    /// Groups the pieces greedily, the longest first: those of its circle with a gap of at most `gap_max` lengths.
    pub(super) fn join(&mut self, pieces: &[Segment], gap_max: f64) {
        let Self { members, starts, order, normals, taken, candidates } = self;
        members.clear();
        starts.clear();
        starts.push(0);
        order.clear();
        order.extend(0..pieces.len() as u32);
        let length = |i: u32| pieces[i as usize].length_rad;
        order.sort_unstable_by(|a, b| length(*b).total_cmp(&length(*a)).then(a.cmp(b)));
        normals.clear();
        normals.extend(order.iter().map(|i| pieces[*i as usize].normal));
        taken.clear();
        taken.resize(pieces.len(), false);
        for (rank, longest) in order.iter().enumerate() {
            if std::mem::replace(&mut taken[*longest as usize], true) {
                continue;
            }
            members.push(*longest);
            let base = &pieces[*longest as usize];
            if gap_max > 0.0 {
                candidates.clear();
                for (i, normal) in order.iter().zip(normals.iter()).skip(rank + 1) {
                    let other = &pieces[*i as usize];
                    if base.normal.dot(normal) > NORMALS_COS && !taken[*i as usize] && on_circle(base, other) {
                        let [a, b] = other.ends.map(|end| angle(base, &end));
                        candidates.push((*i, a.min(b), a.max(b)));
                    }
                }
                let [mut low, mut high] = base.ends.map(|end| angle(base, &end));
                while let Some(k) = candidates.iter().position(|(_, a, b)| {
                    let gap = (a - high).max(low - b);
                    gap < gap_max * (high - low).clamp(SCALE_RAD[0], SCALE_RAD[1])
                        && high.max(*b) - low.min(*a) < LONGEST_RAD
                }) {
                    let (i, a, b) = candidates.remove(k);
                    (low, high) = (low.min(a), high.max(b));
                    taken[i as usize] = true;
                    members.push(i);
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

/// Whether the ends of a piece are on the circle of another.
fn on_circle(base: &Segment, other: &Segment) -> bool {
    other.ends.iter().all(|end| base.normal.dot(end).abs() * other.px_per_rad < APART_PX)
}

/// Angle of a bearing along the circle of a segment from its middle.
fn angle(base: &Segment, bearing: &Vector3<f64>) -> f64 {
    base.along().dot(bearing).atan2(base.middle.dot(bearing))
}
