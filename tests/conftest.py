"""What the tests share: a small upward fisheye, and rooms rendered through it once per session."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator

import cv2
import numpy as np
import pytest

import commands
import tiltvp
from evaluations import evaluated
from tiltvp.cli import main
from tiltvp.lab.datasets.folder import TiltDataset, read_dataset
from tiltvp.lab.datasets.new import new_dataset
from tiltvp.synth import Room, RoomImage, render_room

SIDE = 256


@pytest.hookimpl(tryfirst=True)
def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Marks as slow what needs the dataset, also by way of its run and its report."""
    for item in items:
        if "dataset" in getattr(item, "fixturenames", ()):
            item.add_marker(pytest.mark.slow)


@pytest.fixture(scope="session", autouse=True)
def one_opencv_thread() -> Iterator[None]:
    """OpenCV keeps to one thread: its pool does not survive a fork, and the machine is shared."""
    before = cv2.getNumThreads()
    cv2.setNumThreads(1)
    yield
    cv2.setNumThreads(before)


@pytest.fixture
def run(capfd: pytest.CaptureFixture[str]) -> commands.Run:
    """Runs `tiltvp` in this process."""

    def run_main(*words: object) -> commands.Said:
        code = main([str(word) for word in words])
        said = capfd.readouterr()
        return commands.Said(code, said.out, said.err)

    return run_main


@pytest.fixture(scope="session")
def camera() -> tiltvp.Camera:
    """An equidistant fisheye of 190 degrees that looks up."""
    middle = (SIDE - 1) / 2
    return tiltvp.Camera.equidistant(
        width=SIDE, height=SIDE, focal_px=76.0, cx=middle, cy=middle, max_theta_rad=math.radians(95)
    )


@pytest.fixture(scope="session")
def render(camera: tiltvp.Camera) -> Callable[..., RoomImage]:
    """Renders rooms through that camera, each only once."""
    seen: dict[tuple[tuple[str, object], ...], RoomImage] = {}

    def room(**keywords: object) -> RoomImage:
        key = tuple(sorted(keywords.items()))
        if key not in seen:
            image = render_room(camera, **{"samples": 2, **keywords})  # type: ignore[arg-type]
            image.gray.flags.writeable = image.bgr.flags.writeable = False
            seen[key] = image
        return seen[key]

    return room


@pytest.fixture(scope="session")
def room(render: Callable[..., RoomImage]) -> RoomImage:
    """A living room, leaning by 0.06 radians (3.4 degrees) to the front left."""
    return render(kind="living-room", seed=1, alpha_rad=0.06, beta_rad=0.8)


@pytest.fixture(scope="session")
def upright_room(render: Callable[..., RoomImage]) -> RoomImage:
    """The same room without any lean and without noise."""
    return render(kind="living-room", seed=1, alpha_rad=0.0, beta_rad=0.0, noise_sigma=0.0)


@pytest.fixture(scope="session")
def dataset(tmp_path_factory: pytest.TempPathFactory, camera: tiltvp.Camera) -> TiltDataset:
    """A dataset of fifteen images: five places of one room, each at three leans, one image without any edge."""
    folder = tmp_path_factory.mktemp("dataset") / "rooms"
    scene = Room("living-room", 1, threads=1)
    with new_dataset(folder, camera) as new:
        for place, pose in enumerate(scene.free_poses(5, 1)):
            for lean, (alpha_deg, beta_deg) in enumerate(((0.0, 0.0), (3.0, 0.0), (6.0, 137.0))):
                alpha, beta = math.radians(alpha_deg), math.radians(beta_deg)
                view = scene.render(camera, pose=pose, alpha_rad=alpha, beta_rad=beta, samples=2, seed=place)
                gray = np.full_like(view.gray, 90) if (place, lean) == (1, 2) else view.gray
                truth = {"location": f"place-{place}", "environment": "flat", "alpha_rad": alpha, "beta_rad": beta}
                new.images.append(new.write(f"{place}{lean}", gray, **truth))
    return read_dataset(folder)


@pytest.fixture(scope="session")
def whole(tmp_path_factory: pytest.TempPathFactory, dataset: TiltDataset) -> commands.Run:
    """The run of table 3's parameters over it, on one thread."""
    return evaluated(dataset, tmp_path_factory.mktemp("whole") / "run")


@pytest.fixture(scope="session")
def images(room: RoomImage, upright_room: RoomImage) -> list[np.ndarray]:
    """Seven images of the size of the camera, one of them without any edge."""
    blank = np.full((SIDE, SIDE), 90, dtype=np.uint8)
    return [room.gray, upright_room.gray, room.gray[::-1], room.gray[:, ::-1], blank, room.gray.T, upright_room.gray.T]
