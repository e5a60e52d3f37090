//! Where the pixels of a new image are in an old one: exactly at the corners of cells, interpolated where that is good enough.

use nalgebra::{Matrix3, Vector2, Vector3};

use super::surface::Surface;
use crate::camera::{Camera, Model};

/// Pixels from one corner of a cell to the next: 1,271 corners are projected for a 640 x 480 image. With 8 pixels they are 4,941;
/// larger cells were not tried.
pub(super) const CELL: usize = 16;

/// Cells are split until they are so small; then each pixel is projected by itself.
const SMALLEST: usize = 4;

/// How far interpolation may be wrong, in pixels: a quarter of the bound that [`MAP_ERROR_PX`](super::MAP_ERROR_PX) promises, for what
/// tells it are differences at a cell's corners, or two of its places.
const BEND_MAX_PX: f64 = 0.0125;

/// How far wrong differences may say that it is where two places say that it is right. With twice as much, maps of lenses that fold are
/// wrong by more than is promised (`maps_are_as_exact_as_they_say`).
const FITTING_PX: f64 = 4.0 * BEND_MAX_PX;

/// Beyond such errors differences do not tell those of smaller cells: without a limit two places were right and others 4 px off.
const TOLD_PX: f64 = 8.0 * FITTING_PX;

/// Part of a third difference that interpolation by second differences (Bessel's) is taken to be wrong by. It is 1/125 where fourth ones
/// are nothing.
const OF_THIRD: f64 = 1.0 / 32.0;

/// Part of that error that one of half the size has, an eighth of the third difference, by second differences of one end (1/16 of it).
const OF_HALF: f64 = 0.25;

/// By how much more the map is taken to bend at the image's border than a cell's length before it: with it all lenses of the zoo stay
/// within the bound.
const BORDER: f64 = 4.0;

/// Rows of a panorama beside its poles where columns turn too fast for a grid to tell. With half as many a map was 0.054 px off.
const POLE_PX: f64 = 8.0;

/// A rectangle of pixels of the new image, and where they are in the old one: in its pixels, on one side of its seam.
#[derive(Debug, Clone, Copy)]
pub(super) struct Cell {
    pub(super) first: [usize; 2],
    pub(super) size: [usize; 2],
    pub(super) places: Surface,
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

    /// The second difference over a step of three places, of which the last is `last` steps from the middle one.
    fn second(&self, three: [&Vector2<f64>; 3], last: f64) -> Vector2<f64> {
        (self.between(three[1], three[2]) / last - self.between(three[0], three[1])) * (2.0 / (1.0 + last))
    }

    /// How long a difference is in pixels; in a panorama a column counts as much as it is wide there.
    fn length(&self, mut difference: Vector2<f64>, at: &Vector2<f64>) -> f64 {
        if self.period.is_some() {
            let height = f64::from(self.camera.height());
            difference.x *= (std::f64::consts::PI * ((at.y + 0.5) / height)).sin();
        }
        difference.norm()
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
        let [across, down] = [0, 1].map(|axis| self.differences(axis, &found, places));
        let [columns, rows] = self.counts;
        for (j, i) in (0..rows - 1).flat_map(|j| (0..columns - 1).map(move |i| (j, i))) {
            let at = j * columns + i;
            let [a, b, c, d] = [at, at + 1, at + columns, at + columns + 1];
            let first = [i * CELL, j * CELL];
            let size = std::array::from_fn(|axis| CELL.min(self.image[axis] - first[axis]));
            let reach = std::array::from_fn(|axis| CELL.min(self.image[axis] - 1 - first[axis]).max(1));
            let corners = [a, b, c, d].map(|k| found[k]);
            let error = across.errors[a].max(across.errors[c]) + down.errors[a].max(down.errors[b]);
            let is_own = across.is_own[a] && across.is_own[c] && down.is_own[a] && down.is_own[b];
            let whole = corners.iter().all(|corner| corner.x.is_finite() && !places.is_polar(corner));
            let surface = whole.then(|| {
                let corners = places.together(corners);
                Surface::new(
                    corners,
                    across.over([[a, b], [c, d]], reach[0]),
                    down.over([[a, c], [b, d]], reach[1]),
                    reach,
                )
            });
            let surface = surface.filter(|surface| {
                (is_own && error <= BEND_MAX_PX) || (error <= FITTING_PX && fits(surface, first, size, ray, places))
            });
            if let Some(places) = surface {
                sink.cell(&Cell { first, size, places });
            } else if corners.iter().any(|corner| corner.x.is_finite()) || is_seen(ray, places, first, size) {
                let corners = corners.map(|corner| corner.x.is_finite().then_some(corner));
                let error = if is_own && error <= TOLD_PX { OF_HALF * error } else { f64::INFINITY };
                split(first, size, (reach == size).then_some(corners), error, ray, places, sink);
            }
        }
    }

    /// How places bend from corner to corner along an axis.
    fn differences(&self, axis: usize, found: &[Vector2<f64>], places: &Places<'_>) -> Differences {
        let count = self.counts[axis];
        let (stride, next) = if axis == 0 { (1, self.counts[0]) } else { (self.counts[0], 1) };
        let mut made = Differences {
            seconds: vec![Vector2::repeat(f64::NAN); found.len()],
            errors: vec![f64::INFINITY; found.len()],
            is_own: vec![false; found.len()],
        };
        let (mut seconds, mut errors) = (vec![Vector2::zeros(); count], vec![0.0; count]);
        for line in 0..self.counts[1 - axis] {
            let at = |k: usize| line * next + k * stride;
            seconds.fill(Vector2::repeat(f64::NAN));
            errors.fill(f64::NAN);
            for k in 1..count.saturating_sub(1) {
                seconds[k] = places.second([&found[at(k - 1)], &found[at(k)], &found[at(k + 1)]], self.step(axis, k));
            }
            for k in 1..count.saturating_sub(2) {
                errors[k] = OF_THIRD * places.length(seconds[k + 1] - seconds[k], &found[at(k)]);
            }
            for k in 0..count {
                let nearest = |is_known: &dyn Fn(usize) -> bool| {
                    [k, k + 1, k.wrapping_sub(1), k + 2, k.wrapping_sub(2)]
                        .into_iter()
                        .find(|k| *k < count && is_known(*k))
                };
                if let Some(known) = nearest(&|k| seconds[k].x.is_finite()) {
                    made.seconds[at(k)] = seconds[known];
                }
                let both = k + 1 < count && found[at(k)].x.is_finite() && found[at(k + 1)].x.is_finite();
                if both && let Some(known) = nearest(&|k| errors[k].is_finite()) {
                    made.errors[at(k)] = if known == k { errors[k] } else { BORDER * errors[known] };
                    made.is_own[at(k)] = known == k;
                }
            }
        }
        made
    }

    /// Pixels from a corner to the next along an axis, in [`CELL`]s: fewer for the last.
    fn step(&self, axis: usize, k: usize) -> f64 {
        (self.image[axis] - 1 - k * CELL).min(CELL) as f64 / CELL as f64
    }
}

/// Differences between the corners of cells along an axis.
struct Differences {
    /// Second ones at each corner: its own, or where it has no neighbours those of the nearest that has.
    seconds: Vec<Vector2<f64>>,
    /// By how much interpolation with them errs from each corner to the next, in pixels; infinite where nothing tells.
    errors: Vec<f64>,
    /// Whether that is of this step, not of one beside it.
    is_own: Vec<bool>,
}

impl Differences {
    /// Mean second differences of two pairs of corners, over so many pixels.
    fn over(&self, pairs: [[usize; 2]; 2], reach: usize) -> [Vector2<f64>; 2] {
        let half = 0.5 * (reach as f64 / CELL as f64).powi(2);
        pairs.map(|[one, other]| (self.seconds[one] + self.seconds[other]) * half)
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

/// Goes on with quarters of a cell if its corners, `size` apart, are given, and with its pixels if not. `error` is what interpolation over
/// quarters is wrong by, infinite if that is not known.
fn split(
    first: [usize; 2],
    size: [usize; 2],
    corners: Option<[Option<Vector2<f64>>; 4]>,
    error: f64,
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
    let second = |three: [Option<Vector2<f64>>; 3]| match three {
        [Some(a), Some(b), Some(c)] if !places.is_polar(&b) => Some(places.second([&a, &b, &c], 1.0)),
        _ => None,
    };
    let (across, down) = (nine.map(second), [0, 1, 2].map(|i| second([nine[0][i], nine[1][i], nine[2][i]])));
    for (j, i) in [(0, 0), (0, 1), (1, 0), (1, 1)] {
        let four = [nine[j][i], nine[j][i + 1], nine[j + 1][i], nine[j + 1][i + 1]];
        let (first, size) = ([first[0] + half * i, first[1] + half * j], [half; 2]);
        let surface = match (four, [across[j], across[j + 1], down[i], down[i + 1]]) {
            ([Some(a), Some(b), Some(c), Some(d)], [Some(above), Some(below), Some(left), Some(right)]) => {
                let surface = Surface::new(places.together([a, b, c, d]), [above, below], [left, right], size);
                let bend =
                    [above, below, left, right].iter().map(|bend| places.length(*bend, &a) / 8.0).fold(0.0, f64::max);
                (error.min(bend) <= FITTING_PX && fits(&surface, first, size, ray, places)).then_some(surface)
            }
            _ => None,
        };
        match surface {
            Some(places) => sink.cell(&Cell { first, size, places }),
            None if four.iter().all(Option::is_none) => {}
            None => split(first, size, Some(four), error / 8.0, ray, places, sink),
        }
    }
}

/// Whether a surface is where two pixels are, at which no errors of a third difference across and one down cancel each other.
fn fits(
    surface: &Surface,
    first: [usize; 2],
    size: [usize; 2],
    ray: &impl Fn([usize; 2]) -> Option<Vector3<f64>>,
    places: &Places<'_>,
) -> bool {
    let [across, down] = size.map(|side| side / 4);
    [[across, down], [size[0] - across, down]].into_iter().all(|[column, row]| {
        let column = column.min(size[0] - 1);
        places.of(ray([first[0] + column, first[1] + row])).is_some_and(|exact| {
            let found = surface.at([column, row]);
            places.length(places.between(&found, &exact), &exact) <= BEND_MAX_PX
        })
    })
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
