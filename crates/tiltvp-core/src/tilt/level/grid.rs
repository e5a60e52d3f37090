//! Where the pixels of a new image are in an old one: exactly at the corners of cells, interpolated where that is good enough.

use std::ops::Range;

use nalgebra::{Vector2, Vector3};

use super::parts::{BEND_MAX_PX, FITTING_PX, OF_HALF, Part, fits, pixels, split};
use super::places::{Places, is_panorama};
use super::shown::Shown;
use super::strip::Strip;
use super::surface::{CELL, Cell, PANORAMA_CELL, Surface};
use crate::camera::Camera;

/// Beyond such errors differences do not tell those of smaller cells: without a limit places that were looked at were right and others 4 px
/// off. With a quarter of it the map of a panorama takes a sixth longer.
const TOLD_PX: f64 = 32.0 * FITTING_PX;

/// Part of a fourth difference that interpolation by Everett's formula is taken to be wrong by. It is 3/128 where fifth ones are nothing.
const OF_FOURTH: f64 = 1.0 / 16.0;

/// Part of the second difference down of second differences across that straight interpolation between opposite sides is wrong by, an eighth
/// for each.
const OF_MIXED: f64 = 1.0 / 64.0;

/// By how much more the map is taken to bend at the image's border than a cell's length before it: with it all lenses of the zoo stay
/// within the bound.
const BORDER: f64 = 4.0;

/// Pixels along each side of a cell that are looked at where none of its corners is seen: not farther apart than 8.
const LOOKED_AT: usize = 5;

/// Where the corners of cells look, made once for an image: every so many pixels, and the last column and row.
#[derive(Debug, Clone)]
pub(super) struct Corners {
    image: [usize; 2],
    /// Pixels from one to the next along a row or a column.
    cell: usize,
    counts: [usize; 2],
    /// In row order, and whether they are shown; none also where no cell nearby is shown.
    rays: Vec<(Option<Vector3<f64>>, bool)>,
    /// How many corners of each cell are shown: see [`Self::seen`].
    shown: Vec<u8>,
}

impl Corners {
    pub(super) fn new(shown: &Shown, camera: &Camera) -> Self {
        let cell = if is_panorama(camera) { PANORAMA_CELL } else { CELL };
        let (image, counts) = (shown.size, shown.size.map(|side| side.div_ceil(cell) + 1));
        let mut made = Self { image, cell, counts, rays: Vec::new(), shown: Vec::new() };
        let corner = |axis: usize, i: usize| (i * cell).min(image[axis] - 1);
        let lattice = || pixels([0; 2], counts);
        let is_shown: Vec<_> = lattice().map(|[i, j]| shown.ray([corner(0, i), corner(1, j)]).is_some()).collect();
        made.shown = made.seen(&is_shown, |cell| {
            let (first, size) = made.pixels(cell);
            pixels(first, size).any(|pixel| shown.ray(pixel).is_some())
        });
        // Differences of a cell are told by corners up to two beyond its own.
        let is_needed = |[i, j]: [usize; 2]| {
            let near = |k: usize, count: usize| k.saturating_sub(3)..(k + 3).min(count - 1);
            near(j, counts[1])
                .any(|j| made.shown[j * (counts[0] - 1)..][near(i, counts[0])].iter().any(|seen| *seen > 0))
        };
        let rays = lattice().zip(is_shown).map(|([i, j], is_shown)| {
            let ray = is_needed([i, j]).then(|| shown.unlimited_ray([corner(0, i), corner(1, j)]));
            (ray.flatten(), is_shown)
        });
        made.rays = rays.collect();
        made
    }

    /// How many corners of each cell are seen, in row order; one, where none is and another of its pixels.
    fn seen(&self, corners: &[bool], is_seen: impl Fn([usize; 2]) -> bool) -> Vec<u8> {
        let cells = pixels([0; 2], self.counts.map(|count| count - 1));
        let seen = cells.map(|cell| {
            let count = self.corners(cell).iter().map(|k| u8::from(corners[*k])).sum();
            if count == 0 { u8::from(is_seen(cell)) } else { count }
        });
        seen.collect()
    }

    /// The same of the cells that are shown, where the camera may see some of their pixels: what is seen of a cell without a corner reaches
    /// into it from one beside it, or is looked for.
    fn seen_by(&self, corners: &[bool], shown: &Shown, places: &Places<'_>) -> Vec<u8> {
        let [columns, rows] = self.counts.map(|count| count - 1);
        let is_shown = |[i, j]: [usize; 2]| self.shown[j * columns + i] > 0;
        let mut seen = self.seen(corners, |cell| {
            let (first, size) = self.pixels(cell);
            let at = |axis: usize, k: usize| first[axis] + k * (size[axis] - 1) / (LOOKED_AT - 1);
            is_shown(cell) && pixels([0; 2], [LOOKED_AT; 2]).any(|[i, j]| places.sees(shown.ray([at(0, i), at(1, j)])))
        });
        if seen.iter().all(|count| *count == 0) {
            // Hardly anything is seen, or nothing.
            seen = self.seen(corners, |cell| {
                let (first, size) = self.pixels(cell);
                is_shown(cell) && pixels(first, size).any(|pixel| places.sees(shown.ray(pixel)))
            });
        }
        let beside = |k: usize, count: usize| k.saturating_sub(1)..(k + 2).min(count);
        let reached: Vec<_> = pixels([0; 2], [columns, rows])
            .filter(|[i, j]| seen[j * columns + i] == 0 && is_shown([*i, *j]))
            .filter(|[i, j]| {
                beside(*j, rows).any(|j| seen[j * columns..][beside(*i, columns)].iter().any(|seen| *seen > 0))
            })
            .collect();
        for [i, j] in reached {
            seen[j * columns + i] = 1;
        }
        seen
    }

    /// The first pixel of a cell, and how many it has along each axis.
    fn pixels(&self, cell: [usize; 2]) -> ([usize; 2], [usize; 2]) {
        (cell.map(|k| k * self.cell), [0, 1].map(|axis| self.side(axis, cell[axis])))
    }

    /// Left above, right above, left below, right below.
    fn corners(&self, [i, j]: [usize; 2]) -> [usize; 4] {
        let at = j * self.counts[0] + i;
        [at, at + 1, at + self.counts[0], at + self.counts[0] + 1]
    }

    /// Pixels of a cell along an axis.
    fn side(&self, axis: usize, k: usize) -> usize {
        self.cell.min(self.image[axis] - k * self.cell)
    }

    /// Where the corners are and how places bend between them.
    pub(super) fn found(&self, shown: &Shown, places: &Places<'_>) -> Found {
        let corners: Vec<_> =
            self.rays.iter().map(|(ray, _)| places.of(*ray).unwrap_or(Vector2::repeat(f64::NAN))).collect();
        let is_seen: Vec<_> = self.rays.iter().map(|(ray, is_shown)| *is_shown && places.sees(*ray)).collect();
        let seen = self.seen_by(&is_seen, shown, places);
        let differences = [0, 1].map(|axis| self.differences(axis, &corners, places));
        let mixed = self.mixed(&differences[0], &corners, places);
        Found { corners, seen, differences, mixed }
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
        let cells = rows.start / self.cell..rows.end.div_ceil(self.cell);
        let seen = |j: usize| &found.seen[j * across..][..across];
        let is_seen = |i: &usize| cells.clone().any(|j| seen(j)[*i] > 0);
        let Some((first, last)) = (0..across).find(is_seen).zip((0..across).rfind(is_seen)) else { return 0..0 };
        let columns = first * self.cell..last * self.cell + self.side(0, last);
        for j in cells {
            let (v, height) = (j * self.cell, self.side(1, j));
            let mut written = columns.start;
            for i in (first..=last).filter(|i| seen(j)[*i] > 0) {
                let (u, width) = (i * self.cell, self.side(0, i));
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
        let (four, [across, down]) = (self.corners(cell), &found.differences);
        let (first, size) = self.pixels(cell);
        let reach = std::array::from_fn(|axis| self.cell.min(self.image[axis] - 1 - first[axis]).max(1));
        let ([a, b, c, _], corners) = (four, four.map(|k| found.corners[k]));
        let mixed = four.iter().map(|k| found.mixed[*k]).fold(f64::NAN, f64::max);
        let error = across.errors[a].max(across.errors[c]) + down.errors[a].max(down.errors[b]) + mixed;
        let whole = corners.iter().all(|corner| corner.x.is_finite() && !places.is_polar(corner));
        let seconds = [(across, reach[0]), (down, reach[1])]
            .map(|(differences, reach)| differences.over(four, reach as f64 / self.cell as f64));
        let surface = whole.then(|| Surface::new(places.together(corners), seconds, reach));
        let surface = surface.filter(|surface| {
            error <= BEND_MAX_PX || (error <= FITTING_PX && fits(surface, first, size, shown, places))
        });
        if let Some(places) = surface {
            strip.cell(&Cell { first, size, places });
        } else {
            strip.clear(first, size);
            let corners = corners.map(|corner| corner.x.is_finite().then_some(corner));
            let error = if error <= TOLD_PX { OF_HALF * error } else { f64::INFINITY };
            split(&Part { first, size, reach, corners, seconds, error }, shown, places, strip);
        }
    }

    /// How places bend from corner to corner along an axis.
    fn differences(&self, axis: usize, found: &[Vector2<f64>], places: &Places<'_>) -> Differences {
        let count = self.counts[axis];
        let (stride, next) = if axis == 0 { (1, self.counts[0]) } else { (self.counts[0], 1) };
        let unknown = Vector2::repeat(f64::NAN);
        let mut made = Differences { seconds: vec![unknown; found.len()], errors: vec![f64::INFINITY; found.len()] };
        let (mut seconds, mut fourths) = (vec![unknown; count], vec![f64::NAN; count]);
        for line in 0..self.counts[1 - axis] {
            let at = |k: usize| line * next + k * stride;
            seconds.fill(unknown);
            fourths.fill(f64::NAN);
            for k in 1..count.saturating_sub(1) {
                seconds[k] = places.second([&found[at(k - 1)], &found[at(k)], &found[at(k + 1)]], self.step(axis, k));
            }
            if count > 3 {
                // Where steps are not of one length the difference is that of a place between the corners.
                let (k, step) = (count - 2, self.step(axis, count - 2));
                let third = (seconds[k] - seconds[k - 1]) / (2.0 + step);
                if third.x.is_finite() {
                    seconds[k] += third * (1.0 - step);
                }
            }
            for k in 2..count.saturating_sub(2) {
                let fourth = seconds[k - 1] - 2.0 * seconds[k] + seconds[k + 1];
                fourths[k] = OF_FOURTH * places.length(fourth, &found[at(k)]);
            }
            for k in 0..count {
                made.seconds[at(k)] = self.continued(axis, k, &seconds);
                if k + 1 == count || !(found[at(k)].x.is_finite() && found[at(k + 1)].x.is_finite()) {
                    continue;
                }
                let [own, beside] = [[k, k + 1], [k + 2, k.wrapping_sub(1)]].map(|near| {
                    near.iter().filter_map(|k| fourths.get(*k)).fold(f64::NAN, |error, fourth| error.max(*fourth))
                });
                made.errors[at(k)] =
                    [own, BORDER * beside].into_iter().find(|error| error.is_finite()).unwrap_or(f64::INFINITY);
            }
        }
        made
    }

    /// The second difference of a corner, or where it has none what those beside it lead to.
    fn continued(&self, axis: usize, k: usize, seconds: &[Vector2<f64>]) -> Vector2<f64> {
        let second = |k: usize| seconds.get(k).filter(|second| second.x.is_finite());
        let beyond = |one: usize, other: usize, step: f64| {
            let one = second(one)?;
            Some(second(other).map_or(*one, |other| one + (one - other) * step))
        };
        let before = || beyond(k.wrapping_sub(1), k.wrapping_sub(2), self.step(axis, k.saturating_sub(1)));
        second(k).copied().or_else(|| beyond(k + 1, k + 2, 1.0)).or_else(before).unwrap_or(Vector2::repeat(f64::NAN))
    }

    /// By how much places between opposite sides of cells err, told at each corner; NaN where nothing tells.
    fn mixed(&self, across: &Differences, found: &[Vector2<f64>], places: &Places<'_>) -> Vec<f64> {
        let (columns, rows) = (self.counts[0], self.counts[1]);
        let mixed = pixels([0; 2], self.counts).zip(found).map(|([i, j], place)| {
            let j = j.clamp(1, rows.saturating_sub(2).max(1));
            let [above, here, below] = [j - 1, j, j + 1].map(|j| across.seconds.get(j * columns + i));
            let (Some(above), Some(here), Some(below)) = (above, here, below) else { return f64::NAN };
            let last = self.step(1, j);
            let mixed = ((below - here) / last - (here - above)) * (2.0 / (1.0 + last));
            OF_MIXED * places.length(mixed, place)
        });
        mixed.collect()
    }

    /// Pixels from a corner to the next along an axis, in those of a cell: fewer for the last.
    fn step(&self, axis: usize, k: usize) -> f64 {
        (self.image[axis] - 1 - k * self.cell).min(self.cell) as f64 / self.cell as f64
    }
}

/// What is made once of all corners for a tilt.
#[derive(Debug, Clone)]
pub(super) struct Found {
    /// The places of corners, or where they would be without limits of fields of view; NaN where there is none.
    corners: Vec<Vector2<f64>>,
    /// How many corners of each cell are within the fields of view of both images; see [`Corners::seen_by`].
    seen: Vec<u8>,
    differences: [Differences; 2],
    /// See [`Corners::mixed`].
    mixed: Vec<f64>,
}

/// Differences between the corners of cells along an axis.
#[derive(Debug, Clone)]
struct Differences {
    /// Second ones at each corner; see [`Corners::continued`].
    seconds: Vec<Vector2<f64>>,
    /// By how much interpolation with them errs from each corner to the next, in pixels; infinite where nothing tells.
    errors: Vec<f64>,
}

impl Differences {
    /// Second ones of four corners, over such a part of a cell.
    fn over(&self, corners: [usize; 4], part: f64) -> [Vector2<f64>; 4] {
        corners.map(|k| self.seconds[k] * (part * part))
    }
}
