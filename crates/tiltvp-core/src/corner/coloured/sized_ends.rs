//! Where edges of the coloured cuboid end: where the outlines of its two faces meet.

use nalgebra::{Vector2, Vector3};

use super::segmentation::Primary;
use super::{ColouredScratch, ERRING_TOGETHER, difference, profile};
use crate::corner::options::ColouredOptions;
use crate::corner::sized::{BoxLine, BoxView, SUPPORT_MIN_PX, SeenEnd, Unseen};
use crate::corner::trace::{RaySearch, trace};
use crate::image::{ColorView, LightTable};

/// Where an edge may end from where its ray does, in pixels: a ray is fitted up to 3 pixels before the last labels on both its
/// sides, which reach as far as the search width of 8 pixels beside it. The farthest first, as lines on the faces may seem to end an edge
/// before; one look's reach apart, so that each sees one of two lines.
const OFFSETS_PX: [f64; 7] = [16.0, 12.0, 8.0, 4.0, 0.0, -4.0, -8.0];

/// How far either end of an outline may be off, in pixels: unlike an edge between two faces, of which one primary falls where the
/// other rises, it has one bright side, and what lies behind it. Poses of rendered cuboids have a NEES of 2 of 6 with it.
const OUTLINE_SIGMA_PX: f64 = 0.15;

/// The search for lines of a cuboid, whose line and reach are set for each.
pub(in crate::corner) fn box_search(options: &ColouredOptions) -> RaySearch {
    RaySearch {
        normal: Vector3::z(),
        vertex: Vector3::x(),
        from_rad: 0.0,
        to_rad: 0.0,
        search_px: options.search_px,
        step_min: options.step_min,
        step_share_min: 0.0,
        threshold_px: options.threshold_px,
        share_min: 0.0,
        erring_together: ERRING_TOGETHER,
        ray_sigma_px: OUTLINE_SIGMA_PX,
    }
}

/// The end of an edge, the farthest that holds.
pub(in crate::corner) fn find_end(
    view: &BoxView<'_>,
    axis: usize,
    image: &ColorView<'_>,
    options: &ColouredOptions,
    light: &LightTable,
    scratch: &mut ColouredScratch,
) -> Result<SeenEnd, Unseen> {
    let [top, left, right] = options.lines.color.faces;
    // The face that holds two edges: x and z the top, y and z the left one, x and y the right one.
    let face = |a: usize, b: usize| match 3 - a - b {
        0 => left,
        1 => top,
        _ => right,
    };
    let ray = view.corner.rays()[axis];
    let last = view.corner.vertex().angle(&ray.toward);
    let px_per_rad = view.camera.px_per_rad(&ray.toward).ok_or(Unseen::Outside)?;
    let candidates = OFFSETS_PX.map(|offset| last + offset / px_per_rad);
    let memory = &mut scratch.trace;
    view.end(axis, &candidates, &mut |line, search| match line {
        BoxLine::Edge(own) => {
            let faces = (face(own, (own + 1) % 3), face(own, (own + 2) % 3));
            trace(view.camera, search, SUPPORT_MIN_PX, difference(image, light, faces, [1.0; 2]), memory)
        }
        BoxLine::Far { end_of, along } => {
            trace(view.camera, search, SUPPORT_MIN_PX, outline(image, light, face(end_of, along)), memory)
        }
    })
}

/// How much of a face's primary there is beyond the mean of the others: what is behind its outline has little of it.
fn outline(
    image: &ColorView<'_>,
    light: &LightTable,
    face: Primary,
) -> impl Fn(&Vector2<f64>, &Vector2<f64>, &mut [f64]) -> bool {
    let own = face.byte();
    profile(image, light, move |levels| 1.5 * levels[own] - 0.5 * levels.iter().sum::<f64>())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_outline_is_of_the_primary_beyond_the_mean_of_the_others() {
        let bytes: Vec<u8> = (0..12 * 12).flat_map(|k| if k % 12 < 6 { [10, 50, 90] } else { [40, 60, 80] }).collect();
        let (image, light) = (ColorView::new(&bytes, 12, 12, 36).unwrap(), LightTable::new(1.0).unwrap());
        for (face, expected) in
            [(Primary::Red, [60.0, 30.0]), (Primary::Green, [0.0, 0.0]), (Primary::Blue, [-60.0, -30.0])]
        {
            let mut levels = [0.0; 5];
            assert!(outline(&image, &light, face)(&Vector2::new(5.5, 6.0), &Vector2::x(), &mut levels));
            let middle = 0.5 * (expected[0] + expected[1]);
            let all = [expected[0], expected[0], middle, expected[1], expected[1]];
            assert!(
                levels.iter().zip(all).all(|(level, expected)| (level - expected).abs() < 1e-9),
                "{face:?} {levels:?}"
            );
        }
    }
}
