//! The tilt of one picture of an upward fisheye: `tilt IMAGE.png FOCAL_PX`, with the focal length in pixels per radian.

use std::fs::File;
use std::io::BufReader;

use nalgebra::Matrix3;
use tiltvp_core::camera::{Camera, Equidistant, Model};
use tiltvp_core::image::ImageView;
use tiltvp_core::tilt::{TiltEstimator, TiltOptions};

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let [path, focal_px] = arguments.as_slice() else { return Err("tilt IMAGE.png FOCAL_PX".into()) };
    let (gray, width, height) = read_gray(path)?;

    // The optical axis is taken to be in the middle. Calibrations of other lenses have types of their own in `camera`.
    let (cx, cy) = (0.5 * f64::from(width) - 0.5, 0.5 * f64::from(height) - 0.5);
    let lens = Model::Equidistant(Equidistant::new(focal_px.parse()?, cx, cy)?);
    let camera = Camera::new(width, height, lens)?.with_max_theta_rad(92.5f64.to_radians())?;

    // The tables of a camera are made once; one estimator serves many images and threads, each with its own scratch.
    let estimator = TiltEstimator::new(camera, Matrix3::identity(), TiltOptions::for_method("refined")?)?;
    let image = ImageView::new(&gray, width as usize, height as usize, width as usize)?;
    let estimate = estimator.estimate(&image, &mut estimator.scratch())?;
    match estimate.tilt {
        Some(tilt) => {
            let (alpha, beta) = (tilt.alpha_rad().to_degrees(), tilt.beta_rad().to_degrees());
            println!("leans by {alpha:.2} degrees towards {beta:.0} degrees, confidence {:.2}", estimate.confidence);
        }
        None => println!("no tilt: {}", estimate.stop),
    }
    Ok(())
}

/// The grey levels of a PNG of 8-bit grey in row order, its width and its height.
fn read_gray(path: &str) -> Result<(Vec<u8>, u32, u32), Box<dyn std::error::Error>> {
    let mut reader = png::Decoder::new(BufReader::new(File::open(path)?)).read_info()?;
    let size = reader.output_buffer_size().ok_or("an image that does not fit into memory")?;
    let mut pixels = vec![0; size];
    let info = reader.next_frame(&mut pixels)?;
    if (info.color_type, info.bit_depth) != (png::ColorType::Grayscale, png::BitDepth::Eight) {
        return Err(format!("{path}: {:?}, expected a PNG of 8-bit grey", info.color_type).into());
    }
    Ok((pixels, info.width, info.height))
}
