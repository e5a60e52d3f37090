//! Vertical lines as great circles through the vertical: straight edges that pass it, joined by great circle and polarity.

use nalgebra::{Matrix3, Vector3};

use super::line_fit::{LineFit, Moments};
use crate::lines::angles::wrap;
use crate::lines::line::{Line, LineFrame, Lines};
use crate::lines::options::GreatCircleOptions;
use crate::segments::{EdgePoint, Segment, Segments};

/// Memory of the search.
#[derive(Debug, Clone, Default)]
pub(crate) struct GreatCircleScratch {
    arcs: Vec<Arc>,
    by_azimuth: Vec<(f64, u32)>,
    members: Vec<u32>,
    fits: Vec<LineFit>,
}

/// A straight edge that may be of a vertical line, in the upright frame.
#[derive(Debug, Clone)]
struct Arc {
    moments: Moments,
    azimuth: f64,
    rising: bool,
    /// Lowest and highest elevation, radians.
    ends: (f64, f64),
    taken: bool,
}

/// Greatest root mean square distance in pixels of a straight edge from a line that it is a piece of.
const JOIN_PX: f64 = 0.7;

/// How far in pixels the middle of a straight edge may be from the first of its line: [`JOIN_PX`], and what the line's slant moves it.
const REACH_PX: f64 = 4.0;

/// Pixels farther from their straight edge are where it bends away at a corner.
const STRAY_PX: f64 = 1.2;

/// Standard deviations of a straight edge's direction within which it may pass the vertical.
const DIRECTION_SIGMAS: f64 = 3.0;

/// The largest angle in radians, 20 degrees, by which the great circle of a straight edge or one pixel of it may miss the vertical,
/// however little is known of its direction.
pub(crate) const MISS_MAX_RAD: f64 = 0.35;

/// Finds the lines among the straight edges of an image.
pub(crate) fn find(
    robot_from_camera: &Matrix3<f64>,
    segments: &Segments,
    frame: LineFrame,
    options: &GreatCircleOptions,
    scratch: &mut GreatCircleScratch,
    out: &mut Lines,
) {
    let GreatCircleScratch { arcs, by_azimuth, members, fits } = scratch;
    let upright_from_camera = frame.robot_from_upright().transpose() * robot_from_camera;
    arcs.clear();
    let arc = |segment: &Segment| Arc::new(segment, segments.points_of(segment), &upright_from_camera, options);
    arcs.extend(segments.list.iter().filter_map(arc));
    arcs.sort_unstable_by(|a, b| b.extent().total_cmp(&a.extent()).then(a.azimuth.total_cmp(&b.azimuth)));
    by_azimuth.clear();
    by_azimuth.extend(arcs.iter().zip(0..).map(|(arc, i)| (arc.azimuth, i)));
    by_azimuth.sort_unstable_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
    fits.clear();
    for first in 0..arcs.len() {
        fits.extend(grow(arcs, by_azimuth, first, options, members).filter(|fit| fit.is_one_line(options)));
    }
    keep_apart(fits, options.separation_px);
    if let Some(most) = options.lines_max {
        fits.truncate(most);
    }
    out.frame = frame;
    out.lines.clear();
    out.lines.extend(fits.iter().map(|fit| Line {
        bearing_rad: fit.azimuth,
        sigma_rad: fit.sigma,
        support_px: fit.support,
        elevation_min_rad: fit.ends.0,
        elevation_max_rad: fit.ends.1,
        polarity: if fit.rising { 1.0 } else { -1.0 },
    }));
    out.lines.sort_unstable_by(|a, b| a.bearing_rad.total_cmp(&b.bearing_rad));
}

impl Arc {
    /// None for an edge that passes the vertical too far off.
    fn new(
        segment: &Segment,
        points: &[EdgePoint],
        upright_from_camera: &Matrix3<f64>,
        options: &GreatCircleOptions,
    ) -> Option<Self> {
        let up = upright_from_camera.row(2).transpose();
        let unknown = (segment.variance_at(&up) + options.tilt_sigma_rad.powi(2)).sqrt();
        let limit = (options.plane_max_rad + DIRECTION_SIGMAS * unknown).min(MISS_MAX_RAD.max(options.plane_max_rad));
        if segment.normal.dot(&up).abs() > limit.sin() {
            return None;
        }
        let normal = upright_from_camera * segment.normal;
        let (mut moments, mut lowest, mut highest) = (Moments::default(), 1.0, -1.0);
        let mut middle = Vector3::zeros();
        for point in points {
            let bearing = upright_from_camera * Vector3::from(point.bearing.map(f64::from));
            let px_per_rad = f64::from(point.px_per_rad);
            if (normal.dot(&bearing) * px_per_rad).abs() < STRAY_PX {
                moments.add(&bearing, px_per_rad);
                middle += bearing;
                (lowest, highest) = (bearing.z.min(lowest), bearing.z.max(highest));
            }
        }
        let turn = normal.y * middle.x - normal.x * middle.y;
        (moments.support >= options.run_min_px).then(|| Self {
            moments,
            azimuth: middle.y.atan2(middle.x),
            rising: turn > 0.0,
            ends: (lowest.asin(), highest.asin()),
            taken: false,
        })
    }

    fn extent(&self) -> f64 {
        self.ends.1 - self.ends.0
    }
}

/// The line of an edge and of those on its great circle that no line has yet.
fn grow(
    arcs: &mut [Arc],
    by_azimuth: &[(f64, u32)],
    first: usize,
    options: &GreatCircleOptions,
    members: &mut Vec<u32>,
) -> Option<LineFit> {
    if std::mem::replace(&mut arcs[first].taken, true) {
        return None;
    }
    members.clear();
    members.push(first as u32);
    let Arc { moments, azimuth, rising, .. } = arcs[first].clone();
    let mut line = moments;
    let mut fit = LineFit::of(&line, azimuth, options)?;
    let reach = REACH_PX * fit.per_px + 3.0 * options.tilt_sigma_rad;
    let n = by_azimuth.len();
    let start = by_azimuth.partition_point(|(other, _)| *other < azimuth);
    loop {
        let before = members.len();
        for step in [1, n - 1] {
            let mut at = if step == 1 { start } else { (start + n - 1) % n };
            for _ in 0..n {
                let (other, i) = by_azimuth[at];
                if wrap(other - azimuth).abs() > reach {
                    break;
                }
                at = (at + step) % n;
                let arc = &mut arcs[i as usize];
                if !arc.taken && arc.rising == rising && arc.moments.rms_px(&fit.normal()) < JOIN_PX {
                    arc.taken = true;
                    members.push(i);
                    line.join(&arc.moments);
                    fit = LineFit::of(&line, fit.azimuth, options)?;
                }
            }
        }
        if members.len() == before {
            break;
        }
    }
    fit.rising = rising;
    members.sort_unstable_by(|a, b| arcs[*a as usize].ends.0.total_cmp(&arcs[*b as usize].ends.0).then(a.cmp(b)));
    let (lowest, mut highest) = arcs[members[0] as usize].ends;
    fit.length = highest - lowest;
    for member in &members[1..] {
        let (low, high) = arcs[*member as usize].ends;
        if high > highest {
            // Narrow gaps count as covered.
            fit.length += high - if low - highest <= options.gap_max_rad { highest } else { low };
            highest = high;
        }
    }
    fit.ends = (lowest, highest);
    Some(fit)
}

/// Sorts by length, the longest first, and drops lines beside a longer one: two edges so close blend, whatever their polarity.
fn keep_apart(fits: &mut Vec<LineFit>, separation_px: f64) {
    fits.sort_unstable_by(|a, b| b.length.total_cmp(&a.length).then(a.azimuth.total_cmp(&b.azimuth)));
    let mut kept = 0;
    for i in 0..fits.len() {
        let fit = fits[i];
        let beside = |other: &LineFit| {
            wrap(other.azimuth - fit.azimuth).abs() < 0.5 * separation_px * (fit.per_px + other.per_px)
        };
        if !fits[..kept].iter().any(beside) {
            fits[kept] = fit;
            kept += 1;
        }
    }
    fits.truncate(kept);
}
