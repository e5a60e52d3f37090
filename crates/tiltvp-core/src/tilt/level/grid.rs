//! Where the pixels of a new image are in an old one: exactly at the corners of cells, interpolated where that is good enough.

use std::ops::Range;

use nalgebra::{Matrix3, Vector2, Vector3};

use super::shown::Shown;
use super::strip::{Limit, Strip};
use super::surface::{CELL, Cell, Surface};
use crate::camera::{Camera, Model};

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

/// Where directions are in the old image.
#[derive(Debug, Clone, Copy)]
pub(super) struct Places<'a> {
    camera: &'a Camera,
    /// Takes rays of the new image to those of the camera.
    rotation: Matrix3<f64>,
    /// Columns after which the image begins anew, for panoramas.
    period: Option<f64>,
    /// Of the camera's field of view, in the frame of the new image.
    limit: Option<Limit>,
}

impl<'a> Places<'a> {
    pub(super) fn new(camera: &'a Camera, rotation: Matrix3<f64>) -> Self {
        let is_round = matches!(camera.model(), Model::Equirectangular(_));
        let limit = camera.limit().map(|(axis, least)| Limit { axis: rotation.transpose() * axis, least });
        Self { camera, rotation, period: is_round.then(|| f64::from(camera.width())), limit }
    }

    /// Where a ray is, or would be without the limit of the field of view.
    fn of(&self, ray: Option<Vector3<f64>>) -> Option<Vector2<f64>> {
        ray.and_then(|ray| self.camera.project_unlimited(&(self.rotation * ray)))
    }

    /// Whether a ray is within the limit of the field of view.
    fn sees(&self, ray: Option<Vector3<f64>>) -> bool {
        ray.is_some_and(|ray| self.limit.is_none_or(|limit| limit.sees(&ray)))
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
    /// In row order, and whether they are shown; none also where no cell nearby is shown.
    rays: Vec<(Option<Vector3<f64>>, bool)>,
}

impl Corners {
    pub(super) fn new(shown: &Shown) -> Self {
        let (image, counts) = (shown.size, shown.size.map(|side| side.div_ceil(CELL) + 1));
        let mut made = Self { image, counts, rays: Vec::new() };
        let corner = |axis: usize, i: usize| (i * CELL).min(image[axis] - 1);
        let lattice = || pixels([0; 2], counts);
        let is_shown: Vec<_> = lattice().map(|[i, j]| shown.ray([corner(0, i), corner(1, j)]).is_some()).collect();
        let cells = made.seen(&is_shown, |middle| shown.ray(middle).is_some());
        // Differences of a cell are told by corners up to one beyond its own.
        let is_needed = |[i, j]: [usize; 2]| {
            let near = |k: usize, count: usize| k.saturating_sub(2)..(k + 2).min(count - 1);
            near(j, counts[1]).any(|j| cells[j * (counts[0] - 1)..][near(i, counts[0])].iter().any(|seen| *seen > 0))
        };
        let rays = lattice().zip(is_shown).map(|([i, j], is_shown)| {
            let ray = is_needed([i, j]).then(|| shown.unlimited_ray([corner(0, i), corner(1, j)]));
            (ray.flatten(), is_shown)
        });
        made.rays = rays.collect();
        made
    }

    /// How many corners of each cell are seen, of the cells in row order; one, where none is and the middle of the cell is.
    fn seen(&self, corners: &[bool], middle_is_seen: impl Fn([usize; 2]) -> bool) -> Vec<u8> {
        let cells = pixels([0; 2], self.counts.map(|count| count - 1));
        let seen = cells.map(|cell| {
            let count = self.corners(cell).iter().map(|k| u8::from(corners[*k])).sum();
            let middle = [0, 1].map(|axis| cell[axis] * CELL + self.side(axis, cell[axis]) / 2);
            if count == 0 { u8::from(middle_is_seen(middle)) } else { count }
        });
        seen.collect()
    }

    /// Left above, right above, left below, right below.
    fn corners(&self, [i, j]: [usize; 2]) -> [usize; 4] {
        let at = j * self.counts[0] + i;
        [at, at + 1, at + self.counts[0], at + self.counts[0] + 1]
    }

    /// Pixels of a cell along an axis.
    fn side(&self, axis: usize, k: usize) -> usize {
        CELL.min(self.image[axis] - k * CELL)
    }

    /// Where the corners are and how places bend between them.
    pub(super) fn found(&self, shown: &Shown, places: &Places<'_>) -> Found {
        let corners: Vec<_> =
            self.rays.iter().map(|(ray, _)| places.of(*ray).unwrap_or(Vector2::repeat(f64::NAN))).collect();
        let is_seen: Vec<_> = self.rays.iter().map(|(ray, is_shown)| *is_shown && places.sees(*ray)).collect();
        let seen = self.seen(&is_seen, |middle| places.sees(shown.ray(middle)));
        let differences = [0, 1].map(|axis| self.differences(axis, &corners, places));
        Found { corners, seen, differences }
    }

    /// Writes the places of the pixels of a strip in the columns that are returned: all that is seen is in them.
    pub(super) fn write(
        &self,
        found: &Found,
        shown: &Shown,
        places: &Places<'_>,
        strip: &mut Strip<'_>,
    ) -> Range<usize> {
        let (rows, across) = (strip.rows(), self.counts[0] - 1);
        let cells = rows.start / CELL..rows.end.div_ceil(CELL);
        let seen = |j: usize| &found.seen[j * across..][..across];
        let is_seen = |i: &usize| cells.clone().any(|j| seen(j)[*i] > 0);
        let Some((first, last)) = (0..across).find(is_seen).zip((0..across).rfind(is_seen)) else { return 0..0 };
        let columns = first * CELL..last * CELL + self.side(0, last);
        for j in cells {
            let (v, height) = (j * CELL, self.side(1, j));
            let mut written = columns.start;
            for i in (first..=last).filter(|i| seen(j)[*i] > 0) {
                let (u, width) = (i * CELL, self.side(0, i));
                if written < u {
                    strip.clear([written, v], [u - written, height]);
                }
                written = u + width;
                self.write_cell(found, [i, j], shown, places, strip);
                if seen(j)[i] < 4 {
                    strip.keep([u, v], [width, height], places.limit, shown);
                }
            }
            strip.clear([written, v], [columns.end - written, height]);
        }
        columns
    }

    /// Writes the places of the pixels of a cell.
    fn write_cell(&self, found: &Found, cell: [usize; 2], shown: &Shown, places: &Places<'_>, strip: &mut Strip<'_>) {
        let ([a, b, c, d], [across, down]) = (self.corners(cell), &found.differences);
        let (first, size) = (cell.map(|k| k * CELL), [0, 1].map(|axis| self.side(axis, cell[axis])));
        let reach = std::array::from_fn(|axis| CELL.min(self.image[axis] - 1 - first[axis]).max(1));
        let corners = [a, b, c, d].map(|k| found.corners[k]);
        let error = across.errors[a].max(across.errors[c]) + down.errors[a].max(down.errors[b]);
        let is_own = across.is_own[a] && across.is_own[c] && down.is_own[a] && down.is_own[b];
        let whole = corners.iter().all(|corner| corner.x.is_finite() && !places.is_polar(corner));
        let surface = whole.then(|| {
            let corners = places.together(corners);
            Surface::new(corners, across.over([[a, b], [c, d]], reach[0]), down.over([[a, c], [b, d]], reach[1]), reach)
        });
        let surface = surface.filter(|surface| {
            (is_own && error <= BEND_MAX_PX) || (error <= FITTING_PX && fits(surface, first, size, shown, places))
        });
        if let Some(places) = surface {
            strip.cell(&Cell { first, size, places });
        } else {
            strip.clear(first, size);
            let corners = corners.map(|corner| corner.x.is_finite().then_some(corner));
            let error = if error <= TOLD_PX { OF_HALF * error } else { f64::INFINITY };
            split(&Part { first, size, reach, corners, error }, shown, places, strip);
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
                if let Some(known) = nearest(k, &seconds, |second| second.x.is_finite()) {
                    made.seconds[at(k)] = seconds[known];
                }
                let both = k + 1 < count && found[at(k)].x.is_finite() && found[at(k + 1)].x.is_finite();
                if both && let Some(known) = nearest(k, &errors, |error| error.is_finite()) {
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

/// The place of what is known, at most two beside one place.
fn nearest<T>(k: usize, values: &[T], is_known: impl Fn(&T) -> bool) -> Option<usize> {
    [k, k + 1, k.wrapping_sub(1), k + 2, k.wrapping_sub(2)].into_iter().find(|k| values.get(*k).is_some_and(&is_known))
}

/// What is made once of all corners for a tilt.
#[derive(Debug, Clone)]
pub(super) struct Found {
    /// The places of corners, or where they would be without limits of fields of view; NaN where there is none.
    corners: Vec<Vector2<f64>>,
    /// How many corners of each cell are within the fields of view of both images; see [`Corners::seen`].
    seen: Vec<u8>,
    differences: [Differences; 2],
}

/// Differences between the corners of cells along an axis.
#[derive(Debug, Clone)]
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

/// Those of a rectangle in row order.
fn pixels(first: [usize; 2], size: [usize; 2]) -> impl Iterator<Item = [usize; 2]> {
    (0..size[1]).flat_map(move |v| (0..size[0]).map(move |u| [first[0] + u, first[1] + v]))
}

/// A cell, or a part of one, that is to be split.
struct Part {
    first: [usize; 2],
    size: [usize; 2],
    /// From its first to its last corners: as many pixels as its size, or at the border of the image one less.
    reach: [usize; 2],
    corners: [Option<Vector2<f64>>; 4],
    /// What interpolation over its quarters is wrong by, infinite if that is not known.
    error: f64,
}

/// Goes on with the quarters of a part, in the end with its pixels.
fn split(part: &Part, shown: &Shown, places: &Places<'_>, strip: &mut Strip<'_>) {
    if part.size.iter().any(|side| *side <= SMALLEST) {
        for pixel in pixels(part.first, part.size) {
            if let Some(place) = places.of(shown.ray(pixel)) {
                strip.pixel(pixel, place);
            }
        }
        return;
    }
    let halves = part.reach.map(|reach| [reach.div_ceil(2), reach / 2]);
    let at = |axis: usize, k: usize| part.first[axis] + halves[axis][..k].iter().sum::<usize>();
    let mut nine = [[None; 3]; 3];
    for (j, i) in (0..3).flat_map(|j| (0..3).map(move |i| (j, i))) {
        nine[j][i] = match (j % 2, i % 2) {
            (0, 0) => part.corners[j + i / 2],
            _ => places.of(shown.unlimited_ray([at(0, i), at(1, j)])),
        };
    }
    // Of each axis, the second half over the first one.
    let last = halves.map(|[first, second]| second as f64 / first as f64);
    let second = |axis: usize, three: [Option<Vector2<f64>>; 3]| match three {
        [Some(a), Some(b), Some(c)] if !places.is_polar(&b) => Some(places.second([&a, &b, &c], last[axis])),
        _ => None,
    };
    let across = nine.map(|three| second(0, three));
    let down = [0, 1, 2].map(|i| second(1, [nine[0][i], nine[1][i], nine[2][i]]));
    for (j, i) in [(0, 0), (0, 1), (1, 0), (1, 1)] {
        let four = [nine[j][i], nine[j][i + 1], nine[j + 1][i], nine[j + 1][i + 1]];
        let (first, reach) = ([at(0, i), at(1, j)], [halves[0][i], halves[1][j]]);
        let size = [0, 1].map(|axis| if [i, j][axis] == 0 { reach[axis] } else { part.size[axis] - halves[axis][0] });
        let surface = match (four, [across[j], across[j + 1], down[i], down[i + 1]]) {
            ([Some(a), Some(b), Some(c), Some(d)], [Some(above), Some(below), Some(left), Some(right)]) => {
                let over = |axis: usize, pair: [Vector2<f64>; 2]| {
                    pair.map(|second| second * if [i, j][axis] == 0 { 1.0 } else { last[axis].powi(2) })
                };
                let corners = places.together([a, b, c, d]);
                let surface = Surface::new(corners, over(0, [above, below]), over(1, [left, right]), reach);
                let bend =
                    [above, below, left, right].iter().map(|bend| places.length(*bend, &a) / 8.0).fold(0.0, f64::max);
                (part.error.min(bend) <= FITTING_PX && fits(&surface, first, size, shown, places)).then_some(surface)
            }
            _ => None,
        };
        match surface {
            Some(places) => strip.cell(&Cell { first, size, places }),
            None if four.iter().all(Option::is_none) => {}
            None => {
                let quarter = Part { first, size, reach, corners: four, error: part.error / 8.0 };
                split(&quarter, shown, places, strip);
            }
        }
    }
}

/// Whether a surface is where two pixels are, at which no errors of a third difference across and one down cancel each other.
fn fits(surface: &Surface, first: [usize; 2], size: [usize; 2], shown: &Shown, places: &Places<'_>) -> bool {
    let [across, down] = size.map(|side| side / 4);
    [[across, down], [size[0] - across, down]].into_iter().all(|[column, row]| {
        let column = column.min(size[0] - 1);
        places.of(shown.unlimited_ray([first[0] + column, first[1] + row])).is_some_and(|exact| {
            let found = surface.at([column, row]);
            places.length(places.between(&found, &exact), &exact) <= BEND_MAX_PX
        })
    })
}
