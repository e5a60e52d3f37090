//! The image around a line, resampled with the line upright: rows along it, columns across it.

use nalgebra::{Matrix3, Vector2, Vector3};
use tiltvp_kernels::bilinear::quads;
use tiltvp_kernels::vectorised;

use crate::camera::Camera;
use crate::image::ImageView;
use crate::lines::line::LineFrame;
use crate::lines::tables::LineTables;

/// Samples between two places that are projected exactly; bilinear between them, as a lens hardly bends over four
/// samples.
const SUBDIVISIONS: usize = 4;

/// How places about lines become pixels.
#[derive(Debug, Clone, Copy)]
pub(crate) enum Chart<'a> {
    /// Along a great circle: radians of elevation and radians across, on the plane that touches the sphere at the middle.
    Sphere { camera: &'a Camera, camera_from_upright: Matrix3<f64> },
    /// Along a radius of the image: pixels outwards from the centre and pixels across.
    Plane { center: Vector2<f64>, camera_from_robot: Matrix3<f64> },
}

impl<'a> Chart<'a> {
    pub(crate) fn new(camera: &'a Camera, robot_from_camera: &Matrix3<f64>, frame: &LineFrame) -> Self {
        let camera_from_robot = robot_from_camera.transpose();
        match frame.center_px {
            Some(center) => Self::Plane { center, camera_from_robot },
            None => Self::Sphere { camera, camera_from_upright: camera_from_robot * frame.robot_from_upright() },
        }
    }

    /// The place about `(bearing, middle)` that is `along` and `across` from it.
    pub(super) fn around(&self, bearing: f64, middle: f64) -> impl Fn(f64, f64) -> Option<Vector2<f64>> {
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
pub(crate) struct Raster {
    /// From sample to sample, in the chart's unit.
    pub(crate) pitch: f64,
    /// Along the line.
    pub(crate) rows: usize,
    /// Across the line.
    pub(crate) columns: usize,
    /// How many samples from the middle are needed; the others may be NaN. None for all.
    pub(crate) reach: Option<f64>,
}

/// A resampled rectangle of grey levels, NaN where the world is not seen.
#[derive(Debug, Clone, Default)]
pub(crate) struct Patch {
    /// Rows along the line, from low to high; columns across it, from small to great azimuth.
    pub(crate) levels: Vec<f32>,
    nodes: Vec<Option<[f32; 2]>>,
    cells: Vec<Cell>,
}

impl Patch {
    /// Samples a raster about the middle of a line.
    pub(crate) fn sample(
        &mut self,
        image: &ImageView<'_>,
        tables: &LineTables,
        chart: &Chart<'_>,
        (bearing, middle): (f64, f64),
        raster: &Raster,
    ) {
        let Raster { pitch, rows, columns, reach } = *raster;
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
        let gap = |start: f64| (-start - SUBDIVISIONS as f64).max(start).max(0.0).powi(2);
        self.cells.clear();
        for i in 0..node_rows - 1 {
            let left = near - gap(offset(i, rows));
            for j in (0..node_columns - 1).filter(|j| gap(offset(*j, columns)) <= left) {
                let at = i * node_columns + j;
                let corners = [at, at + 1, at + node_columns, at + node_columns + 1].map(|k| self.nodes[k]);
                if let [Some(a), Some(b), Some(c), Some(d)] = corners {
                    self.cells.push(Cell { row: i * SUBDIVISIONS, column: j * SUBDIVISIONS, corners: [a, b, c, d] });
                }
            }
        }
        fill(&self.cells, image, tables, columns, &mut self.levels);
    }
}

/// Samples between four nodes, where places are nearly bilinear.
#[derive(Debug, Clone, Copy)]
struct Cell {
    row: usize,
    column: usize,
    /// Pixels of the nodes: at this row and column, at the next column, at the next row, at both.
    corners: [[f32; 2]; 4],
}

/// Samples of a cell.
const SAMPLES: usize = SUBDIVISIONS * SUBDIVISIONS;

vectorised! {
    /// Samples cells of a patch in row order.
    fn fill(cells: &[Cell], image: &ImageView<'_>, tables: &LineTables, columns: usize, levels: &mut [f32]) {
        for cell in cells {
            let (x, y) = places(cell);
            let found = if is_clear(cell, tables) {
                levels_at(image, &x, &y)
            } else {
                std::array::from_fn(|k| level_at(image, tables, x[k], y[k]))
            };
            let rows = levels[cell.row * columns..].chunks_mut(columns);
            for (row, found) in rows.zip(found.as_chunks::<SUBDIVISIONS>().0) {
                match row[cell.column..].first_chunk_mut() {
                    Some(out) => *out = *found,
                    None => row[cell.column..].iter_mut().zip(found).for_each(|(out, level)| *out = *level),
                }
            }
        }
    }
}

/// Pixels of a cell's samples, row by row.
#[inline(always)]
fn places(Cell { corners: [a, b, c, d], .. }: &Cell) -> ([f32; SAMPLES], [f32; SAMPLES]) {
    let unit = 1.0 / SUBDIVISIONS as f32;
    let mix = |p: f32, q: f32, t: f32| p + t * (q - p);
    let (mut x, mut y) = ([0.0; SAMPLES], [0.0; SAMPLES]);
    let rows = x.as_chunks_mut::<SUBDIVISIONS>().0.iter_mut().zip(y.as_chunks_mut::<SUBDIVISIONS>().0);
    for (i, (xs, ys)) in rows.enumerate() {
        let t = i as f32 * unit;
        let (x, y) = (mix(a[0], c[0], t), mix(a[1], c[1], t));
        let (dx, dy) = (unit * (mix(b[0], d[0], t) - x), unit * (mix(b[1], d[1], t) - y));
        for (j, (to_x, to_y)) in xs.iter_mut().zip(ys).enumerate() {
            (*to_x, *to_y) = (x + j as f32 * dx, y + j as f32 * dy);
        }
    }
    (x, y)
}

/// Whether the world is seen at all pixels that a cell's samples can be in, their rounding included.
#[inline(always)]
fn is_clear(Cell { corners: [a, others @ ..], .. }: &Cell, tables: &LineTables) -> bool {
    let (u, v) = (a[0] as i32, a[1] as i32);
    let apart = |[x, y]: &[f32; 2]| (*x as i32).abs_diff(u).max((*y as i32).abs_diff(v));
    let reach = others.iter().map(apart).fold(0, u32::max);
    tables.is_clear_around(u, v, reach.saturating_add(1))
}

/// The grey levels between pixels of the image, zero where a sample is not in it.
#[inline(always)]
fn levels_at(image: &ImageView<'_>, x: &[f32; SAMPLES], y: &[f32; SAMPLES]) -> [f32; SAMPLES] {
    let (data, stride) = (image.data(), image.stride());
    let (mut u, mut v, mut at) = ([0; SAMPLES], [0; SAMPLES], [0; SAMPLES]);
    for k in 0..SAMPLES {
        (u[k], v[k]) = (x[k] as i32, y[k] as i32);
        at[k] = (v[k] as u32).wrapping_mul(stride as u32).wrapping_add(u[k] as u32);
    }
    let Some(quads) = quads(data, stride, &at) else { return [0.0; SAMPLES] };
    let mut out = [0.0; SAMPLES];
    for k in 0..SAMPLES {
        let (s, t) = (x[k] - u[k] as f32, y[k] - v[k] as f32);
        let level = |byte: u32| (quads[k] >> (8 * byte) & 0xff) as i32 as f32;
        let (a, b, c, d) = (level(0), level(1), level(2), level(3));
        let (top, bottom) = (a + s * (b - a), c + s * (d - c));
        out[k] = top + t * (bottom - top);
    }
    out
}

/// The grey level between four pixels, NaN where the world is not seen.
#[inline(always)]
pub(super) fn level_at(image: &ImageView<'_>, tables: &LineTables, x: f32, y: f32) -> f32 {
    // Written so that NaN fails.
    if !(x >= 0.0 && y >= 0.0) {
        return f32::NAN;
    }
    let (u, v) = (x as i32, y as i32);
    let (s, t) = (x - u as f32, y - v as f32);
    if !tables.is_clear_around(u, v, 0) {
        return f32::NAN;
    }
    let Some([a, b, c, d]) = image.quad(u as usize, v as usize) else { return f32::NAN };
    let (a, b, c, d) = (f32::from(a), f32::from(b), f32::from(c), f32::from(d));
    let (top, bottom) = (a + s * (b - a), c + s * (d - c));
    top + t * (bottom - top)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::camera::{Equidistant, Model};
    use crate::lines::options::LineOptions;

    /// Cells all over an image and beyond it: in most of them all pixels are seen, in some not.
    #[test]
    fn cells_have_the_levels_of_their_samples_one_by_one() {
        let lens = Equidistant::new(40.0, 79.5, 59.5).unwrap();
        let camera = Camera::new(160, 120, Model::Equidistant(lens)).unwrap().with_max_theta_rad(1.4).unwrap();
        let tables =
            LineTables::new(&camera, &Matrix3::identity(), &LineOptions::for_method("great-circle").unwrap()).unwrap();
        let data: Vec<u8> = (0..160 * 120u32).map(|i| (i.wrapping_mul(2_654_435_761) >> 24) as u8).collect();
        let image = ImageView::new(&data, 160, 120, 160).unwrap();
        let (mut clear, mut unclear) = (0, 0);
        for seed in 0..4000_u32 {
            let share = |k: u32| {
                ((seed * 8 + k).wrapping_mul(747_796_405).wrapping_mul(277_803_737) >> 8) as f32 / 16_777_216.0
            };
            let middle = [180.0 * share(0) - 10.0, 140.0 * share(1) - 10.0];
            let corner = |k: u32| [middle[0] + 9.0 * share(k), middle[1] + 9.0 * share(k + 1)];
            let cell = Cell { row: 0, column: 0, corners: [corner(2), corner(3), corner(4), corner(5)] };
            *(if is_clear(&cell, &tables) { &mut clear } else { &mut unclear }) += 1;
            let mut levels = [0.0; SAMPLES];
            fill(&[cell], &image, &tables, SUBDIVISIONS, &mut levels);
            let (x, y) = places(&cell);
            for k in 0..SAMPLES {
                assert_eq!(levels[k].to_bits(), level_at(&image, &tables, x[k], y[k]).to_bits());
            }
        }
        assert!(clear > 500 && unclear > 500, "{clear} {unclear}");
    }
}
