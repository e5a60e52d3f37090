//! The Python extension `tiltvp._core`: checks, converts, releases the interpreter, calls the core, wraps.

mod array;
mod call;
mod camera;
mod complementary;
mod convert;
mod corner;
mod drive;
mod field;
mod forks;
mod laboratory;
mod level;
mod lines;
mod options;
mod rays;
mod reader;
mod scratch;
mod segments;
mod selfcalib;
mod shared;
mod stereo;
mod synth;
mod tilt;
mod value;
mod yaml;

use pyo3::prelude::*;

/// The variable of the environment that caps the level of vectors.
const SIMD_VARIABLE: &str = "TILTVP_SIMD";

/// What Rust computes for the package: cameras, the tilt of images, common directions, vertical lines, rooms.
///
/// Arrays that come in may have any strides and any real dtype unless a shape and dtype is asked for; they are never
/// altered. Arrays that go out are fresh. Angles are radians. Equation numbers are those of Fleer 2017 (see the README)
/// where nothing else is said.
///
/// `METHODS` are the methods of `TiltEstimator`, `LINE_METHODS` those of `LineExtractor`, `CORNER_METHODS` those of
/// `CornerDetector`, `CALIBRATION_METHODS` those of `SelfCalibrator`, the default first. `CAMERA_MODELS` are the models of
/// `Camera`, `ROOM_KINDS` the kinds of `Room`, and `WALL_PATTERNS` what its walls may have in common. `SIMD_LEVELS` are
/// what `simd_level` may say on this machine, the widest last.
#[pymodule]
mod _core {
    use pyo3::prelude::*;

    use super::SIMD_VARIABLE;

    #[pymodule_export]
    use crate::call::LongCalls;
    #[pymodule_export]
    use crate::camera::{Camera, check_camera, lens_schema};
    #[pymodule_export]
    use crate::complementary::ComplementaryFilter;
    #[pymodule_export]
    use crate::corner::{
        BelievedCorner, CornerAttitude, CornerAttitudes, CornerDetector, CornerEstimate, CornerFeature,
        CornerHypothesis, CornerPose, CornerPoseEstimator, ResolvedAttitude, corner_attitudes, corner_poses,
        fit_corner, included_angle, resolve_corners, screen_corner, solve_corner, solve_corners, triangulate,
    };
    #[pymodule_export]
    use crate::drive::Drive;
    #[pymodule_export]
    use crate::laboratory::Laboratory;
    #[pymodule_export]
    use crate::level::{LevelMap, Leveller};
    #[pymodule_export]
    use crate::lines::{
        LineExtractor, LineTracker, Lines, TrackedLines, descriptor_distances, match_descriptors, match_wide,
        ssd_matrix, zncc_matrix,
    };
    #[pymodule_export]
    use crate::options::option_fields;
    #[pymodule_export]
    use crate::rays::PixelRays;
    #[pymodule_export]
    use crate::segments::{SegmentDetector, Segments};
    #[pymodule_export]
    use crate::selfcalib::{
        CalibrationStep, LogCalibration, MountingEstimate, SelfCalibrator, SimulatedDrive, calibrate, consistency_band,
        drive_legs, misreading_clause, simulate_drive, wheel_displacements,
    };
    #[pymodule_export]
    use crate::stereo::{StereoSequence, read_imu};
    #[pymodule_export]
    use crate::synth::Room;
    #[pymodule_export]
    use crate::tilt::{
        AffineCorrection, CommonDirection, EdgeElements, FilterStep, FilteredTilt, FitReport, ImageEdges,
        PosteriorCorrection, PriorOfTilt, TiltAlternative, TiltEstimate, TiltEstimator, TiltFilter, apply_correction,
        common_direction, leaning_from_upright, normal_from_alpha_beta, tilt_error_rad, tilt_from_wheel_heights,
        train_affine, train_factor, train_posterior,
    };
    #[pymodule_export]
    use crate::yaml::yaml_tree;

    /// The vectors that this process uses: "fallback", "sse4.2", "avx2", "avx512" or "neon".
    ///
    /// Answers do not depend on them. They are the widest of the machine, or those that the environment's `TILTVP_SIMD`
    /// names when tiltvp is imported, where a word that is none of the machine's raises `InvalidInputError`.
    #[pyfunction]
    fn simd_level() -> &'static str {
        tiltvp_core::simd_level()
    }

    #[pymodule_init]
    fn init(module: &Bound<'_, PyModule>) -> PyResult<()> {
        // An empty word is none.
        if let Some(word) = std::env::var_os(SIMD_VARIABLE).filter(|word| !word.is_empty()) {
            tiltvp_core::cap_simd_level(SIMD_VARIABLE, &word.to_string_lossy())
                .map_err(|error| crate::call::exception(&error))?;
        }
        crate::forks::watch(module.py())?;
        module.add("METHODS", tiltvp_core::tilt::METHODS.to_vec())?;
        module.add("CALIBRATION_METHODS", tiltvp_core::selfcalib::CalibrationMethod::NAMES.to_vec())?;
        module.add("CORNER_METHODS", tiltvp_core::corner::CornerMethod::NAMES.to_vec())?;
        module.add("LINE_METHODS", tiltvp_core::lines::LineMethod::NAMES.to_vec())?;
        module.add("MOST_PIXELS", tiltvp_core::camera::MOST_PIXELS)?;
        module.add("LARGEST_SIDE_PX", tiltvp_core::camera::LARGEST_SIDE_PX)?;
        module.add("MOST_COEFFICIENTS", tiltvp_core::camera::MOST_COEFFICIENTS)?;
        module.add("MOST_LANDMARKS", tiltvp_core::selfcalib::MOST_LANDMARKS)?;
        module.add("WHEEL_BASE_MAX_M", tiltvp_core::selfcalib::WHEEL_BASE_MAX_M)?;
        module.add("CAMERA_MODELS", tiltvp_core::camera::Model::names().collect::<Vec<_>>())?;
        module.add("ROOM_KINDS", tiltvp_synth::RoomKind::NAMES.to_vec())?;
        module.add("SIMD_LEVELS", tiltvp_core::simd_levels())?;
        module.add("WALL_PATTERNS", tiltvp_synth::WallPattern::NAMES.to_vec())
    }
}
