//! Chains: ridge pixels that follow one another along their edge.

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
    /// Unit gradients of the ridge pixels.
    units: Vec<[f32; 2]>,
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
        let Self { free, window, units, members, starts } = self;
        let edges = &ridge.edges;
        let (places, gx, gy) = (edges.place(), edges.gx(), edges.gy());
        units.resize(places.len(), [0.0; 2]);
        directions(gx, gy, units);
        for (i, place) in places.iter().enumerate() {
            free[window.place(*place)] = i as u32 + 1;
        }
        let steps = STEPS.map(|(u, v)| (v * window.width as i32 + u) as isize);
        members.clear();
        starts.clear();
        starts.push(0);
        for (seed, place) in places.iter().enumerate() {
            if gx[seed] * gx[seed] + gy[seed] * gy[seed] < start {
                continue;
            }
            let at = window.place(*place);
            if free[at] == 0 {
                continue;
            }
            free[at] = 0;
            let begin = members.len();
            for way in [1.0, -1.0] {
                let (mut here, mut at) = (seed, at);
                if way < 0.0 {
                    members[begin..].reverse();
                    members.push(seed as u32);
                }
                while let Some((following, place)) = next(free, units, &steps, here, at, way) {
                    (here, at) = (following as usize, place);
                    free[at] = 0;
                    members.push(following);
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

    /// The unit gradient of a ridge pixel.
    #[inline(always)]
    pub(super) fn unit(&self, ridge_pixel: u32) -> [f32; 2] {
        self.units[ridge_pixel as usize]
    }
}

/// The free ridge pixel that goes on from one along its edge, one way or the other, and its place. The gradient turns least there.
#[inline(always)]
fn next(
    free: &[u32],
    units: &[[f32; 2]],
    steps: &[isize; 8],
    here: usize,
    at: usize,
    way: f32,
) -> Option<(u32, usize)> {
    let [x, y] = units[here];
    let along = [-y * way, x * way];
    let nearest = step_towards(along);
    // Along a diagonal a ridge may lack a pixel: of two neighbours one is judged by its row, one by its column, and each is beaten.
    for from in [at, at.wrapping_add_signed(steps[nearest])] {
        let mut best = (0.0, None);
        for side in [nearest, (nearest + 1) % 8, (nearest + 7) % 8] {
            let there = from.wrapping_add_signed(steps[side]);
            let Some(next) = free[there].checked_sub(1) else { continue };
            let [p, q] = units[next as usize];
            let turn = x * p + y * q;
            let score = turn * (along[0] * DIRECTIONS[side][0] + along[1] * DIRECTIONS[side][1]);
            if turn >= TURN_COS && score > best.0 {
                best = (score, Some((next, there)));
            }
        }
        if best.1.is_some() {
            return best.1;
        }
    }
    None
}

/// Number of the step nearest to a direction.
#[inline(always)]
fn step_towards([x, y]: [f32; 2]) -> usize {
    let (a, b) = (x.abs(), y.abs());
    if b <= HALF_STEP * a {
        if x > 0.0 { 0 } else { 4 }
    } else if a <= HALF_STEP * b {
        if y > 0.0 { 2 } else { 6 }
    } else {
        match (x > 0.0, y > 0.0) {
            (true, true) => 1,
            (false, true) => 3,
            (false, false) => 5,
            (true, false) => 7,
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
