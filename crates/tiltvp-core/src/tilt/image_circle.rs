//! Where the image circle lies, against where the calibration says that it does: a centre that is off shifts both, and no
//! edge tells.

use nalgebra::{Matrix3, Matrix3x2, Vector2, Vector3};

use crate::camera::Camera;
use crate::image::ImageView;

/// Rays from the optical axis along which the rim is looked for.
const RAYS: usize = 64;

/// How far from where it should be the rim is looked for, as a share of its radius: twice what makes a lean of four degrees.
const REACH: f64 = 0.12;

/// Places on a ray: then one is a pixel of a lens with a radius of 250.
const PLACES: usize = 60;

/// Grey level that a surround has at most: of real photographs with one, the lightest is at 30.
const DARKEST: u8 = 45;

/// Grey levels by which the surround may vary.
const ABOVE: u8 = 8;

/// Share of the radius by which rim points may stray from a circle. Those at which the world is dark stray inwards.
const STRAY: f64 = 0.012;

/// Share of the radius by which the circle found may be larger or smaller than the calibration's: others are another rim.
const LIKE: f64 = 0.05;

/// Offset that is a lens' own. Of real lenses the circle lies up to 1.7 degrees beside the axis.
const OWN_RAD: f64 = 2.0 * std::f64::consts::PI / 180.0;

/// Where the rim of the image circle is looked for: made once.
#[derive(Debug)]
pub(super) struct ImageCircle {
    /// The place on each ray that the calibration calls the rim, in pixels from the axis.
    radii: [f64; RAYS],
    /// How far a circle that is larger by one, or shifted by one along u or v, reaches farther along each ray.
    rows: [Vector3<f64>; RAYS],
    rays: Vec<Ray>,
    /// The mean of the radii.
    radius: f64,
    /// The bearing of the axis, and how bearings there change by pixels.
    axis: (Vector3<f64>, Matrix3x2<f64>),
}

/// Places on one ray from the outermost inwards; few beside the image's border.
#[derive(Debug, Clone, Default)]
struct Ray {
    pixels: Vec<(u16, u16)>,
    /// How far outside of the calibration's rim each is.
    outside_px: Vec<f64>,
}

impl Ray {
    /// How far outside the first of two lit places in a row is; `None` where that is the outermost.
    #[inline(always)]
    fn rim(&self, lit: impl Fn((u16, u16)) -> bool) -> Option<f64> {
        // Of two in a row one is the second of a pair of places: the others are looked at beside lit ones alone.
        for (pair, pixels) in self.pixels.chunks_exact(2).enumerate() {
            let second = 2 * pair + 1;
            if !lit(pixels[1]) {
                continue;
            }
            if lit(pixels[0]) {
                return (pair > 0).then(|| self.outside_px[second - 1]);
            }
            if self.pixels.get(second + 1).is_some_and(|pixel| lit(*pixel)) {
                return Some(self.outside_px[second]);
            }
        }
        None
    }
}

impl ImageCircle {
    /// None where the calibration has no rim within the image, or too little of one.
    pub(super) fn new(camera: &Camera) -> Option<Self> {
        // Of a mirrored camera it is -z.
        let seen = |bearing| camera.project(&bearing).filter(|pixel| camera.contains(pixel));
        let pixel = seen(Vector3::z()).or_else(|| seen(-Vector3::z()))?;
        let axis = camera.unproject_jacobian(&pixel)?;
        let mut radii = [f64::NAN; RAYS];
        let mut rays = vec![Ray::default(); RAYS];
        let rows = std::array::from_fn(|i| {
            let (sin, cos) = (std::f64::consts::TAU * i as f64 / RAYS as f64).sin_cos();
            Vector3::new(1.0, cos, sin)
        });
        for ((radius, ray), row) in radii.iter_mut().zip(&mut rays).zip(&rows) {
            let direction = row.yz();
            let at = |t: f64| pixel + direction * t;
            let (mut inside, mut outside) = (0.0, to_border(camera, &pixel, &direction));
            let border = outside;
            if border <= 0.0 || camera.unproject(&at(border)).is_some() {
                continue;
            }
            while outside - inside > 0.1 {
                let middle = 0.5 * (inside + outside);
                if camera.unproject(&at(middle)).is_some() { inside = middle } else { outside = middle }
            }
            *radius = inside;
            let step = (2.0 * REACH * inside / PLACES as f64).max(1.0);
            let distances = (0..PLACES).map(|k| inside * (1.0 + REACH) - step * k as f64);
            let within = distances.filter(|t| *t <= border && *t >= inside * (1.0 - REACH));
            for t in within {
                ray.pixels.push((at(t).x.round() as u16, at(t).y.round() as u16));
                ray.outside_px.push(t - inside);
            }
        }
        let held = radii.iter().filter(|radius| radius.is_finite());
        let count = held.clone().count();
        let radius = held.sum::<f64>() / count as f64;
        (count >= RAYS / 2).then_some(Self { radii, rows, rays, radius, axis })
    }

    /// How far in pixels the circle of an image lies beside the calibration's; `None` where no dark surround tells.
    pub(super) fn off_px(&self, image: &ImageView<'_>) -> Option<Vector2<f64>> {
        let level = |(u, v): (u16, u16)| image.row(usize::from(v)).get(usize::from(u)).copied().unwrap_or(u8::MAX);
        let mut outermost = [u8::MAX; RAYS];
        let mut count = 0;
        for pixel in self.rays.iter().filter_map(|ray| ray.pixels.first()) {
            outermost[count] = level(*pixel);
            count += 1;
        }
        let outermost = &mut outermost[..count];
        outermost.sort_unstable();
        // Where an eighth of the rays begin in the world, as beside an image that cuts the circle, the others still tell.
        let dark = *outermost.get(count.saturating_sub(1) * 7 / 8)?;
        if dark > DARKEST {
            return None;
        }
        let seen = dark + ABOVE;
        let mut rim = [None; RAYS];
        for (rim, ray) in rim.iter_mut().zip(&self.rays) {
            *rim = ray.rim(|pixel| level(pixel) > seen);
        }
        self.circle(&rim)
    }

    /// The offset of the circle on which most of the rim points lie, if most do.
    fn circle(&self, rim: &[Option<f64>; RAYS]) -> Option<Vector2<f64>> {
        let stray = (STRAY * self.radius).max(1.0);
        let points = || self.rows.iter().zip(rim).filter_map(|(row, rim)| rim.map(|rim| (row, rim)));
        let count = points().count();
        let agreeing = |circle: &Vector3<f64>| {
            let circle = *circle;
            points().filter(move |(row, rim)| (row.dot(&circle) - rim).abs() <= stray)
        };
        let mut best = (0, Vector3::zeros());
        for i in 0..RAYS {
            // The circle through three points of a half: the other half may be dark. The outer two lie opposite each other.
            let [quarter, half] = [RAYS / 4, RAYS / 2].map(|turn| (i + turn) % RAYS);
            let (Some(a), Some(b), Some(c)) = (rim[i], rim[quarter], rim[half]) else { continue };
            let larger = 0.5 * (a + c);
            let [along, across] = [i, quarter].map(|i| self.rows[i].yz());
            let off = along * (a - larger) + across * (b - larger);
            let circle = Vector3::new(larger, off.x, off.y);
            let agree = agreeing(&circle).count();
            if agree > best.0 {
                best = (agree, circle);
            }
            // Few stray from it: no other is far from this one.
            if agree * 8 >= count * 7 {
                break;
            }
        }
        let (mut agree, mut circle) = best;
        for _ in 0..2 {
            let (mut squares, mut sums) = (Matrix3::zeros(), Vector3::zeros());
            for (row, rim) in agreeing(&circle) {
                squares += row * row.transpose();
                sums += row * rim;
            }
            circle = squares.lu().solve(&sums)?;
            agree = agreeing(&circle).count();
        }
        let held = self.radii.iter().filter(|radius| radius.is_finite()).count();
        let is_one = 2 * agree >= held.max(count) && circle.x.abs() <= LIKE * self.radius;
        is_one.then(|| Vector2::new(circle.y, circle.z))
    }
}

/// A calibration's centre that is off, as the image circle tells.
#[derive(Debug, Clone, Copy)]
pub(super) struct CentreOff<'a> {
    pub circle: &'a ImageCircle,
    pub robot_from_camera: &'a Matrix3<f64>,
    /// The circle's centre beside the calibration's.
    pub off_px: Vector2<f64>,
}

impl CentreOff<'_> {
    /// By how much a ground normal in the robot frame errs by it: bearings turn about the axis across the offset. Zero for what
    /// may be the lens' own.
    pub(super) fn error_of(&self, normal: &Vector3<f64>) -> Vector3<f64> {
        let (axis, by_px) = &self.circle.axis;
        let off = by_px * self.off_px;
        if off.norm() < OWN_RAD {
            return Vector3::zeros();
        }
        (self.robot_from_camera * axis.cross(&off)).cross(normal)
    }
}

/// How far it is from a pixel to the image's border.
fn to_border(camera: &Camera, from: &Vector2<f64>, direction: &Vector2<f64>) -> f64 {
    let last = [f64::from(camera.width()) - 1.0, f64::from(camera.height()) - 1.0];
    let along = |from: f64, step: f64, last: f64| match step {
        step if step > 0.0 => (last - from) / step,
        step if step < 0.0 => -from / step,
        _ => f64::INFINITY,
    };
    along(from.x, direction.x, last[0]).min(along(from.y, direction.y, last[1]))
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]

    use super::*;
    use crate::camera::{Equidistant, Model};

    const SIDE: u32 = 200;
    const RADIUS: f64 = 80.0;

    fn camera(cx: f64, cy: f64) -> Camera {
        let lens = Equidistant::new(RADIUS / 1.6, cx, cy).unwrap();
        Camera::new(SIDE, SIDE, Model::Equidistant(lens)).unwrap().with_max_theta_rad(1.6).unwrap()
    }

    /// Levels within a circle about (100, 98), dark beyond.
    fn image(level: impl Fn(usize, usize) -> u8) -> Vec<u8> {
        let side = SIDE as usize;
        let pixel = |i: usize| {
            let (u, v) = (i % side, i / side);
            if (u as f64 - 100.0).hypot(v as f64 - 98.0) <= RADIUS { level(u, v) } else { 6 }
        };
        (0..side * side).map(pixel).collect()
    }

    fn off_px(camera: &Camera, image: &[u8]) -> Option<Vector2<f64>> {
        let side = SIDE as usize;
        ImageCircle::new(camera).unwrap().off_px(&ImageView::new(image, side, side, side).unwrap())
    }

    #[test]
    fn the_circle_is_found_to_a_fraction_of_a_pixel_however_dark_a_third_of_the_world_is() {
        for third in [200, 6] {
            let image = image(|u, v| if u < 75 { third } else { 60 + (u * v % 150) as u8 });
            for (cx, cy) in [(100.0, 98.0), (104.0, 98.0), (97.0, 92.5)] {
                let off = off_px(&camera(cx, cy), &image).unwrap();
                assert!((off - Vector2::new(100.0 - cx, 98.0 - cy)).norm() < 0.4, "{off}");
                assert_eq!(off_px(&camera(cx, cy).mirrored(), &image), Some(off));
            }
        }
    }

    #[test]
    fn a_surround_may_be_lighter_on_one_side() {
        let mut image = image(|u, v| 60 + (u * v % 150) as u8);
        for (i, level) in image.iter_mut().enumerate() {
            if *level < 60 && i % SIDE as usize >= 50 {
                *level = 30;
            }
        }
        let off = off_px(&camera(104.0, 98.0), &image).unwrap();
        assert!((off - Vector2::new(-4.0, 0.0)).norm() < 0.4, "{off}");
    }

    #[test]
    fn without_a_dark_surround_or_with_another_rim_nothing_is_told() {
        let (all, lit) = (camera(100.0, 98.0), image(|_, _| 120));
        assert_eq!(off_px(&all, &vec![120; lit.len()]), None);
        assert_eq!(off_px(&all, &vec![6; lit.len()]), None);
        assert_eq!(off_px(&all.clone().with_max_theta_rad(1.45).unwrap(), &lit), None);
        let whole = Camera::new(SIDE, SIDE, all.model().clone()).unwrap();
        assert!(ImageCircle::new(&whole).is_none());
    }

    #[test]
    fn a_centre_beside_the_axis_errs_by_the_angle_that_it_spans() {
        let looking_up = Matrix3::identity();
        let ahead = Matrix3::new(0.0, 0.0, 1.0, -1.0, 0.0, 0.0, 0.0, -1.0, 0.0);
        let circle = ImageCircle::new(&camera(100.0, 98.0)).unwrap();
        let error = |robot_from_camera: &Matrix3<f64>, x: f64, y: f64| {
            let off_px = Vector2::new(x, y);
            CentreOff { circle: &circle, robot_from_camera, off_px }.error_of(&Vector3::z())
        };
        let angle = 5.0 * 1.6 / RADIUS;
        assert!((error(&looking_up, 5.0, 0.0) - Vector3::new(angle, 0.0, 0.0)).norm() < 1e-9);
        assert!((error(&ahead, 0.0, 5.0).norm() - angle).abs() < 1e-9);
        assert!(error(&ahead, 5.0, 0.0).norm() < 1e-9);
        assert_eq!(error(&looking_up, 1.0, 1.0), Vector3::zeros());
    }
}
