//! Which upright edges of a world are in sight from a place, in which direction, and how much of them.

use nalgebra::{Matrix3, Vector2, Vector3};
use tiltvp_core::camera::Camera;

use crate::encoders::wrapped;
use crate::lights::Lights;
use crate::texture::luminance;
use crate::view::RobotPose;
use crate::world::{Ray, World};

/// Upright segments that stand closer than this are one edge, metres: from 1 m away half a pixel of a fisheye of 140 pixels per
/// radian.
const SAME_M: f64 = 3e-3;

/// Spacing of the points at which an edge is looked for, metres: seven on the leg of a table.
const SPACING_M: f64 = 0.1;

/// How far beside an edge its contrast is measured, radians: a pixel of a fisheye of 140 pixels per radian.
const ASIDE_RAD: f64 = 6e-3;

/// An upright edge of a world, of a wall, an opening, a piece of furniture or a painted pattern; all that stands on one
/// vertical line is one edge.
#[derive(Debug, Clone, PartialEq)]
pub struct UprightEdge {
    /// Where it stands, metres.
    pub position: Vector2<f64>,
    /// The heights between which it is there, ascending and apart, metres.
    pub spans: Vec<[f64; 2]>,
}

/// An upright edge in sight.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct EdgeSighting {
    /// Number of the edge.
    pub edge: usize,
    /// Azimuth, seen from the camera's centre, in the frame of the upright robot: 0 is forward, positive to the left, radians.
    pub bearing_rad: f64,
    /// Elevations of the lowest and the highest point in sight, in the frame of the upright robot, radians.
    pub elevation_rad: [f64; 2],
    /// Share of the edge's height that is in the image with nothing before it.
    pub visible_share: f64,
    /// Mean over that of `|a - b| / (a + b)` of the luminances on both sides.
    pub contrast: f64,
}

/// The edges of a world: those of its geometry first, then those that are painted.
pub(crate) fn upright_edges(world: &World) -> Vec<UprightEdge> {
    let mut edges: Vec<UprightEdge> = Vec::new();
    for segment in world.vertical_edges().iter().chain(world.painted_edges()) {
        let (position, span) = (segment.bottom.xy(), [segment.bottom.z, segment.top.z]);
        match edges.iter_mut().find(|edge| (edge.position - position).norm_squared() < SAME_M * SAME_M) {
            Some(edge) => edge.spans.push(span),
            None => edges.push(UprightEdge { position, spans: vec![span] }),
        }
    }
    for edge in &mut edges {
        edge.spans.sort_by(|a, b| a[0].total_cmp(&b[0]));
        let mut joined: Vec<[f64; 2]> = Vec::new();
        for span in &edge.spans {
            match joined.last_mut() {
                Some(last) if span[0] <= last[1] + SAME_M => last[1] = last[1].max(span[1]),
                _ => joined.push(*span),
            }
        }
        edge.spans = joined;
    }
    edges
}

/// From where, and with which camera and light, edges are looked for.
pub(crate) struct Lookout<'a> {
    pub(crate) world: &'a World,
    pub(crate) camera: &'a Camera,
    pub(crate) blind_rad: f64,
    pub(crate) pose: RobotPose,
    pub(crate) center: Vector3<f64>,
    pub(crate) camera_from_world: Matrix3<f64>,
    pub(crate) lights: &'a Lights<'a>,
}

impl Lookout<'_> {
    /// What is in sight of an edge, if anything is.
    pub(crate) fn sight(&self, number: usize, edge: &UprightEdge) -> Option<EdgeSighting> {
        let ground = edge.position - self.center.xy();
        let distance = ground.norm();
        if distance < 1e-3 {
            return None;
        }
        let (mut seen, mut all, mut contrast) = (0.0, 0.0, 0.0);
        let (mut lowest, mut highest) = (f64::INFINITY, f64::NEG_INFINITY);
        for [low, high] in &edge.spans {
            let count = ((high - low) / SPACING_M).ceil().clamp(3.0, 40.0) as usize;
            let step = (high - low) / count as f64;
            all += high - low;
            for k in 0..count {
                let rise = low + (k as f64 + 0.5) * step - self.center.z;
                let ray = Vector3::new(ground.x, ground.y, rise);
                if !self.is_in_image(&ray) || self.is_hidden(&ray) {
                    continue;
                }
                seen += step;
                contrast += step * self.contrast(&ray);
                lowest = lowest.min(rise - 0.5 * step);
                highest = highest.max(rise + 0.5 * step);
            }
        }
        (seen > 0.0).then(|| EdgeSighting {
            edge: number,
            bearing_rad: wrapped(ground.y.atan2(ground.x) - self.pose.yaw_rad),
            elevation_rad: [lowest.atan2(distance), highest.atan2(distance)],
            visible_share: (seen / all).min(1.0),
            contrast: contrast / seen,
        })
    }

    fn is_in_image(&self, ray: &Vector3<f64>) -> bool {
        let bearing = self.camera_from_world * ray;
        let is_blind = bearing.xy().norm().atan2(bearing.z.abs()) < self.blind_rad;
        !is_blind && self.camera.project(&bearing).is_some_and(|pixel| self.camera.contains(&pixel))
    }

    /// Whether something stands before the end of a ray.
    fn is_hidden(&self, ray: &Vector3<f64>) -> bool {
        let length = ray.norm();
        !self.world.scene().is_clear(&self.center, &(ray / length), length - 2e-3 - 5e-4 * length)
    }

    fn contrast(&self, ray: &Vector3<f64>) -> f64 {
        let (s, c) = ASIDE_RAD.sin_cos();
        let [left, right] = [s, -s].map(|s| {
            let direction = Vector3::new(c * ray.x - s * ray.y, s * ray.x + c * ray.y, ray.z).normalize();
            let contact = self.world.scene().cast(&self.center, &direction, 1e3);
            let ray = Ray { origin: &self.center, direction: &direction, spread: ASIDE_RAD };
            luminance(self.world.seen(&ray, contact, self.lights, || None))
        });
        (left - right).abs() / (left + right).max(1e-9)
    }
}
