//! Which edges of a corner begin at its vertex, and which end before it and only point there.

use nalgebra::Vector3;

use super::{CLEAR_OF_VERTEX_PX, gray_search};
use crate::camera::Camera;
use crate::corner::feature::CornerFeature;
use crate::corner::options::GeneralOptions;
use crate::corner::trace::{RayProfile, RaySearch};
use crate::geometry::tangent_basis;
use crate::image::{ImageView, LightTable};

/// Where an edge is looked at next to its vertex, in pixels: beyond the blur of the vertex and within what no ray is
/// fitted to, as that shows where an edge begins.
const NEXT_PX: [f64; 4] = [2.0, 2.5, 3.0, 3.5];

/// Where the same edge is looked at farther on, in pixels: from twice the reach of what mixes at the vertex, over as
/// many pixels as make a short edge.
const ON_PX: [f64; 12] = [8.0, 9.0, 10.0, 11.0, 12.0, 13.0, 14.0, 15.0, 16.0, 17.0, 18.0, 19.0];

/// Pixels from sample to sample across an edge: the outer two of either side are half and one pixel away from it, nearer than
/// another edge that is a ray's least angle apart.
const ACROSS_PX: f64 = 0.5;

/// The share of an edge's step that is left next to the vertex where it begins there. Where an edge has ended some pixels
/// away there is none. On rooms that were looked at, edges of corners that are there have 0.5 and more, those of drawers'
/// fronts and their case 0.3 and less.
const STEP_SHARE: f64 = 0.4;

/// How many times as strong the step across an edge may be in one image as in the other. On rooms that were looked at, edges of
/// corners that are there mostly have up to 2.5, but for outlines before another background; of each wrong match at most one edge
/// of three has less than 3.
const ALIKE: f64 = 3.0;

/// How far aside edges are that do not begin at a vertex, as a share of [`GeneralOptions::residual_max_px`], which is the farthest at
/// which lines count as meeting: the standard deviation of what is within it is about half. With all of it a real box turns 0.52
/// instead of 0.39 degrees from frame to frame.
const ASIDE_SHARE: f64 = 0.5;

/// The edges of a corner next to its vertex, in one image.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Beginnings {
    /// For each ray that begins at the vertex the step of light across it farther on, positive where it is lighter on the side of
    /// the ray's normal.
    steps: [Option<f64>; 3],
    /// How far aside the edge may be of which a ray does not begin there, as a standard deviation, radians.
    aside_rad: f64,
}

impl Beginnings {
    /// Of rays that are followed from their vertex.
    pub(crate) const ALL: Self = Self { steps: [Some(1.0); 3], aside_rad: 0.0 };

    /// How many rays begin at the vertex.
    pub(crate) fn count(&self) -> usize {
        self.steps.iter().flatten().count()
    }

    /// Which edges begin at the vertex in both images, each the same edge by its step.
    pub(crate) fn shared(&self, other: &Self) -> [bool; 3] {
        let alike = |(a, b): (f64, f64)| (ALIKE.recip()..=ALIKE).contains(&(a / b));
        [0, 1, 2].map(|axis| self.steps[axis].zip(other.steps[axis]).is_some_and(alike))
    }

    /// The corner with those of its rays that are not `held` to its vertex as uncertain sideways as edges of something beside it.
    pub(crate) fn loosened(&self, corner: &CornerFeature, held: [bool; 3]) -> Option<CornerFeature> {
        if held == [true; 3] {
            return Some(*corner);
        }
        let vertex = corner.vertex();
        let mut rays = *corner.rays();
        for (ray, _) in rays.iter_mut().zip(held).filter(|(_, held)| !held) {
            let aside = tangent_basis(&ray.normal).transpose() * vertex * self.aside_rad;
            ray.covariance += aside * aside.transpose();
        }
        CornerFeature::from_rays(rays)
    }
}

/// Which rays of a corner begin at its vertex.
pub(crate) fn beginnings(
    camera: &Camera,
    image: &ImageView<'_>,
    light: &LightTable,
    options: &GeneralOptions,
    corner: &CornerFeature,
) -> Beginnings {
    let vertex = corner.vertex();
    let Some(px_per_rad) = camera.px_per_rad(&vertex) else {
        return Beginnings { steps: [None; 3], ..Beginnings::ALL };
    };
    let begins = |normal: &Vector3<f64>| {
        let on_circle = (vertex - normal * normal.dot(&vertex)).try_normalize(0.5)?;
        let search = gray_search(options, *normal, on_circle, [CLEAR_OF_VERTEX_PX / px_per_rad, 0.0]);
        let step = |away_px: f64| step_across(camera, image, light, &search, away_px / px_per_rad);
        let mut on = [0.0; ON_PX.len()];
        for (on, away_px) in on.iter_mut().zip(ON_PX) {
            *on = step(away_px)?;
        }
        let usual = *on.select_nth_unstable_by(ON_PX.len() / 2, f64::total_cmp).1;
        let next = NEXT_PX.iter().map(|away_px| step(*away_px)).sum::<Option<f64>>()? / NEXT_PX.len() as f64;
        // Of the same sign too.
        (usual.abs() >= options.step_min && next / usual > STEP_SHARE).then_some(usual)
    };
    Beginnings {
        steps: corner.rays().map(|ray| begins(&ray.normal)),
        aside_rad: ASIDE_SHARE * options.residual_max_px / px_per_rad,
    }
}

/// The step of light across a ray at an angle from its vertex; none outside the image.
fn step_across(
    camera: &Camera,
    image: &ImageView<'_>,
    light: &LightTable,
    search: &RaySearch,
    angle_rad: f64,
) -> Option<f64> {
    let RayProfile { pixel, across, .. } = search.profile(camera, angle_rad)?;
    let mut samples = [0.0; 5];
    let inside = light.gray_profile(image, &pixel, &(across * ACROSS_PX), &mut samples);
    inside.then(|| 0.5 * (samples[4] + samples[3] - samples[1] - samples[0]))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::camera::{Model, Pinhole};
    use crate::corner::ray::FittedRay;
    use nalgebra::{Matrix2, Vector2};

    fn camera(width: u32, height: u32, focal_px: f64, centre_px: [f64; 2]) -> Camera {
        Camera::new(width, height, Model::Pinhole(Pinhole::new([focal_px; 2], centre_px, &[]).unwrap())).unwrap()
    }

    /// Where the three edges meet, pixels: between pixel centres, so that nothing hangs on those.
    const AT: Vector2<f64> = Vector2::new(80.3, 59.6);

    /// The ways of the edges in the image, degrees from its rows downwards: as of a box seen from above.
    const WAYS_DEG: [f64; 3] = [-25.0, 90.0, 205.0];

    /// How many of the three rays are said to begin at the vertex, in an image whose level is that of the sector between two
    /// edges, by `level(sector, pixels from the vertex)`, as the mean over each pixel.
    fn begin(level: impl Fn(usize, f64) -> f64) -> usize {
        let (wide, high) = (160, 120);
        let camera = camera(wide, high, 200.0, [79.5, 59.5]);
        let mean = |u: u32, v: u32| {
            let part = |k: u32| (f64::from(k) + 0.5) / 4.0 - 0.5;
            let inside = (0..16).map(|k| {
                let off = Vector2::new(f64::from(u) + part(k % 4), f64::from(v) + part(k / 4)) - AT;
                let turn = (off.y.atan2(off.x).to_degrees() - WAYS_DEG[0]).rem_euclid(360.0);
                level(WAYS_DEG.iter().rposition(|way| turn >= way - WAYS_DEG[0]).unwrap_or(0), off.norm())
            });
            (inside.sum::<f64>() / 16.0).round() as u8
        };
        let data: Vec<u8> = (0..wide * high).map(|i| mean(i % wide, i / wide)).collect();
        let image = ImageView::new(&data, wide as usize, high as usize, wide as usize).unwrap();
        let bearing = |pixel: Vector2<f64>| camera.unproject(&pixel).unwrap();
        let on = WAYS_DEG.map(|way| bearing(AT + 30.0 * Vector2::new(way.to_radians().cos(), way.to_radians().sin())));
        let corner = CornerFeature::from_bearings(&bearing(AT), &on).unwrap();
        let options = GeneralOptions::default();
        beginnings(&camera, &image, &LightTable::new(2.2).unwrap(), &options, &corner).count()
    }

    #[test]
    fn edges_that_end_before_a_vertex_do_not_begin_there() {
        let levels = [60.0, 150.0, 230.0];
        // Lighter or darker, weak or strong.
        for levels in [levels, levels.map(|level| 255.0 - level), [100.0, 112.0, 124.0]] {
            assert_eq!(begin(|sector, _| levels[sector]), 3, "{levels:?}");
            // One of the edges begins eight pixels away, as the side of a board does behind its front; then all of them do.
            for ended in 0..3 {
                let near = |sector: usize| if sector == ended { levels[(ended + 2) % 3] } else { levels[sector] };
                let seen = begin(|sector, away_px| if away_px < 8.0 { near(sector) } else { levels[sector] });
                assert!(seen < 3, "{seen} of {levels:?}, {ended}");
            }
            assert_eq!(begin(|sector, away_px| if away_px < 8.0 { 200.0 } else { levels[sector] }), 0, "{levels:?}");
        }
    }

    #[test]
    fn an_edge_is_shared_that_both_images_show_alike() {
        let seen =
            |steps: [f64; 3]| Beginnings { steps: steps.map(|step| (step != 0.0).then_some(step)), ..Beginnings::ALL };
        let own = seen([20.0, -30.0, 5.0]);
        assert_eq!((own.count(), own.shared(&own)), (3, [true; 3]));
        // Twice as strong; the other way round; seven times as strong; not there.
        assert_eq!(own.shared(&seen([40.0, -60.0, 5.0])), [true; 3]);
        assert_eq!(own.shared(&seen([20.0, 30.0, 5.0])), [true, false, true]);
        assert_eq!(own.shared(&seen([20.0, -30.0, 35.0])), [true, true, false]);
        assert_eq!(own.shared(&seen([0.0, -30.0, 5.0])), [false, true, true]);
    }

    #[test]
    fn an_edge_that_does_not_begin_at_a_vertex_hardly_moves_it() {
        let vertex = Vector3::new(0.1, -0.05, 1.0).normalize();
        let toward = [Vector3::x(), Vector3::y(), Vector3::new(-0.5, -0.4, 0.1)].map(|way| vertex + 0.2 * way);
        let exact = CornerFeature::from_bearings(&vertex, &toward).unwrap();
        // The third edge is that of a thing one milliradian aside, which is five times what each is known to.
        let rays = [0, 1, 2].map(|axis| {
            let ray = exact.rays()[axis];
            let normal = if axis == 2 { (ray.normal + 0.001 * vertex).normalize() } else { ray.normal };
            FittedRay { normal, covariance: Matrix2::identity() * 4e-8, support: 50, ..ray }
        });
        let pulled = CornerFeature::from_rays(rays).unwrap();
        let ends = Beginnings { steps: [Some(1.0), Some(1.0), None], aside_rad: 0.005 };
        let loose = ends.loosened(&pulled, [true, true, false]).unwrap();
        assert!(pulled.vertex().angle(&vertex) > 3e-4 && loose.vertex().angle(&vertex) < 1e-5);
        // The way it runs is known as before.
        let along = |corner: &CornerFeature| {
            let ray = corner.rays()[2];
            let across = ray.normal.cross(&pulled.vertex());
            across.dot(&(ray.covariance_3d() * across))
        };
        assert!((along(&loose) / along(&pulled) - 1.0).abs() < 1e-3);
        assert_eq!(ends.loosened(&pulled, [true; 3]).unwrap(), pulled);
    }

    #[test]
    fn another_edge_in_the_same_line_is_not_the_one_that_begins() {
        let levels = [60.0, 150.0, 230.0];
        // What is light on an edge's one side farther on is dark there next to the vertex.
        let turned = |sector: usize| 255.0 - levels[sector];
        assert_eq!(begin(|sector, away_px| if away_px < 6.0 { turned(sector) } else { levels[sector] }), 0);
        // A step that fades towards the vertex is still there at half of its height, and not at a fifth.
        let faded = |share: f64| move |sector: usize| 150.0 + share * (levels[sector] - 150.0);
        for (share, count) in [(0.6, 3), (0.2, 0)] {
            let near = faded(share);
            assert_eq!(begin(|sector, away_px| if away_px < 6.0 { near(sector) } else { levels[sector] }), count);
        }
    }

    #[test]
    fn an_edge_at_the_border_of_the_image_is_not_known_to_begin() {
        let light = LightTable::new(2.2).unwrap();
        let camera = camera(40, 40, 50.0, [20.0; 2]);
        let data: Vec<u8> = (0..1600).map(|i| if i % 40 < 20 { 50 } else { 200 }).collect();
        let image = ImageView::new(&data, 40, 40, 40).unwrap();
        let bearing = |u: f64, v: f64| camera.unproject(&Vector2::new(u, v)).unwrap();
        let count = |v: f64, to: f64| {
            let toward = [bearing(19.5, v + to), bearing(30.0, v), bearing(5.0, v + 1.0)];
            let corner = CornerFeature::from_bearings(&bearing(19.5, v), &toward).unwrap();
            beginnings(&camera, &image, &light, &GeneralOptions::default(), &corner).count()
        };
        // Along the image's one edge, towards its middle and out of it; the other two rays have no step across them.
        assert_eq!([count(10.0, 5.0), count(30.0, 5.0)], [1, 0]);
    }
}
