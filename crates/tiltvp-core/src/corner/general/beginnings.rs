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
