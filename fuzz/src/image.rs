//! Images of any size, stride and content: refused, or looked at alike wherever their rows lie.

use std::cell::RefCell;
use std::collections::HashMap;
use std::sync::Arc;

use nalgebra::{Matrix3, Vector3};
use tiltvp_core::camera::{Camera, Model};
use tiltvp_core::corner::{CornerDetector, CornerFeature, CornerScratch, DetectorOptions};
use tiltvp_core::filter::positive_semidefinite;
use tiltvp_core::geometry::Tilt;
use tiltvp_core::image::{ColorView, ImageView, LightTable};
use tiltvp_core::lines::{LineExtractor, LineMethod, LineOptions, LineScratch, Lines};
use tiltvp_core::tilt::{LevelMap, Leveller, METHODS, Scratch, TiltEstimate, TiltEstimator, TiltOptions};

use crate::bytes::Bytes;
use crate::picture::{Picture, SMALL};

/// Views of any bytes, and a picture before whatever looks at pictures.
pub fn image(data: &[u8]) {
    let mut bytes = Bytes::new(data);
    views(&mut bytes);
    LOOKERS.with_borrow_mut(|lookers| {
        let which = usize::from(bytes.word()) % (SMALL.len() * KINDS);
        let camera = &SMALL[which / KINDS];
        let Some(looker) = lookers.entry(which).or_insert_with(|| looker(camera, which % KINDS)) else { return };
        match looker {
            Looker::Tilt(estimator, scratch) => {
                let picture = Picture::of(camera, 1, &mut bytes);
                let found = estimator.estimate(&picture.view(), scratch).expect("an image of the camera");
                estimate(&found, estimator.region_pixels());
                // As long again.
                if !bytes.byte().is_multiple_of(8) {
                    return;
                }
                let packed = picture.packed();
                let (_, width, height, _) = picture.bytes();
                let packed = ImageView::new(&packed, width, height, width).expect("packed rows");
                let again = estimator.estimate(&packed, scratch).expect("an image of the camera");
                let told =
                    |one: &TiltEstimate| (one.tilt, one.edge_pixels, one.inlier_pixels, one.confidence, one.iterations);
                assert_eq!(told(&found), told(&again), "the stride tells");
            }
            Looker::Lines(extractor, scratch) => {
                let picture = Picture::of(camera, 1, &mut bytes);
                let tilt = bytes.flag().then(|| Tilt::from_alpha_beta(bytes.within(0.0, 0.4), bytes.within(-3.2, 3.2)));
                lines(extractor, scratch, &picture.view(), tilt.as_ref());
            }
            Looker::Corners(detector, scratch) => corners(detector, scratch, &mut bytes),
            Looker::Level(leveller) => {
                let tilt = Tilt::from_alpha_beta(bytes.mostly(0.0, 0.5), bytes.mostly(-3.2, 3.2));
                level(&leveller.map(&tilt), leveller.camera());
            }
        }
    });
}

/// What looks at pictures, with its memory.
enum Looker {
    Tilt(Box<TiltEstimator>, Scratch),
    Lines(Box<LineExtractor>, LineScratch),
    Corners(Box<CornerDetector>, CornerScratch),
    Level(Arc<Leveller>),
}

/// How many look at the pictures of one camera.
const KINDS: usize = METHODS.len() + LineMethod::NAMES.len() + DETECTORS.len() + 1;

/// Methods of corner detectors.
const DETECTORS: [&str; 3] = ["coloured", "general", "paper"];

thread_local! {
    /// Those that have been asked for, which are kept: each takes a hundred times what a picture takes.
    static LOOKERS: RefCell<HashMap<usize, Option<Looker>>> = RefCell::default();
}

/// One of [`KINDS`]; none where the camera does not see what a method looks at.
fn looker(camera: &Camera, kind: usize) -> Option<Looker> {
    let (camera, upright) = (camera.clone(), Matrix3::identity());
    if let Some(method) = METHODS.get(kind) {
        let options = TiltOptions::for_method(method).expect("one of the methods");
        let estimator = TiltEstimator::new(camera, upright, options).ok()?;
        let scratch = estimator.scratch();
        return Some(Looker::Tilt(estimator.into(), scratch));
    }
    let kind = kind - METHODS.len();
    if let Some(method) = LineMethod::NAMES.get(kind) {
        let options = LineOptions::for_method(method).expect("one of the methods");
        let extractor = LineExtractor::new(camera, upright, options).ok()?;
        let scratch = extractor.scratch();
        return Some(Looker::Lines(extractor.into(), scratch));
    }
    let kind = kind - LineMethod::NAMES.len();
    if let Some(method) = DETECTORS.get(kind) {
        let options = DetectorOptions::for_method(method).expect("one of the methods");
        let detector = CornerDetector::new(camera, options, None).ok()?;
        let scratch = detector.scratch();
        return Some(Looker::Corners(detector.into(), scratch));
    }
    Leveller::new(camera.clone(), &upright, camera, &upright).ok().map(|leveller| Looker::Level(leveller.into()))
}

/// A map whose places are of the camera's pixels, or of none, where it says that something is seen.
fn level(map: &LevelMap, camera: &Camera) {
    // Right of a panorama's last column is its first one.
    let beyond = u32::from(matches!(camera.model(), Model::Equirectangular(_)));
    let last = [camera.width() - 1 + beyond, camera.height() - 1].map(|side| side as f32);
    for (number, first) in (0..map.height()).step_by(map.strip_rows()).enumerate() {
        let pixels = map.strip_rows().min(map.height() - first) * map.width();
        let (mut u, mut v) = (vec![f32::NAN; pixels], vec![f32::NAN; pixels]);
        let seen = map.write_strip(number, [&mut u, &mut v], -1.0).expect("as many numbers as pixels");
        for (place, (u, v)) in u.into_iter().zip(v).enumerate().filter(|(at, _)| seen.contains(&(at % map.width()))) {
            let is_place = (0.0..=last[0]).contains(&u) && (0.0..=last[1]).contains(&v);
            assert!(is_place || (u, v) == (-1.0, -1.0), "({u}, {v}) at {place} of strip {number} of {camera:?}");
        }
    }
}

/// Any bytes as an image of any size.
fn views(bytes: &mut Bytes<'_>) {
    let side = |bytes: &mut Bytes<'_>| match bytes.byte() {
        255 => usize::MAX,
        254 => usize::MAX / 2 + 1,
        253 => bytes.long() as usize,
        n => usize::from(n) % 24,
    };
    let (width, height, stride) = (side(bytes), side(bytes), side(bytes));
    let data = bytes.0;
    let places = [0, 1, height.wrapping_sub(1), height, usize::MAX];
    if let Ok(view) = ImageView::new(data, width, height, stride) {
        for v in places {
            assert_eq!(view.row(v).len(), if v < height { width } else { 0 });
        }
        let light = LightTable::new(2.2).expect("an exponent");
        let (u, v) = (bytes.mostly(-1.0, 24.0), bytes.mostly(-1.0, 24.0));
        assert!(light.gray(&view, u, v).is_none_or(|light| (0.0..=255.1).contains(&light)));
    }
    if let Ok(view) = ColorView::new(data, width, height, stride) {
        for v in places {
            assert_eq!(view.row(v).len(), if v < height { 3 * width } else { 0 });
        }
    }
}

/// An estimate that agrees with itself.
pub(crate) fn estimate(found: &TiltEstimate, region_pixels: usize) {
    assert!(found.inlier_pixels <= found.prefiltered_pixels, "{found:?}");
    assert!(found.prefiltered_pixels <= found.edge_pixels && found.edge_pixels <= region_pixels, "{found:?}");
    assert!((0.0..=1.0).contains(&found.confidence), "{found:?}");
    assert_eq!(found.tilt.is_none(), found.stop.is_failure(), "{found:?}");
    assert_eq!(found.residual_rms.is_finite(), found.tilt.is_some(), "{found:?}");
    let covariance = found.covariance_rad2;
    if covariance.iter().all(|x| x.is_finite()) {
        assert!(found.tilt.is_some() && positive_semidefinite(&covariance), "{found:?}");
        assert!(covariance.symmetric_eigenvalues().min() > 0.0, "{found:?}");
    } else {
        assert!(covariance[(0, 0)].is_infinite() && covariance[(1, 1)].is_infinite(), "{found:?}");
        assert_eq!(found.confidence, 0.0, "{found:?}");
    }
    if let Some(tilt) = found.tilt {
        assert!((tilt.normal().norm() - 1.0).abs() < 1e-9, "{found:?}");
    }
}

fn lines(extractor: &LineExtractor, scratch: &mut LineScratch, image: &ImageView<'_>, tilt: Option<&Tilt>) {
    let mut found = Lines::default();
    extractor.extract(image, tilt, None, scratch, &mut found).expect("an image of the camera");
    assert!(found.lines.is_sorted_by(|a, b| a.bearing_rad <= b.bearing_rad), "{found:?}");
    for line in &found.lines {
        assert!(line.bearing_rad.abs() <= std::f64::consts::PI && line.sigma_rad > 0.0, "{line:?}");
        assert!(line.sigma_rad.is_finite() && line.polarity.abs() <= 1.0, "{line:?}");
        assert!(line.elevation_min_rad <= line.elevation_max_rad, "{line:?}");
    }
    let mut descriptors = Vec::new();
    extractor.describe(image, &found, scratch, &mut descriptors).expect("lines of the image");
    assert!(descriptors.iter().all(|x| x.is_finite()), "{found:?}");
}

fn corners(detector: &CornerDetector, scratch: &mut CornerScratch, bytes: &mut Bytes<'_>) {
    let mut found = Vec::new();
    if detector.options().method.name() == "general" {
        let picture = Picture::of(detector.camera(), 1, bytes);
        let vertical = bytes.flag().then(Vector3::z);
        detector
            .detect_general(&picture.view(), vertical.as_ref(), scratch, &mut found)
            .expect("an image of the camera");
    } else {
        let picture = Picture::of(detector.camera(), 3, bytes);
        let (data, width, height, stride) = picture.bytes();
        let view = ColorView::new(data, width / 3, height, stride).expect("rows that are all there");
        found.extend(detector.detect_coloured(&view, None, scratch).expect("an image of the camera"));
    }
    found.iter().for_each(feature);
}

/// A feature of finite numbers and unit bearings.
pub(crate) fn feature(corner: &CornerFeature) {
    assert!((corner.vertex().norm() - 1.0).abs() < 1e-9, "{corner:?}");
    let spread = corner.vertex_covariance();
    assert!(spread.amax() < 1e-290 || positive_semidefinite(&spread), "{corner:?}");
    assert!(corner.rays().iter().all(tiltvp_core::corner::FittedRay::is_valid), "{corner:?}");
    assert!(corner.chi_square() >= 0.0, "{corner:?}");
}
