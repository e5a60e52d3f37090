//! Every attitude of a box's corner in one picture: `corner FOCAL_PX CX CY`, and then the pixels U V of the vertex and of a point
//! on each of its edges x, y (the vertical one) and z.

use nalgebra::Vector2;
use tiltvp_core::camera::{Camera, Model, Pinhole};
use tiltvp_core::corner::{CornerFeature, FittedRay, IncludedAngle, corner_attitudes};

/// How well a person points at an edge.
const SIGMA_PX: f64 = 0.5;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let numbers: Vec<f64> = std::env::args().skip(1).map(|argument| argument.parse()).collect::<Result<_, _>>()?;
    let [focal_px, cx, cy, u, v, points @ ..] = numbers.as_slice() else {
        return Err("corner FOCAL_PX CX CY U V  U V  U V  U V".into());
    };
    let (&[u_x, v_x, u_y, v_y, u_z, v_z], vertex) = (<&[f64; 6]>::try_from(points)?, Vector2::new(*u, *v));
    let (width, height) = ((2.0 * cx) as u32 + 1, (2.0 * cy) as u32 + 1);
    let lens = Pinhole::new([*focal_px, *focal_px], [*cx, *cy], &[])?;
    let camera = Camera::new(width, height, Model::Pinhole(lens))?;

    // A ray is a great circle with covariance; in a pinhole's picture it is straight from the vertex to the point.
    let ray = |u: f64, v: f64| {
        let end = Vector2::new(u, v);
        let pixels: Vec<_> = (0..=20u8).map(|i| vertex.lerp(&end, f64::from(i) / 20.0)).collect();
        FittedRay::fit_pixels(&camera, &pixels, SIGMA_PX, &end).ok_or("a point on the vertex, or outside the picture")
    };
    let rays = [ray(u_x, v_x)?, ray(u_y, v_y)?, ray(u_z, v_z)?];
    let feature = CornerFeature::from_rays(rays).ok_or("three rays that meet nowhere")?;

    let attitudes = corner_attitudes(&feature, &IncludedAngle::RIGHT)?;
    for attitude in attitudes.iter() {
        let hand = if attitude.is_right_handed() { "right-handed" } else { "left-handed" };
        let sigma = attitude.covariance.diagonal().max().sqrt().to_degrees();
        println!("{hand}, known to {sigma:.2} degrees, camera_from_object{:.4}", attitude.camera_from_object);
    }
    if attitudes.is_empty() { Err("no corner of right angles looks like this".into()) } else { Ok(()) }
}
