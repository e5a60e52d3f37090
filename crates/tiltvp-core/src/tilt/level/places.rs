//! Where directions are in the leaning image.

use nalgebra::{Matrix3, Vector2, Vector3};

use crate::camera::{Camera, Model};

/// Rows of a panorama beside its poles where columns turn too fast for a grid to tell. With half as many a map was 0.054 px off.
const POLE_PX: f64 = 8.0;

/// Of a field of view: rays within it have such a component along an axis.
#[derive(Debug, Clone, Copy)]
pub(super) struct Limit {
    pub(super) axis: Vector3<f64>,
    pub(super) least: f64,
}

impl Limit {
    /// Whether a ray is within it.
    pub(super) fn sees(&self, ray: &Vector3<f64>) -> bool {
        self.axis.dot(ray) >= self.least
    }
}

/// Where directions are in the old image.
#[derive(Debug, Clone, Copy)]
pub(super) struct Places<'a> {
    camera: &'a Camera,
    /// Takes rays of the new image to those of the camera.
    rotation: Matrix3<f64>,
    /// Columns after which the image begins anew, for panoramas.
    period: Option<f64>,
    /// Of the camera's field of view, in the frame of the new image.
    pub(super) limit: Option<Limit>,
}

impl<'a> Places<'a> {
    pub(super) fn new(camera: &'a Camera, rotation: Matrix3<f64>) -> Self {
        let limit = camera.limit().map(|(axis, least)| Limit { axis: rotation.transpose() * axis, least });
        Self { camera, rotation, period: is_panorama(camera).then(|| f64::from(camera.width())), limit }
    }

    /// Where a ray is, or would be without the limit of the field of view.
    pub(super) fn of(&self, ray: Option<Vector3<f64>>) -> Option<Vector2<f64>> {
        ray.and_then(|ray| self.camera.project_unlimited(&(self.rotation * ray)))
    }

    /// Whether a ray is within the limit of the field of view.
    pub(super) fn sees(&self, ray: Option<Vector3<f64>>) -> bool {
        ray.is_some_and(|ray| self.limit.is_none_or(|limit| limit.sees(&ray)))
    }

    /// From one place to another, the shorter way about a panorama.
    pub(super) fn between(&self, from: &Vector2<f64>, to: &Vector2<f64>) -> Vector2<f64> {
        let mut way = to - from;
        if let Some(period) = self.period {
            way.x -= period * (way.x / period).round();
        }
        way
    }

    /// The second difference over a step of three places, of which the last is `last` steps from the middle one.
    pub(super) fn second(&self, three: [&Vector2<f64>; 3], last: f64) -> Vector2<f64> {
        (self.between(three[1], three[2]) / last - self.between(three[0], three[1])) * (2.0 / (1.0 + last))
    }

    /// How long a difference is in pixels; in a panorama a column counts as much as it is wide there.
    pub(super) fn length(&self, mut difference: Vector2<f64>, at: &Vector2<f64>) -> f64 {
        if self.period.is_some() {
            let height = f64::from(self.camera.height());
            difference.x *= (std::f64::consts::PI * ((at.y + 0.5) / height)).sin();
        }
        difference.norm()
    }

    /// Whether a place is beside a pole of a panorama.
    pub(super) fn is_polar(&self, place: &Vector2<f64>) -> bool {
        let last = f64::from(self.camera.height()) - 1.0;
        self.period.is_some() && (place.y < POLE_PX || place.y > last - POLE_PX)
    }

    /// Four corners on one side of the seam: that of the first.
    pub(super) fn together(&self, corners: [Vector2<f64>; 4]) -> [Vector2<f64>; 4] {
        corners.map(|corner| corners[0] + self.between(&corners[0], &corner))
    }
}

pub(super) fn is_panorama(camera: &Camera) -> bool {
    matches!(camera.model(), Model::Equirectangular(_))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::camera::{Equidistant, Equirectangular};

    #[test]
    fn the_way_between_places_is_the_shorter_one_about_a_panorama() {
        let panorama = Camera::new(360, 180, Equirectangular::new(360, 180).unwrap().into()).unwrap();
        let fisheye = Camera::new(360, 180, Equidistant::new(60.0, 179.5, 89.5).unwrap().into()).unwrap();
        for (from, to, about, within) in
            [(350.0, 10.0, 20.0, -340.0), (10.0, 350.0, -20.0, 340.0), (10.0, 30.0, 20.0, 20.0)]
        {
            for (camera, expected) in [(&panorama, about), (&fisheye, within)] {
                let places = Places::new(camera, Matrix3::identity());
                let way = places.between(&Vector2::new(from, 40.0), &Vector2::new(to, 45.0));
                assert_eq!(way, Vector2::new(expected, 5.0));
            }
        }
    }
}
