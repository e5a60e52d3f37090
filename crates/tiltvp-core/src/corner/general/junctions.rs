//! Where three segments meet: one that may be vertical and two more, each beginning near the common vertex.

use nalgebra::{Matrix3, Vector3};

use crate::camera::Camera;
use crate::corner::feature::length_score;
use crate::corner::options::GeneralOptions;
use crate::segments::Segment;

/// One end of a segment, from which its ray runs to the other end.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct RayEnd {
    pub(crate) segment: usize,
    /// 0 if the ray begins at the segment's first end.
    pub(crate) end: usize,
}

/// Three rays that may be those of a corner: x, y (the one that may be vertical), z, clockwise in the image.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Junction {
    pub(crate) rays: [RayEnd; 3],
    pub(crate) vertex: Vector3<f64>,
    /// Better junctions have more.
    pub(crate) score: f64,
}

/// Most junctions that are followed up, which bounds the time. Halved, 1 of 34 heights of a real box is lost; doubled,
/// nothing is gained.
const JUNCTIONS_MAX: usize = 80;

/// How far from the common vertex each of the three lines may pass before they are fitted between pixels, in pixels.
/// Halved, the attitude of a real cabinet is 0.750 degrees off instead of 0.716; doubled, 2 of 34 heights of a real box
/// are lost.
const LOOSE_PX: f64 = 4.0;

impl RayEnd {
    fn near<'a>(&self, segments: &'a [Segment]) -> &'a Vector3<f64> {
        &segments[self.segment].ends[self.end]
    }

    pub(crate) fn far<'a>(&self, segments: &'a [Segment]) -> &'a Vector3<f64> {
        &segments[self.segment].ends[1 - self.end]
    }
}

/// Two rays that begin where their lines cross.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Meeting {
    pub(crate) place: Vector3<f64>,
    gap_share: f64,
}

/// The junctions of an image, the best first. `vertical` is the direction of the vertical in the camera frame, either way,
/// where something is known about it.
pub(crate) fn find(
    camera: &Camera,
    segments: &[Segment],
    vertical: Option<&Vector3<f64>>,
    options: &GeneralOptions,
    meetings: &mut Vec<Vec<(usize, Meeting)>>,
    out: &mut Vec<Junction>,
) {
    out.clear();
    let ends: Vec<RayEnd> = (0..segments.len()).flat_map(|segment| [0, 1].map(|end| RayEnd { segment, end })).collect();
    for list in meetings.iter_mut() {
        list.clear();
    }
    meetings.resize(ends.len(), Vec::new());
    let places: Vec<(Vector3<f64>, f64)> =
        ends.iter().map(|end| (*end.near(segments), reach_rad(&segments[end.segment], options))).collect();
    for (i, (a, (place, reach))) in ends.iter().zip(&places).enumerate() {
        for (j, (b, (other_place, other_reach))) in ends.iter().zip(&places).enumerate().skip(i + 1) {
            // Most are far from each other.
            if (place - other_place).norm() > reach + other_reach {
                continue;
            }
            if let Some(met) = meeting(segments, *a, *b, options) {
                meetings[i].push((j, met));
                meetings[j].push((i, met));
            }
        }
    }
    let (sine, apart) = (options.vertical_max_rad.sin(), options.ray_angle_min_rad.sin());
    for (i, upright) in ends.iter().enumerate() {
        let segment = &segments[upright.segment];
        if vertical.is_some_and(|vertical| segment.normal.dot(vertical).abs() > sine) {
            continue;
        }
        for (k, (j, Meeting { place, gap_share })) in meetings[i].iter().enumerate() {
            for (l, Meeting { place: other_place, gap_share: other_gap_share }) in meetings[i].iter().skip(k + 1) {
                let px_per_rad = segment.px_per_rad;
                // No angle is below its chord.
                let is_near = |away_rad: f64| away_rad * px_per_rad <= 2.0 * LOOSE_PX;
                if !(is_near((place - other_place).norm()) && is_near(place.angle(other_place))) {
                    continue;
                }
                let rays = [ends[*j], *upright, ends[*l]];
                let between = segments[rays[0].segment].normal.cross(&segments[rays[2].segment].normal).norm();
                if rays[0].segment == rays[2].segment || between < apart {
                    continue;
                }
                if let Some(junction) = junction(camera, segments, rays, px_per_rad, gap_share + other_gap_share, place)
                {
                    out.push(junction);
                }
            }
        }
    }
    out.sort_unstable_by(|a, b| b.score.total_cmp(&a.score));
    out.truncate(JUNCTIONS_MAX);
}

/// How far before its begin a segment may meet another one, in pixels.
pub(super) fn widest_px(segment: &Segment, options: &GeneralOptions) -> f64 {
    options.gap_max_px.max(options.gap_max_share * segment.length_px())
}

/// How far from its begin it may, either way, in radians.
fn reach_rad(segment: &Segment, options: &GeneralOptions) -> f64 {
    widest_px(segment, options).max(options.overshoot_max_px) / segment.px_per_rad
}

/// Where the lines of two ends cross, if both rays begin there and run away from it.
pub(crate) fn meeting(segments: &[Segment], a: RayEnd, b: RayEnd, options: &GeneralOptions) -> Option<Meeting> {
    let (first, second) = (&segments[a.segment], &segments[b.segment]);
    if a.segment == b.segment {
        return None;
    }
    // Both begin near the crossing, so they begin near each other.
    if (a.near(segments) - b.near(segments)).norm() > reach_rad(first, options) + reach_rad(second, options) {
        return None;
    }
    let crossing = first.normal.cross(&second.normal);
    if crossing.norm() < options.ray_angle_min_rad.sin() {
        return None;
    }
    let crossing = crossing.normalize();
    let place = if crossing.dot(a.near(segments)) < 0.0 { -crossing } else { crossing };
    let mut gap_share = 0.0;
    for (ray, segment) in [(a, first), (b, second)] {
        let (near, far) = (ray.near(segments), ray.far(segments));
        // Positive where the segment begins beyond the crossing.
        let sign = if place.cross(near).dot(&near.cross(far)) < 0.0 { -1.0 } else { 1.0 };
        let gap_px = sign * place.angle(near) * segment.px_per_rad;
        if gap_px < -options.overshoot_max_px || gap_px > widest_px(segment, options) {
            return None;
        }
        gap_share += gap_px.abs() / segment.length_px();
    }
    Some(Meeting { place, gap_share })
}

/// Whether the rays x, y, z are clockwise in the image, by their directions at the vertex: about the line of sight from y come z, then x.
pub(super) fn are_clockwise(vertex: &Vector3<f64>, along: &[Vector3<f64>; 3]) -> bool {
    let turn = |direction: &Vector3<f64>| {
        let angle = vertex.dot(&along[1].cross(direction)).atan2(along[1].dot(direction));
        if angle < 0.0 { angle + std::f64::consts::TAU } else { angle }
    };
    turn(&along[0]) > turn(&along[2])
}

/// The junction of three rays that meet in pairs.
fn junction(
    camera: &Camera,
    segments: &[Segment],
    rays: [RayEnd; 3],
    px_per_rad: f64,
    gap_share: f64,
    near: &Vector3<f64>,
) -> Option<Junction> {
    let normals = rays.map(|ray| segments[ray.segment].normal);
    let moments: Matrix3<f64> = normals.iter().map(|normal| normal * normal.transpose()).sum();
    let eigen = moments.symmetric_eigen();
    let vertex = eigen.eigenvectors.column(eigen.eigenvalues.imin()).normalize();
    let vertex = if vertex.dot(near) < 0.0 { -vertex } else { vertex };
    camera.project(&vertex)?;
    if normals.iter().any(|normal| normal.dot(&vertex).abs() * px_per_rad > LOOSE_PX) {
        return None;
    }
    let along = rays.map(|ray| vertex.cross(ray.far(segments)).cross(&vertex));
    let rays = if are_clockwise(&vertex, &along) { rays } else { [rays[2], rays[1], rays[0]] };
    let lengths = rays.map(|ray| segments[ray.segment].length_px());
    Some(Junction { rays, vertex, score: length_score(&lengths) / (1.0 + gap_share) })
}
