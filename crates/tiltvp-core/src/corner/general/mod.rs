//! The general front end: line segments joined at vertices, each ray then fitted between pixels.

mod askew;
pub(super) mod attitude_of_most;
pub(super) mod beginnings;
pub(super) mod common_attitude;
pub(super) mod completion;
pub(super) mod double_edges;
pub(super) mod edge_ends;
pub(super) mod guided;
mod junctions;
mod l_junctions;
mod manhattan;
mod sized_ends;

use std::f64::consts::PI;

use nalgebra::Vector3;

pub(super) use self::sized_ends::{box_search, find_end};

use self::junctions::{Junction, Meeting, RayEnd, widest_px};
use super::feature::CornerFeature;
use super::options::GeneralOptions;
use super::trace::{RaySearch, TraceScratch, TracedRay, trace};
use crate::camera::Camera;
use crate::error::Result;
use crate::image::{ImageView, LightTable};
use crate::segments::{Segment, SegmentDetector, SegmentScratch, Segments};

/// How far from the direction of its axis a segment's great circle may pass: the sine of 2.5 degrees, 0.9 pixels at one
/// end of a segment of 20 pixels.
const AXIS_SINE: f64 = 0.0436;

/// Profiles along a ray that err together: a profile shares pixels with about two on either side, as bilinear samples
/// of a smoothed image do. It divides the information of the fit.
const ERRING_TOGETHER: f64 = 4.0;

/// Pixels about the vertex where the edges' gradients mix: the reach of a profile's edge and one pixel of blur.
const CLEAR_OF_VERTEX_PX: f64 = 4.0;

/// Pixels at the far end of a ray that are left out: half of the gradient kernel and one pixel of blur.
const CLEAR_OF_END_PX: f64 = 2.0;

/// How far from a ray's great circle a further segment of the same edge may be, in pixels: a little more than
/// `segment_threshold_px`.
const SAME_LINE_PX: f64 = 1.5;

/// Corners whose vertices are closer than this are one, in pixels: twice the distance at which three lines still count
/// as meeting.
const SAME_VERTEX_PX: f64 = 8.0;

/// Most segments of an image, which bounds the search for junctions to 320 ends.
const SEGMENTS_MAX: usize = 160;

/// Directions of segments in an image that are told apart where there are more: 15 degrees each, in which the edges along one axis
/// of a room are a few.
const DIRECTIONS: usize = 12;

/// Memory of the front end.
#[derive(Debug, Clone)]
pub(crate) struct GeneralScratch {
    detector: SegmentScratch,
    /// The straight edges of the last image, the longest first.
    pub(crate) segments: Segments,
    /// For each end of a segment the others that it meets.
    meetings: Vec<Vec<(usize, Meeting)>>,
    junctions: Vec<Junction>,
    /// For each end of a segment, the vertices from which its ray was followed, and what came of it.
    traced: Vec<Vec<(Vector3<f64>, Option<TracedRay>)>>,
    pub(crate) trace: TraceScratch,
}

impl GeneralScratch {
    pub(crate) fn new(detector: SegmentScratch) -> Self {
        Self {
            detector,
            segments: Segments::default(),
            meetings: Vec::new(),
            junctions: Vec::new(),
            traced: Vec::new(),
            trace: TraceScratch::default(),
        }
    }
}

/// What corners are looked for with.
pub(crate) struct Search<'a> {
    pub(crate) camera: &'a Camera,
    pub(crate) detector: &'a SegmentDetector,
    pub(crate) options: &'a GeneralOptions,
    pub(crate) light: &'a LightTable,
    /// The share of the options' least gradients that edges have.
    pub(crate) share: f64,
    /// A direction along the vertical, where it is known.
    pub(crate) vertical: Option<&'a Vector3<f64>>,
}

/// The corners of an image, the best first. `closeness` is a factor on how good a corner is, none where it is none at all.
pub(crate) fn find(
    search: &Search<'_>,
    image: &ImageView<'_>,
    closeness: impl Fn(&CornerFeature) -> Option<f64>,
    scratch: &mut GeneralScratch,
    out: &mut Vec<CornerFeature>,
) -> Result<()> {
    let Search { camera, detector, options, light, share, vertical } = *search;
    out.clear();
    let GeneralScratch { detector: edges, segments, meetings, junctions, traced, trace: memory } = scratch;
    detector.detect_fainter(image, share, edges, segments)?;
    segments.list.retain(|segment| segment.length_px() >= options.segment_min_px);
    thin(&mut segments.list);
    let segments = &segments.list;
    junctions::find(camera, segments, vertical, options, meetings, junctions);
    traced.iter_mut().for_each(Vec::clear);
    traced.resize(2 * segments.len(), Vec::new());
    let mut scored: Vec<(f64, CornerFeature)> = Vec::new();
    for junction in junctions.iter() {
        let mut rays = [None; 3];
        for (ray, end) in rays.iter_mut().zip(junction.rays) {
            let segment = &segments[end.segment];
            let near_rad = SAME_VERTEX_PX / segment.px_per_rad;
            let known = &mut traced[2 * end.segment + end.end];
            *ray = if let Some((_, found)) = known.iter().find(|(at, _)| at.angle(&junction.vertex) < near_rad) {
                *found
            } else {
                let search = search_of(segments, end, &junction.vertex, options);
                let support_min_px = f64::from(options.support_min_px);
                let found = search.and_then(|search| {
                    trace(
                        camera,
                        &search,
                        support_min_px,
                        |at, step, out| light.gray_profile(image, at, step, out),
                        memory,
                    )
                });
                known.push((junction.vertex, found));
                found
            };
            if ray.is_none() {
                break;
            }
        }
        let [Some(x), Some(y), Some(z)] = rays else { continue };
        let rays = [x, y, z];
        let Some(corner) = CornerFeature::from_rays(rays.map(|traced| traced.ray)) else { continue };
        let good = corner.residual_rad() * y.px_per_rad <= options.residual_max_px;
        if !good || !corner.rays_apart(options.ray_angle_min_rad) {
            continue;
        }
        let Some(closeness) = closeness(&corner) else { continue };
        let off = corner.residual_rad() * y.px_per_rad / options.residual_max_px;
        scored.push((closeness * corner.support_score() / (1.0 + off), corner));
    }
    scored.sort_by(|a, b| b.0.total_cmp(&a.0));
    for (_, corner) in scored {
        if out.len() >= options.corners_max as usize {
            break;
        }
        let pixel = |corner: &CornerFeature| camera.project(&corner.vertex());
        let Some(here) = pixel(&corner) else { continue };
        if out.iter().all(|other| pixel(other).is_none_or(|there| (there - here).norm() > SAME_VERTEX_PX)) {
            out.push(corner);
        }
    }
    Ok(())
}

/// Keeps [`SEGMENTS_MAX`] segments, the longest of each direction in turn: the stripes of a wall leave room for its edges.
fn thin(segments: &mut Vec<Segment>) {
    if segments.len() <= SEGMENTS_MAX {
        return;
    }
    let mut of_direction = [0_usize; DIRECTIONS];
    let rank = |segment: Segment| {
        let turn = segment.normal.y.atan2(segment.normal.x).rem_euclid(PI) / PI;
        let rank = &mut of_direction[(turn * DIRECTIONS as f64) as usize % DIRECTIONS];
        *rank += 1;
        (*rank, segment)
    };
    let mut ranked: Vec<(usize, Segment)> = segments.drain(..).map(rank).collect();
    ranked.sort_by_key(|(rank, _)| *rank);
    segments.extend(ranked.into_iter().take(SEGMENTS_MAX).map(|(_, segment)| segment));
    segments.sort_by(|a, b| b.length_rad.total_cmp(&a.length_rad));
}

/// Where the ray that begins at an end of a segment runs: to the segment's far end, and on where other segments go on.
fn search_of(segments: &[Segment], ray: RayEnd, vertex: &Vector3<f64>, options: &GeneralOptions) -> Option<RaySearch> {
    let segment = &segments[ray.segment];
    let on_line = (vertex - segment.normal * segment.normal.dot(vertex)).try_normalize(1e-6)?;
    let normal = if ray.end == 0 { segment.normal } else { -segment.normal };
    let along = normal.cross(&on_line);
    let angle_of = |bearing: &Vector3<f64>| bearing.dot(&along).atan2(bearing.dot(&on_line));
    let px_per_rad = segment.px_per_rad;
    let mut to_rad = angle_of(ray.far(segments));
    let gap_rad = widest_px(segment, options) / px_per_rad;
    let in_line = |other: &&Segment| other.ends.iter().all(|end| normal.dot(end).abs() * px_per_rad < SAME_LINE_PX);
    let in_line: Vec<[f64; 2]> = segments
        .iter()
        .filter(in_line)
        .map(|other| {
            let angles = other.ends.map(|end| angle_of(&end));
            [angles[0].min(angles[1]), angles[0].max(angles[1])]
        })
        .collect();
    for _ in 0..3 {
        let before = to_rad;
        for [near, far] in &in_line {
            if *near > 0.0 && near - to_rad < gap_rad && *far > to_rad && *far < 1.4 {
                to_rad = *far;
            }
        }
        if to_rad == before {
            break;
        }
    }
    let angles = [CLEAR_OF_VERTEX_PX / px_per_rad, to_rad - CLEAR_OF_END_PX / px_per_rad];
    Some(RaySearch { share_min: options.support_min_share, ..gray_search(options, normal, on_line, angles) })
}

/// The search for a ray of a grey image near a great circle, between two angles from the vertex.
fn gray_search(
    options: &GeneralOptions,
    normal: Vector3<f64>,
    vertex: Vector3<f64>,
    [from_rad, to_rad]: [f64; 2],
) -> RaySearch {
    RaySearch {
        normal,
        vertex,
        from_rad,
        to_rad,
        search_px: options.search_px,
        step_min: options.step_min,
        step_share_min: 0.0,
        threshold_px: options.threshold_px,
        share_min: 0.0,
        erring_together: ERRING_TOGETHER,
        ray_sigma_px: options.ray_sigma_px,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn segment(normal: Vector3<f64>, length_rad: f64) -> Segment {
        Segment {
            normal,
            middle: Vector3::z(),
            ends: [Vector3::z(); 2],
            length_rad,
            variances_rad2: [1e-6; 2],
            contrast: 10.0,
            rms_px: 0.2,
            px_per_rad: 700.0,
            points: 0..0,
        }
    }

    #[test]
    fn stripes_leave_room_for_edges_across_them() {
        let stripes = (0..300_u32).map(|k| segment(Vector3::x(), 0.5 + 0.001 * f64::from(k)));
        let mut segments: Vec<Segment> =
            stripes.chain([segment(Vector3::y(), 0.1), segment(Vector3::y(), 0.2)]).collect();
        segments.sort_by(|a, b| b.length_rad.total_cmp(&a.length_rad));
        let longest = segments[..158].to_vec();
        thin(&mut segments);
        assert_eq!(segments[..158], longest[..]);
        assert_eq!([segments[158].length_rad, segments[159].length_rad], [0.2, 0.1]);
        assert_eq!(segments.len(), SEGMENTS_MAX);
    }

    /// A piece of the great circle x = 0 between two angles from the optical axis, 700 pixels a radian.
    fn piece([from_rad, to_rad]: [f64; 2]) -> Segment {
        let at = |angle: f64| Vector3::new(0.0, angle.sin(), angle.cos());
        // From z to y is a positive turn about -x.
        Segment { ends: [at(from_rad), at(to_rad)], ..segment(-Vector3::x(), to_rad - from_rad) }
    }

    #[test]
    fn rays_go_on_along_pieces_of_their_line() {
        let options = GeneralOptions::default();
        let gap_rad = options.gap_max_px / 700.0;
        let aside = Vector3::new(0.05, 1.0, 0.0).normalize();
        let to_rad = |others: &[Segment]| {
            let segments = [&[piece([0.02, 0.1])], others].concat();
            let search = search_of(&segments, RayEnd { segment: 0, end: 0 }, &Vector3::z(), &options).unwrap();
            search.to_rad + CLEAR_OF_END_PX / 700.0
        };
        let next = 0.1 + 0.9 * gap_rad;
        assert!((to_rad(&[]) - 0.1).abs() < 1e-12);
        assert!((to_rad(&[piece([next, 0.3])]) - 0.3).abs() < 1e-12);
        // In any order, and from piece to piece.
        assert!((to_rad(&[piece([0.3 + 0.9 * gap_rad, 0.5]), piece([next, 0.3])]) - 0.5).abs() < 1e-12);
        // Not over a wider gap, behind the vertex, along another line, or as far as a quarter turn.
        assert!((to_rad(&[piece([0.1 + 1.1 * gap_rad, 0.3])]) - 0.1).abs() < 1e-12);
        assert!((to_rad(&[piece([-0.3, -0.01])]) - 0.1).abs() < 1e-12);
        assert!((to_rad(&[Segment { ends: [Vector3::z(), aside], ..piece([next, 0.3]) }]) - 0.1).abs() < 1e-12);
        assert!((to_rad(&[piece([next, 1.5])]) - 0.1).abs() < 1e-12);
    }
}
