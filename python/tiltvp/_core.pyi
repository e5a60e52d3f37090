"""What Rust computes for the package: cameras, the tilt of images, common directions, vertical lines, rooms.

Arrays that come in may have any strides and any real dtype unless a shape and dtype is asked for; they are never
altered. Arrays that go out are fresh. Angles are radians. Equation numbers are those of Fleer 2017 (see the README)
where nothing else is said.

`METHODS` are the methods of `TiltEstimator`, `LINE_METHODS` those of `LineExtractor`, `CORNER_METHODS` those of
`CornerDetector`, `CALIBRATION_METHODS` those of `SelfCalibrator`, the default first. `CAMERA_MODELS` are the models of
`Camera`, `ROOM_KINDS` the kinds of `Room`, and `WALL_PATTERNS` what its walls may have in common. `SIMD_LEVELS` are
what `simd_level` may say on this machine, the widest last.
"""

import builtins
from collections.abc import Mapping, Sequence
from typing import Any, Final, Literal, Self, SupportsIndex, final

import numpy as np
from numpy.typing import ArrayLike, NDArray
from typing_extensions import disjoint_base

__all__ = [
    "CALIBRATION_METHODS",
    "CAMERA_MODELS",
    "CORNER_METHODS",
    "LARGEST_SIDE_PX",
    "LINE_METHODS",
    "METHODS",
    "MOST_COEFFICIENTS",
    "MOST_LANDMARKS",
    "MOST_PIXELS",
    "ROOM_KINDS",
    "SIMD_LEVELS",
    "WALL_PATTERNS",
    "WHEEL_BASE_MAX_M",
    "AffineCorrection",
    "BelievedCorner",
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
    "LevelMap",
    "Leveller",
    "LineExtractor",
    "LineTracker",
    "Lines",
    "LogCalibration",
    "LongCalls",
    "MountingEstimate",
    "PixelRays",
    "PosteriorCorrection",
    "PriorOfTilt",
    "ResolvedAttitude",
    "Room",
    "SegmentDetector",
    "Segments",
    "SelfCalibrator",
    "SimulatedDrive",
    "StereoSequence",
    "TiltAlternative",
    "TiltEstimate",
    "TiltEstimator",
    "TiltFilter",
    "TrackedLines",
    "apply_correction",
    "calibrate",
    "check_camera",
    "common_direction",
    "consistency_band",
    "corner_attitudes",
    "corner_poses",
    "descriptor_distances",
    "drive_legs",
    "fit_corner",
    "included_angle",
    "leaning_from_upright",
    "lens_schema",
    "match_descriptors",
    "match_wide",
    "misreading_clause",
    "normal_from_alpha_beta",
    "option_fields",
    "read_imu",
    "resolve_corners",
    "screen_corner",
    "simd_level",
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
    "yaml_tree",
    "zncc_matrix",
]
CALIBRATION_METHODS: Final[list[str]]
CAMERA_MODELS: Final[list[str]]
CORNER_METHODS: Final[list[str]]
LARGEST_SIDE_PX: Final[int]
LINE_METHODS: Final[list[str]]
METHODS: Final[list[str]]
MOST_COEFFICIENTS: Final[int]
MOST_LANDMARKS: Final[int]
MOST_PIXELS: Final[int]
ROOM_KINDS: Final[list[str]]
SIMD_LEVELS: Final[list[str]]
WALL_PATTERNS: Final[list[str]]
WHEEL_BASE_MAX_M: Final[float]

@final
class AffineCorrection:
    """alpha = shift / factor + offset_rad, but not below zero. Frozen, comparable, hashable, pickled.

    Raises `tiltvp.errors.InvalidInputError` unless the factor is positive and both are finite.
    """

    def __copy__(self) -> Self: ...
    def __deepcopy__(self, _memo: Any) -> Self: ...
    def __eq__(self, other: object, /) -> bool: ...
    def __hash__(self) -> int: ...
    def __new__(cls, factor: float, offset_rad: float) -> Self: ...
    @property
    def factor(self) -> float:
        """Units of the shift per radian: pixels per radian, or none for raw angles."""

    @classmethod
    def from_dict(cls, values: dict[str, Any]) -> Self:
        """The value of a dict as `to_dict` makes it, equal to the last bit; None for a number, as of JSON, is NaN."""

    @property
    def offset_rad(self) -> float:
        """What is added, in radians."""

    def to_dict(self) -> dict[str, Any]:
        """The attributes by name, arrays as nested lists: plain, good for JSON."""

@final
class BelievedCorner:
    """A corner of a frame that is believed: seen in all images, in one way, with one interpretation that stands out.

    Frozen, comparable, and to be pickled.
    """

    def __copy__(self) -> Self: ...
    def __deepcopy__(self, _memo: Any) -> Self: ...
    def __eq__(self, other: object, /) -> bool: ...
    def __hash__(self) -> int: ...
    @property
    def edge_angle_sigmas_rad(self) -> NDArray[np.float64]:
        """Fresh (3,) float64: the standard deviations of these angles, radians."""

    @property
    def edge_angles_rad(self) -> NDArray[np.float64]:
        """Fresh (3,) float64: the angles between the edges y and z, z and x, x and y, radians, from the planes of each
        edge in both images alone; NaN from one image, and where the two planes of an edge nearly coincide.
        """

    @property
    def edge_ends_m(self) -> NDArray[np.float64]:
        """Fresh (3, 3) float64, rows x, y, z: where its edges end in the left camera's frame, metres, as
        `CornerEstimate.edge_ends_m`.
        """

    @property
    def edge_length_sigmas_m(self) -> NDArray[np.float64]:
        """Fresh (3,) float64: the standard deviations of these lengths, metres."""

    @property
    def edge_lengths_m(self) -> NDArray[np.float64]:
        """Fresh (3,) float64: how long its edges x, y, z are, metres, as `CornerEstimate.edge_lengths_m`; NaN where no
        image shows it.
        """

    @classmethod
    def from_dict(cls, values: dict[str, Any]) -> Self:
        """The value of a dict as `to_dict` makes it, equal to the last bit; None for a number, as of JSON, is NaN."""

    @property
    def hypotheses(self) -> list[CornerHypothesis]:
        """All of its hypotheses, the likeliest first."""

    @property
    def id(self) -> int | None:
        """The name of its place in the world, from 1: kept from frame to frame, and when the corner was out of sight
        and is seen again. None where it has no place or one that is hardly known, and where it is too near to a named
        place to be told from it.
        """

    @property
    def left(self) -> int:
        """Which corner of `features_left` it is."""

    @property
    def pose(self) -> CornerHypothesis:
        """Its pose, the likeliest of its hypotheses."""

    @property
    def right(self) -> int | None:
        """Which corner of `features_right` it is; None with one camera."""

    def to_dict(self) -> dict[str, Any]:
        """The attributes by name, arrays as nested lists: plain, good for JSON."""

@final
class CalibrationStep:
    """What a step of a `SelfCalibrator` did."""

    def __copy__(self) -> Self: ...
    def __deepcopy__(self, _memo: Any) -> Self: ...
    def __eq__(self, other: object, /) -> bool: ...
    def __hash__(self) -> int: ...
    @classmethod
    def from_dict(cls, values: dict[str, Any]) -> Self:
        """The value of a dict as `to_dict` makes it, equal to the last bit; None for a number, as of JSON, is NaN."""

    @property
    def nis(self) -> float:
        """Normalised innovation squared of the bearings that were fused: chi-square of `used` degrees of freedom."""

    @property
    def rejected(self) -> int:
        """Bearings of known landmarks that did not pass the gate."""

    @property
    def started(self) -> int:
        """Landmarks seen for the first time."""

    def to_dict(self) -> dict[str, Any]:
        """The attributes by name, arrays as nested lists: plain, good for JSON."""

    @property
    def used(self) -> int:
        """Bearings of known landmarks that were fused."""

@disjoint_base
class Camera:
    """A calibrated central camera: pixels to unit bearings and back. `Camera(model, width=..., height=..., ...)`.

    Camera frame: z along the optical axis, x right (columns u), y down (rows v). Pixel centres are at integers. Frozen,
    comparable, hashable, and to be pickled. `tiltvp.Camera` adds a constructor for each model, and calibration files.

    `model` is one of `CAMERA_MODELS`; the model's parameters are keywords by name, None leaves one at its default.
    `max_theta_rad` in (0, pi] limits the angle from the ray through the centre; by default the lens' own limit holds.
    Raises `tiltvp.errors.CalibrationError` for a model, a parameter or a value that no such lens has.
    """

    def __copy__(self) -> Self: ...
    def __deepcopy__(self, _memo: Any) -> Self: ...
    def __eq__(self, other: object, /) -> bool: ...
    def __hash__(self) -> int: ...
    def __new__(
        cls,
        model: str,
        *,
        width: int,
        height: int,
        max_theta_rad: float | None = None,
        mirror: bool = False,
        **parameters: ArrayLike | None,
    ) -> Self: ...
    def conformance(self) -> dict[str, float]:
        """Round trips and errors of the analytic Jacobians, measured from the axis to the rim.

        Counts `pixels_tested`, `pixels_outside`, `pixels_lost` (0 for a camera that is right); the largest errors
        `max_round_trip_px`, `max_round_trip_rad`, `max_jacobian_error_relative` (against central differences); and
        `rim_theta_rad`, the largest angle that was tested.
        """

    @classmethod
    def from_dict(cls, values: dict[str, Any]) -> Self:
        """The camera of a dict as `to_dict` makes it."""

    @property
    def height(self) -> int:
        """Rows of its images."""

    @property
    def max_theta_rad(self) -> float:
        """Largest angle in radians from the ray through the centre that has a pixel."""

    @property
    def mirror(self) -> bool:
        """Whether the image is seen in a mirror: the z component of bearings is negated."""

    def mirrored(self) -> Self:
        """The same camera with `mirror` turned over."""

    @property
    def model(self) -> str:
        """The name of the lens model."""

    @property
    def parameters(self) -> dict[str, Any]:
        """The model's parameters by name, defaults included: numbers and lists of numbers."""

    def project(self, bearings: ArrayLike) -> NDArray[np.float64]:
        """Bearings (N, 3) or (3,) of any length but zero to pixels (u, v), (N, 2) or (2,) float64.

        Rows without an answer (behind the lens' reach, zero, not finite) are NaN. Pixels may lie outside the image.
        Raises `tiltvp.errors.InvalidInputError` for other shapes and dtypes.
        """

    def project_jacobian(self, bearings: ArrayLike) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Pixels as `project` gives them, and d pixel / d bearing at the given bearings: (N, 2, 3), (2, 3)."""

    def scaled(self, factor: float) -> Self:
        """The camera of the image resized by `factor`: what was at u is at factor (u + 1/2) - 1/2.

        The size is rounded to whole pixels. Raises `tiltvp.errors.InvalidInputError` for a factor that is not positive.
        """

    def to_dict(self) -> dict[str, Any]:
        """The keywords that make the camera, with `model` among them."""

    def unproject(self, pixels: ArrayLike) -> NDArray[np.float64]:
        """Pixels (u, v), (N, 2) or (2,), to unit bearings, (N, 3) or (3,) float64; NaN rows outside the valid set.

        Raises `tiltvp.errors.InvalidInputError` for other shapes and dtypes.
        """

    def unproject_jacobian(self, pixels: ArrayLike) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Bearings as `unproject` gives them, and d bearing / d pixel: (N, 3, 2) or (3, 2)."""

    def valid_mask(self) -> NDArray[np.bool_]:
        """Fresh (H, W) bool: the pixels that have a bearing."""

    @property
    def width(self) -> int:
        """Columns of its images."""

@final
class CommonDirection:
    """A direction orthogonal to most of the normals. Frozen, comparable, hashable, pickled. True if there is one."""

    def __bool__(self) -> bool: ...
    def __copy__(self) -> Self: ...
    def __deepcopy__(self, _memo: Any) -> Self: ...
    def __eq__(self, other: object, /) -> bool: ...
    def __hash__(self) -> int: ...
    @property
    def covariance_rad2(self) -> NDArray[np.float64]:
        """(2, 2) in squared radians: covariance in the tangent plane of the direction; infinite without one.

        Its axes are x and y, turned by the smallest rotation that takes z to the direction.
        """

    @property
    def direction(self) -> NDArray[np.float64]:
        """Fresh (3,) float64: the unit direction on the prior's side; NaN if the normals do not determine one."""

    @classmethod
    def from_dict(cls, values: dict[str, Any]) -> Self:
        """The value of a dict as `to_dict` makes it, equal to the last bit; None for a number, as of JSON, is NaN."""

    @property
    def inliers(self) -> NDArray[np.bool_]:
        """Fresh (N,) bool: the normals whose great circles pass within three sigma_rad of the direction."""

    @property
    def report(self) -> FitReport:
        """How the fit went; the residual is in radians."""

    def to_dict(self) -> dict[str, Any]:
        """The attributes by name, arrays as nested lists: plain, good for JSON."""

@final
class ComplementaryFilter:
    """Rates of turn in the short run, a reference attitude in the long run: `ComplementaryFilter(reference_from_body)`.

    The explicit complementary filter on rotations with corrections that arrive now and then: an attitude seen in an
    image, say, among the readings of a gyroscope. It starts at an attitude (3, 3), with no bias. Raises
    `tiltvp.errors.InvalidInputError`.
    """

    def __copy__(self) -> Self: ...
    def __deepcopy__(self, _memo: Any) -> Self: ...
    def __eq__(self, other: object, /) -> bool: ...
    def __new__(
        cls,
        reference_from_body: ArrayLike,
        *,
        time_constant_s: float | None = None,
        bias_time_constant_s: float | None = None,
    ) -> Self:
        """The options, by keyword.

        Parameters
        ----------
        time_constant_s
            Time after which a difference from the reference has shrunk to 1/e, seconds. What is quicker is taken from
            the rates, what is slower from the reference. Default: 0.15.
        bias_time_constant_s
            Time over which a lasting difference becomes a bias of the rates, seconds. Default: 4.
        """

    @property
    def bias_rad_s(self) -> NDArray[np.float64]:
        """(3,): the bias of the rates, in the body's axes."""

    @property
    def bias_time_constant_s(self) -> float:
        """Time over which a lasting difference becomes a bias of the rates, seconds."""

    def correct(self, reference_from_body: ArrayLike) -> NDArray[np.float64]:
        """Moves towards a reference (3, 3) by the share 1 - exp(-t / time_constant_s), t the time since the last one.

        Returns (3,): the difference that it found, as a rotation vector in the body's axes.
        """

    @property
    def options(self) -> dict[str, Any]:
        """The options in force, by name, defaults included; a fresh dict, good as keywords."""

    def predict(self, rate_rad_s: ArrayLike, duration_s: float) -> None:
        """Turns on by a rate (3,), in the body's axes, that holds for so long."""

    @property
    def reference_from_body(self) -> NDArray[np.float64]:
        """(3, 3): the attitude now, which takes vectors of the body to the frame of the reference."""

    @property
    def time_constant_s(self) -> float:
        """Time after which a difference from the reference has shrunk to 1/e, seconds."""

@final
class CornerAttitude:
    """One attitude that the rays of a corner admit. Frozen, comparable (bit by bit), hashable, and to be pickled."""

    def __copy__(self) -> Self: ...
    def __deepcopy__(self, _memo: Any) -> Self: ...
    def __eq__(self, other: object, /) -> bool: ...
    def __hash__(self) -> int: ...
    @property
    def alpha_rad(self) -> float:
        """The angle between the vertical edge and the line of sight to the vertex, in [0, pi] radians."""

    @property
    def camera_from_object(self) -> NDArray[np.float64]:
        """(3, 3): the rotation R in v_camera = R v_object, whose columns are the edge x, the edge y, and x cross y."""

    @property
    def case(self) -> str:
        """How the edges of the imaginary box stand: "all-away", "one-perpendicular" or "one-toward"."""

    @property
    def covariance_rad2(self) -> NDArray[np.float64]:
        """(3, 3) in squared radians: covariance of the rotation vector w, camera frame, of the error.

        The true rotation is exp(w) times `camera_from_object`. Infinite where two roots fall together.
        """

    @property
    def edges(self) -> NDArray[np.float64]:
        """Fresh (3, 3) float64: the directions of the edges x, y, z away from the vertex, camera frame, one a row."""

    @classmethod
    def from_dict(cls, values: dict[str, Any]) -> Self:
        """The value of a dict as `to_dict` makes it, equal to the last bit; None for a number, as of JSON, is NaN."""

    @property
    def ln_volume(self) -> float:
        """The logarithm of the volume of attitudes that a volume of the rays' angles admits, up to a constant."""

    @property
    def mirrored(self) -> bool:
        """Whether this is the second of the two interpretations (fig. 3c), the inner instead of the outer corner."""

    @property
    def right_handed(self) -> bool:
        """Whether the edges x, y, z are a right-handed triple; the two interpretations differ in it."""

    @property
    def sensitivity(self) -> float:
        """Radians of attitude per radian of the rays' angles about the vertex; infinite where roots fall together."""

    def to_dict(self) -> dict[str, Any]:
        """The attributes by name, arrays as nested lists: plain, good for JSON."""

@final
class CornerAttitudes:
    """Every attitude of many corners, as arrays of as many rows as there are attitudes.

    Frozen, comparable, hashable, and to be pickled.
    """

    def __copy__(self) -> Self: ...
    def __deepcopy__(self, _memo: Any) -> Self: ...
    def __eq__(self, other: object, /) -> bool: ...
    def __hash__(self) -> int: ...
    def __len__(self) -> int: ...
    @property
    def alpha_rad(self) -> NDArray[np.float64]:
        """Fresh (M,) float64: the angles between the vertical edge and the line of sight, radians."""

    @property
    def attitudes(self) -> list[CornerAttitude]:
        """The attitudes, in that order."""

    @property
    def camera_from_object(self) -> NDArray[np.float64]:
        """Fresh (M, 3, 3) float64: the rotations R in v_camera = R v_object."""

    @property
    def case(self) -> list[str]:
        """How the edges of the imaginary boxes stand, by name."""

    @property
    def corner(self) -> NDArray[np.int64]:
        """Fresh (M,) int64: to which corner each attitude belongs, rising."""

    @property
    def corners(self) -> int:
        """How many corners were asked for; as many attitudes or none may belong to each."""

    @property
    def edges(self) -> NDArray[np.float64]:
        """(M, 3, 3): the directions of the edges x, y, z away from the vertex, camera frame, one a row."""

    @classmethod
    def from_dict(cls, values: dict[str, Any]) -> Self:
        """The value of a dict as `to_dict` makes it, equal to the last bit; None for a number, as of JSON, is NaN."""

    @property
    def mirrored(self) -> NDArray[np.bool_]:
        """Fresh (M,) bool: whether it is the second of two interpretations."""

    def of(self, corner: SupportsIndex) -> list[CornerAttitude]:
        """The attitudes of one corner, by its number."""

    @property
    def right_handed(self) -> NDArray[np.bool_]:
        """Fresh (M,) bool: whether the edges x, y, z are a right-handed triple."""

    @property
    def sensitivity(self) -> NDArray[np.float64]:
        """Fresh (M,) float64: radians of attitude per radian of the rays' angles about the vertex."""

    def to_dict(self) -> dict[str, Any]:
        """The attributes by name, arrays as nested lists: plain, good for JSON."""

@disjoint_base
class CornerDetector:
    """Finds corners in single images of one camera; `tiltvp.corner.CornerDetector` takes images of any usual kind.

    The tables of the camera are made once. `options` tells the options in force; docs/corner_images.md says what they
    mean.
    """

    def __copy__(self) -> Self: ...
    def __deepcopy__(self, _memo: Any) -> Self: ...
    def __eq__(self, other: object, /) -> bool: ...
    def __hash__(self) -> int: ...
    def __new__(
        cls,
        camera: Camera,
        *,
        method: Literal["coloured", "general", "paper"] | str = ...,
        mask: NDArray[np.bool_] | None = None,
        display_gamma: float = ...,
        chromaticity_min: float = ...,
        intensity_min: SupportsIndex = ...,
        faces: str = ...,
        orientation: Literal["either", "upright", "upside-down"] = ...,
        search_width_px: SupportsIndex = ...,
        candidates_min: SupportsIndex = ...,
        line_threshold_px: float = ...,
        seed: SupportsIndex = ...,
        label_step_px: SupportsIndex = ...,
        search_px: float = ...,
        refine_px: float = ...,
        step_min: float = ...,
        threshold_px: float = ...,
        ray_sigma_px: float = ...,
        support_min_px: SupportsIndex = ...,
        residual_max_px: float = ...,
        gradient_min: float = ...,
        gradient_start: float = ...,
        smoothing_px: float = ...,
        margin_px: float = ...,
        segment_min_px: float = ...,
        segment_threshold_px: float = ...,
        gap_max_px: float = ...,
        gap_max_share: float = ...,
        overshoot_max_px: float = ...,
        ray_angle_min_rad: float = ...,
        gamma_rad: float = ...,
        vertical_max_rad: float = ...,
        follow_px: float = ...,
        support_min_share: float = ...,
        guided_min_share: float = ...,
        corners_max: SupportsIndex = ...,
        line_sigma_px: float = ...,
    ) -> Self:
        """The options, by keyword.

        Parameters
        ----------
        display_gamma
            "coloured", "general": The exponent of the images' display curve, `level = light^(1 / gamma)`; 1 for linear
            images. The published method takes levels as they are. Default: 2.2.
        chromaticity_min
            "coloured", "paper": Least share of the face's own primary in the sum of all three. Default: 0.45.
        intensity_min
            "coloured", "paper": Least value of the face's own primary, out of 255. Default: 50.
        faces
            "coloured", "paper": Colours of the top, the left and the right face as an upright camera sees them, by
            their letters. Default: "rgb".
        orientation
            "coloured", "paper": Which way the camera is held. Default: "either".
        search_width_px
            "coloured", "paper": How far apart the faces on both sides of an edge are looked for, in pixels (the paper's
            search width). The default depends on the method.
        candidates_min
            "coloured", "paper": Least number of candidates of each edge, if every pixel were labelled. Default: 40.
        line_threshold_px
            "coloured", "paper": Largest distance of a candidate from the line that RANSAC fits, in pixels. The default
            depends on the method.
        seed
            "coloured", "paper": Seed of the random samples. Default: 0.
        label_step_px
            "coloured": Every how many-th pixel is labelled, along rows and columns; the rays are fitted to all pixels
            whatever it is. The paper's is 1. Default: 2.
        search_px
            "coloured": How far from the candidates' line the edge is looked for, in pixels. Default: 4.
            "general": How far from a segment the edge is looked for, in pixels. Default: 2.5.
        refine_px
            "coloured": How far from the first ray it is looked for the second time, in pixels. Default: 2.
        step_min
            "coloured": Least step across an edge in the light of the two faces' primaries, out of 255. Default: 8.
            "general": Least step across an edge, in the light of grey levels out of 255. Default: 1.
        threshold_px
            "coloured", "general": Largest distance of a place of the edge from its ray, in pixels. The default depends
            on the method.
        ray_sigma_px
            "coloured": What places of an edge do not tell: how far either end of a ray may be off, in pixels. Default:
            0.01.
            "general": What places of an edge do not tell, as real edges are bevelled and worn: how far either end of a
            ray may be off, in pixels. Default: 0.2.
        support_min_px
            "coloured", "general": Least number of places that agree with a ray. The default depends on the method.
        residual_max_px
            Largest root mean square distance of the vertex from the three rays, in pixels. The default depends on the
            method.
        gradient_min
            "general": Least gradient magnitude of an edge pixel, Scharr kernel (3, 10, 3) on 8-bit grey levels. Poses
            are also looked for at half of this and of `gradient_start` where there is none. Default: 30.
        gradient_start
            "general": Gradient magnitude of which an edge has a pixel at least; it is followed down to `gradient_min`.
            Default: 50.
        smoothing_px
            "general": Standard deviation of the Gaussian before the kernel, in pixels. Default: 1.
        margin_px
            "general": Pixels kept clear of the image's border and the mask. Default: 4.
        segment_min_px
            "general": Least length of a line segment, in pixels. Default: 20.
        segment_threshold_px
            "general": Largest distance of a segment's pixels from its great circle, in pixels. Default: 1.2.
        gap_max_px
            "general": How far from the vertex a segment may begin, in pixels. Default: 40.
        gap_max_share
            "general": The same as a share of the segment's length, if that is more. Default: 0.2.
        overshoot_max_px
            "general": How far beyond the vertex a segment may reach, in pixels. Default: 5.
        ray_angle_min_rad
            "general": Least angle between two rays at the vertex, in radians. Default: 0.174533.
        gamma_rad
            "general": The angle between the two level edges of a corner, in radians. Default: 1.5708.
        vertical_max_rad
            "general": How far the vertical edge may be from the prior's vertical, in radians. Default: 0.349066.
        follow_px
            "general": How far from where it was a corner is looked for in the next frame, in pixels. Default: 8.
        support_min_share
            "general": Least share of the places along a ray that agree with it. Default: 0.6.
        guided_min_share
            "general": The same for a corner that is looked for near where it is expected. Default: 0.4.
        corners_max
            "general": Most corners of an image, the best ones. Default: 12.
        line_sigma_px
            "paper": How far colours and blur may shift all midpoints of an edge alike, in pixels: a standard deviation.
            Default: 0.35.
        """

    def _detect_color(self, image: NDArray[np.uint8]) -> list[CornerFeature]:
        """The corner of a C-contiguous `(H, W, 3)` image of uint8, blue first; at most one."""

    def _detect_gray(self, image: NDArray[np.uint8], vertical: ArrayLike | None) -> list[CornerFeature]:
        """The corners of a C-contiguous `(H, W)` image of uint8; `vertical` is a direction of the camera frame."""

    def _segments(self, image: NDArray[np.uint8]) -> NDArray[np.float64]:
        """`(N, 4)` float64: the ends `(u, v, u, v)` of the line segments of a C-contiguous `(H, W)` image of uint8."""

    @property
    def camera(self) -> Camera:
        """The camera whose images are read."""

    @property
    def mask(self) -> NDArray[np.bool_] | None:
        """Fresh (H, W) bool, or None: which pixels may be used."""

    @property
    def method(self) -> str:
        """The name of the method."""

    @property
    def options(self) -> dict[str, Any]:
        """The options that are in force, by name, defaults included; a fresh dict, good as keywords."""

@final
class CornerEstimate:
    """What one frame tells of a corner: the likeliest pose if one stands out, and all hypotheses. False without a pose.

    Frozen, comparable, and to be pickled.
    """

    def __bool__(self) -> bool: ...
    def __copy__(self) -> Self: ...
    def __deepcopy__(self, _memo: Any) -> Self: ...
    def __eq__(self, other: builtins.object, /) -> bool: ...
    def __hash__(self) -> int: ...
    @property
    def chosen_left(self) -> list[int]:
        """Which corners of the left image the pose is from, the one that is its object first."""

    @property
    def chosen_right(self) -> int | None:
        """Which corner of the right image it is from, or None."""

    @property
    def confidence(self) -> float:
        """The probability of the likeliest hypothesis; 0 where there is none."""

    @property
    def corners(self) -> list[BelievedCorner]:
        """All corners that are believed, each with a name, that of the pose first. From one camera that of the pose
        alone.
        """

    @property
    def edge_ends_m(self) -> NDArray[np.float64]:
        """Fresh (3, 3) float64, rows x, y, z: where these edges end in the left camera's frame, metres, from both
        images alone; NaN where only one of them shows it, or none. With a known length from the pose of the one image.
        """

    @property
    def edge_length_sigmas_m(self) -> NDArray[np.float64]:
        """Fresh (3,) float64: the standard deviations of these lengths, metres."""

    @property
    def edge_lengths_m(self) -> NDArray[np.float64]:
        """Fresh (3,) float64: how long the edges x, y, z are, metres, to where lines along the others meet them; NaN
        where no image shows that. From two grey images with right angles, and from one image with a known length.
        """

    @property
    def features_left(self) -> list[CornerFeature]:
        """The corners of the left or only image."""

    @property
    def features_right(self) -> list[CornerFeature]:
        """The corners of the right image."""

    @property
    def followed(self) -> bool:
        """Whether the pose of a frame before was a prior."""

    @classmethod
    def from_dict(cls, values: dict[str, Any]) -> Self:
        """The value of a dict as `to_dict` makes it, equal to the last bit; None for a number, as of JSON, is NaN."""

    @property
    def hypotheses(self) -> list[CornerHypothesis]:
        """All hypotheses, the likeliest first."""

    @property
    def object(self) -> int:
        """The number of the corner that is the object, from 1: it grows where another corner has become the object;
        from one camera, whose attitude all parallel corners share, only after the poses before were forgotten.
        """

    @property
    def place_reason(self) -> str:
        """Why the likeliest hypothesis has no place; empty where it has one, and where there is none."""

    @property
    def pose(self) -> CornerHypothesis | None:
        """The pose, a `CornerHypothesis`; None where none stands out."""

    @property
    def reason(self) -> str:
        """Why there is no pose; empty where there is one."""

    def to_dict(self) -> dict[str, Any]:
        """The attributes by name, arrays as nested lists: plain, good for JSON."""

@final
class CornerFeature:
    """One vertex and the three rays x, y (the vertical one) and z of a corner, as one camera sees it.

    Frozen, comparable, and to be pickled.
    """

    def __copy__(self) -> Self: ...
    def __deepcopy__(self, _memo: Any) -> Self: ...
    def __eq__(self, other: object, /) -> bool: ...
    def __hash__(self) -> int: ...
    @classmethod
    def from_dict(cls, values: dict[str, Any]) -> Self:
        """The value of a dict as `to_dict` makes it, equal to the last bit; None for a number, as of JSON, is NaN."""

    @property
    def meets_probability(self) -> float:
        """The probability that three edges that do meet miss their vertex by more."""

    @property
    def normals(self) -> NDArray[np.float64]:
        """(3, 3), rows x, y, z: unit normals of the rays' great circles, `vertex x toward` up to length."""

    @property
    def ray_covariances_rad2(self) -> NDArray[np.float64]:
        """Fresh (3, 2, 2) float64: covariance of each normal in its tangent plane, square radians."""

    @property
    def ray_rms_rad(self) -> list[float]:
        """Root mean square distance of these from each ray, radians."""

    @property
    def residual_rad(self) -> float:
        """Root mean square of the vertex' distances from the three rays' great circles, radians."""

    @property
    def support_px(self) -> list[int]:
        """How many places of each ray it was fitted to; 0 of the edge of an L-junction that is not seen."""

    def to_dict(self) -> dict[str, Any]:
        """The attributes by name, arrays as nested lists: plain, good for JSON."""

    @property
    def toward(self) -> NDArray[np.float64]:
        """Fresh (3, 3) float64, rows x, y, z: a unit bearing near the far end of each ray."""

    @property
    def vertex(self) -> NDArray[np.float64]:
        """Fresh (3,) float64: unit bearing of the vertex, camera frame."""

    @property
    def vertex_covariance_rad2(self) -> NDArray[np.float64]:
        """Fresh (2, 2) float64: covariance of the vertex in its tangent plane, square radians."""

@final
class CornerHypothesis:
    """One explanation of what is seen: an attitude, from two cameras also a place, and how likely it is.

    Frozen, comparable, and to be pickled.
    """

    def __copy__(self) -> Self: ...
    def __deepcopy__(self, _memo: Any) -> Self: ...
    def __eq__(self, other: object, /) -> bool: ...
    def __hash__(self) -> int: ...
    @property
    def camera_from_object(self) -> NDArray[np.float64]:
        """Fresh (3, 3) float64: the rotation from the object's frame (y along the vertical edge, away from the vertex,
        x along the edge x) to the left camera's.
        """

    @property
    def camera_in_object_m(self) -> NDArray[np.float64] | None:
        """Fresh (3,) float64: where the left camera is in the object's frame, metres; None where `vertex_m` is."""

    @property
    def covariance(self) -> NDArray[np.float64]:
        """Fresh (6, 6) float64: covariance of the attitude's rotation vector (left camera's frame, radians) and of the
        vertex (metres; zero where that is None).
        """

    @property
    def edges(self) -> NDArray[np.float64]:
        """Fresh (3, 3) float64, rows x, y, z: directions of the corner's edges away from its vertex, left camera's
        frame. The frame of `camera_from_object` keeps its axes from frame to frame, whatever the edges are called.
        """

    @classmethod
    def from_dict(cls, values: dict[str, Any]) -> Self:
        """The value of a dict as `to_dict` makes it, equal to the last bit; None for a number, as of JSON, is NaN."""

    @property
    def misfit(self) -> float:
        """Root mean square misfit per degree of freedom in standard deviations of the rays; 0 for a single feature."""

    @property
    def probability(self) -> float:
        """The probability that it is this one, in [0, 1]."""

    @property
    def right_handed(self) -> bool:
        """Whether the edges x, y, z are a right-handed triple, as of an outer corner."""

    def to_dict(self) -> dict[str, Any]:
        """The attributes by name, arrays as nested lists: plain, good for JSON."""

    @property
    def vertex_m(self) -> NDArray[np.float64] | None:
        """Fresh (3,) float64: the vertex in the left camera's frame, metres; None from one image without
        `camera_height_m`, `edge_length_m` or `box_size_m`, and where these do not tell it.
        """

@final
class CornerPose:
    """One pose of a corner before a pair of cameras. Frozen, comparable, hashable, and to be pickled."""

    def __copy__(self) -> Self: ...
    def __deepcopy__(self, _memo: Any) -> Self: ...
    def __eq__(self, other: object, /) -> bool: ...
    def __hash__(self) -> int: ...
    @property
    def camera_from_object(self) -> NDArray[np.float64]:
        """Fresh (3, 3) float64: the rotation R in v_camera = R v_object, of the left camera."""

    @property
    def camera_in_object_covariance_m2(self) -> NDArray[np.float64]:
        """Fresh (3, 3) float64: its covariance, square metres."""

    @property
    def camera_in_object_m(self) -> NDArray[np.float64]:
        """Fresh (3,) float64: where the left camera is in the object's frame, metres."""

    @property
    def case(self) -> str:
        """How the edges of the imaginary box stand to the left camera's line of sight."""

    @property
    def chi_square(self) -> float:
        """The squared misses of the rays, each by its covariance: chi-square of six degrees of freedom."""

    @property
    def covariance(self) -> NDArray[np.float64]:
        """Fresh (6, 6) float64: covariance of the rotation vector (radians) and of the vertex (metres), left camera's
        frame.
        """

    @classmethod
    def from_dict(cls, values: dict[str, Any]) -> Self:
        """The value of a dict as `to_dict` makes it, equal to the last bit; None for a number, as of JSON, is NaN."""

    @property
    def fused(self) -> bool:
        """Whether all six rays were fused; where not, covariances between attitude and vertex are left out."""

    @property
    def mirrored(self) -> bool:
        """Whether this is the second of the two interpretations in the left image (fig. 3c)."""

    @property
    def probability(self) -> float:
        """The probability that it is this pose and none of the others that the rays admit, in [0, 1]."""

    @property
    def right_handed(self) -> bool:
        """Whether the edges x, y, z are a right-handed triple."""

    def to_dict(self) -> dict[str, Any]:
        """The attributes by name, arrays as nested lists: plain, good for JSON."""

    @property
    def vertex_m(self) -> NDArray[np.float64]:
        """(3,): the vertex, which is the object's origin, in the left camera's frame, metres."""

@disjoint_base
class CornerPoseEstimator:
    """Poses from the images of one camera or a pair; `tiltvp.corner.CornerPoseEstimator` takes cameras and any images.

    It holds the detectors of one camera or a pair, and the last pose. Comparable, and to be copied and pickled with
    what was seen.
    """

    def __eq__(self, other: object, /) -> bool: ...
    def __new__(
        cls,
        left: CornerDetector,
        right: CornerDetector | None = None,
        left_from_right: ArrayLike | None = None,
        *,
        gamma_rad: float = ...,
        gamma_sigma_rad: float = ...,
        right_handed: bool | None = ...,
        down: ArrayLike | None = ...,
        down_sigma_rad: float = ...,
        turn_sigma_rad: float = ...,
        forget_after: SupportsIndex = ...,
        agree_max_rad: float = ...,
        parallel_max_rad: float = ...,
        misfit_max: float = ...,
        distance_min_m: float = ...,
        distance_max_m: float = ...,
        camera_height_m: float | None = ...,
        camera_height_sigma_m: float = ...,
        edge_length_m: float | None = ...,
        known_edge: Literal["x", "y", "z"] = ...,
        box_size_m: ArrayLike | None = ...,
        length_sigma_m: float = ...,
        probability_min: float = ...,
    ) -> Self:
        """The options, by keyword.

        Parameters
        ----------
        gamma_rad
            The angle gamma between the edges x and z, radians. Default: 1.5708.
        gamma_sigma_rad
            Its standard deviation, radians; 0 where it is known exactly. Default: 0.
        right_handed
            Whether the edges x, y, z, clockwise in the image, are a right-handed triple: true for outer corners, false
            for inner ones, none where both are possible; the coloured cuboid's is an outer one. Default: None.
        down
            The direction down in the left camera's frame, before anything was seen; none where nothing is known.
            Default: None.
        down_sigma_rad
            Standard deviation of that direction, radians. Default: 0.261799.
        turn_sigma_rad
            How far the camera may turn from one frame to the next, radians, as a standard deviation. Default: 0.10472.
        forget_after
            Frames without a pose after which the last one is forgotten; 0 never follows. Default: 10.
        agree_max_rad
            How far attitudes of several features of one image may be apart, radians. Default: 0.0698132.
        parallel_max_rad
            How far a corner's own attitude may be from that which most straight edges of the images have in common,
            radians, for its edges to be taken as parallel to them; 0 takes none as parallel. Default: 0.0698132.
        misfit_max
            How far the attitudes of one corner in both images may be apart, those of several corners in one image, and
            the rays from the fused pose, in standard deviations of the covariances as they are: root mean square per
            degree of freedom. Default: 5.
        distance_min_m
            The least distance of a vertex, metres. Default: 0.05.
        distance_max_m
            The largest distance of a vertex, metres. Default: 100.
        camera_height_m
            How far one camera is above the level plane through the vertex, metres: it tells the place. Without colours
            the vertex is of a corner whose upright edge rises from it, as of what stands on the floor. None where that
            is not known, and for two cameras, which tell it themselves. Default: None.
        camera_height_sigma_m
            Standard deviation of that height, metres. Default: 0.
        edge_length_m
            The length of one edge of the corner, metres, which tells one camera its place. None where that is not
            known. Default: None.
        known_edge
            Which edge has that length: y is the upright one; x and z only before the coloured cuboid, whose colours
            name them. Default: "y".
        box_size_m
            The sizes of the box along its edges x, y (the upright one) and z, metres, which tell one camera its place.
            Without colours x and z may be exchanged. None where they are not known. Default: None.
        length_sigma_m
            Standard deviation of the known length, or of each size of the box, metres. Default: 0.
        probability_min
            Least probability of the best hypothesis; below it none is chosen. Default: 0.9.
        """

    @property
    def _coloured(self) -> bool:
        """Whether images in colour are wanted."""

    def _observe(
        self,
        left: NDArray[np.uint8],
        right: NDArray[np.uint8] | None,
        gravity: tuple[ArrayLike, float] | None = None,
        gyro: tuple[ArrayLike, ArrayLike] | None = None,
    ) -> CornerEstimate:
        """What one frame tells: C-contiguous images of uint8, (H, W, 3) or (H, W) as `_coloured` says; which way is
        down (3,) with its standard deviation, and the turn since the frame before (3, 3) with its covariance (3, 3).
        """

    @property
    def left(self) -> CornerDetector:
        """The detector of the left or only camera."""

    @property
    def left_from_right(self) -> NDArray[np.float64] | None:
        """Fresh (4, 4) float64, or None: the right camera's pose in the left one's frame."""

    @property
    def options(self) -> dict[str, Any]:
        """The options that are in force, by name, defaults included."""

    def reset(self) -> None:
        """Forgets the poses of the frames before and the corners that have a name; no name is given again."""

    @property
    def right(self) -> CornerDetector | None:
        """The detector of the right camera, or None."""

@disjoint_base
class Drive:
    """A robot's way through a room, any frame of which can be rendered by `tiltvp.synth.Drive`.

    Frozen, comparable, hashable, and to be pickled. N is the number of frames. The drive is planned and daylight
    gathered on `threads` threads (None: one per core), on which nothing depends.
    """

    def __copy__(self) -> Self: ...
    def __deepcopy__(self, _memo: Any) -> Self: ...
    def __eq__(self, other: object, /) -> bool: ...
    def __getnewargs_ex__(self) -> tuple[tuple[Room], dict[str, Any]]: ...
    def __hash__(self) -> int: ...
    def __len__(self) -> int: ...
    def __new__(
        cls,
        room: Room,
        *,
        camera: Camera,
        threads: SupportsIndex | None = None,
        frames: SupportsIndex | None = None,
        seed: SupportsIndex | None = None,
        step_m: float | None = None,
        turn_max_rad: float | None = None,
        mount: ArrayLike | None = None,
        robot_from_camera: ArrayLike | None = None,
        blind_rad: float | None = None,
        wheel_base_m: float | None = None,
        encoder_k_m: float | None = None,
        wheel_radius_errors: ArrayLike | None = None,
        bumps_max_rad: float | None = None,
        lighting: float | None = None,
        samples: SupportsIndex | None = None,
        noise_sigma: float | None = None,
        blur_sigma_px: float | None = None,
        legs: ArrayLike | None = None,
    ) -> Self:
        """The options, by keyword.

        Parameters
        ----------
        frames
            How many frames the robot wanders, from one far place to another. Default: 1500.
        seed
            Seed of way, encoders, bumps, light and noise. Default: 0.
        step_m
            Greatest way from frame to frame, metres. Default: 0.05.
        turn_max_rad
            Greatest turn from frame to frame, radians. Default: 0.08.
        mount
            Where the camera is on the robot: x_m, y_m, yaw_rad and height_m. Default: (0.0, 0.0, 0.0, 0.4).
        robot_from_camera
            How the camera sits in its mounting, which the mount's yaw turns; identity for a camera that looks up.
            Default: [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]].
        blind_rad
            Half angle of the cone around the camera's `z` axis in which it sees only itself, as under a mirror: black,
            radians. Default: 0.
        wheel_base_m
            Distance between the wheels' contact points, metres. Default: 0.35.
        encoder_k_m
            Variance of a reading per metre that a wheel rolls, metres (Chong and Kleeman 1997). Default: 1e-05.
        wheel_radius_errors
            How much larger the left and the right wheel are than the odometry takes them for, relative. Default: (0.0,
            0.0).
        bumps_max_rad
            Greatest lean from bumps, radians; the robot leans about the camera's centre. Default: 0.
        lighting
            How much lamps, daylight, their colours and the exposure change along the way. Default: 0.5.
        samples
            Rays per pixel side where surfaces meet; elsewhere one ray per pixel will do. Default: 3.
        noise_sigma
            Standard deviation of Gaussian noise, grey levels. Default: 2.
        blur_sigma_px
            Standard deviation of a Gaussian blur, pixels, 0 for none. Default: 0.
        legs
            Arcs along which the robot goes, one after the other: distance in metres and turn in radians of each.
            Default: [].
        """

    def _render(
        self, frame: SupportsIndex, *, threads: SupportsIndex | None = None
    ) -> tuple[NDArray[np.uint8], NDArray[np.uint8]]:
        """Grey (H, W) and RGB (H, W, 3) images of a frame."""

    def _render_at(
        self, frame: SupportsIndex, pose: ArrayLike, normal: ArrayLike, *, threads: SupportsIndex | None = None
    ) -> tuple[NDArray[np.uint8], NDArray[np.uint8]]:
        """Grey (H, W) and RGB (H, W, 3) images in a frame's light, from a pose (3,) with a ground normal (3,)."""

    def _truth(
        self, frame: SupportsIndex, *, threads: SupportsIndex | None = None
    ) -> tuple[NDArray[np.int64], NDArray[np.float64], NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]]:
        """Edges in sight at a frame: numbers, bearings, elevations, visible shares, contrasts."""

    @property
    def bumps_max_rad(self) -> float:
        """Greatest lean from bumps, radians."""

    @property
    def camera(self) -> Camera:
        """The camera."""

    @staticmethod
    def check(**options: Any) -> None:
        """Raises what `Drive` raises for these options, whatever the room."""

    @property
    def edges_m(self) -> NDArray[np.float64]:
        """(E, 4): x_m, y_m, lowest and highest z_m of the room's upright edges, visible or not; the row is the number.

        All upright edges within 3 mm of a vertical line are one. Those of wallpaper and tiles come last.
        """

    @property
    def encoder_k_m(self) -> float:
        """Variance of a reading per metre that a wheel rolls, metres."""

    @property
    def frames(self) -> int:
        """N, how many frames it has; also its `len`."""

    @property
    def lighting(self) -> float:
        """How much the light changes along the way, from 0 to 1."""

    @property
    def motions(self) -> NDArray[np.float64]:
        """(N, 2): distance in metres and turn in radians that the encoders' readings stand for."""

    @property
    def mount(self) -> tuple[float, float, float, float]:
        """x_m, y_m, yaw_rad, height_m of the camera's centre on the robot."""

    @property
    def odometry(self) -> NDArray[np.float64]:
        """(N, 2): how far the left and right wheel rolled since the last frame, by their encoders; metres."""

    @property
    def poses(self) -> NDArray[np.float64]:
        """(N, 3): true x_m, y_m, yaw_rad of the robot. Integrating `true_odometry` along arcs gives them exactly."""

    @property
    def robot_from_camera(self) -> NDArray[np.float64]:
        """(3, 3): rotation from camera to robot coordinates, the mount's yaw included."""

    @property
    def room(self) -> Room:
        """The room."""

    @property
    def seed(self) -> int:
        """The seed of everything but the room."""

    @property
    def tilts(self) -> NDArray[np.float64]:
        """(N, 2): true alpha_rad, beta_rad."""

    @property
    def true_odometry(self) -> NDArray[np.float64]:
        """(N, 2): how far the left and right wheel rolled, metres."""

    @property
    def wheel_base_m(self) -> float:
        """Distance between the wheels, metres."""

    @property
    def wheel_radius_errors(self) -> tuple[float, float]:
        """How much larger the left and the right wheel are than the readings assume, relative."""

@final
class EdgeElements:
    """The edge pixels of one image, in row order: where each is, its direction and offset, and what became of it."""

    def __copy__(self) -> Self: ...
    def __deepcopy__(self, _memo: Any) -> Self: ...
    def __eq__(self, other: object, /) -> bool: ...
    def __hash__(self) -> int: ...
    def __len__(self) -> int: ...
    @classmethod
    def from_dict(cls, values: dict[str, Any]) -> Self:
        """The value of a dict as `to_dict` makes it, equal to the last bit; None for a number, as of JSON, is NaN."""

    @property
    def inlier(self) -> NDArray[np.bool_]:
        """(N,): the pixels that agree with the estimate."""

    @property
    def inlier_mask(self) -> NDArray[np.bool_]:
        """(H, W): the pixels that agree with the estimate, over the image."""

    @property
    def normal(self) -> NDArray[np.float64]:
        """(N, 3): unit normals of the edges' great circles in the robot frame (eq. 37), of either sign.

        Those of the method, before any prefilter; NaN for the image-space methods, which have none.
        """

    @property
    def offset_px(self) -> NDArray[np.float64]:
        """(N,): edge offsets s in pixels (eq. 17); NaN where the lens sees neither zenith nor nadir."""

    @property
    def phi_rad(self) -> NDArray[np.float64]:
        """(N,): gradient directions in [0, pi) radians (eq. 16)."""

    @property
    def prefiltered(self) -> NDArray[np.bool_]:
        """(N,): the pixels that passed the prefilter and were not left out."""

    @property
    def size_px(self) -> tuple[int, int]:
        """Columns and rows of the image."""

    def to_dict(self) -> dict[str, Any]:
        """The attributes by name, arrays as nested lists: plain, good for JSON."""

    @property
    def u(self) -> NDArray[np.uint16]:
        """(N,): columns."""

    @property
    def v(self) -> NDArray[np.uint16]:
        """(N,): rows."""

@final
class FilterStep:
    """What a filter did with an estimate, and why. Frozen, comparable, hashable, pickled. True if it was fused."""

    def __bool__(self) -> bool: ...
    def __copy__(self) -> Self: ...
    def __deepcopy__(self, _memo: Any) -> Self: ...
    def __eq__(self, other: object, /) -> bool: ...
    def __hash__(self) -> int: ...
    @property
    def accepted(self) -> bool:
        """Whether the estimate was fused."""

    @classmethod
    def from_dict(cls, values: dict[str, Any]) -> Self:
        """The value of a dict as `to_dict` makes it, equal to the last bit; None for a number, as of JSON, is NaN."""

    @property
    def nis(self) -> float | None:
        """The normalised innovation squared, of two degrees of freedom; None if it did not come to that."""

    @property
    def reason(self) -> str:
        """The same in a sentence, with the measured number and the limit."""

    def to_dict(self) -> dict[str, Any]:
        """The attributes by name, arrays as nested lists: plain, good for JSON."""

    @property
    def verdict(self) -> Literal["accepted", "jumped", "no-tilt", "repeated", "low-confidence", "outside-gate", "lost"]:
        """What was done, in a word.

        Fused: "accepted", or "jumped", if so many rejected estimates agreed that the floor's tilt was forgotten. Left
        out: "no-tilt", "repeated", if it is that of the image before to the last bit though the wheels have rolled,
        "low-confidence", "outside-gate", or "lost", if so many were rejected that the floor's tilt is taken to be
        unknown.
        """

@final
class FilteredTilt:
    """A tilt as a filter holds it to be. Frozen, comparable, hashable, pickled. False where the filter abstains.

    The filter abstains where `sigma_rad` exceeds `sigma_max_rad`: angles and normal are NaN then, while covariance and
    confidence still say how little is known.
    """

    def __bool__(self) -> bool: ...
    def __copy__(self) -> Self: ...
    def __deepcopy__(self, _memo: Any) -> Self: ...
    def __eq__(self, other: object, /) -> bool: ...
    def __hash__(self) -> int: ...
    @property
    def alpha_rad(self) -> float:
        """How far the robot leans, in [0, pi] radians; NaN where the filter abstains."""

    @property
    def beta_rad(self) -> float:
        """In which direction it leans, in (-pi, pi] radians: 0 forward, +pi/2 left; NaN where the filter abstains."""

    @property
    def confidence(self) -> float:
        """Probability, in [0, 1], that the error is below two degrees if it is normal with that covariance."""

    @property
    def covariance_rad2(self) -> NDArray[np.float64]:
        """Fresh (2, 2) float64 in squared radians: covariance of the normal in its tangent plane; finite also where the
        filter abstains.
        """

    @classmethod
    def from_dict(cls, values: dict[str, Any]) -> Self:
        """The value of a dict as `to_dict` makes it, equal to the last bit; None for a number, as of JSON, is NaN."""

    @property
    def normal(self) -> NDArray[np.float64]:
        """Fresh (3,) float64: the unit ground normal, eq. 1; NaN where the filter abstains."""

    @property
    def pitch_rad(self) -> float:
        """Pitch about y in radians, nose down positive (Rz Ry Rx, ROS REP 103); NaN where the filter abstains."""

    @property
    def reason(self) -> str:
        """The standard deviation beside its limit, in a sentence."""

    @property
    def roll_rad(self) -> float:
        """Roll about x in radians, right side down positive (Rz Ry Rx, ROS REP 103); NaN where the filter abstains."""

    @property
    def sigma_max_rad(self) -> float:
        """The largest standard deviation of an answer: the filter's option."""

    @property
    def sigma_rad(self) -> float:
        """One standard deviation in radians in any one direction: the root of half the covariance's trace."""

    def to_dict(self) -> dict[str, Any]:
        """The attributes by name, arrays as nested lists: plain, good for JSON."""

@final
class FitReport:
    """How a robust fit went, and why it stopped. Frozen, comparable, hashable, and to be pickled."""

    def __copy__(self) -> Self: ...
    def __deepcopy__(self, _memo: Any) -> Self: ...
    def __eq__(self, other: object, /) -> bool: ...
    def __hash__(self) -> int: ...
    @classmethod
    def from_dict(cls, values: dict[str, Any]) -> Self:
        """The value of a dict as `to_dict` makes it, equal to the last bit; None for a number, as of JSON, is NaN."""

    @property
    def iterations(self) -> int:
        """Random samples drawn or refits done."""

    @property
    def reason(self) -> str:
        """The same in a sentence, with the measured number and the limit; after it what keeps an estimate from being
        sure.
        """

    @property
    def residual_rms(self) -> float:
        """Root mean square residual: radians, or pixels of the image-space methods; NaN without a model."""

    @property
    def stop(
        self,
    ) -> Literal[
        "confident",
        "trial-limit",
        "converged",
        "settled",
        "iteration-limit",
        "too-few",
        "no-model",
        "out-of-reach",
        "chosen",
        "ambiguous",
        "undetermined",
    ]:
        """Why the fit stopped, in a word.

        "confident": random sampling has drawn as many samples as its confidence needs; "trial-limit": it has drawn all
        it may. "converged": the model has stopped changing; "settled": the residuals are small enough;
        "iteration-limit": refitting has been repeated as often as it may. "chosen": it is the most probable of several
        alternatives; "ambiguous": of several none is probable enough. No answer comes of "too-few" observations,
        "no-model" (they are all alike), "undetermined" (they do not tell how far it may be off) and "out-of-reach" (an
        angle that the method cannot mean).
        """

    def to_dict(self) -> dict[str, Any]:
        """The attributes by name, arrays as nested lists: plain, good for JSON."""

@final
class ImageEdges:
    """The edge pixels of one image and their gradients: every pixel of the band of at least `gradient_min`.

    `TiltEstimator.detect` makes them, `TiltEstimator.estimate_edges` takes them. Frozen, comparable, to be pickled.
    """

    def __copy__(self) -> Self: ...
    def __deepcopy__(self, _memo: Any) -> Self: ...
    def __eq__(self, other: object, /) -> bool: ...
    def __hash__(self) -> int: ...
    def __len__(self) -> int: ...
    @property
    def gradient_min(self) -> float:
        """The least gradient magnitude that was asked for."""

@disjoint_base
class Laboratory:
    """A plain room with a coloured cuboid, to be looked at by `tiltvp.synth.StereoSequence`.

    Frozen, comparable, hashable, and to be pickled. It is built and lit on `threads` threads (None: one per core), on
    which it does not depend.
    """

    def __copy__(self) -> Self: ...
    def __deepcopy__(self, _memo: Any) -> Self: ...
    def __eq__(self, other: object, /) -> bool: ...
    def __getnewargs_ex__(self) -> tuple[tuple[int], dict[str, Any]]: ...
    def __hash__(self) -> int: ...
    def __new__(
        cls,
        seed: SupportsIndex,
        *,
        threads: SupportsIndex | None = None,
        size_m: ArrayLike | None = None,
        gamma_rad: float | None = None,
        marker_m: float | None = None,
        clutter: float | None = None,
        side_light: float | None = None,
        light_spacing_m: float | None = None,
    ) -> Self:
        """The options, by keyword.

        Parameters
        ----------
        size_m
            Lengths of the cuboid's edges `x` (at the foot of the blue face's upper edge), `y` (its height) and `z`,
            metres. Default: (0.4, 0.36, 0.34).
        gamma_rad
            The angle between the level edges `x` and `z`, radians. Default: 1.5708.
        marker_m
            Side of ArUco markers in the middle of the blue, the green and the red face (numbers 0, 1 and 2 of OpenCV's
            `DICT_4X4_50`), metres; 0 for none. Their white cards are a third larger and 1 mm before the face. Default:
            0.
        clutter
            How full the walls are with furniture. Default: 0.3.
        side_light
            Power of the lamp beside the cuboid. Default: 1.
        light_spacing_m
            Spacing of the points where light is gathered, metres. Default: 0.15.
        """

    @property
    def clutter(self) -> float:
        """How full the walls are, from 0 to 1."""

    @property
    def gamma_rad(self) -> float:
        """The angle between the cuboid's level edges, radians."""

    @property
    def light_spacing_m(self) -> float:
        """Spacing of the points where light was gathered, metres."""

    @property
    def marker_m(self) -> float:
        """Side of the ArUco markers on the coloured faces, metres; 0 for none."""

    @property
    def seed(self) -> int:
        """The seed of everything in it."""

    @property
    def side_light(self) -> float:
        """Power of the lamp beside the cuboid, from 0 to 1."""

    @property
    def size_m(self) -> tuple[float, float, float]:
        """Lengths of the cuboid's edges x, y, z, metres."""

@final
class LevelMap:
    """See `Leveller._map`."""

    @property
    def strip_rows(self) -> int:
        """Rows that are written together."""

    def write_strip(
        self, number: SupportsIndex, columns: NDArray[np.float32], rows: NDArray[np.float32], unseen: float
    ) -> tuple[int, int]:
        """Writes, for the pixels of the strip of that number, the columns and the rows (h W,) of those of the leaning
        image that show the same; `unseen` for none. Only those from the first column to before the last are written,
        the two that are returned: nothing is seen beside them.
        """

@final
class Leveller:
    """Level images of one camera, as another camera would take them on the upright robot, or along given rays.

    The rays of their pixels are made once. `tiltvp.Leveller` and `tiltvp.Unwrapper` say what is shown. `camera` is the
    camera whose images will come, `robot_from_camera` (3, 3) its mounting, by default the identity; what is shown is
    what the camera `shown` sees that is mounted by `robot_from_shown`, or the `rays` (H W, 3) of the robot frame of an
    image of `columns` columns, NaN where it shows nothing.
    """

    def __new__(
        cls,
        camera: Camera,
        shown: Camera | None = None,
        *,
        robot_from_camera: ArrayLike | None = None,
        robot_from_shown: ArrayLike | None = None,
        rays: ArrayLike | None = None,
        columns: SupportsIndex = 0,
    ) -> Self: ...
    def _map(self, normal: Any) -> LevelMap:
        """The map of level images by a tilt, which is given as the ground normal (3,) of the robot frame."""

    @property
    def camera(self) -> Camera:
        """The camera whose images are made level."""

    @property
    def robot_from_camera(self) -> NDArray[np.float64]:
        """(3, 3): R of v_robot = R v_camera."""

    @property
    def shape(self) -> tuple[int, int]:
        """(H, W): rows and columns of level images."""

@disjoint_base
class LineExtractor:
    """Finds and describes the vertical lines of single images of one camera.

    The tables of the camera are made once. `tiltvp.lines.LineExtractor` takes images of any usual kind.

    `camera` is the camera whose images will come. `method` is "great-circle", for great circles through the vertical by
    the camera model, or "radial", for lines through the rim's centre, as in Scaramuzza 2009. `robot_from_camera` is the
    (3, 3) rotation R with v_robot = R v_camera, by default the identity: an upward camera, columns to the front.
    `options` tells the options in force.

    Raises `tiltvp.errors.InvalidInputError` for an option that the method does not have (it names the near ones) or
    that is out of its domain, for an R that is no rotation, for a mask of another size than the camera's images, and
    where no pixel sees the band.
    """

    def __copy__(self) -> Self: ...
    def __deepcopy__(self, _memo: Any) -> Self: ...
    def __eq__(self, other: object, /) -> bool: ...
    def __hash__(self) -> int: ...
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
        separation_px: float = ...,
        length_min_rad: float = ...,
        support_min_px: SupportsIndex = ...,
        gap_max_rad: float = ...,
        run_min_px: SupportsIndex = ...,
        covered_min: float = ...,
        scatter_max_px: float = ...,
        tilt_sigma_rad: float = ...,
        lines_max: SupportsIndex | None = ...,
        descriptor_kind: Literal["areas", "profile"] = ...,
        descriptor_areas: SupportsIndex = ...,
        descriptor_overlapping: bool = ...,
        descriptor_bins: SupportsIndex = ...,
        descriptor_clip: float = ...,
        descriptor_window: float = ...,
        descriptor_smoothing: float = ...,
        descriptor_normalisation: Literal["area", "whole"] = ...,
        radial_max_rad: float = ...,
        sectors: SupportsIndex = ...,
        length_min: float = ...,
        radius_min_px: float | None = ...,
        radius_max_px: float | None = ...,
        rim_radius_px: float | None = ...,
        center_search_px: float = ...,
    ) -> Self:
        """The options, by keyword.

        Parameters
        ----------
        gradient_min
            Least gradient magnitude `I_min` of an edge pixel, for the Scharr kernel (3, 10, 3) on 8-bit grey levels.
            Default: 150.
        smoothing_px
            Standard deviation of the Gaussian before the Scharr kernel in pixels, 0 for none. Default: 0.5.
        elevation_min_rad
            Lowest elevation above the robot's horizon in radians. Default: -0.523599.
        elevation_max_rad
            Highest elevation above the robot's horizon in radians. Default: 1.0472.
        margin_px
            Pixels kept clear of the lens' rim, the image border and the mask, beside those the kernels reach. Default:
            1.
        mask
            Pixels that show the world and not the robot; none for all. Default: None.
        plane_max_rad
            "great-circle": How far from the vertical the great circle of a straight edge may pass, in radians, beyond
            what is unknown of it. Default: 0.0872665.
        separation_px
            "great-circle": Least distance of two lines, in pixels: of two closer ones the longer stays. Default: 1.
        length_min_rad
            "great-circle": Least supported length of a line: the elevations that its pieces cover, in radians. Default:
            0.261799.
        support_min_px
            "great-circle": Least number of pixels of a line. Default: 15.
        gap_max_rad
            "great-circle": Widest gap between two pieces of a line that counts as covered, in radians of elevation.
            Default: 0.0349066.
        run_min_px
            "great-circle": Least number of pixels of a piece. Default: 8.
        covered_min
            "great-circle": Least share of the elevations from the lowest to the highest pixel of a line that its pieces
            cover, from 0 to 1: lines that cover less are short edges in line by chance. Default: 0.4.
        scatter_max_px
            "great-circle": Greatest standard deviation of the pixels about their line, in pixels: lines that scatter
            more are edges that blend. Default: 0.36.
        tilt_sigma_rad
            "great-circle": Standard deviation of the tilt that the frame is given, in radians, where the tilt does not
            tell its own as estimates do: lines may slant by as much. Default: 0.00872665.
        lines_max
            "great-circle": The most lines of an image, the longest ones; none for all. Default: None.
        descriptor_kind
            What is described: "areas", the paper's histograms, or "profile", grey levels along the line for
            `match_wide`, to which the other options of descriptors are nothing. Default: "areas".
        descriptor_areas
            Number of circular areas. Default: 3.
        descriptor_overlapping
            Whether neighbouring areas overlap by half. Default: False.
        descriptor_bins
            Number of bins `N_b` over the whole circle of orientations. Default: 32.
        descriptor_clip
            The greatest value of a bin before the second normalisation. Default: 0.1.
        descriptor_window
            Standard deviation of the Gaussian window as a fraction of an area's radius. Default: 0.333333.
        descriptor_smoothing
            Standard deviation of the Gaussian that smooths an area before its gradients are taken, as a fraction of its
            radius, 0 for none. Default: 0.0833333.
        descriptor_normalisation
            What has unit length. Default: "area".
        radial_max_rad
            "radial": How far a gradient may turn from the tangent of its circle about the centre, in radians. Default:
            0.0872665.
        sectors
            "radial": Number of sectors. Default: 720.
        length_min
            "radial": Least length of a line as a fraction of `radius_max_px - radius_min_px`. Default: 0.5.
        radius_min_px
            "radial": Inner radius `R_min` of what is looked at in pixels; none for that of the elevation band. Default:
            None.
        radius_max_px
            "radial": Outer radius `R_max` in pixels; none for that of the elevation band. Default: None.
        rim_radius_px
            "radial": Radius of the mirror's rim in pixels, by whose circle the centre is found in every frame; none for
            that of the camera's valid pixels. Default: None.
        center_search_px
            "radial": How far from the calibrated centre the rim's centre is looked for, in pixels; 0 keeps the
            calibrated one. Default: 8.
        """

    def _describe(self, image: NDArray[np.uint8], lines: Lines) -> NDArray[np.float32]:
        """(N, K): descriptors of the lines of such an image."""

    def _extract(self, image: NDArray[np.uint8], normal: ArrayLike | None, tilt_sigma_rad: float | None) -> Lines:
        """The lines of a C-contiguous (H, W) image of uint8; with a normal its standard deviation where known."""

    def _lines_at(self, bearing_rad: ArrayLike, normal: ArrayLike | None) -> Lines:
        """Lines at any bearings, without support."""

    def _patches(self, image: NDArray[np.uint8], lines: Lines) -> NDArray[np.float32]:
        """(N, rows, columns): grey levels about the lines of such an image."""

    @property
    def band_rad(self) -> tuple[float, float]:
        """Lowest and highest elevation that descriptors cover: what most directions see of the band."""

    @property
    def camera(self) -> Camera:
        """The camera whose images are read."""

    @property
    def method(self) -> str:
        """The name of the method."""

    @property
    def options(self) -> dict[str, Any]:
        """The options that are in force, by name, defaults included; a fresh dict, good as keywords."""

    @property
    def robot_from_camera(self) -> NDArray[np.float64]:
        """Fresh (3, 3) float64: the rotation R in v_robot = R v_camera."""

@final
class LineTracker:
    """Follows lines through successive frames: each gets the identity of the line it is, or a new one.

    Where the robot's motion is known, each track's bearing is predicted from the last one and from how near the edge
    is, as far as bearings have told, and all lines find their tracks together: by bearings, descriptors and sides, at
    the least cost in all. Where it is not, a line is looked for in the last frame, then in the one before, up to
    `look_back` frames. The same calls give the same answers. Comparable, copied and pickled with all that it remembers.

    Raises `tiltvp.errors.InvalidInputError` for an option that is unknown or out of its domain.
    """

    def __copy__(self) -> Self: ...
    def __deepcopy__(self, _memo: Any) -> Self: ...
    def __eq__(self, other: object, /) -> bool: ...
    def __new__(
        cls,
        *,
        look_back: SupportsIndex = ...,
        nearest_m: float = ...,
        camera_m: ArrayLike = ...,
        camera_yaw_rad: float = ...,
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
        """The options, by keyword.

        Parameters
        ----------
        look_back
            How many frames back a line is looked for before it is taken for a new one. Default: 20.
        nearest_m
            The least distance of an edge from the camera, metres: how far bearings may change while nothing else is
            known. Default: 0.3.
        camera_m
            Where the camera's centre is on the robot, x and y from the middle between the wheels, metres. Default:
            (0.0, 0.0).
        camera_yaw_rad
            How far the frame of the bearings is turned to the left of the robot's, radians. Default: 0.
        turn_sigma_rad
            Standard deviation of a turn that is given, radians. Default: 0.005.
        distance_sigma
            Standard deviation of a distance driven that is given, as a share of it. Default: 0.03.
        rate_sigma_rad
            Standard deviation of the change of a bearing per frame beside the turn, where no distance is given,
            radians. Default: 0.05.
        bearing_sigma_rad
            Standard deviation of a bearing beside the line's own, from neighbouring edges that blend, radians. Default:
            0.00174533.
        gate_sigmas
            The greatest difference from a predicted bearing, in standard deviations. Default: 3.
        descriptor_sigma
            Standard deviation of the distance between descriptors of one line. Default: 0.35.
        descriptor_max
            The greatest distance between descriptors of one line at its predicted bearing. Default: 1.25.
        new_cost
            What a new track costs, to be held against the squared deviations of a line that goes on. Default: 18.
        f1
            `F1`: the greatest distance of a match, eq. 8. Default: 1.05.
        f2
            `F2`: the greatest share of the mean distance to all lines of the other image, eq. 9. Default: 0.75.
        f3
            `F3`: the greatest share of the second smallest distance, eq. 10. Default: 0.8.
        mutual
            Whether both lines must be nearest to each other, so that no line is matched twice. Default: True.
        ordered
            Whether matches must keep the cyclic order of the lines. Default: False.
        """

    @property
    def next_frame(self) -> int:
        """Number of the next frame."""

    @property
    def options(self) -> dict[str, Any]:
        """The options in force, by name, defaults included; a fresh dict, good as keywords."""

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
        width, lines of another camera or mounting than those before, bearings and motions that are none, and a distance
        without a turn; the tracker is as before then.
        """

@final
class Lines:
    """The vertical lines of one image, by rising bearing. Frozen, comparable, to be pickled.

    `LineExtractor` makes them. Bearings are azimuths atan2(y, x) about the vertical in the upright robot's frame (the
    camera's without `robot_from_camera`).
    """

    def __copy__(self) -> Self: ...
    def __deepcopy__(self, _memo: Any) -> Self: ...
    def __eq__(self, other: object, /) -> bool: ...
    def __hash__(self) -> int: ...
    def __len__(self) -> int: ...
    def _check_seen_by(self, camera: Camera, robot_from_camera: ArrayLike | None) -> None:
        """Refuses a camera, or a mounting of it, other than that which found the lines."""

    @property
    def bearing_rad(self) -> NDArray[np.float64]:
        """(N,) float64: azimuth about the vertical in the upright robot's frame, radians."""

    @property
    def center_px(self) -> tuple[float, float] | None:
        """Where radial lines meet, (u, v); None but for the method "radial"."""

    @property
    def elevation_max_rad(self) -> NDArray[np.float64]:
        """(N,) float64: elevation of the highest pixel, radians."""

    @property
    def elevation_min_rad(self) -> NDArray[np.float64]:
        """(N,) float64: elevation of the lowest pixel above the upright robot's horizon, radians."""

    @classmethod
    def from_dict(cls, values: dict[str, Any]) -> Self:
        """The value of a dict as `to_dict` makes it, equal to the last bit; None for a number, as of JSON, is NaN."""

    @property
    def normal(self) -> NDArray[np.float64]:
        """Fresh (3,) float64: the ground normal in the robot frame that was taken for the vertical."""

    @property
    def polarity(self) -> NDArray[np.float64]:
        """(N,) in [-1, 1]: share of the pixels that are brighter towards greater azimuth minus that of the others."""

    @property
    def seen_by(self) -> int | None:
        """Tells the camera and the mounting that found the lines from others, 32 bits; None where they are not
        known.
        """

    @property
    def sigma_rad(self) -> NDArray[np.float64]:
        """(N,) float64: standard deviation of the bearing, radians."""

    @property
    def support_px(self) -> NDArray[np.uint32]:
        """(N,) uint32: edge pixels on the line, one across the edge."""

    def to_dict(self) -> dict[str, Any]:
        """The attributes by name, arrays as nested lists: plain, good for JSON."""

@final
class LogCalibration:
    """The mounting, and what else was estimated, from a whole log. True if it can be relied upon."""

    def __bool__(self) -> bool: ...
    def __copy__(self) -> Self: ...
    def __deepcopy__(self, _memo: Any) -> Self: ...
    def __eq__(self, other: object, /) -> bool: ...
    def __hash__(self) -> int: ...
    @property
    def bearing_sigma_rad(self) -> float:
        """Standard deviation of a bearing: as given, or as the residuals tell it where they say that it is larger."""

    @property
    def bearings(self) -> int:
        """Bearings that were used; of those taken at a standstill only the first."""

    @property
    def centre_off_rad(self) -> NDArray[np.float64]:
        """Fresh (2,) float64: how far the image centre about which the bearings were taken is off, along bearings 0 and
        90 degrees, in units of the radius at which lines are seen: radians; 0 where it was not estimated. A camera that
        leans errs alike.
        """

    @property
    def centre_off_sigma_rad(self) -> NDArray[np.float64]:
        """Fresh (2,) float64: standard deviations of it; 0 where it was not estimated."""

    @property
    def converged(self) -> bool:
        """Whether the descent came to rest."""

    @property
    def doubted(self) -> NDArray[np.float64]:
        """Fresh (N, 2) float64: the parts of the drive whose motions the bearings contradict, as on a carpet, each from
        which share of it to which, 0 to 1. Their odometry is taken to have ten times its standard deviations.
        """

    @classmethod
    def from_dict(cls, values: dict[str, Any]) -> Self:
        """The value of a dict as `to_dict` makes it, equal to the last bit; None for a number, as of JSON, is NaN."""

    @property
    def imbalance(self) -> float:
        """Half the logarithm of `right_over_left`."""

    @property
    def imbalance_sigma(self) -> float:
        """Standard deviation of it; 0 where it was not estimated."""

    @property
    def iterations(self) -> int:
        """Linearisations."""

    @property
    def merged_landmarks(self) -> list[int]:
        """Names of landmarks whose bearings are those of two places, which were taken apart."""

    @property
    def misreading(self) -> str | None:
        """How the log may have been meant, where it fits that way only: "reflected" (wheels swapped, both negated, or
        bearings clockwise), "left wheel negated", "right wheel negated", "degrees", "millimetres" or "cumulative". None
        if it fits.
        """

    @property
    def mounting(self) -> MountingEstimate:
        """The mounting; covariances are scaled by the residuals where these are larger than assumed."""

    @property
    def odometry_k_m(self) -> float:
        """Variance of a wheel's displacement for each metre of it, likewise."""

    @property
    def outliers(self) -> int:
        """Bearings farther off than 4.5 standard deviations, which count for nothing."""

    @property
    def reason(self) -> str:
        """Whether the answer can be relied upon, and what speaks against it, in a sentence."""

    @property
    def residual_rms(self) -> float:
        """Root of the mean squared residual of the others, in standard deviations of a bearing."""

    @property
    def right_over_left(self) -> float:
        """How much farther the right wheel goes than the left when both report the same: a ratio, 1 where not
        estimated.
        """

    @property
    def right_over_left_sigma(self) -> float:
        """Standard deviation of it; 0 where it was not estimated."""

    @property
    def rolling_shutter_s(self) -> NDArray[np.float64]:
        """Fresh (2,) float64: how much later than in the middle of the image lines along bearings 0 and 90 degrees are
        seen, as through a rolling shutter: seconds, in a log without times steps; 0 where it was not estimated. Others
        by the cosine of their bearing of the one and the sine of the other.
        """

    @property
    def rolling_shutter_sigma_s(self) -> NDArray[np.float64]:
        """Fresh (2,) float64: standard deviations of it; 0 where it was not estimated."""

    @property
    def time_offset_s(self) -> float:
        """By how much bearings are later than the odometry, seconds; 0 where it was not estimated."""

    @property
    def time_offset_sigma_s(self) -> float:
        """Standard deviation of it; 0 where it was not estimated."""

    def to_dict(self) -> dict[str, Any]:
        """The attributes by name, arrays as nested lists: plain, good for JSON."""

    @property
    def wheel_base_m(self) -> float:
        """Distance between the wheels, metres, as given or as estimated."""

    @property
    def wheel_base_sigma_m(self) -> float:
        """Standard deviation of it; 0 where it was not estimated."""

@final
class LongCalls:
    """Long calls of several threads, ended together: signals are heard on the main thread alone.

    A thread's calls within a `with` block are among them. Those that are ended raise, and so does each that comes
    later.
    """

    def __enter__(self) -> None: ...
    def __exit__(self, *_error: Any) -> None: ...
    def __new__(cls) -> Self: ...
    def end(self) -> None:
        """Ends them."""

@final
class MountingEstimate:
    """Where a camera sits on a robot, with how sure that is. True if it can be relied upon."""

    def __bool__(self) -> bool: ...
    def __copy__(self) -> Self: ...
    def __deepcopy__(self, _memo: Any) -> Self: ...
    def __eq__(self, other: object, /) -> bool: ...
    def __hash__(self) -> int: ...
    @property
    def advice(self) -> str:
        """What motion would determine what is not determined yet."""

    @property
    def alarm(self) -> bool:
        """Whether bearings ever disagreed with the mounting over a window of steps, as after a bump."""

    @property
    def contradicted_motions(self) -> int:
        """Those that the bearings contradict: farther off than five standard deviations of the odometry."""

    @property
    def contradicted_turns(self) -> int:
        """Those that the bearings contradict by more than half of the turn, whatever the noise."""

    @property
    def covariance_phi_rho_psi(self) -> NDArray[np.float64]:
        """Fresh (3, 3) float64: covariance of (phi, rho, psi); infinite where rho is 0."""

    @property
    def covariance_xy_yaw(self) -> NDArray[np.float64]:
        """Fresh (3, 3) float64: covariance of (x, y, yaw)."""

    @property
    def determined(self) -> list[str]:
        """Which of "phi", "rho", "psi", "yaw" the motion so far has determined, beliefs at the start aside.

        Angles to 0.05 rad (phi and psi at a rho beyond three of its standard deviations only), rho to 0.02 m or 5 %.
        """

    @classmethod
    def from_dict(cls, values: dict[str, Any]) -> Self:
        """The value of a dict as `to_dict` makes it, equal to the last bit; None for a number, as of JSON, is NaN."""

    @property
    def mean_nis(self) -> float | None:
        """Mean normalised innovation squared of a bearing over the last steps: 1 if all is as assumed. None before the
        first.
        """

    @property
    def motions(self) -> int:
        """Motions from one pose with bearings to the next: of the whole log, or of the filter's window."""

    @property
    def phi_rad(self) -> float:
        """The paper's phi, the direction in which the camera is, in (-pi, pi] radians; means nothing where rho is near
        0.
        """

    @property
    def psi_rad(self) -> float:
        """The paper's psi = yaw - phi, in (-pi, pi] radians; means nothing where rho is near 0."""

    @property
    def reason(self) -> str:
        """What is determined, what motion would help, whether there was an alarm and what is suspected, in a
        sentence.
        """

    @property
    def rho_m(self) -> float:
        """The paper's rho, the distance of the camera from the middle of the axle, metres."""

    @property
    def rho_near_zero(self) -> bool:
        """Whether rho is not significantly above zero, where phi and psi mean nothing: use x, y and yaw."""

    @property
    def sigma_of_drive(self) -> NDArray[np.float64]:
        """Fresh (3,) float64: standard deviations of (phi, rho, psi) by the drive alone, without what was believed at
        the start.
        """

    @property
    def sigma_of_drive_xy_yaw(self) -> NDArray[np.float64]:
        """Fresh (3,) float64: standard deviations of (x, y, yaw) by the drive alone."""

    @property
    def suspect(self) -> str | None:
        """What is most likely wrong where the log does not fit: "turns" (a sign or a unit), "outliers" (a bump, or
        names), "bump", "slips", "bearing_sigma_rad", "odometry_k_m", "wheel_base_m", "right_over_left",
        "time_offset_s", "centre" (another image centre, or a camera that leans), "rolling_shutter" (lines are seen
        later on one side than on the other), "creep" (the camera turns all along the drive) or "drift" (motions of a
        part of the drive that err together). None if nothing is.
        """

    @property
    def suspect_value(self) -> float | None:
        """The value that would suit the log better, of what `suspect` names (times in steps, or in seconds in a log
        with times); of "turns", "outliers" and "slips" their share, of "bump" its angle and of "centre" the largest
        error of a bearing in radians, of "rolling_shutter" how much later lines are seen on one side, of "creep" the
        angle in radians from the first step to the last, of "drift" the factor of a standard deviation.
        """

    def to_dict(self) -> dict[str, Any]:
        """The attributes by name, arrays as nested lists: plain, good for JSON."""

    @property
    def turns(self) -> int:
        """Turns by some 0.1 rad by the odometry."""

    @property
    def x_m(self) -> float:
        """How far the camera is in front of the middle of the wheel axle, metres."""

    @property
    def y_m(self) -> float:
        """How far it is to the left of it, metres."""

    @property
    def yaw_rad(self) -> float:
        """How far its x axis is turned to the left against the robot's, phi + psi, in (-pi, pi] radians."""

@final
class PixelRays:
    """`samples` x `samples` rays in each pixel of a camera that sees anything, made once, to be met with panoramas.

    The rays are at the centres of equal parts of the pixels; `samples` is from 1 to 16.
    """

    def __copy__(self) -> Self: ...
    def __deepcopy__(self, _memo: Any) -> Self: ...
    def __eq__(self, other: object, /) -> bool: ...
    def __hash__(self) -> int: ...
    def __new__(cls, camera: Camera, *, samples: SupportsIndex) -> Self: ...
    def panorama_map(self, rotation: ArrayLike, *, width: SupportsIndex, height: SupportsIndex) -> NDArray[np.float32]:
        """(2, samples^2, N): columns and rows of an equirectangular panorama of that size that the rays meet.

        `rotation` (3, 3) takes bearings of the camera to the panorama's: x right, y down, z towards longitude 0. Rays
        that the lens does not see are at -1e6, far outside.
        """

    @property
    def pixels(self) -> NDArray[np.uint32]:
        """(N,): places in row order, v width + u, of the pixels in which some ray is seen."""

    @property
    def samples(self) -> int:
        """Rays per pixel and side."""

@final
class PosteriorCorrection:
    """The mean and deviation of P(alpha | l) over a grid of shifts from zero, and the model of shifts behind it.

    `train_posterior` makes them, `from_dict` from their parts. Applying one is one interpolation; shifts beyond the
    grid have the answer of its end. Frozen, comparable, hashable, pickled.
    """

    def __copy__(self) -> Self: ...
    def __deepcopy__(self, _memo: Any) -> Self: ...
    def __eq__(self, other: object, /) -> bool: ...
    def __hash__(self) -> int: ...
    @property
    def factor(self) -> float:
        """Units of the shift per radian, by and large."""

    @classmethod
    def from_dict(cls, values: dict[str, Any]) -> Self:
        """The value of a dict as `to_dict` makes it, equal to the last bit; None for a number, as of JSON, is NaN."""

    @property
    def mean_rad(self) -> NDArray[np.float64]:
        """Fresh (N,) float64: the mean lean in radians at each shift of the table."""

    @property
    def spread(self) -> float:
        """Standard deviation of the error of the upright robot's shift in each direction, in units of the shift."""

    @property
    def spread_per_rad(self) -> float:
        """How it grows with the lean, in units of the shift per radian."""

    @property
    def std_rad(self) -> NDArray[np.float64]:
        """Fresh (N,) float64: the standard deviation of the lean in radians at each shift of the table."""

    @property
    def step(self) -> float:
        """Distance between the shifts of the table, which begins at zero."""

    @property
    def stray_max(self) -> float:
        """Largest of these, in units of the shift."""

    @property
    def stray_share(self) -> float:
        """Share of shifts that have nothing to do with the lean."""

    def to_dict(self) -> dict[str, Any]:
        """The attributes by name, arrays as nested lists: plain, good for JSON."""

@final
class PriorOfTilt:
    """How leans are distributed where the robot goes: one of `empirical()`, `uniform(max_rad)`, `rayleigh(sigma_rad)`.
    Frozen, comparable, hashable, pickled.
    """

    def __copy__(self) -> Self: ...
    def __deepcopy__(self, _memo: Any) -> Self: ...
    def __eq__(self, other: object, /) -> bool: ...
    def __hash__(self) -> int: ...
    @staticmethod
    def empirical() -> PriorOfTilt:
        """As in the training set, smoothed."""

    @staticmethod
    def rayleigh(sigma_rad: float) -> PriorOfTilt:
        """Leans forward and sideways are independent and normal, each with standard deviation `sigma_rad`."""

    @staticmethod
    def uniform(max_rad: float) -> PriorOfTilt:
        """Every lean up to `max_rad`, in (0, pi/2), is as likely."""

@final
class ResolvedAttitude:
    """One attitude that several features agree on, with how likely it is among all such.

    Frozen, comparable, hashable, and to be pickled.
    """

    def __copy__(self) -> Self: ...
    def __deepcopy__(self, _memo: Any) -> Self: ...
    def __eq__(self, other: object, /) -> bool: ...
    def __hash__(self) -> int: ...
    @property
    def chi_square(self) -> float:
        """How far the features are apart: chi-square of three degrees of freedom per feature after the first.

        Two where only the vertical is shared.
        """

    @property
    def choice(self) -> tuple[int, ...]:
        """Which attitude of each feature it is, in the order of `tiltvp.corner.attitudes`."""

    @property
    def common_from_object(self) -> NDArray[np.float64]:
        """Fresh (3, 3) float64: the rotation from the first feature's object to the frame that all features share."""

    @property
    def covariance_rad2(self) -> NDArray[np.float64]:
        """Fresh (3, 3) float64 in squared radians: covariance of the rotation vector, common frame, of the error."""

    @classmethod
    def from_dict(cls, values: dict[str, Any]) -> Self:
        """The value of a dict as `to_dict` makes it, equal to the last bit; None for a number, as of JSON, is NaN."""

    @property
    def probability(self) -> float:
        """The probability that it is this one and none of the others, in [0, 1]."""

    def to_dict(self) -> dict[str, Any]:
        """The attributes by name, arrays as nested lists: plain, good for JSON."""

@disjoint_base
class Room:
    """A furnished, lit room of one of `ROOM_KINDS`, built once. `tiltvp.synth.Room` renders it.

    The world frame has z up and the floor at z = 0; metres. Frozen, comparable, hashable, and to be pickled.

    It is built and lit on `threads` threads (None: one per core), on which it does not depend.
    """

    def __copy__(self) -> Self: ...
    def __deepcopy__(self, _memo: Any) -> Self: ...
    def __eq__(self, other: object, /) -> bool: ...
    def __getnewargs_ex__(self) -> tuple[tuple[str, int], dict[str, Any]]: ...
    def __hash__(self) -> int: ...
    def __new__(
        cls,
        kind: str,
        seed: SupportsIndex,
        *,
        threads: SupportsIndex | None = None,
        clutter: float | None = None,
        daylight: float | None = None,
        light_spacing_m: float | None = None,
        extent: float | None = None,
        floor_gloss: float | None = None,
        wall_pattern: str | None = None,
    ) -> Self:
        """The options, by keyword.

        Parameters
        ----------
        clutter
            How full the room is: the share of the places along the walls that furniture is tried for, and how much
            hangs on the walls. Default: 0.7.
        daylight
            Brightness of the day outside: 0 is night, with the lamps alone. Default: 0.7.
        light_spacing_m
            Spacing of the points where light is gathered, in metres. Finer is slower to build with sharper soft
            shadows. Default: 0.15.
        extent
            How many times larger the floor is than the kind's own. A corridor grows in length only; other kinds grow
            both ways, into halls with pillars from 1.5 on. Default: 1.
        floor_gloss
            How much the floor shines: 0 is matt, 1 mirrors like polished stone under a clear lacquer, the more so the
            flatter one looks. Default: 0.
        wall_pattern
            What all walls have in common; drawn, each on its own, if nothing. Default: "drawn".
        """

    def _corners(self) -> list[tuple[list[float], list[list[float]], list[float], str]]:
        """Position, directions of the edges x, y, z in rows, their lengths, and the kind, of each corner."""

    def _render(
        self, camera: Camera, *, threads: SupportsIndex | None, **options: Any
    ) -> tuple[NDArray[np.uint8], NDArray[np.uint8]]:
        """Grey (H, W) and RGB (H, W, 3) images of the room."""

    def _render_panorama(
        self, height: SupportsIndex, *, threads: SupportsIndex | None, **options: Any
    ) -> tuple[NDArray[np.uint8], NDArray[np.uint8]]:
        """Grey (height, 2 height) and RGB (height, 2 height, 3) images of everything around a place."""

    def _straight_edges(
        self, camera: Camera, contrast_min: float, **options: Any
    ) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """(N, 2, 3) bearings of the ends in the camera frame and (N,) contrasts of the straight edges in sight."""

    @property
    def clutter(self) -> float:
        """How full it is, from 0 to 1."""

    @property
    def daylight(self) -> float:
        """Brightness of the day outside, from 0 to 1."""

    @property
    def extent(self) -> float:
        """How many times larger the floor is than the kind's own."""

    @property
    def floor_gloss(self) -> float:
        """How much the floor shines, from 0 to 1."""

    @property
    def floor_outline_m(self) -> NDArray[np.float64]:
        """(N, 2): the corners of the floor, counter-clockwise, metres."""

    def free_poses(self, count: SupportsIndex, seed: SupportsIndex) -> NDArray[np.float64]:
        """(count, 3): x_m, y_m, yaw_rad of poses at which the robot stands free, drawn by `seed`.

        Raises `tiltvp.errors.InvalidInputError` if the room is too full.
        """

    @property
    def height_m(self) -> float:
        """Height of the ceiling, metres."""

    def is_free(self, x_m: float, y_m: float) -> bool:
        """Whether a round robot of 0.22 m radius and less than 0.4 m height can stand with its centre there."""

    @property
    def kind(self) -> str:
        """Which of `ROOM_KINDS` it is."""

    @property
    def light_spacing_m(self) -> float:
        """Spacing of the points where light was gathered, metres."""

    @property
    def seed(self) -> int:
        """The seed of everything in it."""

    @property
    def vertical_edges_m(self) -> NDArray[np.float64]:
        """(N, 2, 3): lower and upper ends of the vertical edges of walls and furniture, visible or not, metres."""

    @property
    def wall_pattern(self) -> str:
        """Which of `WALL_PATTERNS` its walls have in common."""

@disjoint_base
class SegmentDetector:
    """Finds straight edges as arcs of great circles in the images of one camera, whatever its lens.

    The tables of the camera are made once. `tiltvp.SegmentDetector` takes images of any usual kind.

    `camera` is the camera whose images will come. `options` tells the options in force.

    Raises `tiltvp.errors.InvalidInputError` for an option that it does not have (it names the near ones) or that is out
    of its domain, for a mask of another size than the camera's images, and where no pixel is left.
    """

    def __copy__(self) -> Self: ...
    def __deepcopy__(self, _memo: Any) -> Self: ...
    def __eq__(self, other: object, /) -> bool: ...
    def __hash__(self) -> int: ...
    def __new__(
        cls,
        camera: Camera,
        *,
        gradient_min: float = ...,
        smoothing_px: float = ...,
        margin_px: float = ...,
        mask: NDArray[np.bool_] | None = ...,
        gradient_start: float = ...,
        stray_max_px: float = ...,
        rms_max_px: float = ...,
        support_min_px: SupportsIndex = ...,
        gap_max: float = ...,
    ) -> Self:
        """The options, by keyword.

        Parameters
        ----------
        gradient_min
            Least gradient magnitude `I_min` of an edge pixel, for the Scharr kernel (3, 10, 3) on 8-bit grey levels.
            Default: 64.
        smoothing_px
            Standard deviation of the Gaussian before the Scharr kernel in pixels, 0 for none. Default: 0.7.
        margin_px
            Pixels kept clear of the lens' rim, the image border and the mask, beside those the kernels reach. Default:
            2.
        mask
            Pixels that show the world; none for all. Default: None.
        gradient_start
            Gradient magnitude from which a chain may start, for the Scharr kernel on 8-bit grey levels; it goes on down
            to `gradient_min`. Default: 128.
        stray_max_px
            How far in pixels a chain may stray from the great circle through its ends before it is cut. Default: 0.8.
        rms_max_px
            Greatest root mean square distance of the pixels of a segment from its great circle, in pixels. Default:
            0.7.
        support_min_px
            Least number of pixels of a segment. Default: 12.
        gap_max
            Widest gap between two pieces of one great circle that are joined, in lengths of the longer one; 0 joins
            none. Default: 1.
        """

    def _detect(self, image: NDArray[np.uint8]) -> Segments:
        """The straight edges of a C-contiguous (H, W) image of uint8."""

    @property
    def camera(self) -> Camera:
        """The camera whose images are read."""

    @property
    def options(self) -> dict[str, Any]:
        """The options that are in force, by name, defaults included; a fresh dict, good as keywords."""

@final
class Segments:
    """The straight edges of one image, the longest first. Frozen, comparable, to be pickled.

    `SegmentDetector` makes them. All directions are in the camera frame.
    """

    def __copy__(self) -> Self: ...
    def __deepcopy__(self, _memo: Any) -> Self: ...
    def __eq__(self, other: object, /) -> bool: ...
    def __hash__(self) -> int: ...
    def __len__(self) -> int: ...
    @property
    def contrast(self) -> NDArray[np.float64]:
        """(N,) float64: mean gradients, grey levels per pixel."""

    @property
    def covariance(self) -> NDArray[np.float64]:
        """(N, 3, 3) float64: covariances of the normals, squared radians; of rank two, in the planes across the
        normals.
        """

    @property
    def ends(self) -> NDArray[np.float64]:
        """(N, 2, 3) float64: unit bearings of the ends, a pixel beyond the outermost pixels that show the edge, because
        gradients there see what is behind it; from the first to the second is a positive turn about the normal.
        """

    @classmethod
    def from_dict(cls, values: dict[str, Any]) -> Self:
        """The value of a dict as `to_dict` makes it, equal to the last bit; None for a number, as of JSON, is NaN."""

    @property
    def length_rad(self) -> NDArray[np.float64]:
        """(N,) float64: angles between the ends, radians."""

    @property
    def middle(self) -> NDArray[np.float64]:
        """(N, 3) float64: unit bearings of the middles of the pixels."""

    @property
    def normal(self) -> NDArray[np.float64]:
        """(N, 3) float64: unit normals of the great circles, towards the brighter side."""

    def pixels(self, index: SupportsIndex) -> NDArray[np.float64]:
        """(K, 2) float64: the places (u, v) of the edge in the pixels of segment `index`.

        Raises `IndexError` for a segment that is not there.
        """

    @property
    def points_px(self) -> NDArray[np.float64]:
        """(P, 2) float64: the places (u, v) of the edges in the supporting pixels, segment by segment."""

    @property
    def rms_px(self) -> NDArray[np.float64]:
        """(N,) float64: root mean square distances of the pixels from the circles, pixels."""

    @property
    def support(self) -> NDArray[np.uint32]:
        """(N,) uint32: how many pixels support each."""

    def to_dict(self) -> dict[str, Any]:
        """The attributes by name, arrays as nested lists: plain, good for JSON."""

    @property
    def variances_rad2(self) -> NDArray[np.float64]:
        """(N, 2) float64: variances in squared radians of the turns of the normal about `normal` x `middle`, which
        moves the arc sideways, and about `middle`, which turns it.
        """

@final
class SelfCalibrator:
    """Estimates where a camera sits on a robot, step by step while it drives past landmarks. Changes as it goes.

    `method` is "default", which does not diverge, or "paper", the filter of Scaramuzza 2009 exactly. `start` and
    `start_sigma` are (x_m, y_m, yaw_rad) of the mounting as it is thought to be, and standard deviations (3,) or
    covariance (3, 3) of them. Landmarks that are not seen from the poses kept are forgotten: let `keyframes_max` keep a
    whole drive's for loops to close.

    Raises `tiltvp.errors.InvalidInputError` for options out of their domain or of the other method.
    """

    def __copy__(self) -> Self: ...
    def __deepcopy__(self, _memo: Any) -> Self: ...
    def __eq__(self, other: object, /) -> bool: ...
    def __new__(
        cls,
        *,
        wheel_base_m: float,
        method: str | None = None,
        bearing_sigma_rad: float | None = None,
        odometry_k_m: float | None = None,
        start: ArrayLike | None = None,
        start_sigma: ArrayLike | None = None,
        start_distance_m: float | None = None,
        start_distance_log_sigma: float | None = None,
        gate_probability: float | None = None,
        keyframes_max: SupportsIndex | None = None,
        step_sigma_m: float | None = None,
        step_sigma_rad: float | None = None,
        start_distance_sigma_m: float | None = None,
        odometry_inflation: float | None = None,
    ) -> Self:
        """The options, by keyword.

        Parameters
        ----------
        method
            Which filter. The default depends on the method.
        wheel_base_m
            Distance between the wheels, metres. It has no default that suits.
        bearing_sigma_rad
            Standard deviation of a bearing in radians. Default: 0.00872665.
        odometry_k_m
            Variance of a wheel's displacement for each metre of it (eq. 31), metres. Default: 1e-05.
        start
            The mounting (x_m, y_m, yaw_rad) as it is thought to be: the origin, if nothing is known. Default: (0.0,
            0.0, 0.0).
        start_sigma
            Standard deviations of (x_m, y_m, yaw_rad) at the start, or their covariance (3, 3). Default: [[0.09, 0.0,
            0.0], [0.0, 0.09, 0.0], [0.0, 0.0, 0.25]].
        start_distance_m
            Distance at which landmarks are thought to be when they are first seen, metres. Default: 3.
        start_distance_log_sigma
            "default": Standard deviation of the logarithm of that distance: a factor of so many e. Default: 1.5.
        gate_probability
            "default": Probability with which a bearing passes the gate if its covariance is right. Default: 0.9999.
        keyframes_max
            "default": Size of the sliding window: keyframes that are kept and relinearised. The older half is
            marginalised when there are more, or 300 landmarks with one bearing each. Default: 400.
        step_sigma_m
            "default": Standard deviation of every step's motion in either direction, beside eq. 31, metres. Default: 0.
        step_sigma_rad
            "default": Standard deviation of every step's turn, beside eq. 31, radians. Default: 0.
        start_distance_sigma_m
            "paper": Standard deviation of the distance of landmarks that are first seen, metres. Default: 2.
        odometry_inflation
            "paper": Factor by which `odometry_k_m` is inflated. Default: 5.
        """

    @property
    def estimate(self) -> MountingEstimate:
        """The mounting as it is believed to be now."""

    def examine(self) -> None:
        """Looks now for what the drive so far contradicts, which assumption is likely wrong, and how far motions that
        err together, as on a carpet, may have moved the answer; `estimate` then says so.

        That happens by itself at the end of `follow`, and not between steps, for it costs some twenty solutions of the
        window.
        """

    def follow(self, odometry: ArrayLike, bearings: ArrayLike) -> list[MountingEstimate]:
        """Steps through a log, (N, 2) left and right, (M, 3) step, landmark, bearing: the estimate after each step."""

    @property
    def landmarks(self) -> int:
        """Landmarks that are being followed."""

    @property
    def options(self) -> dict[str, Any]:
        """The options in force, by name, defaults included; a fresh dict, good as keywords."""

    def reset(self) -> None:
        """Forgets everything but the options."""

    def step(
        self, delta_left_m: float, delta_right_m: float, landmark_ids: ArrayLike, bearings_rad: ArrayLike
    ) -> CalibrationStep:
        """Moves by the wheels' displacements, then looks: bearings (N,) of landmarks by whole numbers (N,) from 0.

        Bearings are in the camera's frame, counter-clockwise; of those taken while the robot stands only the first of
        each landmark counts. Raises `tiltvp.errors.InvalidInputError` for numbers that make no sense; the filter is
        then as before.
        """

@final
class SimulatedDrive:
    """A simulated drive past vertical lines, and the truth behind it."""

    def __copy__(self) -> Self: ...
    def __deepcopy__(self, _memo: Any) -> Self: ...
    def __eq__(self, other: object, /) -> bool: ...
    def __hash__(self) -> int: ...
    @property
    def bearings(self) -> NDArray[np.float64]:
        """Fresh (M, 3) float64: step, landmark and bearing in radians of every bearing."""

    def cramer_rao_bound(self, *, start_sigma: ArrayLike) -> NDArray[np.float64]:
        """(3, 3): the smallest covariance of (x, y, yaw) that an unbiased estimator can have on this drive."""

    @property
    def landmarks_m(self) -> NDArray[np.float64]:
        """Fresh (L, 2) float64: where the lines are, metres."""

    @property
    def odometry(self) -> NDArray[np.float64]:
        """Fresh (N, 2) float64: displacements of the left and the right wheel in each step, metres."""

    @property
    def poses(self) -> NDArray[np.float64]:
        """Fresh (N, 3) float64: the true pose (x_m, y_m, heading_rad) after each step, from (0, 0, 0)."""

@disjoint_base
class StereoSequence:
    """A moving pair of cameras, any frame of which can be rendered by `tiltvp.synth.StereoSequence`.

    Frozen, comparable, hashable, and to be pickled. N is the number of frames. A motion in the scene is found and rays
    are made on `threads` threads (None: one per core), on which nothing depends.
    """

    def __copy__(self) -> Self: ...
    def __deepcopy__(self, _memo: Any) -> Self: ...
    def __eq__(self, other: object, /) -> bool: ...
    def __getnewargs_ex__(self) -> tuple[tuple[Any], dict[str, Any]]: ...
    def __hash__(self) -> int: ...
    def __len__(self) -> int: ...
    def __new__(
        cls,
        scene: Laboratory | Room,
        *,
        left: Camera,
        right: Camera,
        threads: SupportsIndex | None = None,
        frames: SupportsIndex | None = None,
        frame_rate_hz: float | None = None,
        seed: SupportsIndex | None = None,
        corner: SupportsIndex | None = None,
        distance_m: ArrayLike | None = None,
        roll_max_rad: float | None = None,
        period_s: float | None = None,
        left_from_right: ArrayLike | None = None,
        samples: SupportsIndex | None = None,
        noise_sigma: float | None = None,
        blur_sigma_px: float | None = None,
        exposure_s: float | None = None,
        gain: float | None = None,
    ) -> Self:
        """The options, by keyword.

        Parameters
        ----------
        frames
            How many frames. Default: 1000.
        frame_rate_hz
            Frames per second. Default: 30.
        seed
            Seed of motion and noise. Default: 0.
        corner
            Which of the world's corners is looked at; none for a laboratory's cuboid, or one that can be approached.
            Default: None.
        distance_m
            Least and greatest distance from the corner, metres. In a room it stays nearer where there is no space.
            Default: (1.0, 3.0).
        roll_max_rad
            Greatest roll, radians. Default: 0.2.
        period_s
            Period of the slowest sway, seconds. Default: 15.
        left_from_right
            The right camera's pose in the left one's frame, (4, 4): 0.12 m to the right, and turned by less than half a
            degree, as a pair is before rectification. Default: [[0.9999795000854165, -0.004007466635500051,
            -0.004993958358437458, 0.12], [0.003992466697999948, 0.9999875000520831, -0.003009974958395903, 0.0],
            [0.0050059583084375425, 0.0029899750417290974, 0.9999830000708331, 0.0], [0.0, 0.0, 0.0, 1.0]].
        samples
            Rays per pixel side where surfaces meet; elsewhere one ray per pixel will do. Default: 3.
        noise_sigma
            Standard deviation of Gaussian noise, grey levels of 255. Default: 2.
        blur_sigma_px
            Standard deviation of a Gaussian blur, pixels, for what lens and sensor do to a point. Default: 0.6.
        exposure_s
            How long the shutter is open, seconds, 0 for no motion blur. Default: 0.
        gain
            Factor from the room's light to display white, the same for all frames. Default: 0.8.
        """

    def _corners(self) -> list[tuple[list[float], list[list[float]], list[float], str]]:
        """Position, directions of the edges x, y, z in rows, their lengths, and the kind, of each corner of the
        scene.
        """

    def _imu(
        self, **options: Any
    ) -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]]:
        """Readings of an inertial sensor: times, rates (M, 3), forces (M, 3), the rates' true biases (M, 3)."""

    def _render(
        self, frame: SupportsIndex, *, threads: SupportsIndex | None = None
    ) -> tuple[NDArray[np.uint8], NDArray[np.uint8]]:
        """The left and the right image of a frame, (H, W, 3)."""

    def _truth(
        self, frame: SupportsIndex, *, threads: SupportsIndex | None = None
    ) -> tuple[NDArray[np.int64], NDArray[np.float64], NDArray[np.float64]]:
        """Corners in sight at a frame: numbers, vertices (M, 2, 2), visible lengths of edges (M, 2, 3)."""

    @property
    def cameras(self) -> tuple[Camera, Camera]:
        """The left and the right camera."""

    @staticmethod
    def check(**options: Any) -> None:
        """Raises what `StereoSequence` raises for these options, whatever the scene."""

    @property
    def corner(self) -> int:
        """Which of the scene's corners is looked at."""

    def distances(self, frame: SupportsIndex, bearings: ArrayLike) -> NDArray[np.float64]:
        """(N,): how far away the first surface is along bearings (N, 3) of the left camera at a frame, metres; NaN
        where there is none.
        """

    @property
    def exposure_s(self) -> float:
        """How long the shutter is open, seconds."""

    @property
    def frame_rate_hz(self) -> float:
        """Frames per second."""

    @property
    def left_from_right(self) -> NDArray[np.float64]:
        """(4, 4): the right camera's pose in the left one's frame."""

    @property
    def poses(self) -> NDArray[np.float64]:
        """(N, 4, 4): the left camera's pose in the world at each frame."""

    def poses_at(self, times_s: ArrayLike) -> NDArray[np.float64]:
        """(T, 4, 4): the left camera's pose in the world at any times, seconds."""

    @property
    def scene(self) -> Laboratory | Room:
        """The laboratory or room."""

    @property
    def seed(self) -> int:
        """The seed of motion and noise."""

    @property
    def times_s(self) -> NDArray[np.float64]:
        """(N,): when each frame is taken, seconds."""

@final
class TiltAlternative:
    """A direction that may be up. Frozen, comparable, hashable, and to be pickled."""

    def __copy__(self) -> Self: ...
    def __deepcopy__(self, _memo: Any) -> Self: ...
    def __eq__(self, other: object, /) -> bool: ...
    def __hash__(self) -> int: ...
    @classmethod
    def from_dict(cls, values: dict[str, Any]) -> Self:
        """The value of a dict as `to_dict` makes it, equal to the last bit; None for a number, as of JSON, is NaN."""

    @property
    def normal(self) -> NDArray[np.float64]:
        """(3,): the unit ground normal in the robot frame."""

    @property
    def probability(self) -> float:
        """Probability, in [0, 1], of being the right one of all."""

    def to_dict(self) -> dict[str, Any]:
        """The attributes by name, arrays as nested lists: plain, good for JSON."""

@final
class TiltEstimate:
    """The tilt of one image. Frozen, comparable (to the last bit), hashable, and to be pickled. True if there is a
    tilt.

    Without a tilt the angles and the normal are NaN, the covariance is infinite, the confidence 0, and `reason` says
    why.
    """

    def __bool__(self) -> bool: ...
    def __copy__(self) -> Self: ...
    def __deepcopy__(self, _memo: Any) -> Self: ...
    def __eq__(self, other: object, /) -> bool: ...
    def __hash__(self) -> int: ...
    @property
    def alpha_rad(self) -> float:
        """How far the robot leans, in [0, pi] radians (eq. 1)."""

    @property
    def alternatives(self) -> list[TiltAlternative]:
        """Directions that may be up, the most probable first; only of the method "segments". The first is the tilt,
        where there is one.
        """

    @property
    def beta_rad(self) -> float:
        """In which direction it leans, in (-pi, pi] radians: 0 is forward, +pi/2 to the left (eq. 1)."""

    @property
    def confidence(self) -> float:
        """Probability, in [0, 1], that the error (eq. 44) is below two degrees, were it normal with that covariance,
        and that no alternative is right.
        """

    @property
    def covariance_rad2(self) -> NDArray[np.float64]:
        """(2, 2) in squared radians: covariance of the normal in its tangent plane.

        Its axes are the robot's x and y, turned by the smallest rotation that takes z to the normal. Pixels of one edge
        err together, so residuals are pooled over 64 sectors of azimuth; to them come the pull of a little unnoticed
        clutter, a fifth of the lean for methods that approximate the lens, and 0.17 degrees a side for what no image
        tells.
        """

    @property
    def edge_pixels(self) -> int:
        """Edge pixels in the elevation band; of the method of straight edges those that are part of one."""

    @classmethod
    def from_dict(cls, values: dict[str, Any]) -> Self:
        """The value of a dict as `to_dict` makes it, equal to the last bit; None for a number, as of JSON, is NaN."""

    @property
    def inlier_pixels(self) -> int:
        """Edge pixels that agree with the estimate."""

    @property
    def normal(self) -> NDArray[np.float64]:
        """(3,): the unit ground normal in the robot frame, (-sin a cos b, -sin a sin b, cos a) (eq. 1)."""

    @property
    def pitch_rad(self) -> float:
        """Pitch about the robot's y in radians, nose down positive (`Rz Ry Rx`, ROS REP 103)."""

    @property
    def prefiltered_pixels(self) -> int:
        """Edge pixels that passed the prefilter and were not left out."""

    @property
    def reason(self) -> str:
        """Why the fit stopped, in a sentence: `report.reason`."""

    @property
    def report(self) -> FitReport:
        """How the fit went."""

    @property
    def roll_rad(self) -> float:
        """Roll about the robot's x in radians, right side down positive (`Rz Ry Rx`, ROS REP 103)."""

    @property
    def shift_px(self) -> float | None:
        """The shift l of the vanishing point in pixels (eq. 20), before any factor; None but for the image-space
        methods.
        """

    def to_dict(self) -> dict[str, Any]:
        """The attributes by name, arrays as nested lists: plain, good for JSON."""

@disjoint_base
class TiltEstimator:
    """Estimates how far and in which direction a robot leans from single images of one camera.

    The tables of the camera are made once. `tiltvp.TiltEstimator` takes images of any usual kind.

    `camera` is the camera whose images will come, `method` one of `METHODS`, `robot_from_camera` the (3, 3) rotation R
    with v_robot = R v_camera, by default the identity: an upward camera, columns to the front. Options and their
    defaults depend on the method; `options` tells those in force.

    Raises `tiltvp.errors.InvalidInputError` for an option that the method does not have (it names the near ones) or
    that is out of its domain, for an R that is no rotation, for a mask of another size than the camera's images, and
    where no pixel sees the band.
    """

    def __copy__(self) -> Self: ...
    def __deepcopy__(self, _memo: Any) -> Self: ...
    def __eq__(self, other: object, /) -> bool: ...
    def __hash__(self) -> int: ...
    def __new__(
        cls,
        camera: Camera,
        *,
        method: Literal["refined", "image-space-ransac", "image-space-reject-refit", "vector-consensus", "segments"]
        | str = ...,
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
        correction: float | str | AffineCorrection | PosteriorCorrection | None = ...,
        sampling: Literal["uniform", "progressive"] = ...,
        local_optimization: bool = ...,
        score: Literal["count", "msac"] = ...,
        threshold_rad: float = ...,
        normal: Literal["gradient", "tangent"] = ...,
        gradient_start: float = ...,
        stray_max_px: float = ...,
        rms_max_px: float = ...,
        support_min_px: SupportsIndex = ...,
        gap_max: float = ...,
        scatter_rad: float = ...,
        segments_max: SupportsIndex = ...,
    ) -> Self:
        """The options, by keyword.

        Parameters
        ----------
        gradient_min
            Least gradient magnitude `I_min` of an edge pixel, for the Scharr kernel (3, 10, 3) on 8-bit grey levels.
            The default depends on the method.
        smoothing_px
            Standard deviation of the Gaussian before the Scharr kernel in pixels, 0 for none. The default depends on
            the method.
        elevation_min_rad
            Lowest elevation above the robot's horizon in radians. The default depends on the method.
        elevation_max_rad
            Highest elevation above the robot's horizon in radians. The default depends on the method.
        margin_px
            Pixels kept clear of the lens' rim, the image border and the mask, beside those the kernels reach. The
            default depends on the method.
        tilt_max_rad
            Largest lean expected, in radians: a larger one that is told here and found is doubted. Edges that would
            need a larger one, of the refined method by more than `scale_rad`, are rejected first, but none that 10
            degrees of the refined method, 12 of segments and 7 of vector consensus allow, which None stands for; the
            image-space methods have `offset_max_px` instead, and this, where given, raises it to the shift of that
            lean. Above 20 degrees the method segments looks for the vertical anywhere. Default: None.
        mask
            Pixels that show the world and not the robot; none for all. Default: None.
        row_stride
            Only one row in so many is looked at: less time, and less sure an answer. Default: 1.
        seed
            Seed of the random samples. Default: 0.
        keep_fraction
            "refined": Share of normal residuals that each trimming round keeps. Default: 0.8.
            "image-space-reject-refit": Share of normal residuals kept each round; eq. 34 with `Q` read as the share
            kept. Default: 0.8.
        scale_rad
            "refined": Standard deviation in radians of the soft gate at the end: how far the edges of vertical things
            stray. Default: 0.0349066.
        tolerance_rad
            "refined": Change of the direction in radians below which it has converged: a fiftieth of a degree. Default:
            0.00035.
        max_iterations
            "refined": Most refits with the gate at its final scale. Default: 4.
            "image-space-reject-refit": Most rounds of rejecting and refitting, `N_E`; 0 is plain least squares.
            Default: 15.
        threshold_px
            "image-space-ransac": Largest residual of an inlier in pixels, `delta_s,max` of eq. 32. Default: 10.
        offset_max_px
            "image-space-ransac", "image-space-reject-refit": Largest edge offset in pixels that passes the prefilter,
            `s_max`; none for 40 pixels of a lens of 139.7 pixels per radian about the vertical, and in proportion for
            others. Default: None.
        correction
            "image-space-ransac", "image-space-reject-refit": From the shift to the angle: `"closed-form"` by the gain
            of each pixel, None by the lens' scale at the vanishing point, a factor in pixels per radian, a line, or a
            posterior. Default: "closed-form".
            "vector-consensus": From the raw angle to the angle: the factor `a'` of eq. 45, a line, a posterior, or
            none. Default: 1.
        sampling
            "image-space-ransac", "vector-consensus": From which observations samples are drawn: "uniform" from all
            alike, "progressive" from a growing pool of the best, the strongest edge pixels (PROSAC, Chum and Matas
            2005). Default: "uniform".
        local_optimization
            "image-space-ransac", "vector-consensus": Whether each new best model is improved by least squares before
            the next sample (LO-RANSAC, Chum, Matas and Kittler 2003). Default: False.
        score
            "image-space-ransac", "vector-consensus": What makes one model better than another: the "count" of inliers,
            or the truncated squares of "msac" (Torr and Zisserman 2000). Default: "count".
        threshold_rad
            "vector-consensus": Largest angle in radians between an inlier's great circle and the vertical,
            `delta_o,max` of eq. 40. Default: 0.0872665.
        normal
            "vector-consensus": How normals are made: `"gradient"` as Fleer 2017 does, `"tangent"` exactly. Default:
            "gradient".
        gradient_start
            "segments": Gradient magnitude from which a chain may start, for the Scharr kernel on 8-bit grey levels; it
            goes on down to `gradient_min`. Default: 128.
        stray_max_px
            "segments": How far in pixels a chain may stray from the great circle through its ends before it is cut.
            Default: 0.8.
        rms_max_px
            "segments": Greatest root mean square distance of the pixels of a segment from its great circle, in pixels.
            Default: 0.7.
        support_min_px
            "segments": Least number of pixels of a segment. Default: 8.
        gap_max
            "segments": Widest gap between two pieces of one great circle that are joined, in lengths of the longer one;
            0 joins none. Default: 1.
        scatter_rad
            "segments": Standard deviation in radians by which the edges of vertical things miss the vertical. Default:
            0.00523599.
        segments_max
            "segments": The most segments that are weighed, the longest ones. Default: 160.
        """

    def _detect(self, image: NDArray[np.uint8]) -> ImageEdges:
        """The edge pixels of a C-contiguous `(H, W)` image of uint8."""

    def _estimate(self, image: NDArray[np.uint8]) -> TiltEstimate:
        """The tilt of a C-contiguous (H, W) image of uint8."""

    def _estimate_many(self, images: list[NDArray[np.uint8]], *, threads: int | None = None) -> list[TiltEstimate]:
        """The tilts of many such images, in their order, the same for any number of threads."""

    def _estimate_with_edges(self, image: NDArray[np.uint8]) -> tuple[TiltEstimate, EdgeElements]:
        """The tilt of such an image, and its edge pixels."""

    def _hypotheses(self, image: NDArray[np.uint8]) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """(K, 3), (K, F): directions that may be up in such an image and what tells which is, for training."""

    def _trust_features(self, image: NDArray[np.uint8]) -> NDArray[np.float64]:
        """(F,): what tells whether the estimate of such an image is of the vertical at all, for training."""

    @property
    def camera(self) -> Camera:
        """The camera whose images are read."""

    def estimate_edges(self, edges: ImageEdges) -> TiltEstimate:
        """The tilt of the image that the edges are of, the same to the last bit as the image itself gives.

        `edges` may be those of any estimator with equal camera, robot_from_camera, mask and edge options (gradient_min,
        smoothing_px, elevations, margin_px, row_stride); else `tiltvp.errors.InvalidInputError` says what differs.
        Other threads run meanwhile.
        """

    @property
    def method(self) -> str:
        """The name of the method."""

    @property
    def options(self) -> dict[str, Any]:
        """The options that are in force, by name, defaults included; a fresh dict, good as keywords."""

    @property
    def region_pixels(self) -> int:
        """How many pixels are looked at: those of the elevation band, clear of the rim, the border and the mask."""

    @property
    def robot_from_camera(self) -> NDArray[np.float64]:
        """Fresh (3, 3) float64: the rotation R in v_robot = R v_camera."""

@final
class TiltFilter:
    """Fuses the tilts of successive images: a Kalman filter of the ground normal on the sphere.

    The floor's tilt turns with the robot's heading and walks slowly; errors that images of one place share are not
    averaged away; estimates that say nothing or do not fit are left out, steps are followed. Changes as it goes; may be
    pickled, copied and compared, state included, and used from several threads. See docs/tilt.md for the model.

    Raises `tiltvp.errors.InvalidInputError` for options out of their domain.
    """

    def __copy__(self) -> Self: ...
    def __deepcopy__(self, _memo: Any) -> Self: ...
    def __eq__(self, other: object, /) -> bool: ...
    def __new__(
        cls,
        *,
        walk_rad_per_sqrt_m: float | None = None,
        half_track_m: float | None = None,
        walk_rad_per_sqrt_step: float | None = None,
        gate_probability: float | None = None,
        confidence_min: float | None = None,
        jump_after: SupportsIndex | None = None,
        lost_after: SupportsIndex | None = None,
        correlated_share: float | None = None,
        correlation_m: float | None = None,
        noise_floor_rad: float | None = None,
        prior_rad: float | None = None,
        sigma_max_rad: float | None = None,
        estimate_mounting: bool | None = None,
        mounting_prior_rad: float | None = None,
        mounting_walk_rad_per_sqrt_m: float | None = None,
    ) -> Self:
        """The options, by keyword.

        Parameters
        ----------
        walk_rad_per_sqrt_m
            How fast the floor's tilt changes, in radians per square root of a metre that the wheels roll. Default:
            0.01.
        half_track_m
            Half the distance between the wheels in metres: how far they roll while the robot turns in place by one
            radian. The default lies between those of vacuum cleaners (0.12) and of robots that people ride on (0.2).
            Default: 0.15.
        walk_rad_per_sqrt_step
            How fast it changes however far the robot drives, in radians per square root of a prediction. Default:
            0.001.
        gate_probability
            Probability with which the gate lets an estimate pass whose covariance is right. Default: 0.999.
        confidence_min
            Least confidence of an estimate that is looked at. Default: 0.5.
        jump_after
            How many rejected estimates in a row have to agree with each other to be followed. Default: 3.
        lost_after
            After how many rejections in a row, agreeing or not, the floor's tilt is taken to be unknown. Default: 10.
        correlated_share
            Share of an estimate's variance that the next image of the same place has in common with it. Default: 0.9.
        correlation_m
            Metres driven after which what images have in common has fallen to 1/e. Default: 2.
        noise_floor_rad
            Standard deviation in radians that is added to that of every estimate. Default: 0.002.
        prior_rad
            Standard deviation of the floor's tilt in radians, in each direction, before anything is known. Default:
            0.174533.
        sigma_max_rad
            Largest standard deviation in radians of an answer; the filter abstains beyond. Default: 0.02.
        estimate_mounting
            Whether a lean of the robot itself is estimated beside that of the floor. Without it all lean is the
            floor's. Default: False.
        mounting_prior_rad
            Standard deviation in radians, in each direction, of that part before anything is known. Default: 0.0261799.
        mounting_walk_rad_per_sqrt_m
            How fast it may change, in radians per square root of a metre driven. Default: 0.0002.
        """

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
    def options(self) -> dict[str, Any]:
        """The options in force, by name, defaults included; a fresh dict, good as keywords."""

    def predict(self, yaw_rad: float | None = None, distance_m: float | None = None) -> None:
        """The robot has turned (left positive) and driven (either way) since the last call; None: it has not.

        Where turns are not known, `walk_rad_per_sqrt_step` of 0.1 rad for each second between calls stands for them.
        """

    @property
    def rejected(self) -> int:
        """How many estimates in a row the gate has rejected: above 0, the estimate may be about to jump."""

    def reset(self) -> None:
        """Forgets everything but the options."""

    def step(
        self,
        estimate: TiltEstimate | tuple[ArrayLike, ArrayLike],
        /,
        yaw_rad: float | None = None,
        distance_m: float | None = None,
    ) -> FilterStep:
        """`predict`, then `update`; where either is refused, the filter is as before."""

    def update(self, estimate: TiltEstimate | tuple[ArrayLike, ArrayLike], /) -> FilterStep:
        """Fuses an estimate, or says why not.

        In its place a pair may stand: a ground normal (3,) of any length, and its covariance (2, 2) in squared radians
        in the tangent plane. Its confidence is the probability of an error below two degrees under that covariance.
        """

@final
class TrackedLines:
    """The lines of one frame and whose they are. Frozen."""

    def __copy__(self) -> Self: ...
    def __deepcopy__(self, _memo: Any) -> Self: ...
    def __eq__(self, other: object, /) -> bool: ...
    def __hash__(self) -> int: ...
    def __len__(self) -> int: ...
    @property
    def frame(self) -> int:
        """Number of the frame, from 0."""

    @property
    def frames_back(self) -> NDArray[np.int64]:
        """(N,) int64: how many frames ago each line was last seen, 0 for a new one."""

    @classmethod
    def from_dict(cls, values: dict[str, Any]) -> Self:
        """The value of a dict as `to_dict` makes it, equal to the last bit; None for a number, as of JSON, is NaN."""

    @property
    def jump_rad(self) -> float:
        """How much farther to the left than was told the camera turned, radians, where few tracks go on by that alone
        and most by another turn: it was bumped, or wheels slipped. 0 elsewhere.
        """

    @property
    def lines(self) -> Lines:
        """The lines."""

    def to_dict(self) -> dict[str, Any]:
        """The attributes by name, arrays as nested lists: plain, good for JSON."""

    @property
    def track(self) -> NDArray[np.int64]:
        """(N,): identity of each line, from 0, never given twice."""

def apply_correction(
    correction: float | AffineCorrection | PosteriorCorrection, shift: ArrayLike
) -> NDArray[np.float64]:
    """(N,): the leans in radians of shifts or raw angles (N,) of zero or more, as an estimator so corrected has them.

    NaN stays NaN. A number is a factor by which the shift is divided.
    """

def calibrate(
    odometry: ArrayLike,
    bearings: ArrayLike,
    *,
    wheel_base_m: float,
    times_s: ArrayLike | None = None,
    bearing_sigma_rad: float | None = None,
    odometry_k_m: float | None = None,
    start: ArrayLike | None = None,
    start_sigma: ArrayLike | None = None,
    start_distance_m: float | None = None,
    start_distance_log_sigma: float | None = None,
    step_sigma_m: float | None = None,
    step_sigma_rad: float | None = None,
    estimate_odometry: bool | None = None,
    estimate_time_offset: bool | None = None,
    estimate_centre: bool | None = None,
    estimate_rolling_shutter: bool | None = None,
    max_iterations: SupportsIndex | None = None,
    jackknife_parts: SupportsIndex | None = None,
) -> LogCalibration:
    """The mounting from a whole log at once, by robust sparse least squares.

    `odometry` (N, 2) are the displacements of left and right wheel, `bearings` (M, 3) rows of step (a row of the
    odometry, after whose motion it was taken), landmark, bearing. `times_s` (N,) are the times of the steps, for
    `estimate_time_offset`. Bearings have no scale: with `estimate_odometry` the mean displacement of both wheels stays
    as reported. Other options are those of `SelfCalibrator`.

    Raises `tiltvp.errors.InvalidInputError` for numbers that make no sense, two bearings of a landmark at one step, and
    logs that determine nothing.

    The options, by keyword.

    Parameters
    ----------
    wheel_base_m
        Distance between the wheels, metres. It has no default that suits.
    bearing_sigma_rad
        Standard deviation of a bearing in radians. Default: 0.00872665.
    odometry_k_m
        Variance of a wheel's displacement for each metre of it (eq. 31), metres. Default: 1e-05.
    start
        The mounting (x_m, y_m, yaw_rad) as it is thought to be: the origin, if nothing is known. Default: (0.0, 0.0,
        0.0).
    start_sigma
        Standard deviations of (x_m, y_m, yaw_rad) at the start, or their covariance (3, 3). Default: [[0.09, 0.0, 0.0],
        [0.0, 0.09, 0.0], [0.0, 0.0, 0.25]].
    start_distance_m
        Distance at which landmarks are thought to be when they are first seen, metres. Default: 3.
    start_distance_log_sigma
        Standard deviation of the logarithm of that distance: a factor of so many e. Default: 1.5.
    step_sigma_m
        Standard deviation of every step's motion in either direction, beside eq. 31, metres. Default: 0.
    step_sigma_rad
        Standard deviation of every step's turn, beside eq. 31, radians. Default: 0.
    estimate_odometry
        Whether the wheel base, and which wheel runs farther, are estimated too. Bearings have no scale: the mean
        displacement of both wheels stays as reported. Default: False.
    estimate_time_offset
        Whether the time by which bearings are later than the odometry is estimated; needs times. Default: False.
    estimate_centre
        Whether an error of the bearings that goes once round the camera is estimated too: what another image centre
        makes, or a camera that leans. Default: False.
    estimate_rolling_shutter
        Whether it is estimated too by how much lines are seen later on one side of the camera than on the other, as
        through a rolling shutter. Default: False.
    max_iterations
        Most linearisations of each of the two descents (robust, then without outliers). Default: 100.
    jackknife_parts
        Parts of the landmarks that are left out in turn: the covariance of the mounting is then no less than the
        scatter of what the others tell. For landmarks that may be two things', as lines of images; 0 leaves none out.
        Default: 0.
    """

def check_camera(
    model: str, width: int, height: int, parameters: Mapping[str, ArrayLike], max_theta_rad: float | None = None
) -> None:
    """Raises what `Camera` raises for these numbers. `parameters` has the names of the lens' parameters alone."""

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
    is the cross product of the bearings of its ends. `weights` (N,) are zero or more; None: all 1.

    Raises `tiltvp.errors.InvalidInputError` for wrong shapes, zero or non-finite rows, negative weights and options out
    of their domain. Too few or degenerate normals, and those of which no more agree than would by chance, give an
    answer without a direction, and a reason. Two always have a direction in common, which no third one bears out: of
    pairs at random 6 % have one within 20 degrees of the prior, and an answer.

    The options, by keyword.

    Parameters
    ----------
    sigma_rad
        How far in radians the great circles of inliers stray from the direction. Default: 0.0174533.
    prior
        A direction near which the answer lies. Default: (0.0, 0.0, 1.0).
    max_angle_rad
        Largest angle in radians between the prior and the answer. Default: 0.349066.
    """

def consistency_band(probability: float, dof: SupportsIndex, samples: SupportsIndex) -> tuple[float, float]:
    """(low, high): the mean of `samples` chi-square values of `dof` degrees of freedom is there with that probability.

    The mean NEES of so many runs of a consistent filter falls there.
    """

def corner_attitudes(feature: CornerFeature, gamma_rad: float, gamma_sigma_rad: float) -> list[CornerAttitude]:
    """Every attitude that a feature admits, with covariance; see `tiltvp.corner.attitudes`."""

def corner_poses(
    left: CornerFeature, right: CornerFeature, left_from_right: ArrayLike, known: Mapping[str, Any], fuse: bool
) -> list[CornerPose]:
    """The poses that explain the features of a pair of cameras, the likeliest first; see `tiltvp.corner.poses`."""

def descriptor_distances(a: NDArray[np.float32], b: NDArray[np.float32]) -> NDArray[np.float64]:
    """(N_A, N_B): Euclidean distances of descriptors, eq. 6 (Scaramuzza 2009)."""

def drive_legs(kind: str = ...) -> NDArray[np.float64]:
    """(L, 2): distance in metres and turn in radians of the legs of a trajectory of `simulate_drive`."""

def fit_corner(x: ArrayLike, y: ArrayLike, z: ArrayLike, sigma_rad: float) -> CornerFeature:
    """A corner from unit bearings along its rays, each by weighted least squares.

    `x`, `y`, `z` are (N, 3) arrays, from the vertex outwards; `sigma_rad` is the standard deviation of each across its
    ray.
    """

def included_angle(
    feature: CornerFeature, vertical: ArrayLike, vertical_covariance_rad2: ArrayLike
) -> tuple[float, float] | None:
    """The included angle of the horizontal edges and its standard deviation; None where the vertex is seen
    horizontally.
    """

def leaning_from_upright(normal: ArrayLike) -> NDArray[np.float64]:
    """(3, 3): the rotation from the upright robot's frame to the leaning one's, without a turn about the vertical.

    `normal` is the ground normal (3,) in the robot frame, of any length but zero.
    """

def lens_schema(model: str) -> dict[str, Any]:
    """What the lens model of a name declares: `name`, `doc`, and its `parameters` in order, each with `name`,
    `required`, `default`, `is_list` and `doc`.
    """

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

    The options, by keyword.

    Parameters
    ----------
    f1
        `F1`: the greatest distance of a match, eq. 8. Default: 1.05.
    f2
        `F2`: the greatest share of the mean distance to all lines of the other image, eq. 9. Default: 0.75.
    f3
        `F3`: the greatest share of the second smallest distance, eq. 10. Default: 0.8.
    mutual
        Whether both lines must be nearest to each other, so that no line is matched twice. Default: True.
    ordered
        Whether matches must keep the cyclic order of the lines. Default: False.
    """

def match_wide(
    lines_a: Lines,
    a: NDArray[np.float32],
    lines_b: Lines,
    b: NDArray[np.float32],
    *,
    ahead_rad: ArrayLike | None = None,
    confidence_min: float = ...,
    likeness_min: float = ...,
    motion_sigma_rad: float = ...,
) -> tuple[NDArray[np.int64], NDArray[np.float64]]:
    """(M, 2) and (M,): lines of an image and those of another, metres away, that are the same, and how confident that
    is.

    `a` and `b` are the descriptors of the lines, of `descriptor_kind` "profile", (N_A, 190) and (N_B, 190) float32. One
    motion of the camera in the plane must explain all matches; `ahead_rad` is its direction as the first and as the
    second image see it, bearings in radians, where it is known, as by odometry. By rising line of the first image;
    confidences are float64 from 0 to 1. Raises `tiltvp.errors.InvalidInputError`.

    The options, by keyword.

    Parameters
    ----------
    confidence_min
        Least confidence of a match. Default: 0.8.
    likeness_min
        Least likeness of two profiles, of at most 2.1. Default: 1.2.
    motion_sigma_rad
        Standard deviation of a direction of motion that is told, in radians: it is looked for up to three of them away.
        Default: 0.0349066.
    """

def misreading_clause(name: str) -> str:
    """A clause: what a log fits with that was misread, by one of the names of `LogCalibration.misreading`.

    Raises `tiltvp.errors.InvalidInputError` for another name.
    """

def normal_from_alpha_beta(alpha_rad: float, beta_rad: float) -> NDArray[np.float64]:
    """(3,): the ground normal of a lean, (-sin a cos b, -sin a sin b, cos a) (eq. 1)."""

def option_fields(owner: str, method: str | None = None) -> list[dict[str, Any]]:
    """The options of a class or function, and of one of its methods; a `Drive` has "legs" as a method.

    A dict with `name`, `type` (an annotation), `default`, `doc` and `expected` for each, in the order of declaration.
    """

def read_imu(
    rates_rad_s: ArrayLike,
    forces_m_s2: ArrayLike,
    *,
    rate_hz: float | None = None,
    seed: SupportsIndex | None = None,
    gyroscope: ArrayLike | None = None,
    accelerometer: ArrayLike | None = None,
) -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]]:
    """Readings of an inertial sensor, such as those of `StereoSequence.imu`, along any motion.

    `rates_rad_s` and `forces_m_s2` are its true rates of turn and specific forces in the sensor's axes, (M, 3) each and
    `rate_hz` a second. Times, rates (M, 3), forces (M, 3), and the rates' true biases (M, 3).

    The options, by keyword.

    Parameters
    ----------
    rate_hz
        Readings per second. Default: 200.
    seed
        Seed of biases and noise. Default: 0.
    gyroscope
        Rates of turn, rad/s: noise density, bias, bias walk, scale error and range. Default: (8.7e-05, 0.0035, 0.0001,
        0.005, 4.363323).
    accelerometer
        Specific forces, m/s^2: the same. Default: (0.00392266, 0.04903325, 0.0001, 0.005, 19.6133).
    """

def resolve_corners(
    features: Sequence[CornerFeature], common_from_camera: Sequence[ArrayLike], known: Mapping[str, Any], alignment: str
) -> list[ResolvedAttitude]:
    """The attitudes that several features agree on, the likeliest first; see `tiltvp.corner.resolve`."""

def screen_corner(feature: CornerFeature, gamma_rad: float) -> str | None:
    """Why a feature is no corner of that angle, in a sentence; None if it is one."""

def simd_level() -> str:
    """The vectors that this process uses: "fallback", "sse4.2", "avx2", "avx512" or "neon".

    Answers do not depend on them. They are the widest of the machine, or those that the environment's `TILTVP_SIMD`
    names when tiltvp is imported, where a word that is none of the machine's raises `InvalidInputError`.
    """

def simulate_drive(
    kind: str = ...,
    *,
    seed: SupportsIndex | None = None,
    mounting: ArrayLike | None = None,
    landmarks: SupportsIndex | None = None,
    bearing_sigma_rad: float | None = None,
    odometry_k_m: float | None = None,
    wheel_base_m: float | None = None,
    outliers: float | None = None,
) -> SimulatedDrive:
    """A drive past 10 vertical lines: "paper" (2.3 m straight on, half a turn), "alternating", "straight", "rotation"
    or "arcs".

    `mounting` is (x_m, y_m, yaw_rad), None: the paper's phi = -0.34, rho = 0.23, psi = 0.33. The noise is that of the
    defaults of `SelfCalibrator`, wheels are 0.4 m apart, `outliers` is the share of bearings that are of nothing.

    The options, by keyword.

    Parameters
    ----------
    seed
        Seed of everything random. Default: 0.
    mounting
        Where the camera is: (x_m, y_m, yaw_rad). Default: (0.21683357307151963, -0.07670203119238732,
        -0.010000000000000009).
    landmarks
        How many vertical lines there are. Default: 10.
    bearing_sigma_rad
        Standard deviation of a bearing, radians. Default: 0.00872665.
    odometry_k_m
        Variance of a wheel's displacement per metre (Scaramuzza, Siegwart and Martinelli 2009, eq. 31), metres.
        Default: 1e-05.
    wheel_base_m
        Distance between the wheels, metres. Default: 0.4.
    outliers
        Probability that a bearing is that of nothing: anywhere on the circle. Default: 0.
    """

def solve_corner(
    vertex: ArrayLike, x_ray: ArrayLike, y_ray: ArrayLike, z_ray: ArrayLike, gamma_rad: float
) -> list[CornerAttitude]:
    """Every attitude that a corner seen at exact bearings may have; see `tiltvp.corner.solve`."""

def solve_corners(
    vertex: ArrayLike, x_ray: ArrayLike, y_ray: ArrayLike, z_ray: ArrayLike, gamma_rad: ArrayLike
) -> CornerAttitudes:
    """The same for many corners at once: (N, 3) arrays, and one included angle or one for each."""

def ssd_matrix(a: NDArray[np.float32], b: NDArray[np.float32]) -> NDArray[np.float64]:
    """(N_A, N_B): means of squared differences of patches (N, K), eq. 12 over the samples that both have."""

def tilt_error_rad(a: ArrayLike, b: ArrayLike) -> float:
    """The angle in [0, pi] radians between two ground normals (3,), of any length but zero (eq. 44)."""

def tilt_from_wheel_heights(
    *, left_m: float, right_m: float, caster_m: float, half_track_m: float, caster_behind_m: float
) -> tuple[float, float]:
    """(alpha_rad, beta_rad) of a robot whose wheels stand at these heights above a common level (eqs. 42 and 43).

    The main wheels are at (0, +-half_track_m) in the robot's frame, the caster at (-caster_behind_m, 0): r_w and r_c of
    fig. 20. With h_r = right - left and h_c = caster - left the ground normal is (-(2 h_c - h_r) / (2 r_c), -h_r / (2
    r_w), cos alpha). Raises `tiltvp.errors.InvalidInputError` for lengths that are not positive, heights that are not
    finite, and heights that no robot of this layout can stand at.
    """

def train_affine(shift: ArrayLike, alpha_rad: ArrayLike) -> AffineCorrection:
    """The line alpha = shift / factor + offset through images of known leans (N,), by least squares of the shift.

    The truth is known and the shift errs, and the line does not depend on how many images there are of each lean.
    Raises `tiltvp.errors.InvalidInputError` for fewer than two different leans or shifts that do not grow with them.
    """

def train_factor(shift: ArrayLike, alpha_rad: ArrayLike) -> float:
    """The factor of eq. 31: the mean of shift / alpha over images of known leans (N,) above zero.

    `shift` (N,) is `shift_px` of an image-space method, or `alpha_rad` of an uncorrected "vector-consensus". Leave out
    images without an estimate. Raises `tiltvp.errors.InvalidInputError` for numbers that make no sense.
    """

def train_posterior(shift: ArrayLike, alpha_rad: ArrayLike, *, prior: PriorOfTilt | None = None) -> PosteriorCorrection:
    """P(alpha | l) from images of known leans (N,), at least ten, under a prior; None: `PriorOfTilt.empirical()`.

    The shift is modelled as the length of a plane vector of mean length factor * alpha with normal errors that grow
    with the lean (a Rice distribution), a share of which strays; the model is fitted by maximum likelihood. Raises
    `tiltvp.errors.InvalidInputError` for numbers that make no sense or shifts that do not grow with the lean.
    """

def triangulate(
    bearings: ArrayLike, covariances_rad2: Sequence[ArrayLike], rig_from_camera: Sequence[ArrayLike]
) -> tuple[NDArray[np.float64], NDArray[np.float64], float] | None:
    """The point that bearings of two or more cameras meet in: (3,) metres, (3, 3) square metres, and chi-square; None
    where they are parallel or the point would be behind a camera.
    """

def wheel_displacements(
    distance_m: ArrayLike, heading_change_rad: ArrayLike, *, wheel_base_m: float
) -> NDArray[np.float64]:
    """(N, 2) displacements (left, right) of wheels that drive distances (N,) and turn (N,) to the left (eq. 15)."""

def yaml_tree(text: str, *, most_values: SupportsIndex, deepest: SupportsIndex) -> Any:
    """The tree of a YAML text; every scalar is its text, tags are ignored, an alias is the object that it names.

    Raises `ValueError` for what is no YAML of one document, for more than `most_values` keys and values, where what an
    alias stands for counts every time, for more than `deepest` levels, and for a key with two values that differ.
    """

def zncc_matrix(a: NDArray[np.float32], b: NDArray[np.float32]) -> NDArray[np.float64]:
    """(N_A, N_B): zero-mean normalised cross-correlations of patches (N, K), eq. 13; 1 for equal ones."""
