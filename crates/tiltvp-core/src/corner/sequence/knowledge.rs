//! What an inertial sensor and the frames before say of the attitude in a frame.

use nalgebra::{Matrix3, Matrix6, Vector3};

use super::estimator::CornerPoseEstimator;
use super::frame_knowledge::{CameraTurn, GravityDirection, UNTOLD_RAD};
use super::track::Track;
use crate::corner::closed_form::prior::AttitudePrior;
use crate::corner::estimate::Hypothesis;
use crate::corner::feature::CornerFeature;
use crate::filter::symmetric;
use crate::geometry::tangent_basis;

impl Track {
    /// Goes on to a frame: everything is turned as the camera has been; without its turn, it may have turned by any.
    pub(super) fn go_on(&mut self, turn: Option<&CameraTurn>, right_from_left: &Matrix3<f64>) {
        self.age += 1;
        let (Some(turn), Some(before)) = (turn, self.turned) else {
            self.turned = None;
            return;
        };
        let now = turn.before_from_now.transpose();
        self.turned = Some(symmetric(&(now * before * now.transpose() + turn.covariance)));
        let pose = &mut self.pose;
        pose.camera_from_object = now * pose.camera_from_object;
        pose.edges = pose.edges.map(|edge| now * edge);
        pose.vertex_m = pose.vertex_m.map(|vertex| now * vertex);
        let mut both = Matrix6::zeros();
        both.fixed_view_mut::<3, 3>(0, 0).copy_from(&now);
        both.fixed_view_mut::<3, 3>(3, 3).copy_from(&now);
        pose.covariance = symmetric(&(both * pose.covariance * both.transpose()));
        for (corners, own) in self.corners.iter_mut().zip([Matrix3::identity(), *right_from_left]) {
            let now = own * now * own.transpose();
            for corner in corners {
                *corner = turned(corner, &now).unwrap_or(*corner);
            }
        }
    }
}

/// A corner as the camera sees it after a turn.
fn turned(corner: &CornerFeature, now_from_before: &Matrix3<f64>) -> Option<CornerFeature> {
    let rays = corner.rays().map(|mut ray| {
        let normal = now_from_before * ray.normal;
        let carried = tangent_basis(&normal).transpose() * now_from_before * tangent_basis(&ray.normal);
        ray.covariance = symmetric(&(carried * ray.covariance * carried.transpose()));
        (ray.normal, ray.toward) = (normal, now_from_before * ray.toward);
        ray
    });
    CornerFeature::from_rays(rays)
}

impl CornerPoseEstimator {
    /// The direction of the vertical in the left camera's frame: of this frame, from the last pose, or from before.
    pub(super) fn vertical(&self) -> Option<Vector3<f64>> {
        let last = self.track.as_ref().map(|track| track.pose.camera_from_object.column(1).into_owned());
        self.known.gravity.map(|gravity| gravity.down).or(last).or(self.options.down)
    }

    /// Which way is down in the left camera's frame, where it was told: in this frame, in one before, or before all. A pose alone
    /// does not tell which of its edges is upright.
    pub(super) fn told_down(&self) -> Option<Vector3<f64>> {
        let last = self.track.as_ref().map(|track| {
            let axis = track.pose.camera_from_object.column(1).into_owned();
            track.y_is_down.map(|is_down| if is_down { axis } else { -axis })
        });
        self.known.gravity.map(|gravity| gravity.down).or_else(|| last.unwrap_or(self.options.down))
    }

    /// Whether gravity, where this frame has it, bears a pose out. A corner without colours has an upright edge; the coloured
    /// cuboid may be held aslant.
    pub(super) fn is_upright(&self, pose: &Hypothesis) -> bool {
        self.is_one_object()
            || self
                .known
                .gravity
                .is_none_or(|gravity| gravity.is_along(&pose.camera_from_object, &pose.attitude_covariance()))
    }

    /// Covariance of the attitude of a track as it is known at this frame, before its images.
    fn attitude_covariance(&self, track: &Track) -> Matrix3<f64> {
        let Some(turned) = track.turned else {
            let sigma_rad = self.options.turn_sigma_rad * f64::from(track.age).sqrt();
            return Matrix3::from_diagonal_element(sigma_rad * sigma_rad);
        };
        let own = track.pose.covariance.fixed_view::<3, 3>(0, 0);
        turned + own + Matrix3::from_diagonal_element(UNTOLD_RAD * UNTOLD_RAD)
    }

    pub(super) fn priors(&self, same_object: bool) -> Vec<AttitudePrior> {
        let mut priors: Vec<AttitudePrior> = self.known.gravity.iter().map(GravityDirection::prior).collect();
        let Some(track) = &self.track else {
            if let (Some(down), true) = (self.options.down, priors.is_empty()) {
                priors.push(GravityDirection { down, sigma_rad: self.options.down_sigma_rad }.prior());
            }
            return priors;
        };
        let (rotation, covariance) = (track.pose.camera_from_object, self.attitude_covariance(track));
        priors.push(if same_object {
            AttitudePrior::Attitude { camera_from_object: rotation, covariance }
        } else {
            // The heading says nothing of a direction: half of what the other two turns say.
            let down = rotation.column(1).into_owned();
            let sigma_rad = (0.5 * (covariance.trace() - down.dot(&(covariance * down)))).sqrt();
            GravityDirection { down, sigma_rad }.prior()
        });
        priors
    }

    /// How far the attitude of a corner may be from that of the track, radians, as a standard deviation: corners agree within
    /// [`agree_max_rad`](crate::corner::EstimatorOptions).
    pub(super) fn turn_sigma_rad(&self, track: &Track) -> f64 {
        match track.turned {
            Some(_) => (self.attitude_covariance(track).trace() / 3.0 + self.options.agree_max_rad.powi(2)).sqrt(),
            None => self.options.turn_sigma_rad,
        }
    }
}

#[cfg(test)]
#[allow(clippy::unwrap_used)]
mod tests {
    use super::*;
    use nalgebra::Rotation3;

    fn track(rotation: &Matrix3<f64>) -> Track {
        let vertex = Vector3::new(0.1, 0.0, 2.0);
        let toward = [0, 1, 2].map(|axis| vertex + 0.3 * rotation.column(axis).into_owned());
        let corner = CornerFeature::from_bearings(&vertex, &toward).unwrap();
        let pose = Hypothesis {
            camera_from_object: *rotation,
            edges: [0, 1, 2].map(|axis| rotation.column(axis).into_owned()),
            vertex_m: Some(vertex),
            covariance: Matrix6::from_diagonal_element(1e-6),
            probability: 1.0,
            right_handed: true,
            misfit: 0.0,
        };
        Track::next(None, &pose, [vec![corner], vec![corner]], 1, &[])
    }

    #[test]
    fn a_track_turns_with_the_camera() {
        let rotation = *Rotation3::from_euler_angles(0.4, 0.5, 0.1).matrix();
        let turn = Rotation3::new(Vector3::new(0.02, -0.3, 0.1)).into_inner();
        let gyro = CameraTurn { before_from_now: turn, covariance: Matrix3::identity() * 1e-4 };
        let mut gone = track(&rotation);
        gone.go_on(Some(&gyro), &Matrix3::identity());
        gone.go_on(Some(&gyro), &Matrix3::identity());
        let now = (turn * turn).transpose();
        assert!((gone.pose.camera_from_object - now * rotation).norm() < 1e-12);
        assert!((gone.pose.vertex_m.unwrap() - now * Vector3::new(0.1, 0.0, 2.0)).norm() < 1e-12);
        let seen = gone.corners[1][0].vertex();
        assert!((seen - now * Vector3::new(0.1, 0.0, 2.0).normalize()).norm() < 1e-9, "{seen}");
        assert!((gone.turned.unwrap() - Matrix3::identity() * 2e-4).norm() < 1e-15);
        // Of one frame the turn is not known: by how much it has turned since is not either.
        gone.go_on(None, &Matrix3::identity());
        gone.go_on(Some(&gyro), &Matrix3::identity());
        assert_eq!((gone.turned, gone.age), (None, 4));
    }

    #[test]
    fn an_upright_edge_is_along_gravity_by_what_both_are_known_to() {
        let along = |off_deg: f64, gravity_deg: f64, own_deg: f64| {
            let turn = Rotation3::from_axis_angle(&Vector3::z_axis(), off_deg.to_radians());
            let own = Matrix3::from_diagonal_element(own_deg.to_radians().powi(2));
            let gravity = GravityDirection { down: turn * Vector3::y(), sigma_rad: gravity_deg.to_radians() };
            gravity.is_along(&Matrix3::identity(), &own)
        };
        // Either way; 3.7 standard deviations are its end, those of gravity, of the pose, and of what it does not tell.
        assert!(along(0.0, 0.5, 0.0) && along(181.0, 0.5, 0.0));
        assert!(along(3.0, 0.5, 0.0) && !along(3.5, 0.5, 0.0));
        assert!(along(11.0, 3.0, 0.0) && !along(12.0, 3.0, 0.0));
        assert!(along(11.0, 0.5, 3.0) && !along(12.0, 0.5, 3.0));
    }
}
