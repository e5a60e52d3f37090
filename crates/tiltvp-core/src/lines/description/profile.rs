//! The profile of a line: grey levels close beside it on both sides, over the logarithm of the height along it.
//!
//! A place at the height `h` above the camera and at the distance `d` is seen at the elevation `e` with `tan e = h / d`. Over
//! `ln |tan e|` a camera that comes nearer shifts the whole profile and changes nothing else, so that profiles are compared at
//! any distance, and the shift that fits tells the ratio of the distances.

use super::patch::{Chart, level_at};
use super::profile_rows::{ROWS, VALUES, elevation_rad};
use crate::image::ImageView;
use crate::lines::line::Lines;
use crate::lines::tables::LineTables;

/// Across the line to the samples whose mean is a value, radians: 0.65 to 0.95 degrees. The edge itself blurs over a pixel
/// or two; farther samples are soon on something else. With another strip at 1.2 degrees fewer lines passed at the same share of
/// false ones.
const ACROSS_RAD: [f64; 3] = [0.0113, 0.014, 0.0166];

/// Writes the profiles of lines, one after the other; NaN where the world is not seen.
pub(crate) fn describe(
    image: &ImageView<'_>,
    tables: &LineTables,
    chart: &Chart<'_>,
    lines: &Lines,
    out: &mut Vec<f32>,
) {
    out.clear();
    out.reserve(lines.lines.len() * VALUES);
    for line in &lines.lines {
        for side in [-1.0, 1.0] {
            out.extend((0..ROWS).map(|row| {
                let place = chart.around(line.bearing_rad, elevation_rad(row));
                let level = |across: f64| {
                    place(0.0, side * across)
                        .map_or(f32::NAN, |pixel| level_at(image, tables, pixel.x as f32, pixel.y as f32))
                };
                ACROSS_RAD.map(level).iter().sum::<f32>() / ACROSS_RAD.len() as f32
            }));
        }
    }
}
