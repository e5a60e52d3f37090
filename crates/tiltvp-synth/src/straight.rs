//! The straight edges of a world as a camera sees them: sides of its flat surfaces, and the upright edges painted on walls.

use nalgebra::{Matrix3, Vector3};
use tiltvp_core::Result;
use tiltvp_core::camera::Camera;

use crate::lights::Lights;
use crate::texture::luminance;
use crate::view::View;
use crate::world::{Ray, World};

/// Spacing of the rays along an edge, radians: a quarter of a pixel of a fisheye of 140 pixels per radian.
const SPACING_RAD: f64 = 2e-3;

/// How far beside an edge its contrast is measured, radians: most of a pixel of that fisheye.
const ASIDE_RAD: f64 = 6e-3;

/// Arcs are one edge where one is within so much of the other, radians: half a pixel of that fisheye.
const SAME_RAD: f64 = 3.5e-3;

/// The part of a straight edge that a camera sees without a break.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct StraightEdge {
    /// Unit bearings of its ends in the camera frame.
    pub ends: [Vector3<f64>; 2],
    /// Mean over it of `|a - b| / (a + b)` of the luminances on both sides.
    pub contrast: f64,
}

impl StraightEdge {
    fn length_rad(&self) -> f64 {
        self.ends[0].angle(&self.ends[1])
    }

    /// Whether it lies on another one.
    fn is_part_of(&self, other: &Self) -> bool {
        let normal = other.ends[0].cross(&other.ends[1]).normalize();
        self.ends.iter().all(|end| {
            let beyond = |from: &Vector3<f64>, towards: f64| towards * normal.cross(from).dot(end) > -SAME_RAD;
            normal.dot(end).abs() < SAME_RAD && beyond(&other.ends[0], 1.0) && beyond(&other.ends[1], -1.0)
        })
    }
}

impl World {
    /// The straight edges that a camera sees, the longest first: those with nothing before them, inside the image, and of at
    /// least so much contrast.
    ///
    /// # Errors
    /// If the view is outside its domain, or the camera is outside the room.
    pub fn straight_edges(&self, camera: &Camera, view: &View<'_>, contrast_min: f64) -> Result<Vec<StraightEdge>> {
        let eye = Eye {
            world: self,
            camera,
            center: self.center_of(view)?,
            camera_from_world: view.world_from_camera().transpose(),
        };
        let mut found = Vec::new();
        let scene = self.scene();
        for piece in &scene.pieces {
            let patch = &scene.patches[piece.patch];
            let at = |s: f64, t: f64| patch.origin + patch.du * s + patch.dv * t;
            let ([s0, t0], [s1, t1]) = (piece.low, piece.high);
            let (o, u, v) = (at(s0, t0), at(s1, t0), at(s0, t1));
            if patch.triangle {
                for (a, b) in [(o, u), (u, v), (v, o)] {
                    eye.see(&a, &b, contrast_min, &mut found);
                }
            } else {
                let w = at(s1, t1);
                for (a, b) in [(o, u), (u, w), (w, v), (v, o)] {
                    eye.see(&a, &b, contrast_min, &mut found);
                }
            }
        }
        for segment in self.painted_edges() {
            eye.see(&segment.bottom, &segment.top, contrast_min, &mut found);
        }
        found.sort_by(|a, b| b.length_rad().total_cmp(&a.length_rad()));
        let mut kept: Vec<StraightEdge> = Vec::new();
        for edge in found {
            if !kept.iter().any(|longer| edge.is_part_of(longer)) {
                kept.push(edge);
            }
        }
        Ok(kept)
    }
}

struct Eye<'a> {
    world: &'a World,
    camera: &'a Camera,
    center: Vector3<f64>,
    camera_from_world: Matrix3<f64>,
}

impl Eye<'_> {
    /// Adds what is in sight of the edge between two points.
    fn see(&self, from: &Vector3<f64>, to: &Vector3<f64>, contrast_min: f64, out: &mut Vec<StraightEdge>) {
        let (a, b) = (from - self.center, to - self.center);
        let normal = a.cross(&b);
        let Some(normal) = normal.try_normalize(1e-9) else { return };
        let first = a.normalize();
        let (along, angle) = (normal.cross(&first), a.angle(&b));
        let count = (angle / SPACING_RAD).ceil() as usize;
        if count < 2 {
            return;
        }
        let mut run: Vec<(Vector3<f64>, f64)> = Vec::new();
        for k in 0..=count {
            let phi = angle * k as f64 / count as f64;
            let direction = first * phi.cos() + along * phi.sin();
            // By the law of sines.
            let (near, far) = (a.norm() * phi.sin(), b.norm() * (angle - phi).sin());
            let length = (a + (b - a) * (near / (near + far).max(1e-12))).norm();
            let contrast = self.contrast(&direction, &normal, length).filter(|contrast| *contrast >= contrast_min);
            if let Some(contrast) = contrast {
                run.push((self.camera_from_world * direction, contrast));
            }
            if contrast.is_none() || k == count {
                if let [(start, _), .., (end, _)] = run[..] {
                    let mean = run.iter().map(|(_, contrast)| contrast).sum::<f64>() / run.len() as f64;
                    out.push(StraightEdge { ends: [start, end], contrast: mean });
                }
                run.clear();
            }
        }
    }

    /// The contrast across a point, if it is in sight.
    fn contrast(&self, direction: &Vector3<f64>, normal: &Vector3<f64>, length: f64) -> Option<f64> {
        let pixel = self.camera.project(&(self.camera_from_world * direction))?;
        if !self.camera.contains(&pixel)
            || !self.world.scene().is_clear(&self.center, direction, length - 2e-3 - 5e-4 * length)
        {
            return None;
        }
        let [a, b] = [ASIDE_RAD, -ASIDE_RAD].map(|aside| {
            let direction = (direction + normal * aside).normalize();
            let contact = self.world.scene().cast(&self.center, &direction, 1e3);
            let ray = Ray { origin: &self.center, direction: &direction, spread: ASIDE_RAD };
            luminance(self.world.seen(&ray, contact, &Lights::STEADY, || None))
        });
        Some((a - b).abs() / (a + b).max(1e-9))
    }
}
