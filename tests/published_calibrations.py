"""The real calibration files of all lenses, and the model and numbers that each states."""

from __future__ import annotations

from published_polynomials import POLYNOMIALS, Expected

TUM_VI = {"fx": 190.97847715128717, "fy": 190.9733070521226, "cx": 254.93170605935475, "cy": 256.8974428996504} | {
    "k1": 0.0034823894022493434,
    "k2": 0.0007150348452162257,
    "k3": -0.0020532361418706202,
    "k4": 0.00020293673591811182,
}
FILES: dict[str, Expected] = {
    "basalt_double_sphere.json": Expected(
        "basalt",
        2,
        "double_sphere",
        (752, 480),
        {"fx": 349.7560023050409, "fy": 348.72454229977035, "cx": 365.89440762590147, "cy": 249.32995565708703}
        | {"xi": -0.2409573942178872, "alpha": 0.566996899163044},
        {"xi": -0.21300835384809327, "alpha": 0.5767008625037023},
    ),
    "basalt_eucm.json": Expected(
        "basalt",
        2,
        "extended_unified",
        (512, 512),
        {"fx": 191.14799836282188, "cy": 256.88154645599445, "alpha": 0.6291060881178562, "beta": 1.0418067381860867},
        {"beta": 1.041250259119081},
    ),
    "basalt_kb4_t265.json": Expected(
        "basalt",
        2,
        "kannala_brandt",
        (848, 800),
        {"fx": 286.60144163375526, "k1": -0.006762412326815424, "k4": 0.008374959821591333},
        {"cx": 431.3293011565108, "k4": 0.009643678532407407},
    ),
    "boofcv_fisheye_chessboard.yaml": Expected(
        "boofcv",
        1,
        "unified",
        (640, 720),
        {"xi": 1.1331346732794045, "fx": 398.77492706579216, "cy": 319.71743712432686, "k1": -0.24972089525362837}
        | {"k2": 0.009672326567075125, "p1": 0.0, "p2": 0.0},
    ),
    "boofcv_omnidirectional_universal.yaml": Expected(
        "boofcv",
        1,
        "unified",
        (960, 1080),
        {"xi": 2.94487011878, "fx": 1125.799138869, "cx": 479.4346090575, "k1": 0.226573352659, "k2": 6.72940754992}
        | {"p1": 0.004624464338, "p2": 9.66390674543e-4},
    ),
    "camodocal_kannala_brandt_vins.yaml": Expected("camodocal", 1, "kannala_brandt", (512, 512), TUM_VI),
    "camodocal_mei_tum_left.yaml": Expected(
        "camodocal",
        1,
        "unified",
        (512, 512),
        {"xi": 1.792187901303534, "fx": 533.340727445877, "fy": 533.2556495307942, "cx": 254.64689387916482}
        | {"cy": 256.4835490935692, "k2": 0.17468739202093328, "p1": 0.000737218969875311, "p2": 0.000574074894976456},
    ),
    "camodocal_mei_vins.yaml": Expected(
        "camodocal",
        1,
        "unified",
        (752, 480),
        {
            "xi": 2.2134257311108083,
            "fx": 1.1659242643040975e03,
            "cx": 3.9238492754088008e02,
            "k2": 9.1226950620748259e-01,
        },
    ),
    "camodocal_mei_visensor.yaml": Expected(
        "camodocal",
        1,
        "unified",
        (752, 480),
        {"xi": 1.8476540167437447, "fx": 1338.1845333957547, "cy": 217.69105287172025, "k1": -0.06597811223735722},
    ),
    "camodocal_realsense_fisheye.yaml": Expected(
        "camodocal",
        1,
        "kannala_brandt",
        (640, 480),
        {
            "fx": 2.7723712054408202e02,
            "fy": 2.7699784668734617e02,
            "cx": 3.3625356873985868e02,
            "k1": 1.7280355035195181e-02,
        }
        | {"k4": -7.3355871719731113e-03},
    ),
    "colmap_cameras_opencv_fisheye.txt": Expected(
        "colmap",
        1,
        "kannala_brandt",
        (3840, 3840),
        {"fx": 1096.18568235725116, "fy": 1096.29168563253802, "cx": 1919.5, "cy": 1919.5, "k1": 0.030349368620543618}
        | {"k4": -0.00035606873525276218},
    ),
    "colmap_cameras_simple_radial.txt": Expected(
        "colmap",
        12,
        "pinhole",
        (5712, 4284),
        {"fx": 3953.2679568575354, "fy": 3953.2679568575354, "cx": 2855.5, "cy": 2141.5, "k1": 0.00093111489634588383},
        {"fx": 4016.4578028692681, "k1": -0.0048392217425330727},
    ),
    "fisheye_calib_adapter_ds.yml": Expected(
        "fisheye-calib-adapter",
        1,
        "double_sphere",
        (752, 480),
        {"fx": 348.112754378549, "fy": 347.1109973814674, "alpha": 0.5657413673629862, "xi": -0.24425190195168348},
    ),
    "fisheye_calib_adapter_eucm.yml": Expected(
        "fisheye-calib-adapter",
        1,
        "extended_unified",
        (752, 480),
        {"fx": 460.92588889854693, "cx": 365.81762690405503, "alpha": 0.5864679700626143, "beta": 1.139248617863534},
    ),
    "fisheye_calib_adapter_kb.yml": Expected(
        "fisheye-calib-adapter",
        1,
        "kannala_brandt",
        (752, 480),
        {"fx": 461.58688085556616, "k1": -0.012523386218579752, "k4": 0.04362766880887814},
    ),
    "gyroflow_lens_profile_gopro.json": Expected(
        "gyroflow",
        1,
        "kannala_brandt",
        (1920, 1080),
        {"fx": 846.7074163244357, "cx": 951.3116625296962, "cy": 547.6408532231006, "k1": 0.07337164744173065}
        | {"k4": -0.025227615002142097},
    ),
    "kalibr_4seasons_camchain.yaml": Expected(
        "kalibr",
        2,
        "kannala_brandt",
        (800, 400),
        {"fx": 527.9990706330082, "cy": 172.8193108347693, "k1": -0.03559759964255725, "k4": -0.01583280039499382},
        {"fx": 529.2496538273606, "k4": 0.009597717025035516},
    ),
    "kalibr_camchain_double_sphere.yaml": Expected(
        "kalibr",
        2,
        "double_sphere",
        (1440, 1080),
        {"xi": -0.19963086018860057, "alpha": 0.5924590037637837, "fx": 317.552559595926, "fy": 316.1745713358917}
        | {"cx": 724.8551471226007, "cy": 546.5708052642561},
        {"xi": -0.19567833352036393, "cy": 557.2224352962965},
    ),
    "kalibr_camchain_imucam_quadcam.yaml": Expected(
        "kalibr",
        4,
        "unified",
        (1280, 800),
        {"xi": 2.2176903753419963, "fx": 1162.5434300524314, "fy": 1161.839362615319, "cx": 660.6393183718625}
        | {"k1": -0.17703529535292872, "p2": 2.1653595535258756e-05},
        {"xi": 2.0702174555251935, "cy": 384.16693082597965, "p2": 0.00017201443530900348},
    ),
    "kalibr_camchain_omni_fisheye_cams.yaml": Expected(
        "kalibr",
        4,
        "unified",
        (1280, 720),
        {"xi": 2.0779806782854466, "fx": 1124.7283061913233, "cy": 327.56651546593287, "k2": 0.4394442689857262},
        {"xi": 2.118109081741645, "k2": 0.49010329824874016, "p2": 4.965097579945239e-05},
    ),
    "kalibr_camchain_pinhole_equi.yaml": Expected(
        "kalibr", 2, "kannala_brandt", (512, 512), TUM_VI, {"fx": 190.44236969414825, "k4": 0.0003299517423931039}
    ),
    "kalibr_camchain_plain.yaml": Expected(
        "kalibr",
        1,
        "pinhole",
        (1280, 720),
        {"fx": 863.7280242706395, "cy": 385.52910358020034, "k1": 0.08852752863539287, "k2": -0.2259944822077573}
        | {"p1": -0.00015262221165681156, "p2": 0.0005662465675565772},
    ),
    "kalibr_camchain_t265.yaml": Expected(
        "kalibr",
        2,
        "kannala_brandt",
        (848, 800),
        {"fx": 282.019963259348, "fy": 280.7145153126385, "k2": 0.05405258144204682},
        {"cx": 414.09933409091184, "k4": 0.010954064142332987},
    ),
    "libper_omni_xml.xml": Expected(
        "libper",
        1,
        "unified",
        (400, 400),
        {"xi": 1.0, "fx": 180.0, "fy": 180.0, "cx": 200.0, "cy": 200.0},
        image_size=(400, 400),
    ),
    "libper_theta_dual_fisheye.xml": Expected(
        "libper",
        2,
        "unified",
        (1280, 640),
        {"xi": 1.9878248282, "fx": 577.7741102813, "fy": 576.1130775378, "cx": 958.6632913081, "cy": 316.8988682143},
        {"xi": 1.9392267289, "cx": 321.5506721254},
        image_size=(1280, 640),
    ),
    "opencv_fisheye_filestorage_like.yaml": Expected(
        "ros",
        1,
        "kannala_brandt",
        (3264, 3264),
        {"fx": 991.0, "fy": 991.0, "cx": 1612.0, "cy": 1617.0, "k1": 0.024943212941115993, "k4": 0.0045520708951808514},
    ),
    "orbslam3_kannala_brandt8_TUM-VI.yaml": Expected(
        "orbslam3",
        1,
        "kannala_brandt",
        (512, 512),
        {
            "fx": 190.978477,
            "fy": 190.973307,
            "cx": 254.931706,
            "cy": 256.897442,
            "k1": 0.003482389402,
            "k4": 0.000202936736,
        },
    ),
    "ros_camera_info_plumb_bob.yaml": Expected(
        "ros",
        1,
        "pinhole",
        (640, 480),
        {"fx": 438.783367, "fy": 437.302876, "cx": 305.593336, "cy": 243.738352, "k1": -0.361976, "k2": 0.110510}
        | {"p1": 0.001014, "p2": 0.000505, "k3": 0.0},
    ),
    "stella_vslam_equirectangular.yaml": Expected("stella-vslam", 1, "equirectangular", (1920, 960), {}),
    "stella_vslam_fisheye.yaml": Expected(
        "stella-vslam",
        1,
        "kannala_brandt",
        (960, 540),
        {"fx": 441.730011169, "fy": 442.520822476, "cx": 480.35667528, "k1": -3.068701296607466433e-02}
        | {"k4": -5.917420310474077278e-04},
    ),
    "vikit_svo_equidistant.yaml": Expected(
        "vikit",
        1,
        "kannala_brandt",
        (752, 480),
        {"fx": 463.34128261574796, "cy": 231.13558880965206, "k1": -0.0027973061697674074, "k4": 0.031185314072573474},
    ),
} | POLYNOMIALS
