//! Where straight edges stand, and of which polarity they are: what tells whether the camera is mounted as told.

use std::f64::consts::{FRAC_1_SQRT_2, FRAC_PI_2};

use nalgebra::{Matrix3, Vector3};

use super::frame::Edge;
use super::near::Columns;
use crate::tilt::trust::ASPECT;

/// The longest segments, which are looked at.
const LONGEST: usize = 120;

/// By how much in radians the edges of things along a direction miss it, with half a step of the grid.
const SCATTER_RAD: f64 = 0.8f64.to_radians();

/// How far from each axis edges may agree: 10 degrees of lean, and 4 by which mountings are off.
const REACH_RAD: f64 = 14f64.to_radians();

/// Distance of neighbouring directions that are tried, twice the scatter.
const STEP_RAD: f64 = 1.75f64.to_radians();

/// Beyond the reach, in radians: three times the scatter, from where on edges add nothing.
const BEYOND_RAD: f64 = 3.0 * SCATTER_RAD;

/// What is looked for, made once.
#[derive(Debug)]
pub(super) struct Aspect {
    /// Two level axes and the robot's z. A camera that is mounted otherwise than told has the vertical near another axis of its own,
    /// however the robot's x and y lie: the first is where the camera looks, or its image's rows where it looks up or down.
    axes: Matrix3<f64>,
    /// Directions about each of them.
    directions: [Vec<[f32; 3]>; 3],
}

impl Aspect {
    pub(super) fn new(robot_from_camera: &Matrix3<f64>) -> Self {
        let axes = level_axes(robot_from_camera);
        let steps = (REACH_RAD / STEP_RAD) as i32;
        let places = (-steps..=steps).flat_map(|i| (-steps..=steps).map(move |k| (i, k)));
        let within = places.filter(|(i, k)| i * i + k * k <= steps * steps);
        let sines = within.map(|(i, k)| [i, k].map(|i| (f64::from(i) * STEP_RAD).sin()));
        let about = |axis: usize| {
            let turned = sines.clone().map(|[a, b]| {
                let mut direction = Vector3::zeros();
                direction[axis] = (1.0 - a * a - b * b).max(0.0).sqrt();
                direction[(axis + 1) % 3] = a;
                direction[(axis + 2) % 3] = b;
                (axes * direction).map(|x| x as f32).into()
            });
            turned.collect()
        };
        Self { axes, directions: [about(0), about(1), about(2)] }
    }

    /// How far from the horizon what is vertical stands, how much what is level is lighter above, how high it stands, and how much
    /// agrees with a direction near the upright, and near the one of two level axes with which more does.
    pub(super) fn of(&self, edges: &[Edge], up: &Vector3<f64>, columns: &mut Columns) -> [f64; ASPECT] {
        let edges = &edges[..edges.len().min(LONGEST)];
        let total = 1.0 + edges.iter().map(|edge| edge.weight).sum::<f64>();
        let (mut vertical, mut distance, mut polarity, mut height) = (1.0, 0.0, 0.0, 0.0);
        for edge in edges {
            let (miss, rise) = (edge.normal.dot(up), edge.middle.dot(up));
            let odds = edge.odds(up, SCATTER_RAD).odds;
            let share = odds / (1.0 + odds);
            vertical += edge.weight * share;
            distance += edge.weight * share * rise.abs();
            polarity += edge.weight * (1.0 - share) * miss;
            height += edge.weight * (1.0 - share) * rise;
        }
        let [first, second, own] = [0, 1, 2].map(|axis| self.most(edges, axis, columns) / total);
        [distance / vertical, polarity / total, height / total, own, first.max(second)]
    }

    /// The greatest sum of odds of a direction near an axis.
    fn most(&self, edges: &[Edge], axis: usize, columns: &mut Columns) -> f64 {
        let limit = (REACH_RAD + BEYOND_RAD).min(FRAC_PI_2).sin();
        let direction = self.axes.column(axis).into_owned();
        columns.clear();
        for edge in edges.iter().filter(|edge| edge.normal.dot(&direction).abs() < limit) {
            columns.push(edge, &direction, SCATTER_RAD);
        }
        f64::from(self.directions[axis].iter().map(|direction| columns.score(direction)).fold(0.0, f32::max))
    }
}

/// The axes of a camera's mounting: two level ones and the robot's z, as columns.
fn level_axes(robot_from_camera: &Matrix3<f64>) -> Matrix3<f64> {
    let [across, ahead] = [0, 2].map(|axis| robot_from_camera.column(axis).xy());
    let heading = if ahead.norm() >= FRAC_1_SQRT_2 { ahead } else { across }.normalize();
    let (x, y) = (heading.x, heading.y);
    Matrix3::new(x, -y, 0.0, y, x, 0.0, 0.0, 0.0, 1.0)
}

#[cfg(test)]
mod tests {
    use nalgebra::Rotation3;

    use super::*;
    use crate::segments::Segment;

    /// Long edges through the zenith at many azimuths, and short ones along x below the horizon, lighter above.
    fn edges(robot_from_camera: &Matrix3<f64>) -> Vec<Edge> {
        let segment = |normal: Vector3<f64>, middle: Vector3<f64>, length_rad| {
            let (normal, middle) = (normal.normalize(), middle.normalize());
            let variances_rad2 = [1e-6; 2];
            let (contrast, rms_px, px_per_rad, points) = (1.0, 0.0, 100.0, 0..0);
            let ends = [middle; 2];
            let own =
                Segment { normal, middle, ends, length_rad, variances_rad2, contrast, rms_px, px_per_rad, points };
            Edge::new(robot_from_camera, &own)
        };
        let upright = (0..12).map(|i| {
            let (sin, cos) = (0.5 * f64::from(i)).sin_cos();
            segment(Vector3::new(-sin, cos, 0.0), Vector3::new(cos, sin, 0.1), 0.4)
        });
        let level = (0..6).map(|i| {
            let down = 0.3 + 0.1 * f64::from(i);
            segment(Vector3::new(0.0, down, 1.0), Vector3::new(0.0, 1.0, -down), 0.1)
        });
        upright.chain(level).collect()
    }

    #[test]
    fn the_axis_with_which_edges_agree_is_told_and_what_is_level_and_light_above() {
        let aspect = |robot_from_camera: Matrix3<f64>| {
            Aspect::new(&robot_from_camera).of(&edges(&robot_from_camera), &Vector3::z(), &mut Columns::default())
        };
        let ahead = Matrix3::new(0.0, 0.0, 1.0, -1.0, 0.0, 0.0, 0.0, -1.0, 0.0);
        let [rise, polarity, height, own, other] = aspect(Matrix3::identity());
        assert!(rise < 0.12 && polarity > 0.1 && height < -0.05, "{rise} {polarity} {height}");
        assert!(own > 3.0 * other, "{own} {other}");
        let [.., own_ahead, other_ahead] = aspect(ahead);
        assert!(other_ahead > 3.0 * own_ahead, "{own_ahead} {other_ahead}");
        assert!((own - other_ahead).abs() < 1e-3, "{own} {other_ahead}");
        for heading in [0.4, 0.8, -2.0] {
            for mounting in [Matrix3::identity(), ahead] {
                let (turned, before) =
                    (aspect(Rotation3::from_axis_angle(&Vector3::z_axis(), heading) * mounting), aspect(mounting));
                assert!(turned.iter().zip(before).all(|(a, b)| (a - b).abs() < 1e-3), "{turned:?} {before:?}");
            }
        }
        let [_, polarity_down, height_down, ..] = aspect(Matrix3::from_diagonal(&Vector3::new(1.0, -1.0, -1.0)));
        assert!((polarity_down + polarity).abs() < 1e-9 && (height_down + height).abs() < 1e-9);
    }
}
