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

/// Which places of a rectangle are sampled.
#[derive(Debug, Clone, Copy)]
pub(super) struct Raster {
    /// From sample to sample, in the chart's unit.
    pub(super) pitch: f64,
    /// Along the line.
    pub(super) rows: usize,
    /// Across the line.
    pub(super) columns: usize,
    /// How many samples from the middle are needed; the others may be NaN. None for all.
    pub(super) reach: Option<f64>,
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
    /// Samples a raster about the middle of a line.
    pub(super) fn sample(
        &mut self,
        image: &ImageView<'_>,
        sight: &Sight,
        chart: &Chart<'_>,
        (bearing, middle): (f64, f64),
        raster: &Raster,
    ) {
        let Raster { pitch, rows, columns, reach } = *raster;
        (self.rows, self.columns) = (rows, columns);
        let (node_rows, node_columns) = (rows.div_ceil(SUBDIVISIONS) + 1, columns.div_ceil(SUBDIVISIONS) + 1);
        let place = chart.around(bearing, middle);
        let offset = |i: usize, n: usize| (i * SUBDIVISIONS) as f64 - 0.5 * (n as f64 - 1.0);
        let far = reach.map_or(f64::INFINITY, |reach| (reach + 1.5 * SUBDIVISIONS as f64).powi(2));
        self.nodes.clear();
        for i in 0..node_rows {
            let along = offset(i, rows);
            self.nodes.extend((0..node_columns).map(|j| {
                let across = offset(j, columns);
                if along * along + across * across > far {
                    return None;
                }
                place(along * pitch, across * pitch).map(|pixel| [pixel.x as f32, pixel.y as f32])
            }));
        }
        self.levels.clear();
        self.levels.resize(rows * columns, f32::NAN);
        let near = reach.map_or(f64::INFINITY, |reach| reach * reach);
        // From the middle to the nearest point of a cell.
        let gap = |start: f64| (-start - SUBDIVISIONS as f64).max(start).max(0.0);
        for i in 0..node_rows - 1 {
            for j in 0..node_columns - 1 {
                if gap(offset(i, rows)).powi(2) + gap(offset(j, columns)).powi(2) > near {
                    continue;
                }
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
        let mix = |p: f32, q: f32, t: f32| p + t * (q - p);
        let count = SUBDIVISIONS.min(self.columns - column);
        for i in 0..SUBDIVISIONS.min(self.rows - row) {
            let t = i as f32 * unit;
            let (x, y) = (mix(a[0], c[0], t), mix(a[1], c[1], t));
            let (dx, dy) = (unit * (mix(b[0], d[0], t) - x), unit * (mix(b[1], d[1], t) - y));
            let start = (row + i) * self.columns + column;
            for (j, level) in self.levels[start..start + count].iter_mut().enumerate() {
                *level = level_at(image, sight, x + j as f32 * dx, y + j as f32 * dy);
            }
        }
    }
}

/// The grey level between four pixels, NaN where the world is not seen.
#[inline]
fn level_at(image: &ImageView<'_>, sight: &Sight, x: f32, y: f32) -> f32 {
    // Written so that NaN fails.
    if !(x >= 0.0 && y >= 0.0) {
        return f32::NAN;
    }
    let (u, v) = (x as i32, y as i32);
    let (s, t) = (x - u as f32, y - v as f32);
    let (u, v) = (u as usize, v as usize);
    if u >= sight.width || !sight.clear.get(v * sight.width + u).is_some_and(|clear| *clear) {
        return f32::NAN;
    }
    let Some([a, b, c, d]) = image.quad(u, v) else { return f32::NAN };
    let (a, b, c, d) = (f32::from(a), f32::from(b), f32::from(c), f32::from(d));
    let (top, bottom) = (a + s * (b - a), c + s * (d - c));
    top + t * (bottom - top)
}
