//! Where the pixels of a new image are in an old one: exactly at the corners of cells, interpolated where that is good enough.

use nalgebra::{Matrix3, Vector2, Vector3};

use crate::camera::{Camera, Model};

/// Pixels from one corner of a cell to the next: as many as the kernel works on together. Larger cells must be split in most of the
/// image, smaller ones cost more projections.
pub(super) const CELL: usize = 8;

/// Cells are split until they are so small; then each pixel is projected by itself.
const SMALLEST: usize = 2;

/// How far interpolation may be wrong, in pixels: a quarter of the bound that [`MAP_ERROR_PX`](super::MAP_ERROR_PX) promises, for the second
/// differences that tell it are those at a cell's corners, not within it.
const BEND_MAX_PX: f64 = 0.0125;

/// By how much more the map is taken to bend at the image's border than a cell's length before it: with it all lenses of the zoo stay
/// within the bound.
const BORDER: f64 = 4.0;

/// Rows of a panorama beside its poles where columns turn too fast for a grid to tell.
const POLE_PX: f64 = 2.0 * CELL as f64;

/// A rectangle of pixels of the new image, and the places of its corners: at its first pixel, and `reach` columns and rows from there.
#[derive(Debug, Clone, Copy)]
pub(super) struct Cell {
    pub(super) first: [usize; 2],
    pub(super) size: [usize; 2],
    pub(super) reach: [usize; 2],
    /// Left above, right above, left below, right below; in pixels of the old image, on one side of its seam.
    pub(super) corners: [Vector2<f64>; 4],
}

/// What is done with places.
pub(super) trait Sink {
    /// Pixels whose places are interpolated.
    fn cell(&mut self, cell: &Cell);
    /// A pixel with its exact place.
    fn pixel(&mut self, pixel: [usize; 2], place: Vector2<f64>);
}

/// Where directions are in the old image.
pub(super) struct Places<'a> {
    pub(super) camera: &'a Camera,
    /// Takes rays of the new image to those of the camera.
    pub(super) rotation: Matrix3<f64>,
    /// Columns after which the image begins anew, for panoramas.
    pub(super) period: Option<f64>,
}

impl<'a> Places<'a> {
    pub(super) fn new(camera: &'a Camera, rotation: Matrix3<f64>) -> Self {
        let is_round = matches!(camera.model(), Model::Equirectangular(_));
        Self { camera, rotation, period: is_round.then(|| f64::from(camera.width())) }
    }

    fn of(&self, ray: Option<Vector3<f64>>) -> Option<Vector2<f64>> {
        ray.and_then(|ray| self.camera.project(&(self.rotation * ray)))
    }

    /// From one place to another, the shorter way about a panorama.
    fn between(&self, from: &Vector2<f64>, to: &Vector2<f64>) -> Vector2<f64> {
        let mut way = to - from;
        if let Some(period) = self.period {
            way.x -= period * (way.x / period).round();
        }
        way
    }

    /// What a line through three places in equal steps is wrong by in the middle of a step, in pixels; in a panorama a column counts as
    /// much as it is wide there.
    fn bend(&self, three: [&Vector2<f64>; 3]) -> f64 {
        if self.is_polar(three[1]) {
            return f64::INFINITY;
        }
        let mut second = self.between(three[1], three[2]) - self.between(three[0], three[1]);
        if self.period.is_some() {
            let height = f64::from(self.camera.height());
            second.x *= (std::f64::consts::PI * ((three[1].y + 0.5) / height)).sin();
        }
        second.norm() / 8.0
    }

    /// Whether a place is beside a pole of a panorama.
    fn is_polar(&self, place: &Vector2<f64>) -> bool {
        let last = f64::from(self.camera.height()) - 1.0;
        self.period.is_some() && (place.y < POLE_PX || place.y > last - POLE_PX)
    }

    /// Four corners on one side of the seam: that of the first.
    fn together(&self, corners: [Vector2<f64>; 4]) -> [Vector2<f64>; 4] {
        corners.map(|corner| corners[0] + self.between(&corners[0], &corner))
    }
}

/// Where the corners of cells look, made once for an image: every [`CELL`] pixels, and the last column and row.
#[derive(Debug, Clone)]
pub(super) struct Corners {
    image: [usize; 2],
    counts: [usize; 2],
}

impl Corners {
    pub(super) fn new(image: [usize; 2]) -> Self {
        Self { image, counts: image.map(|side| side.div_ceil(CELL) + 1) }
    }

    /// The pixels at the corners, in row order.
    pub(super) fn pixels(&self) -> impl Iterator<Item = [usize; 2]> + '_ {
        let at = |axis: usize, i: usize| (i * CELL).min(self.image[axis] - 1);
        (0..self.counts[1]).flat_map(move |j| (0..self.counts[0]).map(move |i| [at(0, i), at(1, j)]))
    }

    /// Gives every cell or pixel that is seen to the sink. `corner_rays` are those of [`pixels`](Self::pixels), `ray` is that of any.
    pub(super) fn walk(
        &self,
        corner_rays: &[[f32; 3]],
        ray: &impl Fn([usize; 2]) -> Option<Vector3<f64>>,
        places: &Places<'_>,
        sink: &mut impl Sink,
    ) {
        let found = found_places(corner_rays, places);
        let bends = self.bends(&found, places);
        let [across, down] = self.counts;
        for (j, i) in (0..down - 1).flat_map(|j| (0..across - 1).map(move |i| (j, i))) {
            let at = j * across + i;
            let four = [at, at + 1, at + across, at + across + 1];
            let first = [i * CELL, j * CELL];
            let size = std::array::from_fn(|axis| CELL.min(self.image[axis] - first[axis]));
            let reach = std::array::from_fn(|axis| CELL.min(self.image[axis] - 1 - first[axis]).max(1));
            let bend = four.iter().map(|k| bends[*k]).fold(0.0, f64::max);
            let corners = four.map(|k| found[k]);
            let whole = corners.iter().all(|corner| corner.x.is_finite());
            if whole && bend <= BEND_MAX_PX {
                sink.cell(&Cell { first, size, reach, corners: places.together(corners) });
            } else if corners.iter().any(|corner| corner.x.is_finite()) || is_seen(ray, places, first, size) {
                let corners = corners.map(|corner| corner.x.is_finite().then_some(corner));
                split(first, size, (reach == size).then_some(corners), ray, places, sink);
            }
        }
    }

    /// By how much interpolation errs about each corner; infinite where neighbours do not tell.
    fn bends(&self, found: &[Vector2<f64>], places: &Places<'_>) -> Vec<f64> {
        let [across, down] = self.counts;
        let mut bends = vec![f64::INFINITY; found.len()];
        if across < 4 || down < 4 {
            return bends;
        }
        let (last_across, last_down) = (across - 3, down - 3);
        for (j, i) in (1..=last_down).flat_map(|j| (1..=last_across).map(move |i| (j, i))) {
            let at = j * across + i;
            let along = |step: usize| places.bend([&found[at - step], &found[at], &found[at + step]]);
            let bend = along(1) + along(across);
            bends[at] = if bend.is_nan() { f64::INFINITY } else { bend };
        }
        // At the border, whose last corners are nearer to one another, lenses bend more than where the next corners are.
        for (j, i) in (0..down).flat_map(|j| (0..across).map(move |i| (j, i))) {
            let next = j.clamp(1, last_down) * across + i.clamp(1, last_across);
            if next != j * across + i {
                bends[j * across + i] = BORDER * bends[next];
            }
        }
        bends
    }
}

/// Whether the middle of a cell of which no corner is seen is seen.
fn is_seen(
    ray: &impl Fn([usize; 2]) -> Option<Vector3<f64>>,
    places: &Places<'_>,
    first: [usize; 2],
    size: [usize; 2],
) -> bool {
    places.of(ray([first[0] + size[0] / 2, first[1] + size[1] / 2])).is_some()
}

/// Goes on with quarters of a cell if its corners, `size` apart, are given, and with its pixels if not.
fn split(
    first: [usize; 2],
    size: [usize; 2],
    corners: Option<[Option<Vector2<f64>>; 4]>,
    ray: &impl Fn([usize; 2]) -> Option<Vector3<f64>>,
    places: &Places<'_>,
    sink: &mut impl Sink,
) {
    let Some(corners) = corners.filter(|_| size[0] > SMALLEST) else {
        for (v, u) in (0..size[1]).flat_map(|v| (0..size[0]).map(move |u| (v, u))) {
            let pixel = [first[0] + u, first[1] + v];
            if let Some(place) = places.of(ray(pixel)) {
                sink.pixel(pixel, place);
            }
        }
        return;
    };
    let half = size[0] / 2;
    let mut nine = [[None; 3]; 3];
    for (j, i) in (0..3).flat_map(|j| (0..3).map(move |i| (j, i))) {
        nine[j][i] = match (j % 2, i % 2) {
            (0, 0) => corners[j + i / 2],
            _ => places.of(ray([first[0] + half * i, first[1] + half * j])),
        };
    }
    let is_flat = nine.as_flattened().iter().all(Option::is_some) && {
        let all = nine.map(|row| row.map(Option::unwrap_or_default));
        let across = all.iter().map(|[a, b, c]| places.bend([a, b, c])).fold(0.0, f64::max);
        let down = (0..3).map(|i| places.bend([&all[0][i], &all[1][i], &all[2][i]])).fold(0.0, f64::max);
        across + down <= BEND_MAX_PX
    };
    for (j, i) in [(0, 0), (0, 1), (1, 0), (1, 1)] {
        let four = [nine[j][i], nine[j][i + 1], nine[j + 1][i], nine[j + 1][i + 1]];
        let (first, size) = ([first[0] + half * i, first[1] + half * j], [half; 2]);
        match four {
            [Some(a), Some(b), Some(c), Some(d)] if is_flat => {
                sink.cell(&Cell { first, size, reach: size, corners: places.together([a, b, c, d]) });
            }
            [None, None, None, None] => {}
            _ => split(first, size, Some(four), ray, places, sink),
        }
    }
}

/// The places of corners, NaN where there is none.
fn found_places(rays: &[[f32; 3]], places: &Places<'_>) -> Vec<Vector2<f64>> {
    let turned: Vec<Vector3<f64>> =
        rays.iter().map(|ray| places.rotation * Vector3::from(ray.map(f64::from))).collect();
    let mut found = vec![Vector2::zeros(); turned.len()];
    // Both are as long as there are corners.
    let _ = places.camera.project_all(&turned, &mut found);
    found
}
