"""What Rust computes for the package: cameras, the tilt of images, common directions, vertical lines, rooms.

Arrays that come in may have any strides and any real dtype unless a shape and dtype is asked for; they are never
altered. Arrays that go out are fresh. Angles are radians. Equation numbers are those of Fleer 2017 (see the README).
"""

import builtins
from collections.abc import Iterable, Sequence
from typing import Any, ClassVar, Final, Literal, Self, SupportsIndex, TypeAlias, final

import numpy as np
from numpy.typing import ArrayLike, NDArray
from typing_extensions import disjoint_base

__all__ = [
    "CALIBRATION_METHODS",
    "CAMERA_MODELS",
    "CORNER_METHODS",
    "LINE_METHODS",
    "METHODS",
    "ROOM_KINDS",
    "WALL_PATTERNS",
    "AffineCorrection",
    "CalibrationStep",
    "Camera",
    "CommonDirection",
    "ComplementaryFilter",
    "CornerAttitude",
    "CornerAttitudes",
    "CornerDetector",
    "CornerEstimate",
    "CornerFeature",
    "CornerHypothesis",
    "CornerPose",
    "CornerPoseEstimator",
    "Drive",
    "EdgeElements",
    "FilterStep",
    "FilteredTilt",
    "FitReport",
    "ImageEdges",
    "Laboratory",
    "LineExtractor",
    "LineTracker",
    "Lines",
    "LogCalibration",
    "MountingEstimate",
    "PixelRays",
    "PosteriorCorrection",
    "PriorOfTilt",
    "ResolvedAttitude",
    "Room",
    "SelfCalibrator",
    "SimulatedDrive",
    "StereoSequence",
    "TiltEstimate",
    "TiltEstimator",
    "TiltFilter",
    "TrackedLines",
    "apply_correction",
    "calibrate",
    "common_direction",
    "consistency_band",
    "corner_attitudes",
    "corner_poses",
    "descriptor_distances",
    "drive_legs",
    "fit_corner",
    "included_angle",
    "leaning_from_upright",
    "level_map",
    "match_descriptors",
    "normal_from_alpha_beta",
    "resolve_corners",
    "screen_corner",
    "simulate_drive",
    "solve_corner",
    "solve_corners",
    "ssd_matrix",
    "tilt_error_rad",
    "tilt_from_wheel_heights",
    "train_affine",
    "train_factor",
    "train_posterior",
    "triangulate",
    "wheel_displacements",
    "zncc_matrix",
]

_Method: TypeAlias = Literal["refined", "image-space-ransac", "image-space-reject-refit", "vector-consensus"]
_Verdict: TypeAlias = Literal["accepted", "jumped", "no-tilt", "low-confidence", "outside-gate", "lost"]
_Stop: TypeAlias = Literal[
    "confident", "trial-limit", "converged", "settled", "iteration-limit", "too-few", "no-model", "out-of-reach"
]

CALIBRATION_METHODS: Final[list[str]]
METHODS: Final[list[str]]
"""The names of the methods of `TiltEstimator`, the default first."""

CAMERA_MODELS: Final[list[str]]
"""The names of the models of `Camera`."""

CORNER_METHODS: Final[list[str]]
LINE_METHODS: Final[list[str]]
"""The names of the methods of `LineExtractor`, the default first."""

ROOM_KINDS: Final[list[str]]
"""The kinds of `Room`."""

WALL_PATTERNS: Final[list[str]]
"""What the walls of a `Room` may have in common."""

@disjoint_base
class Camera:
    """A calibrated central camera: pixels to unit bearings and back.

    Camera frame: z along the optical axis, x right (columns u), y down (rows v). Pixel centres are at integers. Frozen,
    comparable, hashable, and to be pickled. `tiltvp.Camera` adds a constructor for each model, and calibration files.
    """

    def __new__(
        cls,
        model: str,
        *,
        width: int,
        height: int,
        max_theta_rad: float | None = None,
        mirror: bool = False,
        **parameters: ArrayLike | None,
    ) -> Self:
        """A camera of one of `CAMERA_MODELS` with the model's parameters by name; None leaves one at its default.

        `max_theta_rad` in (0, pi] limits the angle from the ray through the centre; by default the lens' own limit
        holds. Raises `tiltvp.errors.CalibrationError` for a model, a parameter or a value that no such lens has.
        """

    @property
    def model(self) -> str:
        """The name of the lens model."""

    @property
    def width(self) -> int:
        """Columns of its images."""

    @property
    def height(self) -> int:
        """Rows of its images."""

    @property
    def max_theta_rad(self) -> float:
        """Largest angle in radians from the ray through the centre that has a pixel."""

    @property
    def mirror(self) -> bool:
        """Whether the image is seen in a mirror: the z component of bearings is negated."""

    @property
    def parameters(self) -> dict[str, float | list[float]]:
        """The model's parameters by name, defaults included; a fresh dict."""

    def project(self, bearings: ArrayLike) -> NDArray[np.float64]:
        """Bearings (N, 3) or (3,) of any length but zero to pixels (u, v), (N, 2) or (2,) float64.

        Rows without an answer (behind the lens' reach, zero, not finite) are NaN. Pixels may lie outside the image.
        Raises `tiltvp.errors.InvalidInputError` for other shapes and dtypes.
        """

    def unproject(self, pixels: ArrayLike) -> NDArray[np.float64]:
        """Pixels (u, v), (N, 2) or (2,), to unit bearings, (N, 3) or (3,) float64; NaN rows outside the valid set.

        Raises `tiltvp.errors.InvalidInputError` for other shapes and dtypes.
        """

    def project_jacobian(self, bearings: ArrayLike) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Pixels as `project` gives them, and d pixel / d bearing at the given bearings: (N, 2, 3), (2, 3)."""

    def unproject_jacobian(self, pixels: ArrayLike) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Bearings as `unproject` gives them, and d bearing / d pixel: (N, 3, 2) or (3, 2)."""

    def valid_mask(self) -> NDArray[np.bool_]:
        """(H, W) bool: the pixels that have a bearing."""

    def mirrored(self) -> Self:
        """The same camera with `mirror` turned over."""

    def scaled(self, factor: float) -> Self:
        """The camera of the image resized by `factor`: what was at u is at factor (u + 1/2) - 1/2.

        The size is rounded to whole pixels. Raises `tiltvp.errors.InvalidInputError` for a factor that is not positive.
        """

    def conformance(self) -> dict[str, float]:
        """Round trips and errors of the analytic Jacobians, measured from the axis to the rim.

        Counts `pixels_tested`, `pixels_outside`, `pixels_lost` (0 for a camera that is right); the largest errors
        `max_round_trip_px`, `max_round_trip_rad`, `max_jacobian_error_relative` (against central differences); and
        `rim_theta_rad`, the largest angle that was tested.
        """

    def to_dict(self) -> dict[str, Any]:
        """The keywords that make the camera, `model` among them."""

    @classmethod
    def from_dict(cls, values: dict[str, Any]) -> Self:
        """The camera of a dict as `to_dict` makes it."""

    def __eq__(self, other: object, /) -> bool: ...
    def __hash__(self) -> int: ...
    def __copy__(self) -> Self: ...
    def __deepcopy__(self, _memo: object) -> Self: ...

@final
class FitReport:
    """How a robust fit went, and why it stopped. Frozen, comparable, hashable, and to be pickled."""

    @property
    def stop(self) -> _Stop:
        """Why the fit stopped, in a word.

        "confident": random sampling has drawn as many samples as its confidence needs; "trial-limit": it has drawn all
        it may. "converged": the model has stopped changing; "settled": the residuals are small enough;
        "iteration-limit": refitting has been repeated as often as it may. No answer comes of "too-few" observations,
        "no-model" (they are all alike) and "out-of-reach" (an angle that the method cannot mean).
        """

    @property
    def reason(self) -> str:
        """The same in a sentence, with the measured number and the limit."""

    @property
    def iterations(self) -> int:
        """Random samples drawn or refits done."""

    @property
    def residual_rms(self) -> float:
        """Root mean square residual: radians, or pixels of the image-space methods; NaN without a model."""

    def to_dict(self) -> dict[str, Any]:
        """The attributes by name."""

    @classmethod
    def from_dict(cls, values: dict[str, Any]) -> Self:
        """The report of a dict as `to_dict` makes it."""

    def __eq__(self, other: object, /) -> bool: ...
    def __hash__(self) -> int: ...
    def __copy__(self) -> Self: ...
    def __deepcopy__(self, _memo: object) -> Self: ...

@final
class TiltEstimate:
    """The tilt of one image. Frozen, comparable (to the last bit), hashable, and to be pickled. True if there is a
    tilt.

    Without a tilt the angles and the normal are NaN, the covariance is infinite, the confidence 0, and `reason` says
    why.
    """

    @property
    def alpha_rad(self) -> float:
        """How far the robot leans, in [0, pi] radians (eq. 1)."""

    @property
    def beta_rad(self) -> float:
        """In which direction it leans, in (-pi, pi] radians: 0 is forward, +pi/2 to the left (eq. 1)."""

    @property
    def roll_rad(self) -> float:
        """Roll about the robot's x in radians, right side down positive (`Rz Ry Rx`, ROS REP 103)."""

    @property
    def pitch_rad(self) -> float:
        """Pitch about the robot's y in radians, nose down positive (`Rz Ry Rx`, ROS REP 103)."""

    @property
    def normal(self) -> NDArray[np.float64]:
        """(3,): the unit ground normal in the robot frame, (-sin a cos b, -sin a sin b, cos a) (eq. 1)."""

    @property
    def covariance_rad2(self) -> NDArray[np.float64]:
        """(2, 2) in squared radians: covariance of the normal in its tangent plane.

        Its axes are the robot's x and y, turned by the smallest rotation that takes z to the normal. Pixels of one edge
        err together, so residuals are pooled over 64 sectors of azimuth; to them come the pull of a little unnoticed
        clutter, a fifth of the lean for methods that approximate the lens, and 0.17 degrees a side for what no image
        tells.
        """

    @property
    def confidence(self) -> float:
        """Probability, in [0, 1], that the error (eq. 44) is below two degrees, were it normal with that covariance."""

    @property
    def edge_pixels(self) -> int:
        """Edge pixels in the elevation band."""

    @property
    def prefiltered_pixels(self) -> int:
        """Edge pixels that passed the prefilter."""

    @property
    def inlier_pixels(self) -> int:
        """Edge pixels that agree with the estimate."""

    @property
    def shift_px(self) -> float | None:
        """The shift l of the vanishing point in pixels (eq. 20), before any factor; None but for the image-space
        methods.
        """

    @property
    def report(self) -> FitReport:
        """How the fit went."""

    @property
    def reason(self) -> str:
        """Why the fit stopped, in a sentence: `report.reason`."""

    def to_dict(self) -> dict[str, Any]:
        """The attributes by name, those of the report among them; arrays as nested lists. A row for a table."""

    @classmethod
    def from_dict(cls, values: dict[str, Any]) -> Self:
        """The estimate of a dict as `to_dict` makes it, equal to the last bit."""

    def __bool__(self) -> bool: ...
    def __eq__(self, other: object, /) -> bool: ...
    def __hash__(self) -> int: ...
    def __copy__(self) -> Self: ...
    def __deepcopy__(self, _memo: object) -> Self: ...

@final
class EdgeElements:
    """The edge pixels of one image, in row order: where each is, its direction and offset, and what became of it."""

    @property
    def u(self) -> NDArray[np.uint16]:
        """(N,): columns."""

    @property
    def v(self) -> NDArray[np.uint16]:
        """(N,): rows."""

    @property
    def phi_rad(self) -> NDArray[np.float64]:
        """(N,): gradient directions in [0, pi) radians (eq. 16)."""

    @property
    def offset_px(self) -> NDArray[np.float64]:
        """(N,): edge offsets s in pixels (eq. 17); NaN where the lens sees neither zenith nor nadir."""

    @property
    def normal(self) -> NDArray[np.float64]:
        """(N, 3): unit normals of the edges' great circles in the robot frame (eq. 37), of either sign.

        Those of the method, before any prefilter; NaN for the image-space methods, which have none.
        """

    @property
    def prefiltered(self) -> NDArray[np.bool_]:
        """(N,): the pixels that passed the prefilter."""

    @property
    def inlier(self) -> NDArray[np.bool_]:
        """(N,): the pixels that agree with the estimate."""

    @property
    def inlier_mask(self) -> NDArray[np.bool_]:
        """(H, W): the same over the image."""

    def __len__(self) -> int: ...
    def __eq__(self, other: object, /) -> bool: ...
    def __copy__(self) -> Self: ...
    def __deepcopy__(self, _memo: object) -> Self: ...
    __hash__: ClassVar[None]  # type: ignore[assignment]

@final
class ImageEdges:
    """The edge pixels of one image and their gradients: every pixel of the band of at least `gradient_min`.

    `TiltEstimator.detect` makes them, `TiltEstimator.estimate_edges` takes them. Frozen, comparable, to be pickled.
    """

    @property
    def gradient_min(self) -> float:
        """The least gradient magnitude that was asked for."""

    def __len__(self) -> int: ...
    def __eq__(self, other: object, /) -> bool: ...
    def __copy__(self) -> Self: ...
    def __deepcopy__(self, _memo: object) -> Self: ...
    __hash__: ClassVar[None]  # type: ignore[assignment]

@final
class AffineCorrection:
    """alpha = shift / factor + offset_rad, but not below zero. Frozen, comparable, hashable, pickled.

    Raises `tiltvp.errors.InvalidInputError` unless the factor is positive and both are finite.
    """

    def __new__(cls, factor: float, offset_rad: float) -> Self: ...
    @property
    def factor(self) -> float:
        """Units of the shift per radian: pixels per radian, or none for raw angles."""

    @property
    def offset_rad(self) -> float:
        """What is added, in radians."""

    def to_dict(self) -> dict[str, float]:
        """The attributes by name."""

    @classmethod
    def from_dict(cls, values: dict[str, Any]) -> Self:
        """The correction of a dict as `to_dict` makes it."""

    def __eq__(self, other: object, /) -> bool: ...
    def __hash__(self) -> int: ...
    def __copy__(self) -> Self: ...
    def __deepcopy__(self, _memo: object) -> Self: ...

@final
class PosteriorCorrection:
    """The mean and deviation of P(alpha | l) over a grid of shifts from zero, and the model of shifts behind it.

    `train_posterior` makes them. Applying one is one interpolation; shifts beyond the grid have the answer of its end.
    Frozen, comparable, hashable, pickled.
    """

    def __new__(
        cls,
        *,
        factor: float,
        spread: float,
        spread_per_rad: float,
        stray_share: float,
        stray_max: float,
        step: float,
        mean_rad: ArrayLike,
        std_rad: ArrayLike,
    ) -> Self: ...
    @property
    def factor(self) -> float:
        """Units of the shift per radian, by and large."""

    @property
    def spread(self) -> float:
        """Standard deviation of the error of the upright robot's shift in each direction, in units of the shift."""

    @property
    def spread_per_rad(self) -> float:
        """How it grows with the lean, in units of the shift per radian."""

    @property
    def stray_share(self) -> float:
        """Share of shifts that have nothing to do with the lean."""

    @property
    def stray_max(self) -> float:
        """Largest of these, in units of the shift."""

    @property
    def step(self) -> float:
        """Distance between the shifts of the table, which begins at zero."""

    @property
    def mean_rad(self) -> NDArray[np.float64]:
        """(N,): the mean lean in radians at each shift of the table; never falls."""

    @property
    def std_rad(self) -> NDArray[np.float64]:
        """(N,): the standard deviation of the lean in radians at each shift of the table."""

    def to_dict(self) -> dict[str, Any]:
        """The attributes by name, arrays as lists."""

    @classmethod
    def from_dict(cls, values: dict[str, Any]) -> Self:
        """The correction of a dict as `to_dict` makes it."""

    def __eq__(self, other: object, /) -> bool: ...
    def __hash__(self) -> int: ...
    def __copy__(self) -> Self: ...
    def __deepcopy__(self, _memo: object) -> Self: ...

@final
class PriorOfTilt:
    """How leans are distributed where the robot goes. Frozen, comparable, hashable, pickled."""

    @staticmethod
    def empirical() -> PriorOfTilt:
        """As in the training set, smoothed."""

    @staticmethod
    def uniform(max_rad: float) -> PriorOfTilt:
        """Every lean up to `max_rad`, in (0, pi/2), is as likely."""

    @staticmethod
    def rayleigh(sigma_rad: float) -> PriorOfTilt:
        """Leans forward and sideways are independent and normal, each with standard deviation `sigma_rad`."""

    def __eq__(self, other: object, /) -> bool: ...
    def __hash__(self) -> int: ...
    def __copy__(self) -> Self: ...
    def __deepcopy__(self, _memo: object) -> Self: ...

@disjoint_base
class TiltEstimator:
    """Estimates how far and in which direction a robot leans from single images of one camera.

    The tables of the camera are made once. `tiltvp.TiltEstimator` takes images of any usual kind.
    """

    def __new__(
        cls,
        camera: Camera,
        *,
        method: _Method | str = ...,
        robot_from_camera: ArrayLike | None = None,
        _like: TiltEstimator | None = None,
        gradient_min: float = ...,
        smoothing_px: float = ...,
        elevation_min_rad: float = ...,
        elevation_max_rad: float = ...,
        margin_px: float = ...,
        tilt_max_rad: float | None = ...,
        mask: NDArray[np.bool_] | None = ...,
        row_stride: SupportsIndex = ...,
        seed: SupportsIndex = ...,
        keep_fraction: float = ...,
        scale_rad: float = ...,
        tolerance_rad: float = ...,
        max_iterations: SupportsIndex = ...,
        threshold_px: float = ...,
        offset_max_px: float | None = ...,
        threshold_rad: float = ...,
        normal: Literal["gradient", "tangent"] = ...,
        sampling: Literal["uniform", "progressive", "prosac"] = ...,
        local_optimization: bool = ...,
        score: Literal["count", "msac", "magsac"] = ...,
        verification: Literal["full", "sprt"] = ...,
        correction: float | AffineCorrection | PosteriorCorrection | Literal["closed-form"] | None = ...,
    ) -> Self:
        """Makes the tables. Defaults depend on the method; `options` tells those in force.

        Parameters
        ----------
        camera
            The camera whose images will come.
        method
            One of `METHODS`.
        robot_from_camera
            (3, 3) rotation R with v_robot = R v_camera; default identity: an upward camera, columns to the front.
        gradient_min
            Least gradient magnitude of an edge pixel, I_min: Scharr kernel (3, 10, 3), 8-bit grey levels.
        smoothing_px
            Standard deviation of the Gaussian before that kernel, 0 to 10 pixels.
        elevation_min_rad, elevation_max_rad
            The band of elevations above the robot's horizon in which edges are looked for.
        margin_px
            Pixels kept clear of the rim, the image border and the mask, 0 to 1000.
        tilt_max_rad
            Largest lean expected, in (0, pi/2): edges that need a larger one are rejected first. None: 12 degrees of
            "refined", 7 of "vector-consensus", and `offset_max_px` of the image-space methods, which this else
            replaces.
        mask
            (H, W) bool, True where the image shows the world and not the robot itself. None: everywhere.
        row_stride
            Every so-manieth row of the image is looked at, from 1: less time, and less sure an answer.
        seed
            Seed of the random samples, 0 to 2^64 - 1. Only the sampling methods draw any.
        keep_fraction
            "refined", "image-space-reject-refit": share of normal residuals that each round keeps, in (0, 1); Q of eqs.
            34 and 35 read as the share kept.
        scale_rad
            "refined": standard deviation of the soft gate at the end.
        tolerance_rad
            "refined": change of the direction below which it has converged.
        max_iterations
            "refined": most refits with the gate at its final scale. "image-space-reject-refit": most rounds of
            rejecting and refitting, N_E; 0 is plain least squares.
        threshold_px
            "image-space-ransac": largest residual of an inlier, delta_s,max of eq. 32.
        offset_max_px
            Image-space methods: largest edge offset that passes the prefilter, s_max. None: the paper's 40 for its lens
            of 139.7 pixels per radian about the vertical, and in proportion for others.
        threshold_rad
            "vector-consensus": largest angle between an inlier's great circle and the vertical, delta_o,max of eq. 40.
        normal
            "vector-consensus": "gradient" is the paper's normal (eq. 37), "tangent" the exact one.
        sampling
            "image-space-ransac", "vector-consensus": "uniform" draws samples from all edge pixels alike, "progressive"
            from a growing pool of the strongest, "prosac" also stops as PROSAC does (Chum and Matas 2005), which
            presumes that pixels err independently.
        local_optimization
            The same methods: whether each new best model is refined by iterated least squares (Chum, Matas and Kittler
            2003; Lebeda, Matas and Chum 2012).
        score
            The same methods: the best model has the most inliers ("count"), the least truncated squares ("msac", Torr
            and Zisserman 2000), or the best score marginalised over the noise ("magsac", MAGSAC++, Barath et al. 2020).
        verification
            The same methods: "full" scores every model, "sprt" gives up those that fail a sequential probability ratio
            test (Matas and Chum 2005).
        correction
            Image-space methods: "closed-form" divides each offset by its pixel's own gain, a number is the factor a of
            eq. 30 in pixels per radian, None is the lens' own scale of eq. 26. "vector-consensus": a number is the
            factor a' of eq. 45, None is 1. Both: an `AffineCorrection` or a `PosteriorCorrection`, trained on shifts in
            pixels or on raw angles.

        Raises `tiltvp.errors.InvalidInputError` for an option that the method does not have (it names the near ones) or
        that is out of its domain, for an R that is no rotation, for a mask of another size than the camera's images,
        and where no pixel sees the band.
        """

    @property
    def camera(self) -> Camera:
        """The camera whose images are read."""

    @property
    def method(self) -> str:
        """The name of the method."""

    @property
    def robot_from_camera(self) -> NDArray[np.float64]:
        """(3, 3): the rotation R in v_robot = R v_camera."""

    @property
    def options(self) -> dict[str, Any]:
        """The options that are in force, by name, defaults included; a fresh dict, good as keywords."""

    @property
    def region_pixels(self) -> int:
        """How many pixels are looked at: those of the elevation band, clear of the rim, the border and the mask."""

    def _estimate(self, image: NDArray[np.uint8]) -> TiltEstimate:
        """The tilt of a C-contiguous (H, W) image of uint8."""

    def _detect(self, image: NDArray[np.uint8]) -> ImageEdges:
        """The edge pixels of such an image."""

    def estimate_edges(self, edges: ImageEdges) -> TiltEstimate:
        """The tilt of the image that the edges are of, the same to the last bit as the image itself gives.

        `edges` may be those of any estimator with equal camera, robot_from_camera, mask and edge options
        (gradient_min, smoothing_px, elevations, margin_px, row_stride); else `tiltvp.errors.InvalidInputError` says
        what differs. Other threads run meanwhile.
        """

    def _estimate_with_edges(self, image: NDArray[np.uint8]) -> tuple[TiltEstimate, EdgeElements]:
        """The tilt of such an image, and its edge pixels."""

    def _estimate_many(self, images: list[NDArray[np.uint8]], *, threads: int | None = None) -> list[TiltEstimate]:
        """The tilts of many such images, in their order, the same for any number of threads."""

    def __eq__(self, other: object, /) -> bool: ...
    def __hash__(self) -> int: ...

@final
class FilteredTilt:
    """A tilt as a filter holds it to be. Frozen, comparable, hashable, pickled. False where the filter abstains.

    The filter abstains where `sigma_rad` exceeds `sigma_max_rad`: angles and normal are NaN then, while covariance and
    confidence still say how little is known.
    """

    @property
    def alpha_rad(self) -> float:
        """How far the robot leans, in [0, pi] radians (eq. 1)."""

    @property
    def beta_rad(self) -> float:
        """In which direction it leans, in (-pi, pi] radians: 0 is forward, +pi/2 to the left (eq. 1)."""

    @property
    def roll_rad(self) -> float:
        """Roll about the robot's x in radians, right side down positive (`Rz Ry Rx`, ROS REP 103)."""

    @property
    def pitch_rad(self) -> float:
        """Pitch about the robot's y in radians, nose down positive (`Rz Ry Rx`, ROS REP 103)."""

    @property
    def normal(self) -> NDArray[np.float64]:
        """(3,): the unit ground normal (eq. 1)."""

    @property
    def covariance_rad2(self) -> NDArray[np.float64]:
        """(2, 2) in squared radians: covariance of the normal in its tangent plane, as that of a `TiltEstimate`."""

    @property
    def confidence(self) -> float:
        """Probability, in [0, 1], that the error is below two degrees if it is normal with that covariance."""

    @property
    def sigma_rad(self) -> float:
        """One standard deviation in any one direction: the root of half the covariance's trace."""

    @property
    def sigma_max_rad(self) -> float:
        """The largest standard deviation of an answer: the filter's option."""

    @property
    def reason(self) -> str:
        """The standard deviation beside its limit, in a sentence."""

    def to_dict(self) -> dict[str, Any]:
        """The attributes by name; arrays as nested lists."""

    @classmethod
    def from_dict(cls, values: dict[str, Any]) -> Self:
        """The value of a dict as `to_dict` makes it."""

    def __bool__(self) -> bool: ...
    def __eq__(self, other: object, /) -> bool: ...
    def __hash__(self) -> int: ...
    def __copy__(self) -> Self: ...
    def __deepcopy__(self, _memo: object) -> Self: ...

@final
class FilterStep:
    """What a filter did with an estimate, and why. Frozen, comparable, hashable, pickled. True if it was fused."""

    @property
    def accepted(self) -> bool:
        """Whether the estimate was fused."""

    @property
    def verdict(self) -> _Verdict:
        """What was done, in a word.

        Fused: "accepted", or "jumped", if so many rejected estimates agreed that the floor's tilt was forgotten. Left
        out: "no-tilt", "low-confidence", "outside-gate", or "lost", if so many were rejected that the floor's tilt is
        taken to be unknown.
        """

    @property
    def reason(self) -> str:
        """The same in a sentence, with the measured number and the limit."""

    @property
    def nis(self) -> float | None:
        """The normalised innovation squared, of two degrees of freedom; None if it did not come to that."""

    def to_dict(self) -> dict[str, Any]:
        """The attributes by name."""

    @classmethod
    def from_dict(cls, values: dict[str, Any]) -> Self:
        """The value of a dict as `to_dict` makes it."""

    def __bool__(self) -> bool: ...
    def __eq__(self, other: object, /) -> bool: ...
    def __hash__(self) -> int: ...
    def __copy__(self) -> Self: ...
    def __deepcopy__(self, _memo: object) -> Self: ...

@final
class TiltFilter:
    """Fuses the tilts of successive images: a Kalman filter of the ground normal on the sphere.

    The floor's tilt turns with the robot's heading and walks slowly; errors that images of one place share are not
    averaged away; estimates that say nothing or do not fit are left out, steps are followed. Changes as it goes; may be
    pickled, copied and compared, state included, and used from several threads. See docs/tilt.md for the model.

    Parameters
    ----------
    walk_rad_per_sqrt_m, walk_rad_per_sqrt_step
        How fast the floor's tilt changes: per square root of a metre driven (default 0.01), and of a call of `predict`
        (0.001).
    gate_probability
        Probability with which the gate lets an estimate pass whose covariance is right (0.999).
    confidence_min
        Least confidence of an estimate that is looked at (0.5).
    jump_after
        How many rejected estimates in a row have to agree with each other to be followed (3).
    lost_after
        After how many rejections in a row, agreeing or not, the floor's tilt is taken to be unknown (10).
    correlated_share, correlation_m
        Share of an estimate's variance that the next image of the same place has in common with it (0.9), and the
        metres after which that has fallen to 1/e (2).
    noise_floor_rad
        Standard deviation that is added to that of every estimate (0.002).
    prior_rad
        Standard deviation of the floor's tilt before anything is known (10 degrees).
    sigma_max_rad
        Largest standard deviation of an answer; beyond, the filter abstains (0.02).
    estimate_mounting, mounting_prior_rad, mounting_walk_rad_per_sqrt_m
        Whether a lean of the robot itself is estimated beside that of the floor, its standard deviation before anything
        is known (1.5 degrees), and how fast it changes (0.0002). Turning tells the two apart.

    Raises `tiltvp.errors.InvalidInputError` for values out of their domain.
    """

    def __new__(
        cls,
        *,
        walk_rad_per_sqrt_m: float | None = None,
        walk_rad_per_sqrt_step: float | None = None,
        gate_probability: float | None = None,
        confidence_min: float | None = None,
        jump_after: int | None = None,
        lost_after: int | None = None,
        correlated_share: float | None = None,
        correlation_m: float | None = None,
        noise_floor_rad: float | None = None,
        prior_rad: float | None = None,
        sigma_max_rad: float | None = None,
        estimate_mounting: bool = False,
        mounting_prior_rad: float | None = None,
        mounting_walk_rad_per_sqrt_m: float | None = None,
    ) -> Self: ...
    @property
    def options(self) -> dict[str, Any]:
        """The options in force, by name, defaults included; a fresh dict, good as keywords."""

    @property
    def estimate(self) -> FilteredTilt:
        """The ground normal in the robot's frame, as the filter holds it to be now."""

    @property
    def floor(self) -> FilteredTilt:
        """The floor's part of it alone, in the frame of the wheels."""

    @property
    def mounting(self) -> FilteredTilt | None:
        """The robot's own part alone, what it would see on level ground; None unless `estimate_mounting`."""

    @property
    def nis_limit(self) -> float:
        """The largest normalised innovation squared that passes the gate."""

    @property
    def rejected(self) -> int:
        """How many estimates in a row the gate has rejected: above 0, the estimate may be about to jump."""

    def predict(self, yaw_rad: float | None = None, distance_m: float | None = None) -> None:
        """The robot has turned (left positive) and driven (either way) since the last call; None: it has not."""

    def update(self, estimate: TiltEstimate | tuple[ArrayLike, ArrayLike], /) -> FilterStep:
        """Fuses an estimate, or says why not.

        In its place a pair may stand: a ground normal (3,) of any length, and its covariance (2, 2) in squared radians
        in the tangent plane. Its confidence is the probability of an error below two degrees under that covariance.
        """

    def step(
        self,
        estimate: TiltEstimate | tuple[ArrayLike, ArrayLike],
        /,
        yaw_rad: float | None = None,
        distance_m: float | None = None,
    ) -> FilterStep:
        """`predict`, then `update`; where either is refused, the filter is as before."""

    def reset(self) -> None:
        """Forgets everything but the options."""

    def __setstate__(self, state: dict[str, Any], /) -> None: ...
    def __eq__(self, other: object, /) -> bool: ...
    def __copy__(self) -> Self: ...
    def __deepcopy__(self, _memo: object) -> Self: ...

@final
class Lines:
    """The vertical lines of one image, by rising bearing. Frozen, comparable, to be pickled.

    `LineExtractor` makes them. Bearings are azimuths atan2(y, x) about the vertical in the upright robot's frame (the
    camera's without `robot_from_camera`).
    """

    @property
    def bearing_rad(self) -> NDArray[np.float64]:
        """(N,): azimuth about the vertical in the upright robot's frame, in (-pi, pi]."""

    @property
    def sigma_rad(self) -> NDArray[np.float64]:
        """(N,): standard deviation of the bearing."""

    @property
    def support_px(self) -> NDArray[np.uint32]:
        """(N,): edge pixels on the line, one across the edge."""

    @property
    def elevation_min_rad(self) -> NDArray[np.float64]:
        """(N,): elevation of the lowest pixel above the upright robot's horizon."""

    @property
    def elevation_max_rad(self) -> NDArray[np.float64]:
        """(N,): elevation of the highest pixel."""

    @property
    def polarity(self) -> NDArray[np.float64]:
        """(N,) in [-1, 1]: share of the pixels that are brighter towards greater azimuth minus that of the others."""

    @property
    def normal(self) -> NDArray[np.float64]:
        """(3,): the ground normal in the robot frame that was taken for the vertical."""

    @property
    def center_px(self) -> tuple[float, float] | None:
        """Where radial lines meet, (u, v); None but for the method "radial"."""

    def to_dict(self) -> dict[str, Any]:
        """Plain numbers and lists, good for JSON."""

    @classmethod
    def from_dict(cls, values: dict[str, Any]) -> Self:
        """The lines that `to_dict` wrote. Raises `tiltvp.errors.InvalidInputError` for anything else."""

    def __len__(self) -> int: ...
    def __eq__(self, other: object, /) -> bool: ...
    def __copy__(self) -> Self: ...
    def __deepcopy__(self, _memo: object) -> Self: ...
    __hash__: ClassVar[None]  # type: ignore[assignment]

@disjoint_base
class LineExtractor:
    """Finds and describes the vertical lines of single images of one camera.

    The tables of the camera are made once. `tiltvp.lines.LineExtractor` takes images of any usual kind.
    """

    def __new__(
        cls,
        camera: Camera,
        *,
        method: Literal["great-circle", "radial"] | str = ...,
        robot_from_camera: ArrayLike | None = None,
        gradient_min: float = ...,
        smoothing_px: float = ...,
        elevation_min_rad: float = ...,
        elevation_max_rad: float = ...,
        margin_px: float = ...,
        mask: NDArray[np.bool_] | None = ...,
        plane_max_rad: float = ...,
        bins: SupportsIndex = ...,
        separation_rad: float = ...,
        length_min_rad: float = ...,
        support_min_px: SupportsIndex = ...,
        gap_max_rad: float = ...,
        run_min_px: SupportsIndex = ...,
        covered_min: float = ...,
        scatter_max_px: float = ...,
        tilt_sigma_rad: float = ...,
        lines_max: SupportsIndex | None = ...,
        radial_max_rad: float = ...,
        sectors: SupportsIndex = ...,
        length_min: float = ...,
        radius_min_px: float | None = ...,
        radius_max_px: float | None = ...,
        rim_radius_px: float | None = ...,
        center_search_px: float = ...,
        descriptor_areas: SupportsIndex = ...,
        descriptor_overlapping: bool = ...,
        descriptor_bins: SupportsIndex = ...,
        descriptor_clip: float = ...,
        descriptor_window: float = ...,
        descriptor_smoothing: float = ...,
        descriptor_normalisation: Literal["area", "whole"] = ...,
    ) -> Self:
        """Makes the tables. `options` tells the options in force.

        Parameters
        ----------
        camera
            The camera whose images will come.
        method
            "great-circle": great circles through the vertical, by the camera model; "radial": lines through the rim's
            centre, as the paper has them.
        robot_from_camera
            (3, 3) rotation R with v_robot = R v_camera; default identity: an upward camera, columns to the front.
        gradient_min, smoothing_px, elevation_min_rad, elevation_max_rad, margin_px, mask
            As those of `TiltEstimator`; the band is from 30 degrees below the horizon to 60 above it.
        plane_max_rad
            "great-circle": how far from the vertical the great circle of an edge pixel may pass.
        bins
            "great-circle": bins of the histogram over azimuth.
        separation_rad
            "great-circle": least angle between two lines of the same polarity.
        length_min_rad, support_min_px
            "great-circle": least elevation that the runs of pixels of a line cover, and least number of its pixels.
        gap_max_rad, run_min_px
            "great-circle": widest gap within a run of pixels, and least number of pixels of a run.
        covered_min
            "great-circle": least share of the elevations from a line's lowest to its highest pixel that its runs cover.
        scatter_max_px
            "great-circle": greatest standard deviation of the pixels about their line.
        tilt_sigma_rad
            "great-circle": standard deviation of the tilt that frames are given; lines may slant by as much.
        lines_max
            "great-circle": the most lines of an image, the longest ones. None: all.
        radial_max_rad
            "radial": how far a gradient may turn from the tangent of its circle about the centre.
        sectors
            "radial": number of sectors.
        length_min
            "radial": least length of a line as a fraction of the outer radius minus the inner.
        radius_min_px, radius_max_px
            "radial": inner and outer radius. None: those of the elevation band.
        rim_radius_px, center_search_px
            "radial": radius of the mirror's rim (None: that of the camera's valid pixels), and how far from the
            calibrated centre the rim's is looked for in every frame; 0 keeps the calibrated one.
        descriptor_areas, descriptor_overlapping
            Number of circular areas along a line, and whether they overlap by half: 3, or 5 that overlap.
        descriptor_bins, descriptor_clip
            Bins of each orientation histogram, and the greatest value of one before the second normalisation.
        descriptor_window
            Standard deviation of the Gaussian window as a fraction of an area's radius.
        descriptor_smoothing
            Standard deviation of the Gaussian that smooths an area before its gradients are taken, the same fraction.
        descriptor_normalisation
            What has unit length: the pair of histograms of each "area" (eq. 3), or the "whole" (eq. 4).

        Raises `tiltvp.errors.InvalidInputError` for an option that the method does not have (it names the near ones) or
        that is out of its domain, for an R that is no rotation, for a mask of another size than the camera's images,
        and where no pixel sees the band.
        """

    @property
    def camera(self) -> Camera:
        """The camera whose images are read."""

    @property
    def method(self) -> str:
        """The name of the method."""

    @property
    def robot_from_camera(self) -> NDArray[np.float64]:
        """(3, 3): the rotation R in v_robot = R v_camera."""

    @property
    def options(self) -> dict[str, Any]:
        """The options that are in force, by name, defaults included; a fresh dict, good as keywords."""

    @property
    def band_rad(self) -> tuple[float, float]:
        """Lowest and highest elevation that descriptors cover: what most directions see of the band."""

    def _extract(self, image: NDArray[np.uint8], normal: ArrayLike | None) -> Lines:
        """The lines of a C-contiguous (H, W) image of uint8."""

    def _describe(self, image: NDArray[np.uint8], lines: Lines) -> NDArray[np.float32]:
        """(N, K): descriptors of the lines of such an image."""

    def _patches(self, image: NDArray[np.uint8], lines: Lines) -> NDArray[np.float32]:
        """(N, rows, columns): grey levels about the lines of such an image."""

    def _lines_at(self, bearing_rad: ArrayLike, normal: ArrayLike | None) -> Lines:
        """Lines at any bearings, without support."""

    def __eq__(self, other: object, /) -> bool: ...
    def __hash__(self) -> int: ...

@final
class TrackedLines:
    """The lines of one frame and whose they are. Frozen."""

    @property
    def frame(self) -> int:
        """Number of the frame, from 0."""

    @property
    def track(self) -> NDArray[np.int64]:
        """(N,): identity of each line, from 0, never given twice."""

    @property
    def frames_back(self) -> NDArray[np.int64]:
        """(N,): how many frames ago each line was last seen, 0 for a new one."""

    @property
    def lines(self) -> Lines:
        """The lines."""

    def __len__(self) -> int: ...

@final
class LineTracker:
    """Follows lines through successive frames: each gets the identity of the line it is, or a new one.

    Where the robot's motion is known, each track's bearing is predicted from the last one and from how near the edge
    is, as far as bearings have told, and all lines find their tracks together: by bearings, descriptors and sides, at
    the least cost in all. Where it is not, a line is looked for in the last frame, then in the one before, up to
    `look_back` frames. The same calls give the same answers. Comparable, copied and pickled with all that it remembers.
    """

    def __new__(
        cls,
        *,
        look_back: SupportsIndex = ...,
        nearest_m: float = ...,
        camera_m: tuple[float, float] = ...,
        turn_sigma_rad: float = ...,
        distance_sigma: float = ...,
        rate_sigma_rad: float = ...,
        bearing_sigma_rad: float = ...,
        gate_sigmas: float = ...,
        descriptor_sigma: float = ...,
        descriptor_max: float = ...,
        new_cost: float = ...,
        f1: float = ...,
        f2: float = ...,
        f3: float = ...,
        mutual: bool = ...,
        ordered: bool = ...,
    ) -> Self:
        """A tracker that has seen nothing.

        Parameters
        ----------
        look_back
            How many frames back a line is looked for before it is taken for a new one.
        nearest_m, camera_m
            The least distance of an edge from the camera, and where the camera's centre is on the robot: x and y from
            the middle between the wheels; metres.
        turn_sigma_rad, distance_sigma
            Standard deviations of a turn and, as a share of it, of a distance driven.
        rate_sigma_rad
            Standard deviation of the change of a bearing per frame beside the turn, where no distance is given.
        bearing_sigma_rad, gate_sigmas
            Standard deviation of a bearing beside the line's own, and how many of them bearings may be off.
        descriptor_sigma, descriptor_max
            Standard deviation and greatest value of the distance between descriptors of one line.
        new_cost
            What a new track costs, against the sum of squared deviations of a line that goes on.
        f1, f2, f3, mutual, ordered
            As those of `match_descriptors`, where the motion is unknown.

        Raises `tiltvp.errors.InvalidInputError` for an option that is unknown or out of its domain.
        """

    @property
    def options(self) -> dict[str, Any]:
        """The options in force, by name, defaults included; a fresh dict, good as keywords."""

    @property
    def next_frame(self) -> int:
        """Number of the next frame."""

    @property
    def track_count(self) -> int:
        """How many identities have been given."""

    def update(
        self,
        lines: Lines,
        descriptors: NDArray[np.float32],
        *,
        yaw_change_rad: float | None = None,
        distance_m: float | None = None,
    ) -> TrackedLines:
        """The next frame: its lines, their descriptors (N, K), and the robot's motion since the last one.

        `yaw_change_rad` is its turn, positive to the left, `distance_m` how far the middle between its wheels went
        along the arc, negative backwards. Raises `tiltvp.errors.InvalidInputError` for descriptors of another number or
        width, motions that are not finite, and a distance without a turn; the tracker is as before then.
        """

    def __eq__(self, other: object, /) -> bool: ...
    def __copy__(self) -> Self: ...
    def __deepcopy__(self, _memo: object) -> Self: ...
    def __setstate__(self, state: tuple[int, int, list[Any], list[Any]], /) -> None:
        """Sets what pickle has kept."""
    __hash__: ClassVar[None]  # type: ignore[assignment]

def match_descriptors(
    a: NDArray[np.float32],
    b: NDArray[np.float32],
    *,
    expected_rad: ArrayLike | None = None,
    seen_rad: ArrayLike | None = None,
    gate_rad: float | None = None,
    f1: float = ...,
    f2: float = ...,
    f3: float = ...,
    mutual: bool = ...,
    ordered: bool = ...,
) -> NDArray[np.int64]:
    """(M, 2): rows of `a` (N_A, K) and the rows of `b` (N_B, K) that are the same lines, by rising row of `a`.

    The nearest descriptor, if its distance is at most `f1` (eq. 8 of Scaramuzza 2009), `f2` times the mean distance
    (eq. 9), and `f3` times the second smallest (eq. 10). `mutual` asks for the nearest both ways, `ordered` for matches
    in cyclic order, for rows by rising bearing. With bearings of `a` as expected in `b`, bearings of `b` and a greatest
    difference, far lines are no candidates. Raises `tiltvp.errors.InvalidInputError`.
    """

def descriptor_distances(a: NDArray[np.float32], b: NDArray[np.float32]) -> NDArray[np.float64]:
    """(N_A, N_B): Euclidean distances of descriptors, eq. 6 (Scaramuzza 2009)."""

def ssd_matrix(a: NDArray[np.float32], b: NDArray[np.float32]) -> NDArray[np.float64]:
    """(N_A, N_B): means of squared differences of patches (N, K), eq. 12 over the samples that both have."""

def zncc_matrix(a: NDArray[np.float32], b: NDArray[np.float32]) -> NDArray[np.float64]:
    """(N_A, N_B): zero-mean normalised cross-correlations of patches (N, K), eq. 13; 1 for equal ones."""

@final
class CommonDirection:
    """A direction orthogonal to most of the normals. Frozen, comparable, hashable, pickled. True if there is one."""

    @property
    def direction(self) -> NDArray[np.float64]:
        """(3,): the unit direction on the prior's side; NaN if the normals do not determine one."""

    @property
    def covariance_rad2(self) -> NDArray[np.float64]:
        """(2, 2) in squared radians: covariance in the tangent plane of the direction; infinite without one.

        Its axes are x and y, turned by the smallest rotation that takes z to the direction.
        """

    @property
    def inliers(self) -> NDArray[np.bool_]:
        """(N,): the normals whose great circles pass within three `sigma_rad` of the direction."""

    @property
    def report(self) -> FitReport:
        """How the fit went; the residual is in radians."""

    def to_dict(self) -> dict[str, Any]:
        """The attributes by name, those of the report among them; arrays as nested lists."""

    @classmethod
    def from_dict(cls, values: dict[str, Any]) -> Self:
        """The value of a dict as `to_dict` makes it."""

    def __bool__(self) -> bool: ...
    def __eq__(self, other: object, /) -> bool: ...
    def __hash__(self) -> int: ...
    def __copy__(self) -> Self: ...
    def __deepcopy__(self, _memo: object) -> Self: ...

def common_direction(
    normals: ArrayLike,
    *,
    weights: ArrayLike | None = None,
    sigma_rad: float | None = None,
    prior: ArrayLike | None = None,
    max_angle_rad: float | None = None,
) -> CommonDirection:
    """The direction most nearly orthogonal to great-circle normals (N, 3) of any length but zero and of either sign.

    For people who bring line segments of their own, found in any central image: the normal of a segment's great circle
    is the cross product of the bearings of its ends.

    Parameters
    ----------
    weights
        (N,), zero or more; None: all 1.
    sigma_rad
        How far the great circles of inliers stray from the direction; None: 1 degree.
    prior
        (3,) direction of any length, near which the answer lies; None: (0, 0, 1).
    max_angle_rad
        Largest angle between the prior and the answer, in (0, pi/2); None: 20 degrees.

    Raises `tiltvp.errors.InvalidInputError` for wrong shapes, zero or non-finite rows, negative weights and options out
    of their domain. Too few or degenerate normals give an answer without a direction, and a reason.
    """

def train_factor(shift: ArrayLike, alpha_rad: ArrayLike) -> float:
    """The factor of eq. 31: the mean of shift / alpha over images of known leans (N,) above zero.

    `shift` (N,) is `shift_px` of an image-space method, or `alpha_rad` of an uncorrected "vector-consensus". Leave out
    images without an estimate. Raises `tiltvp.errors.InvalidInputError` for numbers that make no sense.
    """

def train_affine(shift: ArrayLike, alpha_rad: ArrayLike) -> AffineCorrection:
    """The line alpha = shift / factor + offset through images of known leans (N,), by least squares of the shift.

    The truth is known and the shift errs, and the line does not depend on how many images there are of each lean.
    Raises `tiltvp.errors.InvalidInputError` for fewer than two different leans or shifts that do not grow with them.
    """

def train_posterior(shift: ArrayLike, alpha_rad: ArrayLike, *, prior: PriorOfTilt | None = None) -> PosteriorCorrection:
    """P(alpha | l) from images of known leans (N,), at least ten, under a prior; None: `PriorOfTilt.empirical()`.

    The shift is modelled as the length of a plane vector of mean length factor * alpha with normal errors that grow
    with the lean (a Rice distribution), a share of which strays; the model is fitted by maximum likelihood. Raises
    `tiltvp.errors.InvalidInputError` for numbers that make no sense or shifts that do not grow with the lean.
    """

def apply_correction(
    correction: float | AffineCorrection | PosteriorCorrection, shift: ArrayLike
) -> NDArray[np.float64]:
    """(N,): the leans in radians of shifts or raw angles (N,) of zero or more, as an estimator so corrected has them.

    NaN stays NaN. A number is a factor by which the shift is divided.
    """

def leaning_from_upright(normal: ArrayLike) -> NDArray[np.float64]:
    """(3, 3): the rotation from the upright robot's frame to the leaning one's, without a turn about the vertical.

    `normal` is the ground normal (3,) in the robot frame, of any length but zero.
    """

def level_map(camera: Camera, normal: ArrayLike, *, robot_from_camera: ArrayLike | None = None) -> NDArray[np.float32]:
    """(H, W, 2): where each pixel (u, v) of the upright image is found in the leaning one; NaN where it was not seen.

    `normal` is the ground normal (3,) in the robot frame, of any length but zero.
    """

def normal_from_alpha_beta(alpha_rad: float, beta_rad: float) -> NDArray[np.float64]:
    """(3,): the ground normal of a lean, (-sin a cos b, -sin a sin b, cos a) (eq. 1)."""

def tilt_error_rad(a: ArrayLike, b: ArrayLike) -> float:
    """The angle in [0, pi] radians between two ground normals (3,), of any length but zero (eq. 44)."""

def tilt_from_wheel_heights(
    *, left_m: float, right_m: float, caster_m: float, half_track_m: float, caster_behind_m: float
) -> tuple[float, float]:
    """(alpha_rad, beta_rad) of a robot whose wheels stand at these heights above a common level (eqs. 42 and 43).

    The main wheels are at (0, +-half_track_m) in the robot's frame, the caster at (-caster_behind_m, 0): r_w and r_c of
    fig. 20. With h_r = right - left and h_c = caster - left the ground normal is
    (-(2 h_c - h_r) / (2 r_c), -h_r / (2 r_w), cos alpha). Raises `tiltvp.errors.InvalidInputError` for lengths that are
    not positive, heights that are not finite, and heights that no robot of this layout can stand at.
    """

@final
class PixelRays:
    """`samples` x `samples` rays in each pixel of a camera that sees anything, made once, to be met with panoramas."""

    def __new__(cls, camera: Camera, *, samples: SupportsIndex) -> Self:
        """Makes the rays, at the centres of equal parts of the pixels; `samples` is from 1 to 16."""

    @property
    def samples(self) -> int:
        """Rays per pixel and side."""

    @property
    def pixels(self) -> NDArray[np.uint32]:
        """(N,): places in row order, v width + u, of the pixels in which some ray is seen."""

    def panorama_map(self, rotation: ArrayLike, *, width: SupportsIndex, height: SupportsIndex) -> NDArray[np.float32]:
        """(2, samples^2, N): columns and rows of an equirectangular panorama of that size that the rays meet.

        `rotation` (3, 3) takes bearings of the camera to the panorama's: x right, y down, z towards longitude 0. Rays
        that the lens does not see are at -1e6, far outside.
        """

@disjoint_base
class Room:
    """A furnished, lit room of one of `ROOM_KINDS`, built once. `tiltvp.synth.Room` renders it.

    The world frame has z up and the floor at z = 0; metres. Frozen, comparable, hashable, and to be pickled.
    """

    def __new__(
        cls,
        kind: str,
        seed: SupportsIndex,
        *,
        clutter: float | None = None,
        daylight: float | None = None,
        light_spacing_m: float | None = None,
        extent: float | None = None,
        floor_gloss: float | None = None,
        wall_pattern: str | None = None,
        threads: SupportsIndex | None = None,
    ) -> Self:
        """Builds and lights the room on `threads` threads (None: one per core), on which it does not depend."""

    @property
    def kind(self) -> str:
        """Which of `ROOM_KINDS` it is."""

    @property
    def seed(self) -> int:
        """The seed of everything in it."""

    @property
    def clutter(self) -> float:
        """How full it is, from 0 to 1."""

    @property
    def daylight(self) -> float:
        """Brightness of the day outside, from 0 to 1."""

    @property
    def light_spacing_m(self) -> float:
        """Spacing of the points where light was gathered, metres."""

    @property
    def extent(self) -> float:
        """How many times larger the floor is than the kind's own."""

    @property
    def floor_gloss(self) -> float:
        """How much the floor shines, from 0 to 1."""

    @property
    def wall_pattern(self) -> str:
        """Which of `WALL_PATTERNS` its walls have in common."""

    @property
    def height_m(self) -> float:
        """Height of the ceiling, metres."""

    @property
    def floor_outline_m(self) -> NDArray[np.float64]:
        """(N, 2): the corners of the floor, counter-clockwise, metres."""

    @property
    def vertical_edges_m(self) -> NDArray[np.float64]:
        """(N, 2, 3): lower and upper ends of the vertical edges of walls and furniture, visible or not, metres."""

    def is_free(self, x_m: float, y_m: float) -> bool:
        """Whether a round robot of 0.22 m radius and less than 0.4 m height can stand with its centre there."""

    def free_poses(self, count: SupportsIndex, seed: SupportsIndex) -> NDArray[np.float64]:
        """(count, 3): x_m, y_m, yaw_rad of poses at which the robot stands free, drawn by `seed`.

        Raises `tiltvp.errors.InvalidInputError` if the room is too full.
        """

    def _render(
        self,
        camera: Camera,
        *,
        pose: ArrayLike,
        alpha_rad: float,
        beta_rad: float,
        robot_from_camera: ArrayLike | None,
        camera_height_m: float | None,
        noise_sigma: float,
        samples: SupportsIndex | None,
        seed: SupportsIndex,
        threads: SupportsIndex | None,
    ) -> tuple[NDArray[np.uint8], NDArray[np.uint8]]:
        """Grey (H, W) and RGB (H, W, 3) images of the room."""

    def _render_panorama(
        self,
        *,
        pose: ArrayLike,
        camera_height_m: float | None,
        height: SupportsIndex,
        noise_sigma: float,
        samples: SupportsIndex | None,
        seed: SupportsIndex,
        threads: SupportsIndex | None,
    ) -> tuple[NDArray[np.uint8], NDArray[np.uint8]]:
        """Grey (height, 2 height) and RGB (height, 2 height, 3) images of everything around a place."""

    def __getnewargs_ex__(self) -> tuple[tuple[str, int], dict[str, float | str]]: ...
    def __eq__(self, other: object, /) -> bool: ...
    def __hash__(self) -> int: ...

@final
class ComplementaryFilter:
    """Rates of turn in the short run, a reference attitude in the long run: `ComplementaryFilter(reference_from_body)`.

    The explicit complementary filter on rotations with corrections that arrive now and then: an attitude seen in an
    image, say, among the readings of a gyroscope. `time_constant_s` (None: 0.15) is the time after which a difference
    from the reference has shrunk to 1/e; `bias_time_constant_s` (None: 4) that over which a lasting difference becomes
    a bias of the rates. Raises `tiltvp.errors.InvalidInputError`.
    """

    def __new__(
        cls,
        reference_from_body: ArrayLike,
        *,
        time_constant_s: float | None = None,
        bias_time_constant_s: float | None = None,
    ) -> Self:
        """Starts at an attitude (3, 3), with no bias."""

    @property
    def time_constant_s(self) -> float:
        """Time after which a difference from the reference has shrunk to 1/e."""

    @property
    def bias_time_constant_s(self) -> float:
        """Time over which a lasting difference becomes a bias of the rates."""

    @property
    def reference_from_body(self) -> NDArray[np.float64]:
        """(3, 3): the attitude now, which takes vectors of the body to the frame of the reference."""

    @property
    def bias_rad_s(self) -> NDArray[np.float64]:
        """(3,): the bias of the rates, in the body's axes."""

    def predict(self, rate_rad_s: ArrayLike, duration_s: float) -> None:
        """Turns on by a rate (3,), in the body's axes, that holds for so long."""

    def correct(self, reference_from_body: ArrayLike) -> NDArray[np.float64]:
        """Moves towards a reference (3, 3) by the share 1 - exp(-t / time_constant_s), t the time since the last one.

        Returns (3,): the difference that it found, as a rotation vector in the body's axes.
        """

@disjoint_base
class Laboratory:
    """A plain room with a coloured cuboid, to be looked at by `tiltvp.synth.StereoSequence`.

    Frozen, comparable, hashable, and to be pickled.
    """

    def __new__(
        cls,
        seed: SupportsIndex,
        *,
        size_m: ArrayLike | None = None,
        gamma_rad: float | None = None,
        clutter: float | None = None,
        side_light: float | None = None,
        light_spacing_m: float | None = None,
        threads: SupportsIndex | None = None,
    ) -> Self:
        """Builds and lights it on `threads` threads (None: one per core), which do not matter."""

    @property
    def seed(self) -> int:
        """The seed of everything in it."""

    @property
    def size_m(self) -> tuple[float, float, float]:
        """Lengths of the cuboid's edges x, y, z."""

    @property
    def gamma_rad(self) -> float:
        """The angle between the cuboid's level edges."""

    @property
    def clutter(self) -> float:
        """How full the walls are, from 0 to 1."""

    @property
    def side_light(self) -> float:
        """Power of the lamp beside the cuboid, from 0 to 1."""

    @property
    def light_spacing_m(self) -> float:
        """Spacing of the points where light was gathered."""

    def __eq__(self, other: object, /) -> bool: ...
    def __hash__(self) -> int: ...
    def __getnewargs_ex__(self) -> tuple[tuple[int], dict[str, Any]]: ...

@disjoint_base
class StereoSequence:
    """A moving pair of cameras, any frame of which can be rendered by `tiltvp.synth.StereoSequence`.

    Frozen, comparable, hashable, and to be pickled. N is the number of frames.
    """

    def __new__(
        cls,
        scene: Laboratory | Room,
        *,
        left: Camera,
        right: Camera,
        left_from_right: ArrayLike | None = None,
        frames: SupportsIndex | None = None,
        frame_rate_hz: float | None = None,
        seed: SupportsIndex | None = None,
        corner: SupportsIndex | None = None,
        distance_m: ArrayLike | None = None,
        roll_max_rad: float | None = None,
        period_s: float | None = None,
        samples: SupportsIndex | None = None,
        noise_sigma: float | None = None,
        blur_sigma_px: float | None = None,
        exposure_s: float | None = None,
        gain: float | None = None,
        threads: SupportsIndex | None = None,
    ) -> Self:
        """Finds a motion in the scene and makes rays on `threads` threads (None: one per core), which do not matter."""

    @property
    def scene(self) -> Laboratory | Room:
        """What is looked at."""

    @property
    def cameras(self) -> tuple[Camera, Camera]:
        """The left and the right camera."""

    @property
    def seed(self) -> int:
        """The seed of motion and noise."""

    @property
    def corner(self) -> int:
        """Which of the scene's corners is looked at."""

    @property
    def frame_rate_hz(self) -> float:
        """Frames per second."""

    @property
    def exposure_s(self) -> float:
        """How long the shutter is open."""

    @property
    def left_from_right(self) -> NDArray[np.float64]:
        """(4, 4): the right camera's pose in the left one's frame."""

    @property
    def times_s(self) -> NDArray[np.float64]:
        """(N,): when each frame is taken."""

    @property
    def poses(self) -> NDArray[np.float64]:
        """(N, 4, 4): `world_from_left` at each frame."""

    def poses_at(self, times_s: ArrayLike) -> NDArray[np.float64]:
        """(T, 4, 4): `world_from_left` at any times (T,)."""

    def _corners(self) -> list[tuple[list[float], list[list[float]], list[float], str]]: ...
    def _render(
        self, frame: SupportsIndex, *, threads: SupportsIndex | None = None
    ) -> tuple[NDArray[np.uint8], NDArray[np.uint8]]: ...
    def _truth(
        self, frame: SupportsIndex, *, threads: SupportsIndex | None = None
    ) -> tuple[NDArray[np.int64], NDArray[np.float64], NDArray[np.float64]]: ...
    def _imu(
        self,
        *,
        rate_hz: float | None = None,
        seed: SupportsIndex | None = None,
        gyroscope: ArrayLike | None = None,
        accelerometer: ArrayLike | None = None,
    ) -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]]: ...
    def __len__(self) -> int: ...
    def __eq__(self, other: object, /) -> bool: ...
    def __hash__(self) -> int: ...
    def __getnewargs_ex__(self) -> tuple[tuple[Any], dict[str, Any]]: ...

@disjoint_base
class Drive:
    """A robot's way through a room, any frame of which can be rendered by `tiltvp.synth.Drive`.

    Frozen, comparable, hashable, and to be pickled. N is the number of frames.
    """

    def __new__(
        cls,
        room: Room,
        *,
        camera: Camera,
        robot_from_camera: ArrayLike | None = None,
        mount: ArrayLike | None = None,
        blind_rad: float | None = None,
        frames: SupportsIndex | None = None,
        legs: ArrayLike | None = None,
        seed: SupportsIndex | None = None,
        step_m: float | None = None,
        turn_max_rad: float | None = None,
        wheel_base_m: float | None = None,
        encoder_k_m: float | None = None,
        wheel_radius_errors: ArrayLike | None = None,
        bumps_max_rad: float | None = None,
        lighting: float | None = None,
        samples: SupportsIndex | None = None,
        noise_sigma: float | None = None,
        blur_sigma_px: float | None = None,
        threads: SupportsIndex | None = None,
    ) -> Self:
        """Plans the drive and gathers daylight on `threads` threads (None: one per core), which do not matter."""

    @property
    def room(self) -> Room:
        """The room."""

    @property
    def camera(self) -> Camera:
        """The camera."""

    @property
    def frames(self) -> int:
        """N, how many frames it has; also its `len`."""

    @property
    def seed(self) -> int:
        """The seed of everything but the room."""

    @property
    def wheel_base_m(self) -> float:
        """Distance between the wheels, metres."""

    @property
    def encoder_k_m(self) -> float:
        """Variance of a reading per metre that a wheel rolls, metres."""

    @property
    def wheel_radius_errors(self) -> tuple[float, float]:
        """How much larger the left and the right wheel are than the readings assume, relative."""

    @property
    def bumps_max_rad(self) -> float:
        """Greatest lean from bumps, radians."""

    @property
    def lighting(self) -> float:
        """How much the light changes along the way, from 0 to 1."""

    @property
    def mount(self) -> tuple[float, float, float, float]:
        """x_m, y_m, yaw_rad, height_m of the camera's centre on the robot."""

    @property
    def robot_from_camera(self) -> NDArray[np.float64]:
        """(3, 3): rotation from camera to robot coordinates, the mount's yaw included."""

    @property
    def poses(self) -> NDArray[np.float64]:
        """(N, 3): true x_m, y_m, yaw_rad of the robot. Integrating `true_odometry` along arcs gives them exactly."""

    @property
    def tilts(self) -> NDArray[np.float64]:
        """(N, 2): true alpha_rad, beta_rad."""

    @property
    def odometry(self) -> NDArray[np.float64]:
        """(N, 2): how far the left and right wheel rolled since the last frame, by their encoders; metres."""

    @property
    def true_odometry(self) -> NDArray[np.float64]:
        """(N, 2): how far they really rolled."""

    @property
    def motions(self) -> NDArray[np.float64]:
        """(N, 2): distance in metres and turn in radians that `odometry` stands for."""

    @property
    def edges_m(self) -> NDArray[np.float64]:
        """(E, 4): x_m, y_m, lowest and highest z_m of the room's upright edges, visible or not; the row is the number.

        All upright edges within 3 mm of a vertical line are one. Those of wallpaper and tiles come last.
        """

    def _render(
        self, frame: SupportsIndex, *, threads: SupportsIndex | None = None
    ) -> tuple[NDArray[np.uint8], NDArray[np.uint8]]:
        """Grey (H, W) and RGB (H, W, 3) images of a frame."""

    def _truth(
        self, frame: SupportsIndex, *, threads: SupportsIndex | None = None
    ) -> tuple[NDArray[np.int64], NDArray[np.float64], NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]]:
        """Edges in sight: numbers, bearings, elevations (M, 2), visible shares, contrasts."""

    def __len__(self) -> int: ...
    def __getnewargs_ex__(self) -> tuple[tuple[Room], dict[str, Any]]: ...
    def __eq__(self, other: object, /) -> bool: ...
    def __hash__(self) -> int: ...

@final
class CalibrationStep:
    """What a step of a `SelfCalibrator` did."""

    @property
    def nis(self) -> float:
        """Normalised innovation squared of the bearings that were fused: chi-square of `used` degrees of freedom."""

    @property
    def used(self) -> int:
        """Bearings of known landmarks that were fused."""

    @property
    def rejected(self) -> int:
        """Bearings of known landmarks that did not pass the gate."""

    @property
    def started(self) -> int:
        """Landmarks seen for the first time."""

    def to_dict(self) -> dict[str, Any]:
        """The attributes by name."""

    @classmethod
    def from_dict(cls, values: dict[str, Any]) -> Self:
        """The step of a dict as `to_dict` makes it."""

    def __copy__(self) -> Self: ...
    def __deepcopy__(self, memo: object, /) -> Self: ...
    def __eq__(self, other: object, /) -> bool: ...
    def __ne__(self, other: object, /) -> bool: ...

@final
class MountingEstimate:
    """Where a camera sits on a robot, with how sure that is. True if it can be relied upon."""

    @property
    def x_m(self) -> float:
        """How far the camera is in front of the middle of the wheel axle, metres."""

    @property
    def y_m(self) -> float:
        """How far it is to the left of it, metres."""

    @property
    def yaw_rad(self) -> float:
        """How far its x axis is turned to the left against the robot's, phi + psi, in (-pi, pi] radians."""

    @property
    def phi_rad(self) -> float:
        """The paper's phi, the direction of the camera, in (-pi, pi] radians; means nothing where rho is near 0."""

    @property
    def rho_m(self) -> float:
        """The paper's rho, the distance of the camera from the middle of the axle, metres."""

    @property
    def psi_rad(self) -> float:
        """The paper's psi = yaw - phi, in (-pi, pi] radians; means nothing where rho is near 0."""

    @property
    def covariance_xy_yaw(self) -> NDArray[np.float64]:
        """Fresh (3, 3) float64: covariance of (x, y, yaw)."""

    @property
    def covariance_phi_rho_psi(self) -> NDArray[np.float64]:
        """Fresh (3, 3) float64: covariance of (phi, rho, psi); infinite where rho is 0."""

    @property
    def determined(self) -> list[str]:
        """Which of "phi", "rho", "psi", "yaw" the motion so far has determined, beliefs at the start aside.

        Angles to 0.05 rad (phi and psi at a rho beyond three of its standard deviations only), rho to 0.02 m or 5 %.
        """

    @property
    def sigma_of_drive(self) -> NDArray[np.float64]:
        """Fresh (3,) float64: standard deviations of (phi, rho, psi) by the drive alone, without what was believed."""

    @property
    def advice(self) -> str:
        """What motion would determine what is not determined yet."""

    @property
    def rho_near_zero(self) -> bool:
        """Whether rho is not significantly above zero, where phi and psi mean nothing: use x, y and yaw."""

    @property
    def mean_nis(self) -> float | None:
        """Mean normalised innovation squared of a bearing over the last steps: 1 if all is as assumed. None before."""

    @property
    def alarm(self) -> bool:
        """Whether bearings ever disagreed with the mounting over a window of steps, as after a bump."""

    @property
    def reason(self) -> str:
        """What is determined, what motion would help, and whether there was an alarm, in a sentence."""

    def to_dict(self) -> dict[str, Any]:
        """The attributes by name; arrays as nested lists."""

    @classmethod
    def from_dict(cls, values: dict[str, Any]) -> Self:
        """The estimate of a dict as `to_dict` makes it."""

    def __bool__(self) -> bool: ...
    def __copy__(self) -> Self: ...
    def __deepcopy__(self, memo: object, /) -> Self: ...
    def __eq__(self, other: object, /) -> bool: ...
    def __ne__(self, other: object, /) -> bool: ...

@final
class SelfCalibrator:
    """Estimates where a camera sits on a robot, step by step while it drives past landmarks. Changes as it goes.

    Parameters
    ----------
    wheel_base_m
        Distance between the wheels.
    bearing_sigma_rad
        Standard deviation of a bearing (0.5 degrees).
    odometry_k_m
        Variance of a wheel's displacement for each metre of it, metres (1e-5; eq. 31 of Scaramuzza 2009).
    start, start_sigma
        (x_m, y_m, yaw_rad) of the mounting as it is thought to be, and standard deviations (3,) or covariance (3, 3)
        of them (0.3 m, 0.3 m, 0.5 rad).
    method
        "default", which does not diverge, or "paper", the filter of the paper exactly.
    start_distance_m
        Distance at which landmarks are thought to be (3).
    start_distance_log_sigma, gate_probability, memory
        Of "default": standard deviation of the logarithm of that distance (1.5), probability with which a bearing
        passes the gate (0.9999), and poses that are kept to be linearised anew (400). Landmarks that are not seen from
        the poses kept are forgotten: keep a whole drive's for loops to close.
    step_sigma_m, step_sigma_rad
        Of "default": standard deviations of every step's motion, in either direction and in turning, beside those that
        grow with the wheels' displacements (0).
    start_distance_sigma_m, odometry_inflation
        Of "paper": standard deviation of that distance (2), and the factor by which the noise is inflated (5).

    Raises `tiltvp.errors.InvalidInputError` for options out of their domain or of the other method.
    """

    def __new__(
        cls,
        *,
        wheel_base_m: float,
        bearing_sigma_rad: float | None = None,
        odometry_k_m: float | None = None,
        start: ArrayLike | None = None,
        start_sigma: ArrayLike | None = None,
        method: str = "default",
        start_distance_m: float | None = None,
        start_distance_log_sigma: float | None = None,
        start_distance_sigma_m: float | None = None,
        gate_probability: float | None = None,
        memory: SupportsIndex | None = None,
        odometry_inflation: float | None = None,
        step_sigma_m: float | None = None,
        step_sigma_rad: float | None = None,
    ) -> Self:
        """Makes a filter that has seen nothing."""

    @property
    def options(self) -> dict[str, Any]:
        """The options in force that the method reads, by name, defaults included; a fresh dict, good as keywords."""

    def step(
        self, delta_left_m: float, delta_right_m: float, landmark_ids: ArrayLike, bearings_rad: ArrayLike
    ) -> CalibrationStep:
        """Moves by the wheels' displacements, then looks: bearings (N,) of the landmarks of those whole numbers (N,).

        Bearings are in the camera's frame, counter-clockwise; of those taken while the robot stands only the first of
        each landmark counts. Raises `tiltvp.errors.InvalidInputError` for numbers that make no sense; the filter is
        then as before.
        """

    def follow(self, odometry: ArrayLike, bearings: ArrayLike) -> list[MountingEstimate]:
        """Steps through a log, (N, 2) left and right, (M, 3) step, landmark, bearing: the estimate after each step."""

    @property
    def estimate(self) -> MountingEstimate:
        """The mounting as it is believed to be now."""

    @property
    def landmarks(self) -> int:
        """Landmarks that are being followed."""

    def reset(self) -> None:
        """Forgets everything but the options."""

    def __eq__(self, other: object, /) -> bool: ...
    def __setstate__(self, state: bytes, /) -> None: ...
    def __copy__(self) -> Self: ...
    def __deepcopy__(self, _memo: object) -> Self: ...

@final
class LogCalibration:
    """The mounting, and what else was estimated, from a whole log. True if it can be relied upon."""

    @property
    def mounting(self) -> MountingEstimate:
        """The mounting; covariances are scaled by the residuals where these are larger than assumed."""

    @property
    def wheel_base_m(self) -> float:
        """Distance between the wheels, metres, as given or as estimated."""

    @property
    def wheel_base_sigma_m(self) -> float:
        """Standard deviation of it; 0 where it was not estimated."""

    @property
    def right_over_left(self) -> float:
        """The right wheel's way over the left's when both report the same; 1 where it was not estimated."""

    @property
    def right_over_left_sigma(self) -> float:
        """Standard deviation of it; 0 where it was not estimated."""

    @property
    def time_offset_s(self) -> float:
        """By how much bearings are later than the odometry, seconds; 0 where it was not estimated."""

    @property
    def time_offset_sigma_s(self) -> float:
        """Standard deviation of it; 0 where it was not estimated."""

    @property
    def bearings(self) -> int:
        """Bearings that were used; of those taken at a standstill only the first."""

    @property
    def outliers(self) -> int:
        """Bearings farther off than 4.5 standard deviations, which count for nothing."""

    @property
    def residual_rms(self) -> float:
        """Root of the mean squared residual of the others, in standard deviations of a bearing."""

    @property
    def iterations(self) -> int:
        """Linearisations."""

    @property
    def converged(self) -> bool:
        """Whether the descent came to rest."""

    def to_dict(self) -> dict[str, Any]:
        """The attributes by name, those of the mounting among them; arrays as nested lists."""

    @classmethod
    def from_dict(cls, values: dict[str, Any]) -> Self:
        """The calibration of a dict as `to_dict` makes it."""

    def __bool__(self) -> bool: ...
    def __copy__(self) -> Self: ...
    def __deepcopy__(self, memo: object, /) -> Self: ...
    def __eq__(self, other: object, /) -> bool: ...
    def __ne__(self, other: object, /) -> bool: ...

def calibrate(
    odometry: ArrayLike,
    bearings: ArrayLike,
    *,
    wheel_base_m: float,
    bearing_sigma_rad: float | None = None,
    odometry_k_m: float | None = None,
    start: ArrayLike | None = None,
    start_sigma: ArrayLike | None = None,
    start_distance_m: float | None = None,
    start_distance_log_sigma: float | None = None,
    estimate_odometry: bool = False,
    estimate_time_offset: bool = False,
    times_s: ArrayLike | None = None,
    max_iterations: int | None = None,
    step_sigma_m: float | None = None,
    step_sigma_rad: float | None = None,
) -> LogCalibration:
    """The mounting from a whole log at once, by robust sparse least squares.

    `odometry` (N, 2) are the displacements of left and right wheel, `bearings` (M, 3) rows of step (a row of the
    odometry, after whose motion it was taken), landmark, bearing. Options as those of `SelfCalibrator`.

    Parameters
    ----------
    estimate_odometry
        Also the wheel base, and which wheel runs farther. Bearings have no scale: the mean displacement of both wheels
        stays as reported.
    estimate_time_offset, times_s
        Also by how much the bearings are later than the odometry; (N,) times of the steps.
    max_iterations
        Most linearisations of each of the two descents (60).

    Raises `tiltvp.errors.InvalidInputError` for numbers that make no sense and logs that determine nothing.
    """

def wheel_displacements(
    distance_m: ArrayLike, heading_change_rad: ArrayLike, *, wheel_base_m: float
) -> NDArray[np.float64]:
    """(N, 2) displacements (left, right) of wheels that drive distances (N,) and turn (N,) to the left (eq. 15)."""

def consistency_band(probability: float, dof: int, samples: int) -> tuple[float, float]:
    """(low, high): the mean of `samples` chi-square values of `dof` degrees of freedom is there with that probability.

    The mean NEES of so many runs of a consistent filter falls there.
    """

@final
class SimulatedDrive:
    """A simulated drive past vertical lines, and the truth behind it."""

    @property
    def odometry(self) -> NDArray[np.float64]:
        """Fresh (N, 2) float64: displacements of the left and the right wheel in each step, metres."""

    @property
    def bearings(self) -> NDArray[np.float64]:
        """Fresh (M, 3) float64: step, landmark and bearing in radians of every bearing."""

    @property
    def poses(self) -> NDArray[np.float64]:
        """Fresh (N, 3) float64: the true pose (x_m, y_m, heading_rad) after each step, from (0, 0, 0)."""

    @property
    def landmarks_m(self) -> NDArray[np.float64]:
        """Fresh (L, 2) float64: where the lines are, metres."""

    def cramer_rao_bound(self, *, start_sigma: ArrayLike) -> NDArray[np.float64]:
        """(3, 3): the smallest covariance of (x, y, yaw) that an unbiased estimator can have on this drive."""

def drive_legs(kind: str = "paper") -> NDArray[np.float64]:
    """(L, 2): distance in metres and turn in radians of the legs of a trajectory of `simulate_drive`."""

def simulate_drive(
    kind: str = "paper",
    *,
    seed: int = 0,
    mounting: ArrayLike | None = None,
    landmarks: int | None = None,
    bearing_sigma_rad: float | None = None,
    odometry_k_m: float | None = None,
    wheel_base_m: float | None = None,
    outliers: float | None = None,
) -> SimulatedDrive:
    """A drive past 10 vertical lines: "paper" (2.3 m straight on, half a turn), "alternating" or "straight".

    `mounting` is (x_m, y_m, yaw_rad), None: the paper's phi = -0.34, rho = 0.23, psi = 0.33. The noise is that of the
    defaults of `SelfCalibrator`, wheels are 0.4 m apart, `outliers` is the share of bearings that are of nothing.
    """

@final
class CornerFeature:
    """One vertex and the three rays x, y (the vertical one) and z of a corner, as one camera sees it.

    Frozen, comparable, and to be pickled.
    """

    @property
    def vertex(self) -> NDArray[np.float64]:
        """(3,): unit bearing of the vertex, camera frame."""

    @property
    def vertex_covariance_rad2(self) -> NDArray[np.float64]:
        """(2, 2) in squared radians: covariance of the vertex in its tangent plane."""

    @property
    def residual_rad(self) -> float:
        """Root mean square of the vertex' distances from the three rays' great circles, radians."""

    @property
    def meets_probability(self) -> float:
        """The probability that three edges that do meet miss their vertex by more."""

    @property
    def normals(self) -> NDArray[np.float64]:
        """(3, 3), rows x, y, z: unit normals of the rays' great circles, `vertex x toward` up to length."""

    @property
    def toward(self) -> NDArray[np.float64]:
        """(3, 3), rows x, y, z: a unit bearing near the far end of each ray."""

    @property
    def ray_covariances_rad2(self) -> NDArray[np.float64]:
        """(3, 2, 2) in squared radians: covariance of each normal in its tangent plane."""

    @property
    def support_px(self) -> list[int]:
        """How many places of each ray it was fitted to."""

    @property
    def ray_rms_rad(self) -> list[float]:
        """Root mean square distance of these from each ray, radians."""

    def to_dict(self) -> dict[str, Any]:
        """Plain numbers and lists, good for JSON."""

    @classmethod
    def from_dict(cls, values: dict[str, Any]) -> Self:
        """The corner that `to_dict` wrote."""

    def __eq__(self, other: object, /) -> bool: ...
    def __copy__(self) -> Self: ...
    def __deepcopy__(self, _memo: Any) -> Self: ...

@disjoint_base
class CornerDetector:
    """Finds corners in single images of one camera; `tiltvp.corner.CornerDetector` takes images of any usual kind."""

    def __new__(
        cls,
        camera: Camera,
        *,
        method: Literal["coloured", "general"] | str = ...,
        mask: NDArray[np.bool_] | None = None,
        **options: Any,
    ) -> Self:
        """Makes the tables. `options` tells the options in force; docs/corner_images.md says what they mean."""

    @property
    def camera(self) -> Camera:
        """The camera whose images are read."""

    @property
    def method(self) -> str:
        """The name of the front end."""

    @property
    def mask(self) -> NDArray[np.bool_] | None:
        """Fresh (H, W) bool, or None: which pixels may be used."""

    @property
    def options(self) -> dict[str, Any]:
        """The options that are in force, by name, defaults included."""

    def _detect_gray(self, image: NDArray[np.uint8], vertical: ArrayLike | None) -> list[CornerFeature]: ...
    def _detect_color(self, image: NDArray[np.uint8]) -> list[CornerFeature]: ...
    def _segments(self, image: NDArray[np.uint8]) -> NDArray[np.float64]: ...
    def __eq__(self, other: object, /) -> bool: ...
    def __hash__(self) -> int: ...

@final
class CornerHypothesis:
    """One explanation of what is seen: an attitude, from two cameras also a place, and how likely it is.

    Frozen, comparable, and to be pickled.
    """

    @property
    def camera_from_object(self) -> NDArray[np.float64]:
        """Fresh (3, 3): the rotation from the object's frame to the left camera's."""

    @property
    def edges(self) -> NDArray[np.float64]:
        """Fresh (3, 3), rows x, y, z: directions of the corner's edges away from its vertex, left camera's frame."""

    @property
    def vertex_m(self) -> NDArray[np.float64] | None:
        """Fresh (3,): the vertex in the left camera's frame, metres; None from one image."""

    @property
    def camera_in_object_m(self) -> NDArray[np.float64] | None:
        """Fresh (3,): where the left camera is in the object's frame, metres; None from one image."""

    @property
    def covariance(self) -> NDArray[np.float64]:
        """Fresh (6, 6): of the attitude's rotation vector (radians) and of the vertex (metres), left camera's frame."""

    @property
    def probability(self) -> float:
        """The probability that it is this one, in [0, 1]."""

    @property
    def right_handed(self) -> bool:
        """Whether the edges x, y, z are a right-handed triple, as of an outer corner."""

    @property
    def misfit(self) -> float:
        """Root mean square misfit per degree of freedom in standard deviations; 0 for a single feature."""

    def to_dict(self) -> dict[str, Any]:
        """Plain numbers and lists, good for JSON."""

    @classmethod
    def from_dict(cls, values: dict[str, Any]) -> Self:
        """The hypothesis that `to_dict` wrote."""

    def __eq__(self, other: object, /) -> bool: ...
    def __copy__(self) -> Self: ...
    def __deepcopy__(self, _memo: Any) -> Self: ...

@final
class CornerEstimate:
    """What one frame tells of a corner: the likeliest pose if one stands out, and all hypotheses. False without a
    pose.

    Frozen, comparable, and to be pickled.
    """

    @property
    def pose(self) -> CornerHypothesis | None:
        """The pose; None where none stands out."""

    @property
    def hypotheses(self) -> list[CornerHypothesis]:
        """All hypotheses, the likeliest first."""

    @property
    def confidence(self) -> float:
        """The probability of the likeliest hypothesis; 0 where there is none."""

    @property
    def reason(self) -> str:
        """Why there is no pose; empty where there is one."""

    @property
    def features_left(self) -> list[CornerFeature]:
        """The corners of the left or only image."""

    @property
    def features_right(self) -> list[CornerFeature]:
        """The corners of the right image."""

    @property
    def chosen_left(self) -> list[int]:
        """Which corners of the left image the pose is from, the one that is its object first."""

    @property
    def chosen_right(self) -> int | None:
        """Which corner of the right image it is from, or None."""

    @property
    def edge_lengths_m(self) -> NDArray[np.float64]:
        """Fresh (3,): how long the edges x, y, z are, metres, to where lines along the others meet them; NaN where no
        image shows that. From two grey images and with right angles.
        """

    @property
    def edge_ends_m(self) -> NDArray[np.float64]:
        """Fresh (3, 3), rows x, y, z: where these edges end in the left camera's frame, metres, from both images alone;
        NaN where only one of them shows it, or none.
        """

    @property
    def followed(self) -> bool:
        """Whether the pose of a frame before was a prior."""

    @property
    def object(self) -> int:
        """The number of the corner that is the object, from 1: it grows where another corner has become the object."""

    def to_dict(self) -> dict[str, Any]:
        """Plain numbers and lists, good for JSON."""

    @classmethod
    def from_dict(cls, values: dict[str, Any]) -> Self:
        """The estimate that `to_dict` wrote."""

    def __bool__(self) -> bool: ...
    def __eq__(self, other: builtins.object, /) -> bool: ...
    def __copy__(self) -> Self: ...
    def __deepcopy__(self, _memo: Any) -> Self: ...

@disjoint_base
class CornerPoseEstimator:
    """Poses from the images of one camera or a pair; `tiltvp.corner.CornerPoseEstimator` takes cameras and any
    images.
    """

    def __new__(
        cls,
        left: CornerDetector,
        right: CornerDetector | None = None,
        left_from_right: ArrayLike | None = None,
        **options: Any,
    ) -> Self: ...
    @property
    def left(self) -> CornerDetector:
        """The detector of the left or only camera."""

    @property
    def right(self) -> CornerDetector | None:
        """The detector of the right camera, or None."""

    @property
    def left_from_right(self) -> NDArray[np.float64] | None:
        """Fresh (4, 4), or None: the right camera's pose in the left one's frame."""

    @property
    def options(self) -> dict[str, Any]:
        """The options that are in force, by name, defaults included."""

    @property
    def _coloured(self) -> bool: ...
    def reset(self) -> None:
        """Forgets the poses of the frames before."""

    def _observe(self, left: NDArray[np.uint8], right: NDArray[np.uint8] | None) -> CornerEstimate: ...
    def __eq__(self, other: object, /) -> bool: ...
    def __setstate__(self, state: tuple[int, dict[str, Any] | None]) -> None: ...

@final
class CornerAttitude:
    """One attitude that the rays of a corner admit. Frozen, comparable (bit by bit), hashable, and to be pickled."""

    @property
    def camera_from_object(self) -> NDArray[np.float64]:
        """(3, 3): the rotation R in v_camera = R v_object, whose columns are the edge x, the edge y, and x cross y."""

    @property
    def edges(self) -> NDArray[np.float64]:
        """(3, 3): the directions of the edges x, y, z away from the vertex, camera frame, one a row."""

    @property
    def alpha_rad(self) -> float:
        """The angle between the vertical edge and the line of sight to the vertex, in [0, pi] radians."""

    @property
    def mirrored(self) -> bool:
        """Whether this is the second of the two interpretations (fig. 3c), the inner instead of the outer corner."""

    @property
    def case(self) -> str:
        """How the edges of the imaginary box stand: "all-away", "one-perpendicular" or "one-toward"."""

    @property
    def right_handed(self) -> bool:
        """Whether the edges x, y, z are a right-handed triple; the two interpretations differ in it."""

    @property
    def covariance_rad2(self) -> NDArray[np.float64]:
        """(3, 3) in squared radians: covariance of the rotation vector w, camera frame, of the error.

        The true rotation is exp(w) times `camera_from_object`. Infinite where two roots fall together.
        """

    @property
    def sensitivity(self) -> float:
        """Radians of attitude per radian of the rays' angles about the vertex; infinite where roots fall together."""

    def to_dict(self) -> dict[str, Any]:
        """The attributes by name; arrays as nested lists."""

    @classmethod
    def from_dict(cls, values: dict[str, Any]) -> Self:
        """The value of a dict as `to_dict` makes it."""

    def __eq__(self, other: object, /) -> bool: ...
    def __hash__(self) -> int: ...
    def __copy__(self) -> Self: ...
    def __deepcopy__(self, _memo: Any) -> Self: ...

@final
class CornerAttitudes:
    """Every attitude of many corners, as arrays of as many rows as there are attitudes.

    Frozen, comparable, hashable, and to be pickled.
    """

    @property
    def corners(self) -> int:
        """How many corners were asked for; several attitudes or none may belong to each."""

    @property
    def corner(self) -> NDArray[np.int64]:
        """(M,): to which corner each attitude belongs, rising."""

    @property
    def camera_from_object(self) -> NDArray[np.float64]:
        """(M, 3, 3): the rotations R in v_camera = R v_object."""

    @property
    def edges(self) -> NDArray[np.float64]:
        """(M, 3, 3): the directions of the edges x, y, z away from the vertex, camera frame, one a row."""

    @property
    def alpha_rad(self) -> NDArray[np.float64]:
        """(M,): the angles between the vertical edge and the line of sight, radians."""

    @property
    def mirrored(self) -> NDArray[np.bool_]:
        """(M,): whether it is the second of two interpretations."""

    @property
    def case(self) -> list[str]:
        """How the edges of the imaginary boxes stand, by name."""

    @property
    def right_handed(self) -> NDArray[np.bool_]:
        """(M,): whether the edges x, y, z are a right-handed triple."""

    @property
    def sensitivity(self) -> NDArray[np.float64]:
        """(M,): radians of attitude per radian of the rays' angles about the vertex."""

    def of(self, corner: int) -> list[CornerAttitude]:
        """The attitudes of one corner, by its number."""

    def __len__(self) -> int: ...
    def to_dict(self) -> dict[str, Any]:
        """The number of corners and, for each attitude, its corner and its own dict."""

    @classmethod
    def from_dict(cls, values: dict[str, Any]) -> Self:
        """The value of a dict as `to_dict` makes it."""

    def __eq__(self, other: object, /) -> bool: ...
    def __hash__(self) -> int: ...
    def __copy__(self) -> Self: ...
    def __deepcopy__(self, _memo: Any) -> Self: ...

@final
class ResolvedAttitude:
    """One attitude that several features agree on, with how likely it is among all such.

    Frozen, comparable, hashable, and to be pickled.
    """

    @property
    def common_from_object(self) -> NDArray[np.float64]:
        """(3, 3): the rotation from the first feature's object to the frame that all features share."""

    @property
    def covariance_rad2(self) -> NDArray[np.float64]:
        """(3, 3) in squared radians: covariance of the rotation vector, common frame, of the error."""

    @property
    def probability(self) -> float:
        """The probability that it is this one and none of the others, in [0, 1]."""

    @property
    def choice(self) -> tuple[int, ...]:
        """Which attitude of each feature it is, in the order of `tiltvp.corner.attitudes`."""

    @property
    def chi_square(self) -> float:
        """How far the features are apart: chi-square of three degrees of freedom per feature after the first.

        Two where only the vertical is shared.
        """

    def to_dict(self) -> dict[str, Any]:
        """The attributes by name; arrays as nested lists."""

    @classmethod
    def from_dict(cls, values: dict[str, Any]) -> Self:
        """The value of a dict as `to_dict` makes it."""

    def __eq__(self, other: object, /) -> bool: ...
    def __ne__(self, other: object, /) -> bool: ...
    def __hash__(self) -> int: ...
    def __copy__(self) -> Self: ...
    def __deepcopy__(self, _memo: Any) -> Self: ...

@final
class CornerPose:
    """One pose of a corner before a pair of cameras. Frozen, comparable, hashable, and to be pickled."""

    @property
    def camera_from_object(self) -> NDArray[np.float64]:
        """(3, 3): the rotation R in v_camera = R v_object, of the left camera."""

    @property
    def vertex_m(self) -> NDArray[np.float64]:
        """(3,): the vertex, which is the object's origin, in the left camera's frame, metres."""

    @property
    def covariance(self) -> NDArray[np.float64]:
        """(6, 6): covariance of the rotation vector (radians) and of the vertex (metres), left camera's frame."""

    @property
    def probability(self) -> float:
        """The probability that it is this pose and none of the others that the rays admit, in [0, 1]."""

    @property
    def mirrored(self) -> bool:
        """Whether this is the second of the two interpretations in the left image (fig. 3c)."""

    @property
    def case(self) -> str:
        """How the edges of the imaginary box stand to the left camera's line of sight."""

    @property
    def right_handed(self) -> bool:
        """Whether the edges x, y, z are a right-handed triple."""

    @property
    def chi_square(self) -> float:
        """The squared misses of the rays, each by its covariance: chi-square of six degrees of freedom."""

    @property
    def fused(self) -> bool:
        """Whether all six rays were fused; where not, covariances between attitude and vertex are left out."""

    @property
    def camera_in_object_m(self) -> NDArray[np.float64]:
        """(3,): where the left camera is in the object's frame, metres."""

    @property
    def camera_in_object_covariance_m2(self) -> NDArray[np.float64]:
        """(3, 3): its covariance, square metres."""

    def to_dict(self) -> dict[str, Any]:
        """The attributes by name; arrays as nested lists."""

    @classmethod
    def from_dict(cls, values: dict[str, Any]) -> Self:
        """The value of a dict as `to_dict` makes it."""

    def __eq__(self, other: object, /) -> bool: ...
    def __ne__(self, other: object, /) -> bool: ...
    def __hash__(self) -> int: ...
    def __copy__(self) -> Self: ...
    def __deepcopy__(self, _memo: Any) -> Self: ...

def solve_corner(
    vertex: ArrayLike, x_ray: ArrayLike, y_ray: ArrayLike, z_ray: ArrayLike, gamma_rad: float
) -> list[CornerAttitude]:
    """Every attitude that a corner seen at exact bearings may have; see `tiltvp.corner.solve`."""

def solve_corners(
    vertex: ArrayLike, x_ray: ArrayLike, y_ray: ArrayLike, z_ray: ArrayLike, gamma_rad: ArrayLike
) -> CornerAttitudes:
    """The same for many corners at once; see `tiltvp.corner.solve_many`."""

def fit_corner(x: ArrayLike, y: ArrayLike, z: ArrayLike, sigma_rad: float) -> CornerFeature:
    """A corner from unit bearings along its rays; see `tiltvp.corner.fit`."""

def corner_attitudes(feature: CornerFeature, gamma_rad: float, gamma_sigma_rad: float) -> list[CornerAttitude]:
    """Every attitude that a feature admits, with covariance; see `tiltvp.corner.attitudes`."""

def screen_corner(feature: CornerFeature, gamma_rad: float) -> str | None:
    """Why a feature is no corner of that angle, in a sentence; None if it is one."""

def included_angle(
    feature: CornerFeature, vertical: ArrayLike, vertical_covariance_rad2: ArrayLike
) -> tuple[float, float] | None:
    """The included angle of the horizontal edges and its standard deviation; see `tiltvp.corner.included_angle`."""

def resolve_corners(
    features: Sequence[CornerFeature],
    common_from_camera: Sequence[ArrayLike],
    gamma_rad: float,
    gamma_sigma_rad: float,
    alignment: str,
    right_handed: bool | None,
    priors: Iterable[Any],
) -> list[ResolvedAttitude]:
    """The attitudes that several features agree on, the likeliest first; see `tiltvp.corner.resolve`."""

def corner_poses(
    left: CornerFeature,
    right: CornerFeature,
    left_from_right: ArrayLike,
    gamma_rad: float,
    gamma_sigma_rad: float,
    right_handed: bool | None,
    priors: Iterable[Any],
    fuse: bool,
) -> list[CornerPose]:
    """The poses that explain the features of a pair of cameras, the likeliest first; see `tiltvp.corner.poses`."""

def triangulate(
    bearings: ArrayLike, covariances_rad2: Sequence[ArrayLike], rig_from_camera: Sequence[ArrayLike]
) -> tuple[NDArray[np.float64], NDArray[np.float64], float] | None:
    """The point that bearings of two or more cameras meet in; see `tiltvp.corner.triangulate`."""
