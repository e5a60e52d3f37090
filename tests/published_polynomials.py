"""The real calibration files of polynomial lenses, and the model and numbers that each states."""

from __future__ import annotations

from typing import Any, NamedTuple


class Expected(NamedTuple):
    """What a file holds: format, number of cameras, model and size of the first, some of its numbers."""

    format: str
    cameras: int
    model: str
    size: tuple[int, int]
    numbers: dict[str, Any]
    last: dict[str, Any] | None = None
    image_size: tuple[int, int] | None = None


ZURICH_OCAM = {
    "polynomial": [-69.6915, 0.0, 5.4772e-4, 2.1371e-5, -8.7523e-9],
    "inverse_polynomial": [142.7468, 104.8486, 7.3973, 17.4581, 12.6308, -4.3751]
    + [6.9093, 10.9703, -0.6053, -3.9119, -1.0675, 0.0],
    "cx": 320.0,
    "cy": 240.0,
    "c": 1.0,
    "d": 0.0,
    "e": 0.0,
}

POLYNOMIALS: dict[str, Expected] = {
    "camodocal_scaramuzza_vins.yaml": Expected(
        "camodocal",
        1,
        "ocam",
        (1280, 960),
        {"polynomial": [-2.445239e02, 0.0, 1.748610e-03, -1.757770e-06, 4.475965e-09], "cx": 645.107791}
        | {"cy": 486.025172, "c": 1.0, "d": 0.0, "e": 0.0},
    ),
    "fisheye_calib_adapter_ocam.yml": Expected(
        "fisheye-calib-adapter",
        1,
        "ocam",
        (752, 480),
        {"cx": 359.829671, "cy": 243.611488, "c": 1 / 0.998870, "d": 0.000110 / 0.998870, "e": -0.000169 / 0.998870}
        | {
            "polynomial": [
                -2.093037e02 * 0.998870,
                0.0,
                2.216175e-03 / 0.998870,
                -5.122558e-06 / 0.998870**2,
                2.149945e-08 / 0.998870**3,
            ]
        },
    ),
    "multicolslam_ocam_opencv_filestorage.yaml": Expected(
        "opencv",
        1,
        "ocam",
        (754, 480),
        {"cx": 392.219508388648, "cy": 243.494438476351, "c": 1 / 0.999626131079017}
        | {"d": 0.00385134991673147 / 0.999626131079017, "e": -0.0034775192597376 / 0.999626131079017}
        | {
            "polynomial": [
                -209.200757992065 * 0.999626131079017,
                0.0,
                0.00213741670953883 / 0.999626131079017,
                -4.2203617319086e-06 / 0.999626131079017**2,
                1.77146086919594e-08 / 0.999626131079017**3,
            ]
        },
    ),
    "ocamcalib_catadioptric_3digit_exponent.txt": Expected(
        "ocamcalib",
        1,
        "ocam",
        (1024, 768),
        {"polynomial": [-131.4797, 0.0, 1.848991e-3, 2.251206e-7, -7.343233e-10], "cx": 515.323794, "cy": 382.294245}
        | {"c": 0.999845, "d": 0.000044, "e": 0.000008},
    ),
    "ocamcalib_fisheye.txt": Expected(
        "ocamcalib",
        1,
        "ocam",
        (1024, 768),
        {"polynomial": [-551.7655, 0.0, 8.372454e-4, -6.474789e-7, 1.235631e-9], "cx": 505.480427, "cy": 381.777786}
        | {
            "inverse_polynomial": [730.949123, 315.876984, -177.960849, -352.468231]
            + [-678.144608, -615.917273, -262.086205, -42.961956]
        },
    ),
    "ocamcalib_homing.txt": Expected(
        "ocamcalib",
        1,
        "ocam",
        (1024, 768),
        {"polynomial": [-153.467, 0.0, 1.034692e-3, 5.138226e-6, -5.694855e-9], "cx": 456.345673, "cy": 382.828814}
        | {"c": 1.000651, "d": -0.000625, "e": 0.000431},
    ),
    "ocamcalib_param_line_based.txt": Expected("ocamcalib", 1, "ocam", (640, 480), ZURICH_OCAM),
    "py_omnicalib.yml": Expected(
        "py-omnicalib",
        1,
        "ocam",
        (2560, 2048),
        {
            "polynomial": [
                -561.4162101837792,
                0,
                0.0006389615917920563,
                -2.3906218090316645e-07,
                3.656089007737983e-10,
            ],
            "cx": 1280.4586417260234,
            "cy": 1031.5806574524036,
            "c": 1.0,
            "d": 0.0,
            "e": 0.0,
        },
        image_size=(2560, 2048),
    ),
    "pyocamcalib.json": Expected(
        "pyocamcalib",
        1,
        "ocam",
        (1032, 778),
        {"cx": 543.9861511428039, "cy": 377.64882547339226, "c": 1 / 1.0032962305648117}
        | {"d": 0.00017686046028285402 / 1.0032962305648117, "e": 0.00014800947722706114 / 1.0032962305648117}
        | {
            "polynomial": [
                -337.71684227978966 * 1.0032962305648117,
                0.0,
                0.0012238320710672823 / 1.0032962305648117,
                -1.3803997515890267e-06 / 1.0032962305648117**2,
                3.0106166073815756e-09 / 1.0032962305648117**3,
            ]
        },
        image_size=(1032, 778),
    ),
    "svo_bluefox_fisheye_rig.yaml": Expected(
        "vikit",
        1,
        "ocam",
        (752, 480),
        {"polynomial": [-206.5170, 0.0, 2.207161e-03, -4.879622e-06, 1.865656e-08], "cx": 394.552874, "cy": 241.800066}
        | {"c": 1.000330, "d": 0.000219, "e": 0.000257},
    ),
    "vikit_svo_ocam.yaml": Expected("vikit", 1, "ocam", (752, 480), ZURICH_OCAM),
    "woodscape_radial_poly.json": Expected(
        "woodscape",
        1,
        "radial_polynomial",
        (1280, 966),
        {"k1": 339.749, "k2": -31.988, "k3": 48.275, "k4": -7.201, "aspect_ratio": 1.0}
        | {"cx": 3.942 + 639.5, "cy": -3.093 + 482.5},
    ),
}
