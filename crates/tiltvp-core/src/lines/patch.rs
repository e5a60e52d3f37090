//! The image around a line, resampled with the line upright: rows along it, columns across it.

use nalgebra::{Matrix3, Vector2, Vector3};

use super::line::LineFrame;
use super::sight::Sight;
use crate::camera::Camera;
use crate::image::ImageView;

/// Samples between two places that are projected exactly.
const SUBDIVISIONS: usize = 4;

/// How places about lines become pixels.
#[derive(Debug, Clone, Copy)]
pub(super) enum Chart<'a> {
    /// Along a great circle: radians of elevation and radians across, on the plane that touches the sphere at the middle.
    Sphere { camera: &'a Camera, camera_from_upright: Matrix3<f64> },
    /// Along a radius of the image: pixels outwards from the centre and pixels across.
    Plane { center: Vector2<f64>, camera_from_robot: Matrix3<f64> },
}

impl<'a> Chart<'a> {
    pub(super) fn new(camera: &'a Camera, robot_from_camera: &Matrix3<f64>, frame: &LineFrame) -> Self {
        let camera_from_robot = robot_from_camera.transpose();
        match frame.center_px {
            Some(center) => Self::Plane { center, camera_from_robot },
            None => Self::Sphere { camera, camera_from_upright: camera_from_robot * frame.robot_from_upright() },
        }
    }

    /// The place about `(bearing, middle)` that is `along` and `across` from it.
    fn around(&self, bearing: f64, middle: f64) -> impl Fn(f64, f64) -> Option<Vector2<f64>> {
        let (sin, cos) = bearing.sin_cos();
        let chart = *self;
        let (a, b, c) = match self {
            Self::Sphere { camera_from_upright: turn, .. } => {
                let (sin_e, cos_e) = middle.sin_cos();
                let (ray, up, left) = (
                    Vector3::new(cos_e * cos, cos_e * sin, sin_e),
                    Vector3::new(-sin_e * cos, -sin_e * sin, cos_e),
                    Vector3::new(-sin, cos, 0.0),
                );
                (turn * ray, turn * up, turn * left)
            }
            Self::Plane { center, camera_from_robot: turn } => {
                let outwards = (turn * Vector3::new(cos, sin, 0.0)).xy().normalize();
                let left = (turn * Vector3::new(-sin, cos, 0.0)).xy().normalize();
                ((center + middle * outwards).push(0.0), outwards.push(0.0), left.push(0.0))
            }
        };
        move |along, across| {
            let place = a + b * along + c * across;
            match chart {
                Chart::Sphere { camera, .. } => camera.project(&place),
                Chart::Plane { .. } => Some(place.xy()),
            }
        }
    }
}

/// A resampled rectangle of grey levels, NaN where the world is not seen.
#[derive(Debug, Clone, Default)]
pub(super) struct Patch {
    /// Rows along the line, from low to high; columns across it, from small to great azimuth.
    pub(super) levels: Vec<f32>,
    pub(super) rows: usize,
    pub(super) columns: usize,
    nodes: Vec<Option<[f32; 2]>>,
}

impl Patch {
    /// Samples `rows x columns` places, `pitch` apart, about the middle of a line.
    pub(super) fn sample(
        &mut self,
        image: &ImageView<'_>,
        sight: &Sight,
        chart: &Chart<'_>,
        (bearing, middle): (f64, f64),
        pitch: f64,
        (rows, columns): (usize, usize),
    ) {
        (self.rows, self.columns) = (rows, columns);
        let (node_rows, node_columns) = (rows.div_ceil(SUBDIVISIONS) + 1, columns.div_ceil(SUBDIVISIONS) + 1);
        let place = chart.around(bearing, middle);
        let offset = |i: usize, n: usize| (i as f64 - 0.5 * (n as f64 - 1.0)) * pitch;
        self.nodes.clear();
        for i in 0..node_rows {
            let along = offset(i * SUBDIVISIONS, rows);
            self.nodes.extend((0..node_columns).map(|j| {
                place(along, offset(j * SUBDIVISIONS, columns)).map(|pixel| [pixel.x as f32, pixel.y as f32])
            }));
        }
        self.levels.clear();
        self.levels.resize(rows * columns, f32::NAN);
        for i in 0..node_rows - 1 {
            for j in 0..node_columns - 1 {
                let at = i * node_columns + j;
                let corners = [at, at + 1, at + node_columns, at + node_columns + 1].map(|k| self.nodes[k]);
                if let [Some(a), Some(b), Some(c), Some(d)] = corners {
                    self.fill(image, sight, (i * SUBDIVISIONS, j * SUBDIVISIONS), [a, b, c, d]);
                }
            }
        }
    }

    /// Samples one cell between four nodes, where places are nearly bilinear.
    fn fill(
        &mut self,
        image: &ImageView<'_>,
        sight: &Sight,
        (row, column): (usize, usize),
        [a, b, c, d]: [[f32; 2]; 4],
    ) {
        let unit = 1.0 / SUBDIVISIONS as f32;
        let mix = |p: [f32; 2], q: [f32; 2], t: f32| [p[0] + t * (q[0] - p[0]), p[1] + t * (q[1] - p[1])];
        for i in 0..SUBDIVISIONS.min(self.rows - row) {
            let (left, right) = (mix(a, c, i as f32 * unit), mix(b, d, i as f32 * unit));
            let line = (row + i) * self.columns + column;
            for j in 0..SUBDIVISIONS.min(self.columns - column) {
                let [x, y] = mix(left, right, j as f32 * unit);
                self.levels[line + j] = level_at(image, sight, x, y);
            }
        }
    }
}

/// The grey level between four pixels, NaN where the world is not seen.
fn level_at(image: &ImageView<'_>, sight: &Sight, x: f32, y: f32) -> f32 {
    // Written so that NaN fails.
    if !(x >= 0.0 && y >= 0.0 && x < (sight.width - 1) as f32 && y < (sight.height - 1) as f32) {
        return f32::NAN;
    }
    let (u, v) = (x as usize, y as usize);
    if !sight.clear[v * sight.width + u] {
        return f32::NAN;
    }
    let (s, t) = (x - u as f32, y - v as f32);
    let (above, below) = (image.row(v), image.row(v + 1));
    let top = f32::from(above[u]) + s * (f32::from(above[u + 1]) - f32::from(above[u]));
    let bottom = f32::from(below[u]) + s * (f32::from(below[u + 1]) - f32::from(below[u]));
    top + t * (bottom - top)
}
