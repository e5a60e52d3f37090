//! Circles about the vertical, and the great circles that cross one at a step up and a step down.

use std::f64::consts::TAU;

use nalgebra::Vector3;

use crate::image::ImageView;
use crate::tilt::image_edges::EdgeOrigin;

/// Places on each circle: some two pixels apart in images of 640 x 480 pixels.
const PLACES: usize = 256;

/// Largest reach of a step: it would be larger in images of some thirty pixels alone.
const REACH_MAX: usize = 16;

/// Places by which a step may lie beside a great circle: 1.8 degrees on the largest circle.
const BESIDE: usize = 2;

/// Largest angle in radians between the great circle of a line and the vertical: none of more draws a fit.
const LEAN_MAX_RAD: f64 = 14f64.to_radians();

/// Most steps up and most steps down of the largest circle: of texture the strongest.
const STEPS: usize = 32;

/// Most pairs of them that may be lines.
pub(super) const PAIRS: usize = 256;

/// A circle about the vertical.
#[derive(Debug)]
pub(super) struct Circle {
    tangent: f64,
    /// Column and row of each place that is in view, by azimuth.
    places: Vec<Option<[u16; 2]>>,
    /// Places to each side of a step, for which the levels are two pixels apart and more.
    reach: usize,
}

/// A great circle by its normal, towards the brighter side: azimuth, and tangent of the elevation.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Pair {
    azimuth: f64,
    tangent: f64,
    /// Steps that are missing.
    missed: usize,
}

impl Circle {
    /// The circle at an angle from the vertical.
    pub(super) fn new(origin: &EdgeOrigin, angle: f64, pixels_per_rad: f64) -> Self {
        let length = TAU * angle.sin() * pixels_per_rad;
        let EdgeOrigin { camera, robot_from_camera, mask, .. } = origin;
        let [width, height] = [camera.width(), camera.height()].map(f64::from);
        let place = |k: usize| {
            let azimuth = azimuth(k as f64);
            let bearing = Vector3::new(angle.sin() * azimuth.cos(), angle.sin() * azimuth.sin(), angle.cos());
            let pixel = camera.project(&(robot_from_camera.transpose() * bearing))?;
            let [u, v] = [pixel.x.round(), pixel.y.round()];
            let is_inside = u >= 0.0 && v >= 0.0 && u < width && v < height;
            let is_usable = is_inside && mask.as_ref().is_none_or(|mask| mask.usable(u as usize, v as usize));
            is_usable.then_some([u as u16, v as u16])
        };
        Self {
            tangent: angle.tan(),
            places: (0..PLACES).map(place).collect(),
            reach: ((PLACES as f64 / length).ceil() as usize).clamp(1, REACH_MAX),
        }
    }

    /// Whether any of it is in view.
    pub(super) fn is_seen(&self) -> bool {
        self.places.iter().any(Option::is_some)
    }

    /// The great circles near the vertical that cross the circle at a step up and a step down.
    pub(super) fn pairs<'a>(&self, image: &ImageView<'_>, step_min: i16, out: &'a mut [Pair; PAIRS]) -> &'a mut [Pair] {
        let steps = self.steps(image);
        let (mut ups, mut downs) = ([0; STEPS], [0; STEPS]);
        let (ups, downs) = (strongest(&steps, 1, step_min, &mut ups), strongest(&steps, -1, step_min, &mut downs));
        let mut room = out.iter_mut();
        let mut found = 0;
        for up in ups {
            for down in downs {
                let half = 0.5 * azimuth(((down + PLACES - up) % PLACES) as f64);
                // The brighter side is beyond the step up: a normal n has n . b = 0 at both.
                let pair = Pair { azimuth: azimuth(*up as f64) + half, tangent: -half.cos() * self.tangent, missed: 0 };
                if pair.tangent.abs() <= LEAN_MAX_RAD.tan()
                    && let Some(place) = room.next()
                {
                    *place = pair;
                    found += 1;
                }
            }
        }
        &mut out[..found]
    }

    /// Differences of levels along the circle, none beside what is not in view.
    fn steps(&self, image: &ImageView<'_>) -> [i16; PLACES] {
        // Once around, and on by twice the reach.
        let mut levels = [-1; PLACES + 2 * REACH_MAX];
        for (level, place) in levels[self.reach..].iter_mut().zip(&self.places) {
            if let Some([u, v]) = place {
                *level = image.row(usize::from(*v)).get(usize::from(*u)).map_or(-1, |level| i16::from(*level));
            }
        }
        levels.copy_within(PLACES..PLACES + self.reach, 0);
        levels.copy_within(self.reach..2 * self.reach, PLACES + self.reach);
        let mut steps = [0; PLACES];
        for (step, (before, after)) in steps.iter_mut().zip(levels.iter().zip(&levels[2 * self.reach..])) {
            *step = if *before < 0 || *after < 0 { 0 } else { *after - *before };
        }
        steps
    }

    /// Keeps the pairs that cross the circle at steps too, but for so many in all, and returns how many these are.
    pub(super) fn keep(&self, image: &ImageView<'_>, step_min: i16, missed_max: usize, pairs: &mut [Pair]) -> usize {
        let [ups, downs] = self.near_steps(image, step_min);
        let mut kept = 0;
        for k in 0..pairs.len() {
            let pair = &mut pairs[k];
            let half = (-pair.tangent / self.tangent).clamp(-1.0, 1.0).acos();
            let is_at = [ups[at(pair.azimuth - half)], downs[at(pair.azimuth + half)]];
            pair.missed += is_at.into_iter().filter(|is_at| !is_at).count();
            if pair.missed <= missed_max {
                pairs[kept] = pairs[k];
                kept += 1;
            }
        }
        kept
    }

    /// Whether places are near a step up, and near a step down.
    fn near_steps(&self, image: &ImageView<'_>, step_min: i16) -> [[bool; PLACES]; 2] {
        let mut near = [[false; PLACES]; 2];
        for (place, step) in self.steps(image).iter().enumerate().filter(|(_, step)| step.abs() >= step_min) {
            for by in 0..=2 * BESIDE {
                near[usize::from(*step < 0)][(place + PLACES + by - BESIDE) % PLACES] = true;
            }
        }
        near
    }
}

impl Pair {
    /// Towards the brighter side.
    pub(super) fn normal(&self) -> Vector3<f64> {
        Vector3::new(self.azimuth.cos(), self.azimuth.sin(), self.tangent).normalize()
    }
}

/// The azimuth of a place.
fn azimuth(place: f64) -> f64 {
    TAU / PLACES as f64 * place
}

/// The place at an azimuth.
fn at(azimuth: f64) -> usize {
    (azimuth.rem_euclid(TAU) * (PLACES as f64 / TAU)).round() as usize % PLACES
}

/// The strongest steps of a sign, as many as there is room for or fewer, in the order of their places.
fn strongest<'a>(steps: &[i16; PLACES], sign: i16, step_min: i16, out: &'a mut [usize; STEPS]) -> &'a [usize] {
    let peaks = |least: i16| {
        let strong = steps.iter().enumerate().map(move |(place, step)| (place, sign * step));
        strong.filter(move |(place, own)| {
            let above = |by: usize| *own - sign * steps[(place + by) % PLACES];
            *own >= least && above(PLACES - 1) > 0 && above(1) >= 0
        })
    };
    let mut least = step_min;
    while peaks(least).count() > STEPS {
        least += 1 + least / 4;
    }
    let mut found = 0;
    for (own, (place, _)) in out.iter_mut().zip(peaks(least)) {
        *own = place;
        found += 1;
    }
    &out[..found]
}
