//! Radial lines as in Scaramuzza, Siegwart and Martinelli 2009, section 2: edges that point at the rim's centre, 720 sectors, a length threshold.

use std::f64::consts::{PI, TAU};

use nalgebra::{Matrix3, Vector2, Vector3};

use super::rim_center::{CenterScratch, find_center};
use crate::camera::Camera;
use crate::error::{Error, Result};
use crate::image::ImageView;
use crate::lines::line::{Line, LineFrame, Lines};
use crate::lines::options::RadialOptions;
use crate::lines::tables::LineTables;

/// Constants of the camera for the radial variant: where the radial lines meet, the radii, the rim.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Radii {
    pub(crate) center: Vector2<f64>,
    pub(crate) inner: f64,
    pub(crate) outer: f64,
    pub(crate) rim: f64,
    robot_from_camera: Matrix3<f64>,
}

/// Memory of the search.
#[derive(Debug, Clone, Default)]
pub(crate) struct RadialScratch {
    gx: Vec<f32>,
    gy: Vec<f32>,
    magnitude: Vec<f32>,
    radial: Vec<f32>,
    center: CenterScratch,
    sectors: Vec<Sector>,
}

#[derive(Debug, Clone, Copy, Default)]
struct Sector {
    pixels: u32,
    rising: u32,
    nearest: f32,
    farthest: f32,
}

/// How far the optical axis may be from the vertical. Under an equidistant lens a lean of the axis turns a vertical that crosses the
/// horizon from its radius by as much (`pi/2 - 2/pi` = 0.93 of it) and its bearing by `2/pi` of it: beyond the paper's 5 degrees of a
/// gradient, verticals across the lean are lost.
const AXIS_MAX_RAD: f64 = 5.0 * PI / 180.0;

/// Refuses a mounting under which azimuths of the image are none of the robot.
///
/// # Errors
/// [`Error::InvalidArgument`] if the optical axis is not along the vertical, up or down.
pub(crate) fn check_axis(robot_from_camera: &Matrix3<f64>) -> Result<()> {
    let axis = robot_from_camera.column(2);
    let away = axis.xy().norm().atan2(axis.z.abs());
    if away <= AXIS_MAX_RAD {
        return Ok(());
    }
    let got = format!("an optical axis {:.1} degrees from the vertical", away.to_degrees());
    let expected = "at most 5 for method \"radial\", which knows no other mounting; \"great-circle\" takes any";
    Err(Error::argument("robot_from_camera", got, expected))
}

impl Radii {
    /// From the options, and from the camera what they leave open.
    pub(crate) fn new(
        camera: &Camera,
        robot_from_camera: &Matrix3<f64>,
        tables: &LineTables,
        options: &RadialOptions,
    ) -> Self {
        let up: Vector3<f64> = robot_from_camera.transpose().column(2).into_owned();
        let middle = Vector2::new(0.5 * (tables.width as f64 - 1.0), 0.5 * (tables.height as f64 - 1.0));
        let center = camera.project(&up).or_else(|| camera.project(&-up)).unwrap_or(middle);
        let radius = |u: usize, v: usize| (u as f64 - center.x).hypot(v as f64 - center.y);
        let (mut inner, mut outer) = (f64::INFINITY, 0.0f64);
        for (u, v, ray) in tables.region.pixels() {
            let elevation = ray.z.atan2(ray.xy().norm());
            if (tables.band.0..=tables.band.1).contains(&elevation) {
                inner = inner.min(radius(u, v));
                outer = outer.max(radius(u, v));
            }
        }
        let valid =
            (0..tables.width * tables.height).filter(|i| tables.ray(i % tables.width, i / tables.width).is_some());
        let rim = valid.map(|i| radius(i % tables.width, i / tables.width)).fold(0.0, f64::max) + 0.5;
        Self {
            center,
            inner: options.radius_min_px.unwrap_or(inner.min(outer)),
            outer: options.radius_max_px.unwrap_or(outer),
            rim: options.rim_radius_px.unwrap_or(rim),
            robot_from_camera: *robot_from_camera,
        }
    }
}

/// Finds the radial lines of an image.
pub(crate) fn find(
    image: &ImageView<'_>,
    tables: &LineTables,
    radii: &Radii,
    gradient_min: f64,
    options: &RadialOptions,
    scratch: &mut RadialScratch,
    out: &mut Lines,
) {
    let RadialScratch { gx, gy, magnitude, radial, center: circle, sectors } = scratch;
    sobel(image, gx, gy, magnitude);
    // The Scharr kernel's weights sum to 16, the Sobel kernel's to 4.
    let gradient_min = (gradient_min / 4.0) as f32;
    let mut center = radii.center;
    if options.center_search_px > 0.0 {
        let found = find_center(magnitude, image, gradient_min, &center, radii.rim, options.center_search_px, circle);
        center = found.unwrap_or(center);
    }
    keep_radial((gx, gy, magnitude), tables, radii, &center, gradient_min, options, radial);
    fill_sectors((gx, gy, radial), tables.width, &center, options.sectors, sectors);
    out.frame = LineFrame { center_px: Some(center), ..LineFrame::default() };
    lines_of(sectors, tables, radii, &center, options.length_min, &mut out.lines);
}

/// The second step: keeps the magnitudes of gradients along the circle about the centre, whose edges point at the centre.
fn keep_radial(
    (gx, gy, magnitude): (&[f32], &[f32], &[f32]),
    tables: &LineTables,
    radii: &Radii,
    center: &Vector2<f64>,
    gradient_min: f32,
    options: &RadialOptions,
    radial: &mut Vec<f32>,
) {
    let (width, height) = (tables.width, tables.height);
    let limit = (options.radial_max_rad.sin() as f32).powi(2);
    radial.clear();
    radial.resize(width * height, 0.0);
    for v in 1..height.saturating_sub(1) {
        for u in 1..width.saturating_sub(1) {
            let i = v * width + u;
            let (x, y) = ((u as f64 - center.x) as f32, (v as f64 - center.y) as f32);
            let distance = x.hypot(y);
            if magnitude[i] < gradient_min
                || tables.clearance[i] == 0
                || f64::from(distance) > radii.outer
                || f64::from(distance) < radii.inner
            {
                continue;
            }
            let outwards = (x * gx[i] + y * gy[i]) / distance;
            if outwards * outwards <= limit * magnitude[i] * magnitude[i] {
                radial[i] = magnitude[i];
            }
        }
    }
}

/// Thins the radial edges and counts their pixels by sector of the image.
fn fill_sectors(
    (gx, gy, radial): (&[f32], &[f32], &[f32]),
    width: usize,
    center: &Vector2<f64>,
    count: usize,
    sectors: &mut Vec<Sector>,
) {
    let height = radial.len() / width;
    sectors.clear();
    sectors.resize(count, Sector { nearest: f32::INFINITY, ..Sector::default() });
    for v in 1..height.saturating_sub(1) {
        for u in 1..width.saturating_sub(1) {
            let i = v * width + u;
            if radial[i] <= 0.0 {
                continue;
            }
            // Thinning: the greatest of three across the edge.
            let step = if gx[i].abs() >= gy[i].abs() { 1 } else { width };
            if radial[i - step] >= radial[i] || radial[i + step] > radial[i] {
                continue;
            }
            let (x, y) = (u as f64 - center.x, v as f64 - center.y);
            let turn = (y.atan2(x) + PI) / TAU;
            let sector = &mut sectors[((turn * count as f64) as usize).min(count - 1)];
            let distance = x.hypot(y) as f32;
            sector.pixels += 1;
            sector.rising += u32::from(x * f64::from(gy[i]) > y * f64::from(gx[i]));
            sector.nearest = sector.nearest.min(distance);
            sector.farthest = sector.farthest.max(distance);
        }
    }
}

/// The third step: sectors with more pixels than their neighbours, and enough of them, are lines.
fn lines_of(
    sectors: &[Sector],
    tables: &LineTables,
    radii: &Radii,
    center: &Vector2<f64>,
    length_min: f64,
    out: &mut Vec<Line>,
) {
    let least = length_min * (radii.outer - radii.inner);
    out.clear();
    let n = sectors.len();
    for (k, sector) in sectors.iter().enumerate() {
        let (before, after) = (sectors[(k + n - 1) % n].pixels, sectors[(k + 1) % n].pixels);
        if sector.pixels == 0 || f64::from(sector.pixels) < least || before >= sector.pixels || after > sector.pixels {
            continue;
        }
        let angle = (k as f64 + 0.5) / n as f64 * TAU - PI;
        let elevation = |distance: f32| {
            let (x, y) = (center.x + angle.cos() * f64::from(distance), center.y + angle.sin() * f64::from(distance));
            let ray = tables.ray(x.round().max(0.0) as usize, y.round().max(0.0) as usize);
            ray.map_or(f64::NAN, |ray| f64::from(ray[2]).atan2(f64::from(ray[0].hypot(ray[1]))))
        };
        let ends = (elevation(sector.nearest), elevation(sector.farthest));
        let direction = radii.robot_from_camera * Vector3::new(angle.cos(), angle.sin(), 0.0);
        // A camera that is upside down on the robot sees azimuths the other way round.
        let handed = if radii.robot_from_camera[(2, 2)] < 0.0 { -1.0 } else { 1.0 };
        out.push(Line {
            bearing_rad: direction.y.atan2(direction.x),
            sigma_rad: TAU / n as f64 / 12f64.sqrt(),
            support_px: sector.pixels,
            elevation_min_rad: ends.0.min(ends.1),
            elevation_max_rad: ends.0.max(ends.1),
            polarity: handed * (2.0 * f64::from(sector.rising) / f64::from(sector.pixels) - 1.0),
        });
    }
    out.sort_by(|a, b| a.bearing_rad.total_cmp(&b.bearing_rad));
}

/// The 3x3 Sobel derivatives and their magnitude, eq. 1; zero at the border.
fn sobel(image: &ImageView<'_>, gx: &mut Vec<f32>, gy: &mut Vec<f32>, magnitude: &mut Vec<f32>) {
    let (width, height) = (image.width(), image.height());
    for out in [&mut *gx, &mut *gy, &mut *magnitude] {
        out.clear();
        out.resize(width * height, 0.0);
    }
    for v in 1..height.saturating_sub(1) {
        let [above, middle, below] = [v - 1, v, v + 1].map(|v| image.row(v));
        for u in 1..width.saturating_sub(1) {
            let at = |row: &[u8], u: usize| f32::from(row[u]);
            let x = at(above, u + 1) - at(above, u - 1) + at(below, u + 1) - at(below, u - 1)
                + 2.0 * (at(middle, u + 1) - at(middle, u - 1));
            let y = at(below, u - 1) - at(above, u - 1) + at(below, u + 1) - at(above, u + 1)
                + 2.0 * (at(below, u) - at(above, u));
            let i = v * width + u;
            (gx[i], gy[i], magnitude[i]) = (x, y, x.hypot(y));
        }
    }
}
