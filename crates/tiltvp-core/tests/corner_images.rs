//! Corners of an image of a cube that a formula draws: where its vertex is, and in which half-planes its edges lie.

#![allow(clippy::unwrap_used)]

mod scene;

use nalgebra::{Rotation3, Vector3};
use scene::cube;
use tiltvp_core::corner::{CornerDetector, CornerFeature, DetectorOptions};
use tiltvp_core::image::{ColorView, ImageView};

/// A tenth of a pixel.
const CLOSE_RAD: f64 = 0.1 / 175.5;

fn detector(method: &str) -> CornerDetector {
    CornerDetector::new(cube::pinhole(), DetectorOptions::for_method(method).unwrap(), None).unwrap()
}

/// How far the vertex of a corner is from the cube's, and how far the farthest of the cube's edges is from a ray of it, radians.
fn errors(corner: &CornerFeature, right_m: f64) -> (f64, f64) {
    let turn =
        Rotation3::from_axis_angle(&Vector3::x_axis(), 0.5) * Rotation3::from_axis_angle(&Vector3::y_axis(), -0.7);
    let vertex = Vector3::new(-right_m, -0.05, 0.8);
    let off = |axis: usize| {
        let along = turn * Vector3::ith(axis, 0.3);
        let normal = vertex.cross(&along).normalize();
        corner.rays().iter().map(|ray| ray.normal.angle(&normal)).fold(f64::INFINITY, f64::min)
    };
    (corner.vertex().angle(&vertex), (0..3).map(off).fold(0.0, f64::max))
}

#[test]
fn the_corner_of_a_coloured_cube_is_where_it_is() {
    let detector = detector("coloured");
    let mut scratch = detector.scratch();
    for right_m in [0.0, 0.12, -0.1] {
        let bytes = cube::cube(right_m);
        let corner = detector.detect_coloured(&cube::view(&bytes), None, &mut scratch).unwrap().unwrap();
        let (vertex, rays) = errors(&corner, right_m);
        assert!(vertex < CLOSE_RAD && rays < 0.01, "{right_m}: {vertex} {rays}");
    }
    let wall = vec![150; 3 * 320 * 180];
    assert!(detector.detect_coloured(&cube::view(&wall), None, &mut scratch).unwrap().is_none());
}

#[test]
fn the_corner_of_a_grey_cube_is_among_those_that_are_found() {
    let detector = detector("general");
    let mut scratch = detector.scratch();
    let mut found = Vec::new();
    for right_m in [0.0, 0.12] {
        let grey: Vec<u8> = cube::cube(right_m).chunks(3).map(|bgr| bgr[1] / 2 + bgr[2] / 2).collect();
        let image = ImageView::new(&grey, 320, 180, 320).unwrap();
        detector.detect_general(&image, None, &mut scratch, &mut found).unwrap();
        let best = found.iter().map(|corner| errors(corner, right_m)).min_by(|a, b| a.0.total_cmp(&b.0)).unwrap();
        assert!(best.0 < 2.0 * CLOSE_RAD && best.1 < 0.01, "{right_m}: {best:?} of {}", found.len());
        // Each vertex once: the others are 8 pixels away or more.
        let near = |a: &CornerFeature, b: &CornerFeature| a.vertex().angle(&b.vertex()) < 60.0 * CLOSE_RAD;
        let pairs = found.iter().enumerate().flat_map(|(k, a)| found[..k].iter().map(move |b| (a, b)));
        assert_eq!(pairs.filter(|(a, b)| near(a, b)).count(), 0, "{right_m}: of {}", found.len());
    }
    let wall = vec![150; 320 * 180];
    let image = ImageView::new(&wall, 320, 180, 320).unwrap();
    detector.detect_general(&image, None, &mut scratch, &mut found).unwrap();
    assert!(found.is_empty());
}

#[test]
fn an_image_of_another_size_is_refused() {
    let (coloured, general) = (detector("coloured"), detector("general"));
    let bytes = vec![0; 3 * 320 * 180];
    let turned = ColorView::new(&bytes, 180, 320, 3 * 180).unwrap();
    let told = coloured.detect_coloured(&turned, None, &mut coloured.scratch()).unwrap_err().to_string();
    assert!(told.contains("320 x 180 pixels") && told.contains("180 x 320 (rows x columns)"), "{told}");
    let small = ImageView::new(&bytes, 320, 179, 320).unwrap();
    assert!(general.detect_general(&small, None, &mut general.scratch(), &mut Vec::new()).is_err());
}
