//! Pieces of chains that a great circle fits.

use std::ops::Range;

use super::segment::EdgePoint;
use crate::segments::fit::{cross, dot};

/// Cosine of the longest piece, 120 degrees: a circle through two bearings is ill determined where they are nearly opposite.
const LONGEST_COS: f32 = -0.5;

/// Cuts a chain of points until each piece strays at most `stray_px` from the great circle through its ends, and passes on the
/// pieces of at least `least` points, in order. `stack` is scratch.
pub(super) fn split(
    points: &[EdgePoint],
    stray_px: f32,
    least: usize,
    stack: &mut Vec<Range<usize>>,
    mut piece: impl FnMut(Range<usize>),
) {
    stack.clear();
    stack.push(0..points.len());
    while let Some(range) = stack.pop() {
        let own = &points[range.clone()];
        if own.len() < least {
            continue;
        }
        let at = match farthest(own) {
            Some((at, distance)) if distance > stray_px => at.clamp(1, own.len() - 1),
            Some(_) => {
                piece(range);
                continue;
            }
            None => own.len() / 2,
        };
        stack.push(range.start + at..range.end);
        stack.push(range.start..range.start + at);
    }
}

/// The point farthest from the circle through the ends, and its distance in pixels; none where the ends determine no circle. Ends
/// are the sums of two points, which halves the variance of noise.
fn farthest(points: &[EdgePoint]) -> Option<(usize, f32)> {
    let [a, b, .., c, d] = points else { return None };
    let sum = |p: &EdgePoint, q: &EdgePoint| [0, 1, 2].map(|k| p.bearing[k] + q.bearing[k]);
    let (first, last) = (sum(a, b), sum(c, d));
    let normal = cross(first, last);
    let length = dot(normal, normal).sqrt();
    if dot(first, last) < LONGEST_COS * 4.0 || length.is_nan() || length < 1e-9 {
        return None;
    }
    let scale = 1.0 / length;
    let mut worst = (0, 0.0f32);
    for (i, point) in points.iter().enumerate() {
        let distance = dot(point.bearing, normal).abs() * scale * point.px_per_rad;
        if distance > worst.1 {
            worst = (i, distance);
        }
    }
    Some(worst)
}
