//! Candidate pixels of the cuboid's three edges in one pass over the labels (Liu et al. 2018, algorithm 1).

use super::segmentation::{LEFT, Labels, NONE, RIGHT, TOP};

/// Which way the cuboid's top is in the image.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Orientation {
    /// The camera's upward direction points upwards.
    Upright,
    /// The camera is upside down.
    UpsideDown,
}

/// Twice the pixel coordinates of candidates: midpoints between two labelled pixels lie on half pixels.
pub(crate) type Doubled = [i32; 2];

/// Labels that are looked at together: most of an image shows none of the faces. Answers do not depend on it.
const BLOCK: usize = 64;

/// The places of labels of the left and the right face.
fn faces_below(row: &[u8]) -> impl Iterator<Item = usize> {
    let blocks = row.chunks(BLOCK).zip((0..).step_by(BLOCK));
    blocks
        .filter(|(block, _)| block.iter().fold(NONE, |most, label| most.max(*label)) > TOP)
        .flat_map(|(block, start)| block.iter().zip(start..).filter(|(label, _)| **label > TOP).map(|(_, place)| place))
}

/// Candidates of the x edge (top and right face), the y edge (left and right face) and the z edge (top and left face).
#[derive(Debug, Clone, Default)]
pub(crate) struct EdgeCandidates {
    pub(crate) edges: [Vec<Doubled>; 3],
}

impl EdgeCandidates {
    /// Looks from each pixel of the right and the left face one `width` (in pixels) towards where the neighbouring face is
    /// expected; the midpoint between two faces is a candidate. At most two looks for each pixel.
    pub(crate) fn find(&mut self, labels: &Labels, width: usize, orientation: Orientation) {
        self.edges.iter_mut().for_each(Vec::clear);
        let [x_edge, y_edge, z_edge] = &mut self.edges;
        let (rows, step) = (labels.size[1], labels.step as i32);
        let [left, top] = labels.origin.map(|first| 2 * first as i32);
        let width = width.div_ceil(labels.step.max(1));
        let (w, upright) = (width as i32, orientation == Orientation::Upright);
        for v in 0..rows {
            let row = labels.row(v);
            let beyond = if upright { v.checked_sub(width) } else { Some(v + width).filter(|v| *v < rows) };
            let beyond = beyond.map_or(&[][..], |v| labels.row(v));
            let sideways = if upright { -w } else { w };
            for u in faces_below(row) {
                let place = |du: i32, dv: i32| [left + step * (2 * u as i32 + du), top + step * (2 * v as i32 + dv)];
                let above = beyond.get(u).copied().unwrap_or(NONE);
                if row[u] == RIGHT {
                    let beside = if upright { u.checked_sub(width) } else { Some(u + width) };
                    if beside.and_then(|u| row.get(u)) == Some(&LEFT) {
                        y_edge.push(place(sideways, 0));
                    } else if above == TOP {
                        x_edge.push(place(0, sideways));
                    }
                } else if above == TOP {
                    z_edge.push(place(0, sideways));
                }
            }
        }
    }

    /// How many candidates the edge with the fewest has.
    pub(crate) fn fewest(&self) -> usize {
        self.edges.iter().map(Vec::len).min().unwrap_or(0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A cuboid whose top is above row 20, left of column 30 the left face, right of it the right one, with gaps.
    fn scene(upside_down: bool) -> Labels {
        let mut labels = vec![NONE; 60 * 40];
        for v in 0..40_usize {
            for u in 0..60_usize {
                let label = match (u, v) {
                    (5..=55, 5..=19) => TOP,
                    (5..=29, 22..=38) => LEFT,
                    (32..=55, 22..=38) => RIGHT,
                    _ => NONE,
                };
                let at = if upside_down { 60 * 40 - 1 - (v * 60 + u) } else { v * 60 + u };
                labels[at] = label;
            }
        }
        Labels { values: labels, origin: [100, 50], size: [60, 40], step: 1 }
    }

    #[test]
    fn candidates_are_centred_on_the_gaps_for_both_orientations() {
        for (orientation, middle) in [(Orientation::Upright, [130.5, 70.5]), (Orientation::UpsideDown, [128.5, 68.5])] {
            let mut found = EdgeCandidates::default();
            found.find(&scene(orientation == Orientation::UpsideDown), 8, orientation);
            let mean = |edge: usize, axis: usize| {
                let places = &found.edges[edge];
                places.iter().map(|place| f64::from(place[axis])).sum::<f64>() / places.len() as f64 / 2.0
            };
            assert_eq!(mean(1, 0), middle[0]);
            assert_eq!(mean(0, 1), middle[1]);
            assert_eq!(mean(2, 1), middle[1]);
            assert!((mean(0, 0) > middle[0]) == (orientation == Orientation::Upright));
            assert!(found.fewest() > 100);
            let other =
                [Orientation::Upright, Orientation::UpsideDown].into_iter().find(|o| *o != orientation).unwrap();
            found.find(&scene(orientation == Orientation::UpsideDown), 8, other);
            assert_eq!(found.fewest(), 0);
        }
    }
}
