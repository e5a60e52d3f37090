//! Parts of cells that bend too much for one surface.

use nalgebra::Vector2;

use super::places::Places;
use super::shown::Shown;
use super::strip::Strip;
use super::surface::{Cell, Surface};

/// Cells are split until they are so small; then each pixel is projected by itself.
const SMALLEST: usize = 4;

/// How far interpolation may be wrong, in pixels: a quarter of the bound that [`MAP_ERROR_PX`](super::MAP_ERROR_PX) promises, for what
/// tells it are differences at a cell's corners, or three of its places.
pub(super) const BEND_MAX_PX: f64 = 0.0125;

/// How far wrong differences may say that it is where three places say that it is right. With twice as much, maps of lenses that fold are
/// wrong by more than is promised (`maps_are_as_exact_as_they_say`).
pub(super) const FITTING_PX: f64 = 4.0 * BEND_MAX_PX;

/// Part of an error that one of half the size is taken to have. It is 1/16, but its second differences are in part those of the whole.
pub(super) const OF_HALF: f64 = 1.0 / 8.0;

/// Those of a rectangle in row order.
pub(super) fn pixels(first: [usize; 2], size: [usize; 2]) -> impl Iterator<Item = [usize; 2]> {
    (0..size[1]).flat_map(move |v| (0..size[0]).map(move |u| [first[0] + u, first[1] + v]))
}

/// A cell, or a part of one, that is to be split.
pub(super) struct Part {
    pub(super) first: [usize; 2],
    pub(super) size: [usize; 2],
    /// From its first to its last corners: as many pixels as its size, or at the border of the image one less.
    pub(super) reach: [usize; 2],
    pub(super) corners: [Option<Vector2<f64>>; 4],
    /// At the corners, over its reach across and down; NaN where nothing tells.
    pub(super) seconds: [[Vector2<f64>; 4]; 2],
    /// What interpolation over its quarters is wrong by, infinite if that is not known.
    pub(super) error: f64,
}

/// Goes on with the quarters of a part, in the end with its pixels.
pub(super) fn split(part: &Part, shown: &Shown, places: &Places<'_>, strip: &mut Strip<'_>) {
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
    let [across, down] = [0, 1].map(|axis| {
        let place = |line: usize, k: usize| if axis == 0 { nine[line][k] } else { nine[k][line] };
        let middle = [0, 1, 2].map(|line| match (place(line, 0), place(line, 1), place(line, 2)) {
            (Some(a), Some(b), Some(c)) if !places.is_polar(&b) => places.second([&a, &b, &c], last[axis]),
            _ => Vector2::repeat(f64::NAN),
        });
        let part_of = (halves[axis][0] as f64 / part.reach[axis] as f64).powi(2);
        let [firsts, lasts] = [0, 1].map(|end| {
            let [one, other] =
                [0, 1].map(|side| part.seconds[axis][if axis == 0 { 2 * side + end } else { 2 * end + side }]);
            // Of the line between the sides the mean of theirs.
            [one * part_of, (one + other) * (0.5 * part_of), other * part_of]
        });
        [0, 1, 2].map(|line| {
            let told = |second: Vector2<f64>| if second.x.is_finite() { second } else { middle[line] };
            [told(firsts[line]), middle[line], told(lasts[line])]
        })
    });
    for (j, i) in [(0, 0), (0, 1), (1, 0), (1, 1)] {
        let four = [nine[j][i], nine[j][i + 1], nine[j + 1][i], nine[j + 1][i + 1]];
        let (first, reach) = ([at(0, i), at(1, j)], [halves[0][i], halves[1][j]]);
        let size = [0, 1].map(|axis| if [i, j][axis] == 0 { reach[axis] } else { part.size[axis] - halves[axis][0] });
        let over = |axis: usize| if [i, j][axis] == 0 { 1.0 } else { last[axis].powi(2) };
        let seconds = [
            [across[j][i], across[j][i + 1], across[j + 1][i], across[j + 1][i + 1]].map(|second| second * over(0)),
            [down[i][j], down[i + 1][j], down[i][j + 1], down[i + 1][j + 1]].map(|second| second * over(1)),
        ];
        let surface = if let [Some(a), Some(b), Some(c), Some(d)] = four {
            let surface = Surface::new(places.together([a, b, c, d]), seconds, reach);
            let bend = seconds.as_flattened().iter().map(|bend| places.length(*bend, &a) / 8.0).fold(0.0, f64::max);
            (part.error.min(bend) <= FITTING_PX && fits(&surface, first, size, shown, places)).then_some(surface)
        } else {
            None
        };
        match surface {
            Some(places) => strip.cell(&Cell { first, size, places }),
            None if four.iter().all(Option::is_none) => {}
            None => {
                let quarter = Part { first, size, reach, corners: four, seconds, error: OF_HALF * part.error };
                split(&quarter, shown, places, strip);
            }
        }
    }
}

/// Whether a surface is where three pixels are: two at which no errors of a third difference across and one down cancel each other, and
/// one where errors of fourth differences do not.
pub(super) fn fits(surface: &Surface, first: [usize; 2], size: [usize; 2], shown: &Shown, places: &Places<'_>) -> bool {
    let [across, down] = size.map(|side| side / 4);
    [[across, down], [size[0] - across, down], [0, 2 * down]].into_iter().all(|[column, row]| {
        let column = column.min(size[0] - 1);
        places.of(shown.unlimited_ray([first[0] + column, first[1] + row])).is_some_and(|exact| {
            let found = surface.at([column, row]);
            places.length(places.between(&found, &exact), &exact) <= BEND_MAX_PX
        })
    })
}
