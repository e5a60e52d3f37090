"""The recipe for an option in CONTRIBUTING.md, followed in a copy of the tree: a declaration and a use are enough."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
METHOD = Path("crates/tiltvp-core/src/tilt/methods/refined.rs")
DECLARED = "        /// Standard deviation in radians of the soft gate at the end"
USED = "keep_fraction: options.keep_fraction,"
OPTION = """        /// Share that is kept less than `keep_fraction` says.
        dummy_share: f64 = 0.0 => 0.0..=0.3, "a share from 0 to 0.3";
"""
PROOF = """
import pickle
import numpy as np
import pytest
import tiltvp
from tiltvp.errors import InvalidInputError

camera = tiltvp.Camera.equidistant(width=320, height=240, focal_px=70.0, cx=159.5, cy=119.5)
image = tiltvp.synth.render_room(camera, seed=1, alpha_rad=0.06, samples=1).gray
plain, other = tiltvp.TiltEstimator(camera), tiltvp.TiltEstimator(camera, dummy_share=0.3)
assert plain.options["dummy_share"] == 0.0 and other.options["dummy_share"] == 0.3
assert plain(image) != other(image) and plain != other
assert pickle.loads(pickle.dumps(other)).options == other.options
with pytest.raises(InvalidInputError, match="dummy_share = 0.5, expected a share from 0 to 0.3"):
    tiltvp.TiltEstimator(camera, dummy_share=0.5)
with pytest.raises(InvalidInputError, match="did you mean dummy_share"):
    tiltvp.TiltEstimator(camera, dumy_share=0.1)
"""


@pytest.fixture(scope="module")
def tree(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A copy of the tracked files in which the recipe was followed, built."""
    tree = tmp_path_factory.mktemp("recipe") / "tiltvp"
    listed = subprocess.run(["git", "ls-files"], cwd=ROOT, stdout=subprocess.PIPE, text=True, check=True)
    for name in listed.stdout.splitlines():
        (tree / name).parent.mkdir(parents=True, exist_ok=True)
        shutil.copy2(ROOT / name, tree / name)
    source = (tree / METHOD).read_text(encoding="utf-8")
    assert source.count(DECLARED) == source.count(USED) == 1
    source = source.replace(DECLARED, OPTION + DECLARED)
    source = source.replace(USED, "keep_fraction: options.keep_fraction - options.dummy_share,")
    (tree / METHOD).write_text(source, encoding="utf-8")
    target = ROOT / "target" / "recipe"
    build = ["cargo", "build", "--quiet", "--locked", "--profile", "quick", "--package", "tiltvp-py"]
    subprocess.run(build, cwd=tree, env={**os.environ, "CARGO_TARGET_DIR": str(target)}, check=True)
    shutil.copy2(target / "quick" / "lib_core.so", tree / "python" / "tiltvp" / "_core.abi3.so")
    return tree


def run(tree: Path, *arguments: str) -> str:
    """What Python prints with the package of that tree."""
    environment = {**os.environ, "PYTHONPATH": f"{tree / 'python'}{os.pathsep}{tree / 'tests'}", "COLUMNS": "200"}
    done = subprocess.run(
        [sys.executable, *arguments], cwd=tree, env=environment, capture_output=True, text=True, check=False
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
    return done.stdout


@pytest.mark.timeout(1500)
def test_one_declaration_and_one_use_make_an_option(tree: Path) -> None:
    run(tree, "-c", PROOF)
    assert "--dummy-share" in run(tree, "-m", "tiltvp", "tilt", "--help")
    row = "| `dummy_share` | Share that is kept less than `keep_fraction` says. | 0 |"
    assert row in run(tree, "-c", "import options_page; print(options_page.page())")
