//! The Python extension `tiltvp._core`: checks, converts, releases the interpreter, calls the core, wraps.

mod call;
mod camera;
mod complementary;
mod convert;
mod corner;
mod drive;
mod laboratory;
mod lines;
mod rays;
mod selfcalib;
mod stereo;
mod synth;
mod tilt;

use pyo3::prelude::*;

/// What Rust computes for the Python package.
#[pymodule]
mod _core {
    use pyo3::prelude::*;

    #[pymodule_export]
    use crate::camera::Camera;
    #[pymodule_export]
    use crate::complementary::ComplementaryFilter;
    #[pymodule_export]
    use crate::corner::{
        CornerAttitude, CornerAttitudes, CornerDetector, CornerEstimate, CornerFeature, CornerHypothesis, CornerPose,
        CornerPoseEstimator, ResolvedAttitude, corner_attitudes, corner_poses, fit_corner, included_angle,
        resolve_corners, screen_corner, solve_corner, solve_corners, triangulate,
    };
    #[pymodule_export]
    use crate::drive::Drive;
    #[pymodule_export]
    use crate::laboratory::Laboratory;
    #[pymodule_export]
    use crate::lines::{
        LineExtractor, LineTracker, Lines, TrackedLines, descriptor_distances, match_descriptors, ssd_matrix,
        zncc_matrix,
    };
    #[pymodule_export]
    use crate::rays::PixelRays;
    #[pymodule_export]
    use crate::selfcalib::{
        CalibrationStep, LogCalibration, MountingEstimate, SelfCalibrator, SimulatedDrive, calibrate, consistency_band,
        drive_legs, simulate_drive, wheel_displacements,
    };
    #[pymodule_export]
    use crate::stereo::StereoSequence;
    #[pymodule_export]
    use crate::synth::Room;
    #[pymodule_export]
    use crate::tilt::{
        AffineCorrection, CommonDirection, EdgeElements, FilterStep, FilteredTilt, FitReport, ImageEdges,
        PosteriorCorrection, PriorOfTilt, TiltEstimate, TiltEstimator, TiltFilter, apply_correction, common_direction,
        leaning_from_upright, level_map, normal_from_alpha_beta, tilt_error_rad, tilt_from_wheel_heights, train_affine,
        train_factor, train_posterior,
    };

    #[pymodule_init]
    fn init(module: &Bound<'_, PyModule>) -> PyResult<()> {
        module.add("METHODS", tiltvp_core::tilt::METHODS.to_vec())?;
        module.add("CALIBRATION_METHODS", tiltvp_core::selfcalib::CALIBRATION_METHODS.to_vec())?;
        module.add("CORNER_METHODS", tiltvp_core::corner::CORNER_METHODS.to_vec())?;
        module.add("LINE_METHODS", tiltvp_core::lines::LINE_METHODS.to_vec())?;
        module.add("CAMERA_MODELS", tiltvp_core::camera::Model::names().collect::<Vec<_>>())?;
        module.add("ROOM_KINDS", tiltvp_synth::RoomKind::ALL.map(tiltvp_synth::RoomKind::name).to_vec())?;
        module.add("WALL_PATTERNS", tiltvp_synth::WallPattern::ALL.map(tiltvp_synth::WallPattern::name).to_vec())
    }
}
