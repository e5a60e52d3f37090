//! Renders a room through a 185-degree equidistant fisheye and writes the picture:
//! `render_room KIND SEED OUT.png [ALPHA_DEG BETA_DEG] [gray|rgb|panorama|pinhole]`.

use std::time::Instant;

use nalgebra::{Matrix3, Vector3};
use tiltvp_core::geometry::Tilt;
use tiltvp_synth::{RenderOptions, RoomKind, RoomOptions, View, World, render, render_panorama};

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let args: Vec<String> = std::env::args().skip(1).collect();
    let arg = |k: usize, default: &str| args.get(k).cloned().unwrap_or_else(|| default.to_owned());
    let kind: RoomKind = arg(0, "office").parse()?;
    let seed: u64 = arg(1, "0").parse()?;
    let out = arg(2, "room.png");
    let tilt =
        Tilt::from_alpha_beta(arg(3, "0").parse::<f64>()?.to_radians(), arg(4, "0").parse::<f64>()?.to_radians());
    let mode = arg(5, "gray");

    let start = Instant::now();
    let world = World::new(&RoomOptions::new(kind, seed))?;
    let built = start.elapsed();
    let pose = world.free_poses(1, seed)?[0];

    let lens = |x: f64, y: f64| {
        let (dx, dy) = (x - 319.5, y - 239.5);
        let theta = dx.hypot(dy) / 139.7;
        let (s, c) = theta.sin_cos();
        let phi = dy.atan2(dx);
        (theta <= 92.5f64.to_radians()).then(|| Vector3::new(s * phi.cos(), s * phi.sin(), c))
    };
    let options = RenderOptions { noise_sigma: 2.0, ..RenderOptions::default() };
    let start = Instant::now();
    let pinhole = |x: f64, y: f64| Some(Vector3::new(x - 319.5, y - 239.5, 330.0).normalize());
    // The pinhole looks forward: its optical axis is the robot's x, its image's right the robot's -y.
    let forward = Matrix3::new(0.0, 0.0, 1.0, -1.0, 0.0, 0.0, 0.0, -1.0, 0.0);
    let rendering = match mode.as_str() {
        "panorama" => render_panorama(&world, pose, 1.3, 512, &options)?,
        "pinhole" => {
            let view = View::new(&pinhole, 640, 480, pose);
            render(&world, &View { tilt, robot_from_camera: forward, camera_height_m: 1.3, ..view }, &options)?
        }
        _ => render(&world, &View { tilt, ..View::new(&lens, 640, 480, pose) }, &options)?,
    };
    println!("{kind} {seed}: built in {built:.2?}, rendered in {:.2?}", start.elapsed());
    println!("{} vertical edges, {pose:?}", world.vertical_edges().len());

    let image = rendering.image;
    let file = std::io::BufWriter::new(std::fs::File::create(out)?);
    let mut encoder = png::Encoder::new(file, u32::try_from(image.width_px)?, u32::try_from(image.height_px)?);
    encoder.set_color(if mode == "gray" { png::ColorType::Grayscale } else { png::ColorType::Rgb });
    encoder.write_header()?.write_image_data(if mode == "gray" { &image.gray } else { &image.rgb })?;
    Ok(())
}
