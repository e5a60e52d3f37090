# The one place where a command is spelled. `just --list` shows all of them.

set shell := ["bash", "-euo", "pipefail", "-c"]

bin := ".venv/bin"
export PIP_DISABLE_PIP_VERSION_CHECK := "1"

# Lists the recipes.
default:
    @just --list

# The virtual environment with the package, built for speed, and the tools that develop it.
setup:
    test -x {{bin}}/python || python3 -m venv .venv
    {{bin}}/pip install --quiet --require-hashes --requirement requirements-dev.lock
    PATH="$PWD/{{bin}}:$PATH" {{bin}}/pip install --quiet --no-build-isolation --no-deps --editable .

# Sets up; a rendered room by every method, with pictures; then a robot's drive, from its recording to mounting, level video and MCAP.
demo *arguments: setup
    {{bin}}/tiltvp demo --overwrite {{arguments}}
    {{bin}}/tiltvp lab demo --overwrite

# Lints, the unit tests of the crates and the fast Python tests: for every round of change. It builds by the profile `quick`.
quick: quick-extension check
    PROPTEST_RNG_SEED=20171028 cargo test --locked --workspace --lib --quiet
    {{bin}}/pytest --quiet --numprocesses 2 --dist worksteal -m 'not slow'

# The extension as the profile `quick` builds it, in place of that of `setup`.
quick-extension:
    test -x {{bin}}/pytest || {{just_executable()}} setup
    cargo build --locked --quiet --profile quick --package tiltvp-py
    cmp --quiet target/quick/lib_core.so python/tiltvp/_core.abi3.so || cp target/quick/lib_core.so python/tiltvp/_core.abi3.so

# Sets up; checks and tests everything that needs neither data nor programs of the system.
test: setup check test-rust test-python

# Debian's chromium, valgrind and Xvfb, and the Tk of its Python, by apt-get, if they are not there.
system-programs:
    #!/usr/bin/env bash
    set -euo pipefail
    missing=""
    for name in chromium valgrind Xvfb; do command -v $name > /dev/null || missing="$missing ${name,,}"; done
    {{bin}}/python -c "import tkinter" 2> /dev/null || missing="$missing python3-tk"
    [ -z "$missing" ] || {{just_executable()}} install-packages $missing

# The only recipe that installs into the system: this, what the tests of the system want, and ViSP for `measure-visp`.
[private]
install-packages +packages:
    #!/usr/bin/env bash
    set -euo pipefail
    root=""
    [ "$(id -u)" = 0 ] || root=sudo
    echo "installing {{packages}}"
    $root apt-get update --quiet --quiet
    DEBIAN_FRONTEND=noninteractive $root apt-get install --quiet --quiet --yes --no-install-recommends {{packages}} > /dev/null

# Those are the page of a report, the window of `--show`, and what an image costs in instructions.
# The wheel in a bare environment, the notebooks, and the tests that want a browser, a screen and valgrind.
test-system *arguments: setup system-programs smoke notebooks
    {{bin}}/pytest --quiet --numprocesses 2 --dist loadfile tests/system {{arguments}}
    cargo test --locked --workspace --test instructions --quiet

# Runs the notebooks: each ends in assertions, and takes less than a minute of a quiet machine.
notebooks *arguments:
    rm -rf target/notebooks
    mkdir -p target/notebooks
    for name in notebooks/*.py; do {{bin}}/jupytext --quiet --to ipynb --output target/notebooks/$(basename $name .py).ipynb $name; done
    {{bin}}/pytest --quiet --numprocesses 2 --dist worksteal --nbmake --nbmake-timeout=300 --timeout=0 -p no:run-parallel {{arguments}} target/notebooks

# The pages of the site, with the notebooks' figures, in target/docs/html; a warning fails, and so does a link within that leads nowhere.
docs:
    {{bin}}/sphinx-build --quiet --fail-on-warning --keep-going --conf-dir docs --doctree-dir target/docs/doctrees . target/docs/html

# Pictures of the guides, of rooms that the package renders, in docs/images.
pictures *names: setup
    {{bin}}/python docs/pictures.py {{names}}

# Licences, duplicates, sources and advisories of the crates, by cargo-deny, which is built if it is not there.
deny *arguments:
    test -x target/tools/bin/cargo-deny || cargo install --quiet --locked --root target/tools cargo-deny
    target/tools/bin/cargo-deny check {{arguments}}

# What `cargo publish` would send to crates.io, each crate built from its package alone; nothing is sent. (It asks crates.io's index.)
crates *arguments:
    cargo publish --dry-run --locked --package tiltvp-kernels --package tiltvp-core {{arguments}}

# Not among the tests: it needs the target's standard library, `rustup target add aarch64-unknown-linux-gnu`.
# The core for 64-bit ARM, by the compiler alone.
check-aarch64:
    cargo check --locked --package tiltvp-core --target aarch64-unknown-linux-gnu

# Which kernels are vector code on 64-bit ARM: instructions, those of them on vectors, and the name.
vectors-aarch64:
    mkdir -p target
    cargo rustc --locked --release --package tiltvp-kernels --lib --target aarch64-unknown-linux-gnu -- --emit asm=target/aarch64.s -C codegen-units=1 -C debuginfo=0
    awk '/^_[A-Za-z0-9_$.]*:/ { name = $1 } /^\t[a-z]/ { all[name]++ } /[ ,]v[0-9]+\.(16b|8h|4s|2d|8b|4h|2s)/ { vector[name]++ } \
        END { for (name in vector) if (vector[name] >= 25) printf "%6d %6d  %s\n", all[name], vector[name], name }' target/aarch64.s | sort --key=2 --reverse --numeric-sort

# Formats and lints of both languages. (Types, stubs and layers are among the Python tests, the core's layers among the Rust ones.)
check:
    cargo fmt --all --check
    cargo clippy --locked --workspace --all-targets --quiet -- --deny warnings
    RUSTDOCFLAGS="--deny warnings" cargo doc --locked --quiet --no-deps --package tiltvp-kernels --package tiltvp-core --package tiltvp-synth
    {{bin}}/ruff check --quiet
    {{bin}}/ruff format --check --quiet

# The tests of the crates, their documentation's examples and the architecture, with the same random cases every time.
test-rust:
    PROPTEST_RNG_SEED=20171028 cargo test --locked --workspace --quiet

# The tests of the Python package, without real data, with the same random cases every time.
test-python *arguments:
    {{bin}}/pytest --quiet --numprocesses 2 --dist worksteal --hypothesis-seed=20171028 {{arguments}}

# The tests of properties, of both languages, with random cases of their own: run it now and then, mend what it finds.
test-random: setup
    cargo test --locked --workspace --quiet
    {{bin}}/pytest --quiet --hypothesis-seed=random tests/test_properties.py tests/test_common_direction.py tests/formats

# Keeps today's answers as those that tests/test_golden.py holds every later build to; read the change as a diff.
golden *groups: setup
    PYTHONPATH=tests {{bin}}/python -m golden {{groups}}

# Runs a measurement and keeps what it prints in docs/measured, which docs/measured.md is held to.
record recipe *arguments: setup
    {{bin}}/python tests/measured.py {{recipe}} {{arguments}}

# Writes docs/options.md from what the core declares.
options: setup
    {{bin}}/python tests/options_page.py

# Writes THIRD-PARTY-LICENSES, which wheels carry, from the crates in Cargo.lock.
licences:
    python3 crates/tiltvp-py/licences.py

# Writes the C header, from the sources of the C interface.
header:
    cargo test --locked --quiet --package tiltvp-capi --lib write_the_header -- --ignored

# Writes the stubs: that of the extension, from what Rust declares, and that of the cameras' constructors, from the core's lenses.
stub: setup
    #!/usr/bin/env bash
    set -euo pipefail
    introspection=target/tools/bin/pyo3-introspection
    test -x $introspection || cargo install --quiet --locked --root target/tools pyo3-introspection@0.30.1
    cargo build --locked --quiet --profile quick --package tiltvp-py --features stub
    cp target/quick/lib_core.so python/tiltvp/_core.abi3.so
    $introspection target/quick/lib_core.so _core target/stub
    {{bin}}/python crates/tiltvp-py/stub.py target/stub/__init__.pyi python/tiltvp/_core.pyi
    {{bin}}/python -m tiltvp.lenses
    {{bin}}/ruff check --fix --quiet --select I python/tiltvp/_core.pyi
    {{bin}}/ruff format --quiet python/tiltvp/_core.pyi python/tiltvp/lenses.pyi

# Hostile files, damaged files and states, full disks, kills: what SECURITY.md promises, in about five minutes of the processor.
survive *arguments: setup
    {{bin}}/pytest --quiet --numprocesses 2 --dist worksteal tests/survive {{arguments}}

# A robot's hours: cameras that are unplugged, clocks that are set back, disks that fill, Ctrl-C. Takes --minutes (default 60).
soak *arguments: setup
    {{bin}}/python tests/soak.py {{arguments}}

# What they find is in out/fuzz, what they have learned in the folders of it. atheris has an environment of its own, in target.
# Attacks on the readers of files, options and states, then on the core, which coverage guides: for an hour, or the given seconds.
survive-long seconds="3600": setup (fuzz seconds)
    test -x target/atheris/bin/python || {{bin}}/python -m venv target/atheris
    target/atheris/bin/pip install --quiet atheris==3.0.0
    PYTHONPATH="$PWD/python:$PWD/tests:$({{bin}}/python -c 'import sysconfig; print(sysconfig.get_path("purelib"))')" \
        target/atheris/bin/python tests/fuzz_readers.py out/fuzz/readers \
        -max_total_time=$(({{seconds}} / 2 + 1)) -timeout=5 -rss_limit_mb=1024 -artifact_prefix=out/fuzz/ -print_final_stats=1

# For the toolchain that alone has coverage and sanitizers: not installed by a recipe, as it takes a gigabyte.
[private]
nightly:
    @cargo +nightly --version > /dev/null 2>&1 || { echo "needs Rust's nightly toolchain: rustup toolchain install nightly" >&2; exit 1; }

# What cargo-fuzz would say to the compiler, but for the operands of comparisons, which take a third of the time: numbers are made of
# many bytes each, so that an operand is none of the bytes that made it.
coverage := "-Cpasses=sancov-module -Cllvm-args=-sanitizer-coverage-level=3 -Cllvm-args=-sanitizer-coverage-inline-8bit-counters \
    -Cllvm-args=-sanitizer-coverage-pc-table -Zsanitizer=address"

# Attacks on the core alone, by each file of fuzz/src/bin for as long, half of the given seconds in all. TILTVP_SIMD caps the vectors.
fuzz seconds="3600": nightly
    #!/usr/bin/env bash
    set -euo pipefail
    host=$(rustc --print host-tuple)
    RUSTFLAGS="{{coverage}}" cargo +nightly build --locked --release --manifest-path fuzz/Cargo.toml --target $host --target-dir target/fuzz
    targets=$(ls fuzz/src/bin | sed 's/[.]rs$//')
    # Less than ASan's defaults of freed memory that is kept, and of the stack that is walked at each allocation.
    export ASAN_OPTIONS=quarantine_size_mb=16:malloc_context_size=3
    for target in $targets; do
        mkdir -p out/fuzz/$target
        echo "== $target"
        target/fuzz/$host/release/$target out/fuzz/$target fuzz/corpus/$target -max_len=400 -timeout=20 -rss_limit_mb=2048 -verbosity=0 \
            -max_total_time=$(({{seconds}} / 2 / $(wc -w <<< $targets) + 1)) -artifact_prefix=out/fuzz/$target- -print_final_stats=1
    done

# Kernels and core are tested at each level of vectors that the machine has.
# The unit tests of kernels, core and C interface under AddressSanitizer; what runs on several threads under ThreadSanitizer.
sanitize: setup nightly
    #!/usr/bin/env bash
    set -euo pipefail
    host=$(rustc --print host-tuple)
    tests() { cargo +nightly test --locked --target $host --target-dir target/sanitize --quiet --lib "$@"; }
    export PROPTEST_RNG_SEED=20171028 PROPTEST_CASES=32 RUSTFLAGS="-Zsanitizer=address"
    for level in $({{bin}}/python -c 'import tiltvp._core; print(*tiltvp._core.SIMD_LEVELS)'); do
        echo "== AddressSanitizer, $level"
        TILTVP_BUILT_FOR=$level tests --package tiltvp-kernels --package tiltvp-core
    done
    echo "== AddressSanitizer, C interface"
    tests --package tiltvp-capi
    echo "== ThreadSanitizer"
    export RUSTFLAGS="-Zsanitizer=thread -Cunsafe-allow-abi-mismatch=sanitizer" TSAN_OPTIONS="suppressions=$PWD/fuzz/thread-sanitizer.supp"
    tests --package tiltvp-core --package tiltvp-capi --test determinism

# What is found is in out/mutants.out; `--in-place` changes the checkout and puts it back.
# Mutation testing of the core's tests, by cargo-mutants: tilt, selfcalib and corner; one in 64 mutants, or other `--shard`s.
mutants shard="0/64" *arguments:
    test -x target/tools/bin/cargo-mutants || cargo install --quiet --locked --root target/tools cargo-mutants
    PROPTEST_RNG_SEED=20171028 PROPTEST_CASES=32 CARGO_INCREMENTAL=1 target/tools/bin/cargo-mutants mutants \
        --in-place --baseline skip --timeout 120 --sharding round-robin --shard {{shard}} --output out {{arguments}}

# Those that `just mutants` has found to be missed, tested by the kept answers, which need the extension: two minutes each.
mutants-missed: setup
    PYTHONPATH=tests {{bin}}/python tests/missed_mutants.py

# The tests on real data, in the folder that TILTVP_DATA names.
test-real *arguments: setup
    {{bin}}/pytest --quiet --numprocesses 2 --dist worksteal tests/real_data {{arguments}}

# Every method on views of upright panoramas of known tilt, in the folder panos of TILTVP_DATA.
measure-panoramas *arguments: setup
    {{bin}}/tiltvp measure panoramas "$TILTVP_DATA/panos" {{arguments}}

# The vertical of views that look anywhere: pinhole and fisheye views of the panoramas, rolled and pitched.
measure-views *arguments: setup
    {{bin}}/tiltvp measure views "$TILTVP_DATA/panos" {{arguments}}

# The tables, how far covariance and confidence can be trusted, and the report. Remove out/database to begin anew.
# The paper's sweep on views of all panoramas of TILTVP_DATA and on rendered rooms, as they are and made harder.
measure-database *arguments: setup
    test -d out/database/panoramas || {{bin}}/tiltvp dataset render --panoramas "$TILTVP_DATA/panos" --out out/database/panoramas
    test -d out/database/rooms || {{bin}}/tiltvp dataset synth --rooms 18 --locations-per-room 2 --samples 2 --out out/database/rooms
    for name in panoramas rooms; do \
        test -d out/database/$name-degraded || {{bin}}/tiltvp dataset degrade out/database/$name --out out/database/$name-degraded; \
    done
    {{bin}}/tiltvp evaluate out/database/panoramas --sweep paper --out out/database/runs/panoramas {{arguments}}
    for name in rooms panoramas-degraded rooms-degraded; do \
        {{bin}}/tiltvp evaluate out/database/$name --sweep table3 --out out/database/runs/$name {{arguments}}; \
    done
    {{bin}}/tiltvp measure confidence out/database/runs/panoramas out/database/runs/rooms out/database/runs/panoramas-degraded out/database/runs/rooms-degraded
    {{bin}}/tiltvp measure scaling --overwrite --out out/database/runs/panoramas/scaling.parquet
    {{bin}}/tiltvp report out/database/runs/panoramas --overwrite --out out/database/report

# Each method on images that mislead, of the panoramas of TILTVP_DATA and of rendered rooms: how often it is wrong and sure.
measure-trust *arguments: setup
    test -e out/room-panoramas/INDEX.csv || {{bin}}/tiltvp dataset panoramas --out out/room-panoramas
    {{bin}}/tiltvp measure trust "$TILTVP_DATA/panos" out/room-panoramas {{arguments}}

# The robot's own body, painted into rendered drives and into views of the panoramas of TILTVP_DATA: how much of it is found.
measure-body *arguments: setup
    {{bin}}/tiltvp measure body "$TILTVP_DATA/panos" {{arguments}}

# Which way is up, the mounting with all extrinsics but the height, and the sense of turns, from rendered recordings of drives.
measure-mounting *arguments: setup
    {{bin}}/tiltvp measure mounting {{arguments}}

# Self-calibration on simulated logs that mislead: how often it is wrong and sure.
measure-trust-calibration *arguments: setup
    {{bin}}/tiltvp measure trust-calibration {{arguments}}

# The same from the pictures of rendered drives.
measure-trust-pictures *arguments: setup
    {{bin}}/tiltvp measure trust-pictures {{arguments}}

# What an evaluation costs over the number of images and over their pixels.
measure-scaling *arguments: setup
    {{bin}}/tiltvp measure scaling {{arguments}}

# The refined method on panoramas as they were taken, against an inertial sensor.
measure-inertial *arguments: setup
    {{bin}}/tiltvp measure inertial "$TILTVP_DATA/panos_theta_imu" {{arguments}}

# 360-degree panoramas made level, and times of levelling beside OpenCV's remapping.
measure-level *arguments: setup
    {{bin}}/tiltvp measure level "$TILTVP_DATA/panos" --inertial "$TILTVP_DATA/panos_theta_imu" {{arguments}}

# COLMAP's reconstructions of rendered rooms: how far their gravity is off, without our priors and with them.
measure-colmap *arguments: setup
    {{bin}}/tiltvp measure colmap {{arguments}}

# Planar-motion pose estimation over tilt in rendered rooms, without and with tilt correction.
measure-planar-pose *arguments: setup
    {{bin}}/tiltvp measure planar-pose {{arguments}}

# The options of the sampling loop against plain RANSAC, on the same panoramas and on rendered rooms.
measure-sampling *arguments: setup
    {{bin}}/tiltvp measure sampling "$TILTVP_DATA/panos" {{arguments}}

# Each method of edge pixels on every row, every second, third and fourth row of views of panoramas and rendered rooms.
measure-striding *arguments: setup
    {{bin}}/tiltvp measure striding "$TILTVP_DATA/panos" {{arguments}}

# Vertical lines found and followed on rendered drives, upright and leaning, against the paper's recognition rates.
measure-lines *arguments: setup
    {{bin}}/tiltvp measure lines {{arguments}}

# Two drives of 425 frames each, in whose frames every upright edge is known. Remove out/drives to begin anew.
drives: setup
    test -d out/drives/corridor || {{bin}}/tiltvp dataset drive --kind corridor --frames 425 --samples 2 --seed 7101 --out out/drives/corridor
    test -d out/drives/hall || {{bin}}/tiltvp dataset drive --kind hall --frames 425 --samples 2 --seed 7102 --out out/drives/hall

# The descriptor of vertical lines: figures 9 to 18 and 22 of Scaramuzza, Siegwart and Martinelli 2009, tables beside them, in out/descriptors.
measure-descriptors *arguments: drives
    {{bin}}/tiltvp measure descriptors out/drives/corridor out/drives/hall --overwrite --out out/descriptors {{arguments}}

# cv2 is that of opencv-contrib-python-headless, of the version that is installed without contrib, in a folder of its own.
# Our vertical lines against OpenCV's LSD and LBD on the same frames: times as ratios, and how well pairs are matched.
measure-line-peers *arguments: drives
    test -d out/peers/opencv-contrib || {{bin}}/pip install --quiet --no-deps --target out/peers/opencv-contrib \
        "opencv-contrib-python-headless==$({{bin}}/python -c 'from importlib.metadata import version; print(version("opencv-python-headless"))')"
    PYTHONPATH="$PWD/out/peers/opencv-contrib" {{bin}}/python benches/peers/line_segments.py out/drives/corridor out/drives/hall {{arguments}}

# Our straight edges against OpenCV's LSD on rendered rooms whose edges are known, and the picture of both, in out/segments.
measure-segments *arguments: setup
    {{bin}}/python benches/peers/segments.py --picture out/segments/beside-lsd.jpg {{arguments}}

# cv2 is that with contrib, as above; lu-vp-detect wants it too.
# The vertical of an image by us, by the paper's methods on OpenCV and NumPy, by LSD and FLD, and by lu-vp-detect.
measure-vertical-peers *arguments: setup
    test -d out/peers/vertical || {{bin}}/pip install --quiet --no-deps --target out/peers/vertical lu-vp-detect==1.0.4 \
        "opencv-contrib-python-headless==$({{bin}}/python -c 'from importlib.metadata import version; print(version("opencv-python-headless"))')"
    PYTHONPATH="$PWD/out/peers/vertical" {{bin}}/python benches/peers/vertical.py {{arguments}}

# Corners of a real cabinet and a real box: attitude against motion capture, sizes, smoothness.
measure-corners-real folder *arguments: setup
    {{bin}}/tiltvp measure corners-real {{folder}} --overwrite --overlay out/corners-real {{arguments}}

# The tracker's headers include those of OpenCV's modules.
# Corners of the real box beside ViSP's model-based tracker, which knows the box (Debian's ViSP, installed by apt-get if it is not there).
measure-visp folder: setup
    dpkg-query --show libvisp-mbt-dev libopencv-calib3d-dev libopencv-objdetect-dev > /dev/null 2>&1 || {{just_executable()}} install-packages \
        g++ libvisp-mbt-dev libvisp-io-dev libopencv-highgui-dev libopencv-calib3d-dev libopencv-video-dev libopencv-objdetect-dev
    mkdir -p out/peers
    g++ -O2 -std=c++17 -I/usr/include/opencv4 benches/peers/visp_tracker.cpp -o out/peers/visp_tracker -lvisp_mbt -lvisp_io -lvisp_core
    {{bin}}/python benches/peers/visp.py {{folder}} out/peers/visp_tracker

# Poses of corners: the closed form on random poses, and rendered sequences of a hand-held stereo pair, with plots.
measure-corners *arguments: setup
    {{bin}}/tiltvp measure corners --overwrite --out out/corners {{arguments}}

# Attitudes by one camera with gravity: facades, furniture, and the panoramas of TILTVP_DATA.
measure-corner-attitudes *arguments: setup
    {{bin}}/tiltvp measure corner-attitudes "$TILTVP_DATA/panos" {{arguments}}

# Round trips and Jacobians of the calibrations of TILTVP_DATA, as a table.
measure-cameras: setup
    {{bin}}/pytest --quiet --capture=no tests/real_data/test_camera_conformance.py

# Self-calibration on 1,000 simulated drives of each trajectory, and on the real logs in the folder odometry of TILTVP_DATA.
measure-calibration *arguments: setup
    {{bin}}/tiltvp measure calibration "$TILTVP_DATA/odometry" {{arguments}}

# Self-calibration from the pictures of rendered drives.
measure-calibration-images *arguments: setup
    {{bin}}/tiltvp measure calibration-images {{arguments}}

# Times of an image and of making its estimator, from 0.1 to 12 megapixels, with the exponent; a batch on one and on two threads.
measure-growth *arguments: setup
    {{bin}}/python benches/peers/growth.py {{arguments}}

# Each method's time as a ratio to OpenCV's pair of Scharr derivatives, in one process on one thread.
measure-time *arguments: setup
    {{bin}}/python benches/peers/scharr.py {{arguments}}

# A step of the self-calibration filters against a dense NumPy filter of the paper's equations, in one process.
measure-calibration-time *arguments: setup
    OPENBLAS_NUM_THREADS=1 {{bin}}/python benches/peers/calibration_filter.py {{arguments}}

# `tiltvp tilt --cluster` on two worker processes, of which one is killed: the table, and time over the number of images.
measure-cluster *arguments: setup
    {{bin}}/python benches/many_machines.py {{arguments}}

# What each constant of the core does when it is halved and doubled; paths of files or folders choose some of them.
measure-constants *arguments: setup
    {{bin}}/python benches/constants.py {{arguments}}

# The wheel is built if sources are newer than the last one. (It has a folder of its own: target/wheels has what `setup` makes, which
# only points to the sources.)
# Builds the wheel, installs it without extras into an environment of its own, and tries it there.
smoke:
    #!/usr/bin/env bash
    set -euo pipefail
    mkdir -p target/install
    newest() { find target/install -name 'tiltvp-*.whl' -printf '%T@ %p\n' | sort --numeric-sort | tail --lines=1 | cut --delimiter=' ' --fields=2; }
    wheel=$(newest)
    if [ -z "$wheel" ] || [ -n "$(find Cargo.toml Cargo.lock pyproject.toml crates python -name '*.*' -newer "$wheel" \
            ! -name '*.pyc' ! -name '*.so' -type f -print -quit)" ]; then
        PATH="$PWD/{{bin}}:$PATH" {{bin}}/maturin build --release --locked --quiet --out target/install
        wheel=$(newest)
    fi
    python3 -m venv --clear --without-pip out/install
    {{bin}}/pip --quiet --python out/install/bin/python install "$wheel"
    env --unset=PYTHONPATH out/install/bin/python -W error tests/smoke.py

# The steps of the Dockerfile as a script: its context, its build, its installation, its smoke test. No engine of containers is needed.
docker-steps:
    python3 tests/docker_steps.py

# The size of `pip install tiltvp` without extras, in an environment of its own, and the time of `import tiltvp`.
measure-install: smoke
    python3 benches/install.py out/install

# The benches of the core.
bench *arguments:
    cargo bench --locked --package tiltvp-benches {{arguments}}

# What every submission must pass, as .ci/run has it.
ci: test test-system test-real

# Writes formatted sources.
format:
    cargo fmt --all
    {{bin}}/ruff check --fix --quiet
    {{bin}}/ruff format --quiet

# Writes versions and hashes of what `setup` installs, for every platform and Python; with --upgrade the newest.
lock *arguments:
    test -x target/tools/uv/bin/uv || {{bin}}/pip install --quiet --target target/tools/uv uv
    target/tools/uv/bin/uv pip compile pyproject.toml --extra dev --universal --generate-hashes --no-annotate --quiet {{arguments}} \
        --custom-compile-command 'just lock' --output-file requirements-dev.lock
