//! The front end of Liu et al. 2018 for the coloured cuboid: labels, algorithm 1, lines by RANSAC, then rays between pixels.

mod edge_candidates;
mod highlights;
pub(super) mod paper;
pub(super) mod segmentation;
mod sized_ends;

use nalgebra::{Vector2, Vector3};

pub(super) use self::sized_ends::{box_search, find_end};

use self::edge_candidates::{Doubled, EdgeCandidates, Orientation};
use self::highlights::trusts;
use self::segmentation::{Labels, Primary};
use super::feature::CornerFeature;
use super::options::{ColouredOptions, EdgeLineOptions, OrientationChoice};
use super::trace::{RaySearch, TraceScratch, TracedRay, trace};
use crate::camera::Camera;
use crate::image::{ColorView, LightTable};
use crate::robust::{Direction, RansacOptions, RansacScratch, Rows, ransac};

/// Most candidates of an edge that are lifted to bearings: lines of a few hundred pixels need no more. Doubled, no pose
/// of the rendered cuboid changes.
const LIFTED_MAX: usize = 300;

/// Most samples of two candidates: with half of them outliers, one of 80 is clean but for 1e-10.
const LINE_TRIALS: u32 = 80;

/// Pixels about the vertex where the edges' gradients mix: one more than in grey images, as demosaicing blurs colours.
/// Doubled, the cuboid is lost in images of half the size.
const CLEAR_OF_VERTEX_PX: f64 = 5.0;

/// Pixels at the far end of a ray that are left out: there it meets other edges. One more than in grey images for the
/// same reason. Doubled, the cuboid is lost in images of half the size.
const CLEAR_OF_END_PX: f64 = 3.0;

/// Profiles along a ray that err together: neighbours share pixels. Less than in grey images, where edges are also
/// crooked.
const ERRING_TOGETHER: f64 = 2.0;

/// The least step of a place as a share of those next to the vertex: two faces are as different all along their edge,
/// shading within a factor of two aside. Doubled, the cuboid is lost.
const STEP_SHARE_MIN: f64 = 0.5;

/// From the vertex candidates lie on one side, but for a few that the gap's width brings about: the share of the longer side that the
/// shorter one may have.
const NEAR_SHARE_MAX: f64 = 0.3;

/// The part of an image that is looked at.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Window {
    /// Columns.
    pub columns: std::ops::Range<usize>,
    /// Rows.
    pub rows: std::ops::Range<usize>,
}

/// Memory of the front end.
#[derive(Debug, Clone, Default)]
pub(crate) struct ColouredScratch {
    pub(crate) labels: Labels,
    candidates: EdgeCandidates,
    rows: Rows<f64>,
    bearings: Vec<Vector3<f64>>,
    weights: Vec<f32>,
    ransac: RansacScratch,
    trace: TraceScratch,
}

/// A line through candidates.
#[derive(Debug, Clone, Copy)]
struct CandidateLine {
    normal: Vector3<f64>,
    /// Mean bearing of the candidates that agree.
    middle: Vector3<f64>,
    /// A unit tangent along the line, and the angles from `middle` along it between which they lie.
    along: Vector3<f64>,
    reach: [f64; 2],
    /// How many candidates agree, and the root mean square of their distances from the line.
    support: usize,
    rms_rad: f64,
    /// Pixels per radian about the middle.
    px_per_rad: f64,
}

/// The cuboid's corner in a window of the image; none where an edge has too few candidates or the edges do not meet.
pub(crate) fn find(
    camera: &Camera,
    image: &ColorView<'_>,
    options: &ColouredOptions,
    light: &LightTable,
    window: &Window,
    scratch: &mut ColouredScratch,
) -> Option<CornerFeature> {
    let lines = find_lines(camera, image, &options.lines, (options.label_step_px, LIFTED_MAX), window, scratch)?;
    let mut vertex = meeting_point(&lines);
    let px_per_rad = camera.px_per_rad(&vertex)?;
    let [top, left, right] = options.lines.color.faces;
    let faces = [(top, right), (left, right), (top, left)];
    let mut searches = lines.map(|line| search_of(&line, &vertex, px_per_rad, options));
    let mut feature = None;
    for round in 0..2 {
        let mut traced: [Option<TracedRay>; 3] = [None; 3];
        for ((traced, search), (a, b)) in traced.iter_mut().zip(&searches).zip(faces) {
            let search = search.as_ref()?;
            let trusts = trusts(camera, search, image, light, (a, b));
            let signal = difference(image, light, (a, b), trusts);
            *traced = trace(camera, search, f64::from(options.support_min_px), signal, &mut scratch.trace);
        }
        let [Some(x), Some(y), Some(z)] = traced else { return None };
        let traced = [x, y, z];
        let found = CornerFeature::from_rays(traced.map(|traced| traced.ray))?;
        vertex = found.vertex();
        for (search, traced) in searches.iter_mut().zip(&traced) {
            *search = search.map(|search| RaySearch {
                normal: traced.ray.normal,
                vertex: (vertex - traced.ray.normal * traced.ray.normal.dot(&vertex)).normalize(),
                to_rad: vertex.angle(&traced.ray.toward),
                search_px: options.refine_px,
                ..search
            });
        }
        feature = Some(found).filter(|_| round == 1);
    }
    feature.filter(|found| found.residual_rad() * px_per_rad <= options.residual_max_px)
}

/// The lines of the three edges by algorithm 1 and RANSAC; every `step`-th pixel is labelled, and at most `lifted_max` candidates
/// of an edge are lifted to bearings. None where an edge has too few candidates.
fn find_lines(
    camera: &Camera,
    image: &ColorView<'_>,
    options: &EdgeLineOptions,
    (step, lifted_max): (u32, usize),
    window: &Window,
    scratch: &mut ColouredScratch,
) -> Option<[CandidateLine; 3]> {
    scratch.labels.fill(image, &options.color, window.columns.clone(), window.rows.clone(), step as usize);
    let orientations: &[Orientation] = match options.orientation {
        OrientationChoice::Upright => &[Orientation::Upright],
        OrientationChoice::UpsideDown => &[Orientation::UpsideDown],
        OrientationChoice::Either => &[Orientation::Upright, Orientation::UpsideDown],
    };
    let width = options.search_width_px as usize;
    let least = (options.candidates_min / step.pow(2)).max(2) as usize;
    let found = orientations.iter().any(|orientation| {
        scratch.candidates.find(&scratch.labels, width, *orientation);
        scratch.candidates.fewest() >= least
    });
    if !found {
        return None;
    }
    let mut lines = [None; 3];
    for (line, candidates) in lines.iter_mut().zip(&scratch.candidates.edges) {
        let memory = (&mut scratch.rows, &mut scratch.bearings, &mut scratch.weights, &mut scratch.ransac);
        *line = fit_line(camera, candidates, options, lifted_max, memory);
    }
    let [Some(x), Some(y), Some(z)] = lines else { return None };
    Some([x, y, z])
}

/// How much brighter the one primary is than the other: across the edge between their faces one rises where the other falls,
/// so that what glare does to both cancels.
fn difference(
    image: &ColorView<'_>,
    light: &LightTable,
    (a, b): (Primary, Primary),
    trusts: [f64; 2],
) -> impl Fn(&Vector2<f64>, &Vector2<f64>, &mut [f64]) -> bool {
    let (a, b) = (a.byte(), b.byte());
    profile(image, light, move |levels| trusts[0] * levels[a] - trusts[1] * levels[b])
}

/// What `of` makes of the levels of places across an edge.
fn profile(
    image: &ColorView<'_>,
    light: &LightTable,
    of: impl Fn([f64; 3]) -> f64,
) -> impl Fn(&Vector2<f64>, &Vector2<f64>, &mut [f64]) -> bool {
    move |middle, step, out| {
        let half = (out.len() / 2) as f64;
        out.iter_mut().enumerate().all(|(i, out)| {
            let place = middle + step * (i as f64 - half);
            let Some(levels) = light.color(image, place.x, place.y) else { return false };
            *out = of(levels);
            true
        })
    }
}

/// RANSAC over the candidates of an edge, lifted to bearings: only these are rectified.
fn fit_line(
    camera: &Camera,
    candidates: &[Doubled],
    options: &EdgeLineOptions,
    lifted_max: usize,
    (rows, bearings, weights, memory): (&mut Rows<f64>, &mut Vec<Vector3<f64>>, &mut Vec<f32>, &mut RansacScratch),
) -> Option<CandidateLine> {
    bearings.clear();
    let stride = candidates.len().div_ceil(lifted_max).max(1);
    let pixels = candidates.iter().step_by(stride).map(|[u, v]| Vector2::new(f64::from(*u), f64::from(*v)) * 0.5);
    bearings.extend(pixels.filter_map(|pixel| camera.unproject(&pixel)));
    let middle = bearings.iter().sum::<Vector3<f64>>().try_normalize(1e-3)?;
    let spread: nalgebra::Matrix3<f64> = bearings.iter().map(|b| (b - middle) * (b - middle).transpose()).sum();
    let eigen = spread.symmetric_eigen();
    let longest = eigen.eigenvectors.column(eigen.eigenvalues.imax()).into_owned();
    let along = (longest - middle * middle.dot(&longest)).try_normalize(1e-6)?;
    let across = middle.cross(&along);
    rows.clear();
    for bearing in bearings.iter() {
        rows.push(bearing.dot(&middle), bearing.dot(&along), bearing.dot(&across));
    }
    let (_, jacobian) = camera.project_jacobian(&middle)?;
    let px_per_rad = (jacobian * across).norm().max((jacobian * along).norm());
    let limits = RansacOptions::with_threshold(options.line_threshold_px / px_per_rad);
    let limits = RansacOptions { max_trials: LINE_TRIALS, seed: options.seed, ..limits };
    weights.clear();
    weights.resize(rows.len(), 1.0);
    let model = ransac(&Direction::new(rows), &limits, weights, memory).model?;
    let normal = (middle * model.x + along * model.y + across * model.z).normalize();
    let agreeing = bearings.iter().zip(weights.iter()).filter(|(_, weight)| **weight > 0.0).map(|(b, _)| b);
    let middle = agreeing.clone().sum::<Vector3<f64>>();
    let middle = (middle - normal * normal.dot(&middle)).try_normalize(1e-6)?;
    let along = normal.cross(&middle);
    let mut reach = [f64::INFINITY, f64::NEG_INFINITY];
    for bearing in agreeing.clone() {
        let angle = bearing.dot(&along).atan2(bearing.dot(&middle));
        reach = [reach[0].min(angle), reach[1].max(angle)];
    }
    let support = agreeing.clone().count();
    let rms_rad = (agreeing.map(|bearing| bearing.dot(&normal).powi(2)).sum::<f64>() / support as f64).sqrt();
    (reach[0] < reach[1]).then_some(CandidateLine { normal, middle, along, reach, support, rms_rad, px_per_rad })
}

/// Where three lines meet, by unweighted least squares (eqs. 25 to 27 in bearings).
fn meeting_point(lines: &[CandidateLine; 3]) -> Vector3<f64> {
    let moments: nalgebra::Matrix3<f64> = lines.iter().map(|line| line.normal * line.normal.transpose()).sum();
    let eigen = moments.symmetric_eigen();
    let vertex = eigen.eigenvectors.column(eigen.eigenvalues.imin()).normalize();
    let side: Vector3<f64> = lines.iter().map(|line| line.middle).sum();
    if vertex.dot(&side) < 0.0 { -vertex } else { vertex }
}

/// Where the ray of a line runs, away from the vertex; none if the vertex is in the middle of the candidates.
fn search_of(
    line: &CandidateLine,
    vertex: &Vector3<f64>,
    px_per_rad: f64,
    options: &ColouredOptions,
) -> Option<RaySearch> {
    let on_line = (vertex - line.normal * line.normal.dot(vertex)).try_normalize(1e-6)?;
    let at = on_line.dot(&line.along).atan2(on_line.dot(&line.middle));
    let [low, high] = line.reach.map(|angle| angle - at);
    let forwards = high.abs() >= low.abs();
    let (near, far) = if forwards { (low, high) } else { (-high, -low) };
    if near < -NEAR_SHARE_MAX * far || far <= 0.0 {
        return None;
    }
    Some(RaySearch {
        normal: if forwards { line.normal } else { -line.normal },
        vertex: on_line,
        from_rad: CLEAR_OF_VERTEX_PX / px_per_rad,
        to_rad: far - CLEAR_OF_END_PX / px_per_rad,
        step_share_min: STEP_SHARE_MIN,
        ray_sigma_px: options.ray_sigma_px,
        ..box_search(options)
    })
}
