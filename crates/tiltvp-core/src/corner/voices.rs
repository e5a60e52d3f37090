//! What the other corners of a frame say to a pose: whether their rays run along the same axes.

use nalgebra::{Matrix3, Vector3};

use super::consensus::weight;
use super::estimate::Hypothesis;
use super::vertex::CornerFeature;
use crate::geometry::RigidMotion;

/// How far a corner's rays may be from the axes to count half: 1 degree.
const HALF_SINE: f64 = 0.0175;

/// What is left of a pose that no other corner agrees with.
const ALONE: f64 = 1.0;

/// Corners whose bearings are closer than this share a vertex, and say nothing new.
const SAME_VERTEX_RAD: f64 = 0.01;

/// One corner's voice.
struct Voice {
    side: usize,
    vertex: Vector3<f64>,
    /// Normals of its rays, left camera's frame.
    normals: [Vector3<f64>; 3],
    weight: f64,
}

/// The corners of both images.
pub(super) struct Voices {
    voices: Vec<Voice>,
    right_from_left: RigidMotion,
}

impl Voices {
    pub(super) fn new(features: &[Vec<CornerFeature>; 2], left_from_right: &RigidMotion) -> Self {
        let of = |side: usize, rotation: Matrix3<f64>| {
            features[side].iter().map(move |corner| Voice {
                side,
                vertex: corner.vertex(),
                normals: corner.rays().map(|ray| rotation * ray.normal),
                weight: weight(corner),
            })
        };
        let voices = of(0, Matrix3::identity()).chain(of(1, left_from_right.rotation)).collect();
        Self { voices, right_from_left: left_from_right.inverse() }
    }

    /// The share of the other corners, by what they say, whose rays run along the axes of a pose; and 1 for none of them.
    pub(super) fn agreeing(&self, pose: &Hypothesis) -> f64 {
        let Some(vertex_m) = pose.vertex_m else { return 1.0 };
        let own = [vertex_m, self.right_from_left.point(&vertex_m)];
        let (mut agreeing, mut all) = (0.0, 0.0);
        for voice in self.voices.iter().filter(|voice| voice.vertex.angle(&own[voice.side]) > SAME_VERTEX_RAD) {
            let off = |normal: &Vector3<f64>| pose.camera_from_object.tr_mul(normal).abs().min();
            let most = voice.normals.iter().map(off).fold(0.0, f64::max);
            agreeing += voice.weight / (1.0 + (most / HALF_SINE).powi(2));
            all += voice.weight;
        }
        ALONE + if all > 0.0 { agreeing / all } else { 1.0 }
    }
}
