# tiltvp for robots that want a container, with what reads recordings of ROS and the times of videos: docker build --tag tiltvp . &&
# docker run --rm --user "$(id -u)" --volume "$PWD:/data" tiltvp tilt ...
FROM rust:1-slim-bookworm AS build
RUN apt-get update --quiet --quiet && apt-get install --quiet --quiet --yes --no-install-recommends python3-venv
WORKDIR /source
COPY . .
RUN python3 -m venv /build && /build/bin/pip install --quiet "maturin>=1.9,<2" \
    && PATH="/build/bin:$PATH" maturin build --release --locked --out /wheels

FROM python:3.13-slim-bookworm
RUN --mount=type=bind,from=build,source=/wheels,target=/wheels pip install --no-cache-dir "$(echo /wheels/*.whl)[bags,video]"
RUN --mount=type=bind,source=tests/smoke.py,target=/smoke.py python /smoke.py
# Nobody's data is written by root.
RUN useradd --create-home robot
USER robot
WORKDIR /data
ENTRYPOINT ["tiltvp"]
CMD ["--help"]
