//! Chains: ridge pixels that follow one another along their edge.

use std::hint::select_unpredictable;

use tiltvp_kernels::vectorised;

use crate::edges::{Region, RidgePixels};

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
    /// Number of the ridge pixel, and one more, at each pixel of the window that is one and is not yet in a chain; zero elsewhere,
    /// and everywhere between images.
    free: Vec<u32>,
    window: Window,
    /// Unit gradients of the ridge pixels, each in the place one more than its number; in the first one of none, which goes on from nothing.
    units: Vec<[f32; 2]>,
    /// The step nearest to the edge's direction, with the brighter side to the right, in the same places.
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

    /// The place of a packed pixel.
    #[inline(always)]
    pub(super) fn place(&self, packed: u32) -> usize {
        let (u, v) = ((packed & 0xffff) as usize, (packed >> 16) as usize);
        (v - self.top) * self.width + u - self.left
    }
}

impl Chains {
    /// Room for the chains of a region.
    pub(super) fn new(window: Window) -> Self {
        Self { free: vec![0; window.width * window.height], window, ..Self::default() }
    }

    /// Links ridge pixels, from those with a squared gradient of at least `start` on, in the order of the pixels.
    pub(super) fn link(&mut self, ridge: &RidgePixels, start: f32) {
        let Self { free, window, units, towards, members, starts } = self;
        let edges = &ridge.edges;
        let (places, gx, gy) = (edges.place(), edges.gx(), edges.gy());
        units.resize(places.len() + 1, [0.0; 2]);
        towards.resize(places.len() + 1, 0);
        directions(gx, gy, &mut units[1..]);
        nearest_steps(&units[1..], &mut towards[1..]);
        for (number, place) in (1..).zip(places) {
            free[window.place(*place)] = number;
        }
        let steps = Step::of(window);
        members.clear();
        starts.clear();
        starts.push(0);
        for (((place, gx), gy), number) in places.iter().zip(gx).zip(gy).zip(1..) {
            let at = window.place(*place);
            if free[at] == 0 || gx * gx + gy * gy < start {
                continue;
            }
            free[at] = 0;
            let begin = members.len();
            for way in [Way::Forward, Way::Back] {
                let mut here = Here { number, place: at };
                if way == Way::Back {
                    members[begin..].reverse();
                    members.push(number - 1);
                }
                while let Some(following) = next(free, units, towards, &steps, here, way) {
                    here = following;
                    free[here.place] = 0;
                    members.push(here.number - 1);
                }
            }
            starts.push(members.len());
        }
        for place in places {
            free[window.place(*place)] = 0;
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

/// A ridge pixel, by one more than its number.
#[derive(Debug, Clone, Copy)]
struct Here {
    number: u32,
    place: usize,
}

/// The free ridge pixel that goes on from one along its edge, one way or the other. The gradient turns least there.
#[inline(always)]
fn next(
    free: &[u32],
    units: &[[f32; 2]],
    towards: &[u8],
    steps: &[[Step; 3]; 8],
    here: Here,
    way: Way,
) -> Option<Here> {
    let [x, y] = units[here.number as usize];
    let (along, turned) = if way == Way::Forward { ([-y, x], 0) } else { ([y, -x], 4) };
    let sides = &steps[usize::from(towards[here.number as usize] + turned) % 8];
    // Along a diagonal a ridge may lack a pixel: of two neighbours one is judged by its row, one by its column, and each is beaten.
    for from in [here.place, here.place.wrapping_add_signed(sides[0].places)] {
        let there: [Here; 3] = sides.map(|side| {
            let place = from.wrapping_add_signed(side.places);
            Here { number: free[place], place }
        });
        let weigh = |side: usize| {
            let [p, q] = units[there[side].number as usize];
            let (turn, direction) = (x * p + y * q, sides[side].direction);
            let score = turn * (along[0] * direction[0] + along[1] * direction[1]);
            if turn >= TURN_COS { score } else { 0.0 }
        };
        let [a, b, c] = there.map(|here| usize::from(here.number != 0));
        if a + b + c == 0 {
            continue;
        }
        if a + b + c == 1 {
            // Most often: who follows is known before it is known whether it does.
            let only = b + 2 * c;
            if weigh(only) > 0.0 {
                return Some(there[only]);
            }
            continue;
        }
        // All three are weighed, also where nobody is, and chosen from without a branch: none could be guessed.
        let (mut best, mut chosen) = (0.0, Here { number: 0, place: 0 });
        for (side, here) in there.iter().enumerate() {
            let score = weigh(side);
            let better = score > best;
            best = select_unpredictable(better, score, best);
            chosen.number = select_unpredictable(better, here.number, chosen.number);
            chosen.place = select_unpredictable(better, here.place, chosen.place);
        }
        if chosen.number != 0 {
            return Some(chosen);
        }
    }
    None
}

vectorised! {
    /// The steps nearest to the directions of edges: unit gradients turned by a quarter.
    fn nearest_steps(units: &[[f32; 2]], out: &mut [u8]) {
        for ([gx, gy], out) in units.iter().zip(out) {
            let (x, y) = (-gy, *gx);
            let (a, b) = (x.abs(), y.abs());
            let (right, down) = (i32::from(x > 0.0), i32::from(y > 0.0));
            let level = if right == 1 { 0 } else { 4 };
            let upright = if down == 1 { 2 } else { 6 };
            let diagonal = if down == 1 { 3 - 2 * right } else { 5 + 2 * right };
            let steep = if a <= HALF_STEP * b { upright } else { diagonal };
            *out = (if b <= HALF_STEP * a { level } else { steep }) as u8;
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
