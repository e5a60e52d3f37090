//! L-junctions: corners of which two edges begin where they cross, and the third is not seen.

use nalgebra::{Matrix2, Vector3};

use super::GeneralScratch;
use super::completion::{CornerCompletion, clockwise};
use crate::corner::feature::CornerFeature;
use crate::corner::ray::FittedRay;

/// The standard deviation of where an edge is that is not seen, radians: 11 degrees, which tells next to nothing and leaves no
/// direction of a pose open.
const UNSEEN_SIGMA_RAD: f64 = 0.2;

impl CornerCompletion<'_> {
    /// Adds the L-junctions of the image that was looked at last to `out`, each with a third ray of no support. That edge runs away from
    /// the camera, behind the face that the other two bound: one towards the camera would be seen.
    pub(crate) fn l_junctions(&self, scratch: &mut GeneralScratch, out: &mut Vec<CornerFeature>) {
        let GeneralScratch { segments, trace: memory, .. } = scratch;
        for crossing in &self.crossings(&segments.list) {
            let Some(px_per_rad) = self.camera.px_per_rad(&crossing.place) else { continue };
            let Some(seen) = self.own_edges(crossing, px_per_rad, &segments.list, memory) else { continue };
            let mut rays = seen.map(|traced| traced.map(|traced| traced.ray));
            rays[crossing.third()] = self.unseen(crossing.third(), &crossing.place);
            let [Some(x), Some(y), Some(z)] = rays else { continue };
            out.extend(clockwise(&[x, y, z]).filter(|corner| corner.rays_apart(self.options.ray_angle_min_rad)));
        }
    }

    /// The ray of an edge along an axis, away from the camera; none along the line of sight.
    fn unseen(&self, axis: usize, vertex: &Vector3<f64>) -> Option<FittedRay> {
        let along = self.camera_from_object.column(axis).into_owned();
        let toward = vertex + along * along.dot(vertex).signum();
        Some(FittedRay {
            normal: vertex.cross(&toward).try_normalize(0.05)?,
            covariance: Matrix2::from_diagonal_element(UNSEEN_SIGMA_RAD * UNSEEN_SIGMA_RAD),
            toward: toward.normalize(),
            support: 0,
            residual_rms_rad: 0.0,
        })
    }
}
