// The C interface of tiltvp: a robot's tilt from one image, vertical lines, and where the camera sits on the robot.
// Written by `just header` from crates/tiltvp-capi/src; docs/c.md is the guide.
//
// A call that may fail returns a TiltvpStatus; tiltvp_last_error() then has a sentence. What a call makes is its caller's, who ends
// it by the call that ends in _free. Pointers may be NULL only where it says so, and are refused else; those that are not NULL
// point to what they say, for as long as the call lasts and no longer. What a call writes to has one thread at a time; a handle is
// ended once, when no other call uses it. Texts are UTF-8 and end in a zero. Angles are radians, lengths metres, pixel centres
// integers. The camera frame has z along the optical axis, x to the right (columns) and y down (rows); the robot frame has x forward,
// y left, z up.

#ifndef TILTVP_H
#define TILTVP_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

// Bytes of the room for a sentence of a result, with the zero at its end.
#define TILTVP_REASON_BYTES 512

// How a call ended.
typedef enum TiltvpStatus {
  // As it should.
  TILTVP_STATUS_OK = 0,
  // A pointer that is NULL, a size or a number that makes no sense.
  TILTVP_STATUS_INVALID_ARGUMENT = 1,
  // Options that there are not, or of which one is out of its domain.
  TILTVP_STATUS_INVALID_OPTION = 2,
  // A calibration that no camera has, or that is not understood.
  TILTVP_STATUS_INVALID_CAMERA = 3,
  // A file that cannot be read.
  TILTVP_STATUS_UNREADABLE_FILE = 4,
  // A fault of this library.
  TILTVP_STATUS_INTERNAL_ERROR = 5,
} TiltvpStatus;

// A calibrated camera, with the mounting that its file tells. Any number of threads may use it at once.
typedef struct TiltvpCamera TiltvpCamera;

// Finds the vertical lines of single images of one camera. Any number of threads may use it at once.
typedef struct TiltvpLineExtractor TiltvpLineExtractor;

// Estimates where a camera sits on a robot from the wheels' displacements and bearings of landmarks. Threads wait for each other.
typedef struct TiltvpSelfCalibrator TiltvpSelfCalibrator;

// Estimates the tilt of a robot from single images of one camera. Any number of threads may use it at once.
typedef struct TiltvpTiltEstimator TiltvpTiltEstimator;

// What a step did.
typedef struct TiltvpCalibrationStep {
  // Normalised innovation squared of the bearings that were fused: chi-square of `used` degrees of freedom.
  double nis;
  // Bearings of known landmarks that were fused.
  size_t used;
  // Bearings of known landmarks that did not pass the gate.
  size_t rejected;
  // Landmarks seen for the first time.
  size_t started;
} TiltvpCalibrationStep;

// The mounting as it is known.
typedef struct TiltvpMountingEstimate {
  // Whether it can be relied upon: everything determined, finite, no alarm, nothing suspected.
  bool reliable;
  // Whether the drive so far has determined phi.
  bool phi_determined;
  // Whether it has determined rho.
  bool rho_determined;
  // Whether it has determined psi.
  bool psi_determined;
  // Whether it has determined yaw.
  bool yaw_determined;
  // Whether rho is not significantly above zero, where phi and psi mean nothing: use x, y and yaw.
  bool rho_near_zero;
  // Whether bearings ever disagreed with the mounting over a window of steps, as after a bump.
  bool alarm;
  // How far the camera is in front of the middle of the wheel axle, metres.
  double x_m;
  // How far it is to the left of it, metres.
  double y_m;
  // How far its x axis is turned to the left against the robot's, phi + psi, in (-pi, pi] radians.
  double yaw_rad;
  // The direction in which the camera is, in (-pi, pi] radians.
  double phi_rad;
  // Its distance from the middle of the axle, metres.
  double rho_m;
  // yaw - phi, in (-pi, pi] radians.
  double psi_rad;
  // Covariance of (x_m, y_m, yaw_rad), 3 x 3 in row order.
  double covariance_xy_yaw[9];
  // Covariance of (phi_rad, rho_m, psi_rad), 3 x 3 in row order; infinite at rho = 0.
  double covariance_phi_rho_psi[9];
  // Mean normalised innovation squared of a bearing over the last steps, 1 if all is as assumed; NaN before the first.
  double mean_nis;
  // Whether it can be relied upon, what is determined, what motion would help and what is suspected: a sentence.
  char reason[TILTVP_REASON_BYTES];
} TiltvpMountingEstimate;

// An 8-bit grey image of the caller's, row after row from the top.
typedef struct TiltvpImage {
  // The first pixel of the first row.
  const uint8_t *data;
  // Columns.
  size_t width;
  // Rows.
  size_t height;
  // Bytes from the begin of a row to that of the next, at least `width`.
  size_t stride;
} TiltvpImage;

// A vertical line of the world as one image shows it.
typedef struct TiltvpLine {
  // Azimuth atan2(y, x) about the vertical in the upright robot's frame, in (-pi, pi] radians.
  double bearing_rad;
  // Standard deviation of the bearing in radians.
  double sigma_rad;
  // Elevation of the lowest pixel above the upright robot's horizon, in radians.
  double elevation_min_rad;
  // Elevation of the highest pixel, in radians.
  double elevation_max_rad;
  // Share of the pixels that are brighter towards greater azimuth minus that of the others, in [-1, 1].
  double polarity;
  // Edge pixels on the line, one across the edge.
  uint32_t support_px;
} TiltvpLine;

// The tilt of one image. Without one the angles and the normal are NaN, the covariance is infinite and the confidence 0.
typedef struct TiltvpTiltEstimate {
  // Whether there is a tilt.
  bool valid;
  // How far the robot leans, in [0, pi] radians.
  double alpha_rad;
  // In which direction it leans, in (-pi, pi] radians: 0 is forward, +pi/2 to the left.
  double beta_rad;
  // Roll about the robot's x in radians, right side down positive (Rz Ry Rx, ROS REP 103).
  double roll_rad;
  // Pitch about the robot's y in radians, nose down positive.
  double pitch_rad;
  // The unit ground normal in the robot frame.
  double normal[3];
  // Covariance of the normal in its tangent plane in squared radians, 2 x 2 in row order: close to the robot's x and y.
  double covariance_rad2[4];
  // Probability, in [0, 1], that the error is below two degrees.
  double confidence;
  // Edge pixels in the elevation band.
  size_t edge_pixels;
  // Those that agree with the estimate.
  size_t inlier_pixels;
  // Why the fit stopped, and what most likely keeps it from being sure: a sentence.
  char reason[TILTVP_REASON_BYTES];
} TiltvpTiltEstimate;

#ifdef __cplusplus
extern "C" {
#endif // __cplusplus

// What was wrong with the last call of this thread that failed: a sentence with what was given and what expected, empty if none has
// failed. It stays till a call of this thread fails again.
const char *tiltvp_last_error(void);

// The version of the library, such as "0.2.0".
const char *tiltvp_version(void);

// A calibrator that has seen nothing. `options` is a text in TOML with the options of `SelfCalibrator` in docs/options.md, NULL for
// the defaults; `wheel_base_m` is none of them here.
enum TiltvpStatus tiltvp_self_calibrator_new(double wheel_base_m,
                                             const char *options,
                                             struct TiltvpSelfCalibrator **calibrator);

// Moves by the displacements of the wheels in metres, then takes the bearings of `count` landmarks by their numbers: radians in the
// camera's frame, counter-clockwise.
//
// `step` may be NULL. What makes no sense is refused; the calibrator is then as before.
enum TiltvpStatus tiltvp_self_calibrator_step(const struct TiltvpSelfCalibrator *calibrator,
                                              double delta_left_m,
                                              double delta_right_m,
                                              const uint64_t *landmark_ids,
                                              const double *bearings_rad,
                                              size_t count,
                                              struct TiltvpCalibrationStep *step);

// Looks for what the drive so far contradicts and which assumption is likely wrong; estimates then say so. It costs some twenty
// solutions of the window: call it before an estimate that decides something, not after every step.
enum TiltvpStatus tiltvp_self_calibrator_examine(const struct TiltvpSelfCalibrator *calibrator);

// The mounting as it is known now. What is suspected is as of the last `tiltvp_self_calibrator_examine`.
enum TiltvpStatus tiltvp_self_calibrator_estimate(const struct TiltvpSelfCalibrator *calibrator,
                                                  struct TiltvpMountingEstimate *estimate);

// Ends a calibrator. NULL is nothing to end.
void tiltvp_self_calibrator_free(struct TiltvpSelfCalibrator *calibrator);

// The camera of a file in TOML: what `tiltvp camera convert` makes of twenty formats, or a robot's file by `tiltvp setup`.
//
// `name` picks one by its name; NULL takes the first. What is made of the camera of a robot's file is mounted as that says, and asks
// for the pixels of its mask.
enum TiltvpStatus tiltvp_camera_load(const char *path,
                                     const char *name,
                                     struct TiltvpCamera **camera);

// The same from a text in memory, for programs without files.
enum TiltvpStatus tiltvp_camera_parse(const char *toml, const char *name, struct TiltvpCamera **camera);

// Columns and rows of the camera's images.
enum TiltvpStatus tiltvp_camera_size(const struct TiltvpCamera *camera, size_t *width, size_t *height);

// Ends a camera; what was made of it stays. NULL is nothing to end.
void tiltvp_camera_free(struct TiltvpCamera *camera);

// An extractor for the images of a camera. The arguments are those of `tiltvp_tilt_estimator_new`; the options are those of
// `LineExtractor` in docs/options.md.
enum TiltvpStatus tiltvp_line_extractor_new(const struct TiltvpCamera *camera,
                                            const double *robot_from_camera,
                                            const struct TiltvpImage *mask,
                                            const char *options,
                                            struct TiltvpLineExtractor **extractor);

// The vertical lines of an image of the camera's size, by rising bearing.
//
// `normal` is the ground normal in the robot frame, as an estimate tells it, 3 numbers; NULL for a robot that does not lean. `lines`
// has room for `capacity` lines. `count` tells how many there are: where that is more than the room for them, nothing is written and
// the call fails.
enum TiltvpStatus tiltvp_line_extractor_extract(const struct TiltvpLineExtractor *extractor,
                                                const struct TiltvpImage *image,
                                                const double *normal,
                                                struct TiltvpLine *lines,
                                                size_t capacity,
                                                size_t *count);

// Ends an extractor. NULL is nothing to end.
void tiltvp_line_extractor_free(struct TiltvpLineExtractor *extractor);

// An estimator for the images of a camera: its tables are made once.
//
// `robot_from_camera` is the rotation R of v_robot = R v_camera, 9 numbers in row order; NULL for that of the camera's file, or the
// identity. `mask` has 128 and more where images show the world, NULL for everywhere. `options` is a text in TOML, such as
// "method = 'segments'\ntilt_max_rad = 0.2", with the names of docs/options.md; NULL for the defaults.
enum TiltvpStatus tiltvp_tilt_estimator_new(const struct TiltvpCamera *camera,
                                            const double *robot_from_camera,
                                            const struct TiltvpImage *mask,
                                            const char *options,
                                            struct TiltvpTiltEstimator **estimator);

// The tilt of an image of the camera's size.
enum TiltvpStatus tiltvp_tilt_estimator_estimate(const struct TiltvpTiltEstimator *estimator,
                                                 const struct TiltvpImage *image,
                                                 struct TiltvpTiltEstimate *estimate);

// Ends an estimator. NULL is nothing to end.
void tiltvp_tilt_estimator_free(struct TiltvpTiltEstimator *estimator);

#ifdef __cplusplus
}  // extern "C"
#endif  // __cplusplus

#endif  /* TILTVP_H */
