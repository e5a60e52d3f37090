//! Edges beside those of a corner, as of a drawer's front before its case: images hardly tell which of the two is the corner's.

use super::SAME_LINE_PX;
use crate::corner::feature::CornerFeature;
use crate::corner::ray::FittedRay;
use crate::segments::Segment;

/// How far beside a ray another edge may be that of the same corner, in pixels: boards and fronts are 2 cm thick, which is as much from
/// 1.2 metres on.
const BESIDE_PX: f64 = 12.0;

/// How far from the vertex it may begin, in pixels: more than edges beside each other are apart.
const BEGINS_PX: f64 = 2.0 * BESIDE_PX;

/// How far aside the edges of a corner may be meant, in radians: of the edge that is nearest to each ray the farthest, 0 where all are
/// alone.
pub(in crate::corner) fn double_edges_rad(corner: &CornerFeature, segments: &[Segment]) -> f64 {
    let vertex = corner.vertex();
    let beside = |ray: &FittedRay| {
        let along = ray.normal.cross(&vertex);
        let end_rad = ray.toward.dot(&along).atan2(ray.toward.dot(&vertex));
        let aside = segments.iter().filter_map(|segment| {
            let px_per_rad = segment.px_per_rad;
            let off_px = segment.ends.map(|end| ray.normal.dot(&end) * px_per_rad);
            let middle_rad = ray.normal.dot(&segment.middle).abs();
            if off_px.iter().any(|off| off.abs() > BESIDE_PX) || middle_rad * px_per_rad <= SAME_LINE_PX {
                return None;
            }
            let at = segment.ends.map(|end| end.dot(&along).atan2(end.dot(&vertex)));
            let [near, far] = [at[0].min(at[1]), at[0].max(at[1])];
            (far > 0.0 && near < end_rad && near * px_per_rad < BEGINS_PX).then_some(middle_rad)
        });
        aside.min_by(f64::total_cmp)
    };
    corner.rays().iter().filter_map(beside).fold(0.0, f64::max)
}

#[cfg(test)]
mod tests {
    use nalgebra::Vector3;

    use super::*;

    #[test]
    fn an_edge_beside_a_ray_makes_it_double() {
        let toward = [Vector3::x(), Vector3::y(), -Vector3::x() - Vector3::y()].map(|way| Vector3::z() + 0.2 * way);
        let corner = CornerFeature::from_bearings(&Vector3::z(), &toward).unwrap();
        // Along the first ray, between two places and as far aside, in pixels.
        let aside_px = |from_px: f64, to_px: f64, aside_px: f64| {
            let at = |along_px: f64| Vector3::new(along_px, aside_px, 700.0).normalize();
            let ends = [at(from_px), at(to_px)];
            let segment = Segment {
                normal: ends[0].cross(&ends[1]).normalize(),
                middle: at(0.5 * (from_px + to_px)),
                ends,
                length_rad: ends[0].angle(&ends[1]),
                variances_rad2: [1e-8; 2],
                contrast: 10.0,
                rms_px: 0.2,
                px_per_rad: 700.0,
                points: 0..0,
            };
            double_edges_rad(&corner, &[segment]) * 700.0
        };
        assert!((aside_px(5.0, 100.0, 6.0) - 6.0).abs() < 0.1);
        assert!((aside_px(-5.0, 100.0, -6.0) - 6.0).abs() < 0.1);
        // The same edge; another thing's; behind the vertex; farther on.
        let others = [(5.0, 100.0, 1.0), (5.0, 100.0, 14.0), (-100.0, -5.0, 6.0), (40.0, 100.0, 6.0)];
        for (from_px, to_px, off_px) in others {
            assert_eq!(aside_px(from_px, to_px, off_px), 0.0, "{from_px} {to_px} {off_px}");
        }
        assert_eq!(double_edges_rad(&corner, &[]), 0.0);
    }
}
