//! Which edges of a corner begin at its vertex, and which end before it and only point there.

use nalgebra::Vector3;

use super::{CLEAR_OF_VERTEX_PX, gray_search};
use crate::camera::Camera;
use crate::corner::feature::CornerFeature;
use crate::corner::options::GeneralOptions;
use crate::corner::trace::{RayProfile, RaySearch};
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

/// How many rays of a corner begin at its vertex.
pub(crate) fn begin_at_vertex(
    camera: &Camera,
    image: &ImageView<'_>,
    light: &LightTable,
    options: &GeneralOptions,
    corner: &CornerFeature,
) -> usize {
    let vertex = corner.vertex();
    let Some((_, jacobian)) = camera.project_jacobian(&vertex) else { return 0 };
    let px_per_rad = jacobian.norm() / 2f64.sqrt();
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
        Some(next * usual > STEP_SHARE * usual * usual)
    };
    corner.rays().iter().filter(|ray| begins(&ray.normal) == Some(true)).count()
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
    use nalgebra::Vector2;

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
        begin_at_vertex(&camera, &image, &LightTable::new(2.2).unwrap(), &options, &corner)
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
            begin_at_vertex(&camera, &image, &light, &GeneralOptions::default(), &corner)
        };
        // Along the image's one edge, towards its middle and out of it; the other two rays have no step across them.
        assert_eq!([count(10.0, 5.0), count(30.0, 5.0)], [1, 0]);
    }
}
