//! One ray followed through the image: places of its edge between pixels, and the great circle through them.

use nalgebra::{Matrix2, Vector2, Vector3};

use super::edge_place::{EdgePlace, PROFILE_MAX, SHOULDER, SearchWindow, edge_place};
use super::ray::FittedRay;
use crate::camera::Camera;
use crate::geometry::tangent_basis;
use crate::robust::{Direction, Gate, Problem, RansacOptions, RansacScratch, Rows, ransac};

/// The least standard deviation of one profile's place, in pixels, however well the profiles agree: interpolation
/// between pixels errs by as much. Doubled, the vertical of an office is off by 0.108 instead of 0.082 degrees.
const PLACE_SIGMA_MIN_PX: f64 = 0.05;

/// Longest gap in a ray whose steps are alike, pixels: what comes after a longer one is another object. Between 6 and
/// 24 the poses of the rendered cuboid are the same.
const GAP_MAX_PX: f64 = 12.0;

/// Profiles with which a long ray is known well enough: beyond them they are farther apart, as far at most as profiles err
/// together.
const PROFILES_ENOUGH: f64 = 128.0;

/// Most profiles along a ray, as a multiple of both sides of the image together: an arc through the middle of a circular image has 0.8 of
/// that. A pinhole's pixels per radian grow without bound, so that a ray to its rim would be followed for ever.
const PROFILES_SHARE_MAX: usize = 2;

/// The first pixels of a ray. They separate it from an edge that begins elsewhere and happens to point at the vertex.
/// Halved, the attitude of a real box turns more from frame to frame (0.238 instead of 0.206 degrees).
const FIRST_PX: f64 = 20.0;

/// Least share of the first profiles that agree with the ray. Less than half, as the gradients of all three edges mix
/// at the vertex. Doubled, true corners of a real box are lost (0.218 instead of 0.206 degrees from frame to frame).
const FIRST_SHARE: f64 = 0.3;

/// Where a ray is expected, and how far from there it is looked for.
#[derive(Debug, Clone, Copy)]
pub(super) struct RaySearch {
    /// Unit normal of the expected great circle.
    pub(super) normal: Vector3<f64>,
    /// Unit bearing of the vertex, on the circle.
    pub(super) vertex: Vector3<f64>,
    /// Angle from the vertex at which the ray is followed first, in radians.
    pub(super) from_rad: f64,
    /// Angle at which it ends.
    pub(super) to_rad: f64,
    /// Largest distance of the edge from the expected circle, in pixels.
    pub(super) search_px: f64,
    /// Least step across the edge, in the units of the signal.
    pub(super) step_min: f64,
    /// The least step as a share of those next to the vertex, of the same sign; 0 where what is beside the edge may change
    /// along it.
    pub(super) step_share_min: f64,
    /// Largest distance of a profile's edge from the fitted circle, in pixels.
    pub(super) threshold_px: f64,
    /// Least share of the profiles that agree with the ray.
    pub(super) share_min: f64,
    /// How many profiles along the ray err together: neighbours share pixels and the edge's crookedness.
    pub(super) erring_together: f64,
    /// How far either end of a whole ray may be off in a way that no profile shows, in pixels.
    pub(super) ray_sigma_px: f64,
}

/// Where a profile crosses a ray.
#[derive(Debug, Clone, Copy)]
pub(super) struct RayProfile {
    pub(super) pixel: Vector2<f64>,
    /// Unit vector of the image across the ray.
    pub(super) across: Vector2<f64>,
    /// Pixels per radian along the ray.
    pub(super) pace: f64,
    /// Pixels along `across` per radian towards the ray's normal.
    pub(super) px_per_rad: f64,
}

impl RaySearch {
    /// The profile at an angle from the vertex.
    pub(super) fn profile(&self, camera: &Camera, angle_rad: f64) -> Option<RayProfile> {
        self.profile_along(camera, &self.along()?, [angle_rad.cos(), angle_rad.sin()])
    }

    /// The direction along the ray at the vertex.
    fn along(&self) -> Option<Vector3<f64>> {
        self.normal.cross(&self.vertex).try_normalize(1e-9)
    }

    /// The same by the cosine and the sine of the angle.
    fn profile_along(&self, camera: &Camera, along: &Vector3<f64>, [cos, sin]: [f64; 2]) -> Option<RayProfile> {
        let (bearing, onwards) = (self.vertex * cos + along * sin, along * cos - self.vertex * sin);
        let (pixel, jacobian) = camera.project_jacobian(&bearing)?;
        let (forwards, sideways) = (jacobian * onwards, jacobian * self.normal);
        let pace = forwards.norm();
        let across = Vector2::new(-forwards.y, forwards.x) / pace;
        (pace > 0.0).then(|| RayProfile { pixel, across, pace, px_per_rad: sideways.dot(&across) })
    }
}

/// A place of the edge.
#[derive(Debug, Clone, Copy)]
struct EdgePoint {
    /// Which profile of the ray it is from.
    profile: usize,
    /// The cosine and the sine of its angle from the vertex.
    along: [f64; 2],
    /// Distance from the expected circle, in radians.
    shift_rad: f64,
    step: f64,
    rad_per_px: f64,
}

/// A ray that was followed.
#[derive(Debug, Clone, Copy)]
pub(super) struct TracedRay {
    pub(super) ray: FittedRay,
    /// The share of the profiles that agree.
    pub(super) share: f64,
    /// The share of the first ones.
    first_share: f64,
    /// Pixels per radian along the ray.
    pub(super) px_per_rad: f64,
}

impl TracedRay {
    /// Whether the edge is seen next to the vertex, so that it begins there.
    pub(super) fn begins_at_vertex(&self) -> bool {
        self.first_share >= FIRST_SHARE
    }
}

/// Memory of the fits.
#[derive(Debug, Clone, Default)]
pub(super) struct TraceScratch {
    rows: Rows<f64>,
    places: Vec<EdgePoint>,
    steps: Vec<f64>,
    weights: Vec<f32>,
    ransac: RansacScratch,
}

/// Follows a ray from its vertex: at each pixel along it the `signal` fills in a profile across it, the edge is found between
/// samples, and a great circle is fitted robustly. None if less than `support_min_px` or a smaller share than that of the search agree. The signal is given the middle of the
/// profile, the step from sample to sample, and the samples, and says whether all of them are in the image.
pub(super) fn trace(
    camera: &Camera,
    search: &RaySearch,
    support_min_px: f64,
    signal: impl Fn(&Vector2<f64>, &Vector2<f64>, &mut [f64]) -> bool,
    scratch: &mut TraceScratch,
) -> Option<TracedRay> {
    trace_every(1.0, camera, search, support_min_px, signal, scratch)
}

/// The same with places at least `stride_px` pixels apart along the ray.
pub(super) fn trace_every(
    stride_px: f64,
    camera: &Camera,
    search: &RaySearch,
    support_min_px: f64,
    signal: impl Fn(&Vector2<f64>, &Vector2<f64>, &mut [f64]) -> bool,
    scratch: &mut TraceScratch,
) -> Option<TracedRay> {
    let TraceScratch { rows, places, steps, weights, ransac: memory } = scratch;
    let along = search.along()?;
    let length_px = (search.to_rad - search.from_rad) * search.profile(camera, search.from_rad)?.pace;
    let stride_px = (length_px / PROFILES_ENOUGH).min(search.erring_together).max(stride_px);
    let looked_at = edge_points(stride_px, camera, (search, &along), signal, places);
    if search.step_share_min > 0.0 && !places.is_empty() {
        keep_alike(places, search.step_share_min, support_min_px, stride_px, steps);
    }
    rows.clear();
    for place in places.iter() {
        // In the chart of the ray: x along the vertex, y along the ray, z the expected normal.
        rows.push(place.along[0], place.along[1], place.shift_rad);
    }
    let share = |agree: usize, of: usize| agree as f64 / of.max(1) as f64;
    let is_enough = |agree: usize| {
        agree >= 2 && agree as f64 * stride_px >= support_min_px && share(agree, looked_at) >= search.share_min
    };
    // No more places agree than there are.
    if !is_enough(places.len()) {
        return None;
    }
    let rad_per_px = places.iter().map(|place| place.rad_per_px).sum::<f64>() / places.len() as f64;
    weights.clear();
    weights.extend(places.iter().map(|place| (rad_per_px / place.rad_per_px).powi(2) as f32));
    let threshold = search.threshold_px * rad_per_px;
    let options = RansacOptions { max_trials: 60, ..RansacOptions::with_threshold(threshold) };
    let problem = Direction::new(rows);
    let report = ransac(&problem, &options, weights, memory);
    let refined = report.model?;
    // The consensus set of a minimal sample is not that of the refit.
    weights.iter_mut().zip(places.iter()).for_each(|(w, p)| *w = (rad_per_px / p.rad_per_px).powi(2) as f32);
    let moments = rows.moments(refined.into(), Gate::Hard { threshold }, weights);
    let model = problem.fit_weighted(&moments)?;
    let rms = moments.rms(model.into());

    let agreeing = || places.iter().zip(weights.iter()).filter(|(_, weight)| **weight > 0.0);
    let support = agreeing().count();
    if !is_enough(support) {
        return None;
    }
    let (first, last) = (agreeing().next()?.0.along, agreeing().next_back()?.0.along);
    let chart = [search.vertex, along, search.normal];
    let normal = (chart[0] * model.x + chart[1] * model.y + chart[2] * model.z).try_normalize(1e-9)?;
    let agreeing_places = agreeing().map(|(place, weight)| (place.along, f64::from(*weight)));
    let in_chart = plane_covariance(search, stride_px, agreeing_places, [first, last], rms, rad_per_px)?;
    // The chart's plane is tangent at the expected normal, which is close to the fitted one.
    let basis = tangent_basis(&normal);
    let turn = basis.transpose() * nalgebra::Matrix3x2::from_columns(&[chart[0], chart[1]]);
    let toward = chart[0] * last[0] + chart[1] * last[1];
    let ray = FittedRay {
        normal,
        covariance: turn * in_chart * turn.transpose(),
        toward: (toward - normal * normal.dot(&toward)).try_normalize(1e-9)?,
        support: (support as f64 * stride_px).round() as usize,
        residual_rms_rad: rms,
    };
    let first_profiles = ((FIRST_PX / stride_px) as usize).min(looked_at);
    let first = agreeing().filter(|(place, _)| place.profile <= first_profiles).count();
    Some(TracedRay {
        ray,
        share: share(support, looked_at),
        first_share: share(first, first_profiles),
        px_per_rad: 1.0 / rad_per_px,
    })
}

/// Fills in where profiles along the ray cross an edge, and returns how many profiles there are.
fn edge_points(
    stride_px: f64,
    camera: &Camera,
    (search, along): (&RaySearch, &Vector3<f64>),
    signal: impl Fn(&Vector2<f64>, &Vector2<f64>, &mut [f64]) -> bool,
    places: &mut Vec<EdgePoint>,
) -> usize {
    places.clear();
    let half = (search.search_px.ceil() as usize + SHOULDER).min(PROFILE_MAX / 2);
    let mut profile = [0.0; PROFILE_MAX];
    let profile = &mut profile[..=2 * half];
    let window = SearchWindow::new(profile.len(), search.search_px);
    let (mut angle, mut looked_at) = (search.from_rad, 0_usize);
    let most = PROFILES_SHARE_MAX * (camera.width() + camera.height()) as usize;
    while angle <= search.to_rad && looked_at < most {
        let (sin, cos) = angle.sin_cos();
        let crossing = search.profile_along(camera, along, [cos, sin]);
        let Some(RayProfile { pixel, across, pace, px_per_rad }) = crossing else { break };
        angle += stride_px / pace;
        looked_at += 1;
        let inside = signal(&pixel, &across, profile);
        let found = if inside { edge_place(profile, &window, search.step_min) } else { None };
        let Some(EdgePlace { shift, step }) = found else { continue };
        let (shift_rad, rad_per_px) = (shift / px_per_rad, 1.0 / px_per_rad.abs());
        places.push(EdgePoint { profile: looked_at, along: [cos, sin], shift_rad, step, rad_per_px });
    }
    looked_at
}

/// The covariance of a ray's plane in the chart of the ray, from the cosines and sines of the angles and the weights of the
/// places that agree, those of the first and the last one, and the root mean square of their distances.
fn plane_covariance(
    search: &RaySearch,
    stride_px: f64,
    agreeing: impl Iterator<Item = ([f64; 2], f64)>,
    ends: [[f64; 2]; 2],
    rms: f64,
    rad_per_px: f64,
) -> Option<Matrix2<f64>> {
    let sigma = (rms * rms + (PLACE_SIGMA_MIN_PX * rad_per_px).powi(2)).sqrt();
    let mut information = Matrix2::zeros();
    for (along, weight) in agreeing {
        let at = Vector2::from(along);
        information += at * at.transpose() * weight;
    }
    information /= sigma * sigma * (search.erring_together / stride_px).max(1.0);
    let ends = ends.map(Vector2::from);
    let from_ends = Matrix2::from_rows(&[ends[0].transpose(), ends[1].transpose()]).try_inverse()?;
    let whole = from_ends * from_ends.transpose() * (search.ray_sigma_px * rad_per_px).powi(2);
    Some(information.try_inverse()? + whole)
}

/// Keeps the places whose steps are at least a share of the median of the first ones, up to the first gap.
fn keep_alike(places: &mut Vec<EdgePoint>, step_share_min: f64, first_px: f64, stride_px: f64, steps: &mut Vec<f64>) {
    steps.clear();
    steps.extend(places.iter().take(((first_px / stride_px) as usize).max(1)).map(|place| place.step));
    let middle = steps.len() / 2;
    let (_, median, _) = steps.select_nth_unstable_by(middle, f64::total_cmp);
    let median = *median;
    places.retain(|place| place.step * median >= step_share_min * median * median);
    if let Some(gap) =
        places.windows(2).position(|pair| (pair[1].profile - pair[0].profile) as f64 * stride_px > GAP_MAX_PX)
    {
        places.truncate(gap + 1);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::camera::{Model, Pinhole};

    /// Along an arc whose covariance is that of its places alone.
    const SEARCH: RaySearch = RaySearch {
        normal: Vector3::new(0.0, 0.0, 1.0),
        vertex: Vector3::new(1.0, 0.0, 0.0),
        from_rad: 0.0,
        to_rad: 0.2,
        search_px: 2.5,
        step_min: 1.0,
        step_share_min: 0.0,
        threshold_px: 0.7,
        share_min: 0.0,
        erring_together: 4.0,
        ray_sigma_px: 0.0,
    };

    #[test]
    fn a_ray_to_the_rim_of_a_pinhole_has_an_end() {
        let lens = Pinhole::new([300.0; 2], [319.5, 239.5], &[]).unwrap();
        let camera = Camera::new(640, 480, Model::Pinhole(lens)).unwrap();
        let search = RaySearch { normal: Vector3::y(), vertex: Vector3::z(), to_rad: 2.0, ..SEARCH };
        let looks = std::cell::Cell::new(0);
        let signal = |_: &Vector2<f64>, _: &Vector2<f64>, _: &mut [f64]| {
            looks.set(looks.get() + 1);
            assert!(looks.get() < 10_000);
            false
        };
        assert!(trace(&camera, &search, 20.0, signal, &mut TraceScratch::default()).is_none());
        assert!(looks.get() > 100);
    }

    /// Steps of the first ten profiles are 40; of the others one is too weak, one is of the other sign, and one comes after a gap.
    #[test]
    fn places_are_kept_while_their_steps_are_alike() {
        let place = |profile: usize, step: f64| EdgePoint {
            profile,
            along: [1.0, 0.0],
            shift_rad: 0.0,
            step,
            rad_per_px: 1e-3,
        };
        let mut places: Vec<EdgePoint> = (0..10).map(|profile| place(profile, -40.0)).collect();
        places.extend([place(10, -19.0), place(11, 40.0), place(12, -21.0), place(13, -400.0)]);
        let gap = (GAP_MAX_PX / 2.0).ceil() as usize + 1;
        places.push(place(13 + gap, -40.0));
        keep_alike(&mut places, 0.5, 20.0, 2.0, &mut Vec::new());
        let kept: Vec<usize> = places.iter().map(|place| place.profile).collect();
        assert_eq!(kept, [0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 12, 13]);
    }

    #[test]
    fn the_covariance_of_a_ray_is_that_of_its_places() {
        let rad_per_px = 1e-3;
        let at = |angle: f64| [angle.cos(), angle.sin()];
        let places = || (0..100).map(|k| (at(0.002 * f64::from(k)), 1.0));
        let covariance = |search: &RaySearch, stride_px: f64, rms: f64| {
            plane_covariance(search, stride_px, places(), [at(0.0), at(0.198)], rms, rad_per_px).unwrap()
        };
        // The regression of 100 places of which 4 err together, each with the scatter and the least standard deviation.
        let moments: Matrix2<f64> = places().map(|(at, _)| Vector2::from(at) * Vector2::from(at).transpose()).sum();
        let by_places = moments.try_inverse().unwrap() * 4.0;
        let variance = |rms: f64| rms * rms + (PLACE_SIGMA_MIN_PX * rad_per_px).powi(2);
        for rms in [0.0, 2e-4] {
            let off = covariance(&SEARCH, 1.0, rms) / variance(rms) - by_places;
            assert!(off.norm() < 1e-9 * by_places.norm(), "{off}");
        }
        // Places farther apart than profiles err together are independent of each other.
        let apart = covariance(&SEARCH, 8.0, 2e-4) * 4.0 / variance(2e-4) - by_places;
        assert!(apart.norm() < 1e-9 * by_places.norm());
        // Either end of the whole ray may be off.
        let whole = RaySearch { ray_sigma_px: 0.2, ..SEARCH };
        let more = covariance(&whole, 1.0, 0.0) - covariance(&SEARCH, 1.0, 0.0);
        for end in [at(0.0), at(0.198)].map(Vector2::from) {
            assert!((end.dot(&(more * end)) - (0.2 * rad_per_px).powi(2)).abs() < 1e-15);
        }
    }
}
