//! Chains: ridge pixels that follow one another along their edge.

use std::hint::select_unpredictable;

use tiltvp_kernels::vectorised;

use crate::edges::{Region, RidgePixels};
use crate::interrupt::check;

/// The eight neighbours, by turns of 45 degrees from `u` towards `v`.
const STEPS: [(i32, i32); 8] = [(1, 0), (1, 1), (0, 1), (-1, 1), (-1, 0), (-1, -1), (0, -1), (1, -1)];

/// Half of the root of two: the steps' directions.
const DIAGONAL: f32 = std::f32::consts::FRAC_1_SQRT_2;

/// Unit vectors along the steps.
const DIRECTIONS: [[f32; 2]; 8] = [
    [1.0, 0.0],
    [DIAGONAL, DIAGONAL],
    [0.0, 1.0],
    [-DIAGONAL, DIAGONAL],
    [-1.0, 0.0],
    [-DIAGONAL, -DIAGONAL],
    [0.0, -1.0],
    [DIAGONAL, -DIAGONAL],
];

/// Tangent of half a turn of 45 degrees: which of the eight steps a direction is nearest to.
const HALF_STEP: f32 = 0.414_213_56;

/// Cosine of the largest turn of the gradient from one pixel to the next: 37 degrees, more than noise turns a gradient of twice
/// its size, less than a corner.
const TURN_COS: f32 = 0.8;

/// A map from pixels to ridge pixels, and the chains of the last image.
#[derive(Debug, Clone, Default)]
pub(super) struct Chains {
    /// One more than the step nearest to the edge's direction, with the brighter side to the right, at each pixel of the window that is a
    /// ridge pixel and not yet in a chain; zero elsewhere, and everywhere between images. A byte, for chains wait for these.
    free: Vec<u8>,
    /// One more than the number of the ridge pixel, where there is one; anything elsewhere.
    numbers: Vec<u32>,
    window: Window,
    /// The ridge pixels' places in the window.
    places: Vec<u32>,
    /// Their unit gradients, each in the place one more than its number; in the first one of none, which goes on from nothing.
    units: Vec<[f32; 2]>,
    /// One more than the step nearest to the edge's direction.
    towards: Vec<u8>,
    /// Ridge pixels in the order of the chains.
    members: Vec<u32>,
    /// Where each chain begins, and the end.
    starts: Vec<usize>,
}

/// The part of an image that holds a region, two pixels wider on every side: as far as a chain looks for its next pixel.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub(super) struct Window {
    pub left: usize,
    pub top: usize,
    pub width: usize,
    pub height: usize,
}

impl Window {
    pub(super) fn new(region: &Region) -> Self {
        let (first, last) = (region.spans().first(), region.spans().last());
        let (top, bottom) = (first.map_or(0, |span| span.v), last.map_or(0, |span| span.v + 1));
        let columns = region.columns();
        // Regions keep clear of the image's border.
        Self {
            left: columns.start.saturating_sub(2),
            top: top.saturating_sub(2),
            width: columns.len() + 4,
            height: bottom - top + 4,
        }
    }
}

impl Chains {
    /// Room for the chains of a region.
    pub(super) fn new(window: Window) -> Self {
        let pixels = window.width * window.height;
        Self { free: vec![0; pixels], numbers: vec![0; pixels], window, ..Self::default() }
    }

    /// Links ridge pixels, from those with a squared gradient of at least `start` on, in the order of the pixels.
    pub(super) fn link(&mut self, ridge: &RidgePixels, start: f32) {
        let Self { free, numbers, window, places, units, towards, members, starts } = self;
        let edges = &ridge.edges;
        let (gx, gy) = (edges.gx(), edges.gy());
        let n = gx.len();
        units.resize(n + 1, [0.0; 2]);
        towards.resize(n, 0);
        places.resize(n, 0);
        directions(gx, gy, &mut units[1..]);
        nearest_steps(&units[1..], towards);
        places_in(window, edges.place(), places);
        let (free, numbers, units) = (&mut free[..], &mut numbers[..], &units[..]);
        for ((place, towards), number) in places.iter().zip(&*towards).zip(1..) {
            free[*place as usize] = *towards;
            numbers[*place as usize] = number;
        }
        let steps = Step::of(window);
        members.clear();
        starts.clear();
        starts.push(0);
        for (((place, gx), gy), number) in places.iter().zip(gx).zip(gy).zip(1..) {
            let place = *place as usize;
            if free[place] == 0 || gx * gx + gy * gy < start {
                continue;
            }
            check();
            let first = Here { place, towards: std::mem::replace(&mut free[place], 0), number };
            let begin = members.len();
            for way in [Way::Forward, Way::Back] {
                let mut here = first;
                if way == Way::Back {
                    members[begin..].reverse();
                    members.push(number - 1);
                }
                while let Some(following) = next(free, numbers, units, &steps, here, way) {
                    here = following;
                    free[here.place] = 0;
                    members.push(here.number - 1);
                }
            }
            starts.push(members.len());
        }
        for place in places {
            free[*place as usize] = 0;
        }
    }

    /// The chains of at least so many pixels, as numbers of ridge pixels.
    pub(super) fn of_at_least(&self, pixels: usize) -> impl Iterator<Item = &[u32]> {
        self.starts.windows(2).map(|ends| &self.members[ends[0]..ends[1]]).filter(move |chain| chain.len() >= pixels)
    }

    /// The unit gradients of the ridge pixels.
    pub(super) fn units(&self) -> &[[f32; 2]] {
        &self.units[1..]
    }
}

/// A step to a neighbour: how far places lie apart, and its direction.
#[derive(Debug, Clone, Copy)]
struct Step {
    places: isize,
    direction: [f32; 2],
}

impl Step {
    /// Each step of a window, followed by its two neighbours.
    fn of(window: &Window) -> [[Self; 3]; 8] {
        let one = |k: usize| {
            let (u, v) = STEPS[k % 8];
            Self { places: (v * window.width as i32 + u) as isize, direction: DIRECTIONS[k % 8] }
        };
        std::array::from_fn(|k| [one(k), one(k + 1), one(k + 7)])
    }
}

/// Which of its two ways an edge is followed.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Way {
    Forward,
    Back,
}

/// A ridge pixel: where it is, and one more than the step nearest to its edge's direction and than its number.
#[derive(Debug, Clone, Copy)]
struct Here {
    place: usize,
    towards: u8,
    number: u32,
}

/// The free ridge pixel that goes on from one along its edge, one way or the other. The gradient turns least there.
#[inline(always)]
fn next(
    free: &[u8],
    numbers: &[u32],
    units: &[[f32; 2]],
    steps: &[[Step; 3]; 8],
    here: Here,
    way: Way,
) -> Option<Here> {
    let [x, y] = units[here.number as usize];
    let (along, turned) = if way == Way::Forward { ([-y, x], 7) } else { ([y, -x], 3) };
    let sides = &steps[usize::from(here.towards + turned) % 8];
    // Along a diagonal a ridge may lack a pixel: of two neighbours one is judged by its row, one by its column, and each is beaten.
    for from in [here.place, here.place.wrapping_add_signed(sides[0].places)] {
        let places = sides.map(|side| from.wrapping_add_signed(side.places));
        let towards = places.map(|place| free[place]);
        let weigh = |side: usize, number: u32| {
            let [p, q] = units[number as usize];
            let (turn, direction) = (x * p + y * q, sides[side].direction);
            let score = turn * (along[0] * direction[0] + along[1] * direction[1]);
            if turn >= TURN_COS { score } else { 0.0 }
        };
        let [a, b, c] = towards.map(|towards| usize::from(towards != 0));
        if a + b + c == 0 {
            continue;
        }
        if a + b + c == 1 {
            // Most often: who follows is known before it is known whether it does.
            let only = b + 2 * c;
            let place = select_unpredictable(a == 1, places[0], select_unpredictable(b == 1, places[1], places[2]));
            let number = numbers[place];
            if weigh(only, number) > 0.0 {
                return Some(Here { place, towards: towards[0] | towards[1] | towards[2], number });
            }
            continue;
        }
        // All three are weighed, also where nobody is, and chosen from without a branch: none could be guessed.
        let (mut best, mut chosen) = (0.0, Here { place: 0, towards: 0, number: 0 });
        for (side, (place, towards)) in places.into_iter().zip(towards).enumerate() {
            let number = select_unpredictable(towards != 0, numbers[place], 0);
            let score = weigh(side, number);
            let better = score > best;
            best = select_unpredictable(better, score, best);
            chosen.place = select_unpredictable(better, place, chosen.place);
            chosen.towards = select_unpredictable(better, towards, chosen.towards);
            chosen.number = select_unpredictable(better, number, chosen.number);
        }
        if chosen.number != 0 {
            return Some(chosen);
        }
    }
    None
}

vectorised! {
    /// Where packed pixels are in a window.
    fn places_in(window: &Window, packed: &[u32], out: &mut [u32]) {
        let (width, first) = (window.width as u32, (window.top * window.width + window.left) as u32);
        for (packed, out) in packed.iter().zip(out) {
            *out = (packed >> 16) * width + (packed & 0xffff) - first;
        }
    }
}

vectorised! {
    /// One more than the steps nearest to the directions of edges: unit gradients turned by a quarter.
    fn nearest_steps(units: &[[f32; 2]], out: &mut [u8]) {
        for ([gx, gy], out) in units.iter().zip(out) {
            let (x, y) = (-gy, *gx);
            let (a, b) = (x.abs(), y.abs());
            let (right, down) = (i32::from(x > 0.0), i32::from(y > 0.0));
            let level = if right == 1 { 0 } else { 4 };
            let upright = if down == 1 { 2 } else { 6 };
            let diagonal = if down == 1 { 3 - 2 * right } else { 5 + 2 * right };
            let steep = if a <= HALF_STEP * b { upright } else { diagonal };
            *out = (if b <= HALF_STEP * a { level } else { steep }) as u8 + 1;
        }
    }
}

vectorised! {
    /// Unit vectors along gradients.
    fn directions(gx: &[f32], gy: &[f32], out: &mut [[f32; 2]]) {
        for ((x, y), out) in gx.iter().zip(gy).zip(out) {
            let length = (f64::from(*x) * f64::from(*x) + f64::from(*y) * f64::from(*y)).sqrt() as f32;
            *out = [x / length, y / length];
        }
    }
}
