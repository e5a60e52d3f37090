//! The rays of a camera's pixels, made once, and where they meet panoramas.

use nalgebra::{Matrix3, Vector2, Vector3};

use super::calibrated::Camera;
use super::equirectangular::Equirectangular;
use super::model::CameraModel;
use crate::error::{Error, Result};
use crate::interrupt::check;

/// `samples` x `samples` rays in each pixel that sees anything, at the centres of as many equal parts of it.
///
/// What a panorama looks like through the camera is found by looking up each ray ([`panorama_map`](Self::panorama_map)) and
/// averaging the `samples` squared values of each pixel.
#[derive(Debug, Clone, PartialEq)]
pub struct PixelRays {
    samples: usize,
    /// Places in row order of the pixels in which some ray is seen.
    pixels: Vec<u32>,
    /// Unit bearings; ray `k` of pixel `i` is at `k * pixels.len() + i`. NaN where the lens has no answer.
    bearings: Vec<[f32; 3]>,
}

impl PixelRays {
    /// Where [`panorama_map`](Self::panorama_map) sends the rays that the lens does not see: far outside any panorama.
    pub const OUTSIDE_PX: f32 = -1e6;

    /// The rays of a camera.
    ///
    /// # Errors
    /// [`Error::InvalidOption`] unless `samples` is from 1 to 16, and for a camera of more than 2^32 pixels.
    pub fn new(camera: &Camera, samples: usize) -> Result<Self> {
        if !(1..=16).contains(&samples) {
            return Err(Error::option("samples", samples, "rays per pixel and side from 1 to 16"));
        }
        let (width, height) = (camera.width(), camera.height());
        let Some(count) = width.checked_mul(height) else {
            return Err(Error::option("camera", format!("{width} x {height}"), "fewer than 2^32 pixels"));
        };
        let step = 1.0 / samples as f64;
        let offsets: Vec<f64> = (0..samples).map(|k| (k as f64 + 0.5) * step - 0.5).collect();
        let mut pixels = Vec::new();
        let mut by_pixel = Vec::new();
        let mut rays = vec![[f32::NAN; 3]; samples * samples];
        for place in 0..count {
            let (u, v) = (f64::from(place % width), f64::from(place / width));
            if u == 0.0 {
                check();
            }
            let places = offsets.iter().flat_map(|dv| offsets.iter().map(move |du| Vector2::new(u + du, v + dv)));
            let mut is_seen = false;
            for (ray, pixel) in rays.iter_mut().zip(places) {
                let bearing = camera.unproject(&pixel);
                is_seen |= bearing.is_some();
                *ray = bearing.map_or([f32::NAN; 3], |b| [b.x as f32, b.y as f32, b.z as f32]);
            }
            if is_seen {
                pixels.push(place);
                by_pixel.extend_from_slice(&rays);
            }
        }
        let n = samples * samples;
        let bearings = (0..n).flat_map(|k| by_pixel.iter().skip(k).step_by(n).copied()).collect();
        Ok(Self { samples, pixels, bearings })
    }

    /// Rays per pixel and side.
    pub fn samples(&self) -> usize {
        self.samples
    }

    /// Places in row order (`v width + u`) of the pixels in which some ray is seen.
    pub fn pixels(&self) -> &[u32] {
        &self.pixels
    }

    /// How many rays there are: `samples` squared for each of [`pixels`](Self::pixels).
    pub fn len(&self) -> usize {
        self.bearings.len()
    }

    /// Whether no pixel sees anything.
    pub fn is_empty(&self) -> bool {
        self.bearings.is_empty()
    }

    /// The pixels of a panorama that the rays meet; ray `k` of pixel `i` is at `k * pixels().len() + i`, and
    /// [`OUTSIDE_PX`](Self::OUTSIDE_PX) where the lens sees nothing.
    ///
    /// `rotation` takes bearings of the camera to those of the panorama, whose `z` is at longitude 0 and whose `y` is down.
    ///
    /// # Errors
    /// [`Error::InvalidArgument`] if `u_px` or `v_px` is not of length [`len`](Self::len).
    pub fn panorama_map(
        &self,
        panorama: &Equirectangular,
        rotation: &Matrix3<f64>,
        u_px: &mut [f32],
        v_px: &mut [f32],
    ) -> Result<()> {
        if u_px.len() != self.len() || v_px.len() != self.len() {
            let got = format!("{} and {} places", u_px.len(), v_px.len());
            return Err(Error::argument("u_px, v_px", got, format!("{} places, as many as rays", self.len())));
        }
        for ((bearing, u), v) in self.bearings.iter().zip(u_px).zip(v_px) {
            let place = panorama.project(&(rotation * Vector3::from(bearing.map(f64::from))));
            (*u, *v) = place.map_or((Self::OUTSIDE_PX, Self::OUTSIDE_PX), |p| (p.x as f32, p.y as f32));
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::camera::Equidistant;

    fn fisheye() -> Camera {
        let lens = Equidistant::new(30.0, 45.5, 40.0).expect("a lens");
        Camera::new(91, 81, lens.into()).and_then(|camera| camera.with_max_theta_rad(1.0)).expect("a camera")
    }

    #[test]
    fn rays_are_those_of_the_camera_and_meet_the_panorama_where_it_sees_them() {
        let camera = fisheye();
        let panorama = Equirectangular::new(720, 360).expect("a panorama");
        let rotation = *nalgebra::Rotation3::from_euler_angles(0.3, -0.2, 1.0).matrix();
        let rays = PixelRays::new(&camera, 3).expect("rays");
        let (n, seen) = (rays.pixels().len(), rays.pixels().to_vec());
        assert!(n > 2000 && n < 91 * 81 && rays.len() == 9 * n);
        let (mut u, mut v) = (vec![0.0; rays.len()], vec![0.0; rays.len()]);
        rays.panorama_map(&panorama, &rotation, &mut u, &mut v).expect("lengths");
        let mut unseen = 0;
        for (i, place) in seen.iter().enumerate() {
            for k in 0..9 {
                let (du, dv) = ((k % 3) as f64 / 3.0 - 1.0 / 3.0, (k / 3) as f64 / 3.0 - 1.0 / 3.0);
                let pixel = Vector2::new(f64::from(place % 91) + du, f64::from(place / 91) + dv);
                let (found_u, found_v) = (u[k * n + i], v[k * n + i]);
                if let Some(bearing) = camera.unproject(&pixel) {
                    let expected = panorama.project(&(rotation * bearing)).expect("the whole sphere");
                    assert!(
                        (f64::from(found_u) - expected.x).abs() < 2e-3
                            && (f64::from(found_v) - expected.y).abs() < 2e-3
                    );
                } else {
                    unseen += 1;
                    assert_eq!((found_u, found_v), (PixelRays::OUTSIDE_PX, PixelRays::OUTSIDE_PX));
                }
            }
        }
        assert!(unseen > 0);
    }

    #[test]
    fn wrong_questions_are_refused() {
        let camera = fisheye();
        assert!(PixelRays::new(&camera, 0).is_err() && PixelRays::new(&camera, 17).is_err());
        let rays = PixelRays::new(&camera, 1).expect("rays");
        let panorama = Equirectangular::new(20, 10).expect("a panorama");
        let mut u = vec![0.0; rays.len()];
        assert!(!rays.is_empty() && rays.samples() == 1);
        assert!(rays.panorama_map(&panorama, &Matrix3::identity(), &mut u, &mut [0.0]).is_err());
    }
}
