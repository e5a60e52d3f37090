//! What is done where edge pixels that agree are steps of the pixel grid: of borders, what is burnt in, blocks, broken columns.

use super::doubt::Doubt;
use super::estimate::TiltEstimate;
use super::work::Work;
use crate::edges::{EdgePixels, Region, StepMap, is_grid_step};
use crate::image::ImageView;

/// Share of the edge pixels that agree from which on the others are asked. Of 41 views each that are not harmed none upward has as many, and one
/// ahead by a pinhole camera; of what was made small without blur 16 by a fisheye ahead have, and 29 panoramas.
const SHARE_MIN: f64 = 0.15;

/// Rows that are looked at, or up to twice as many: where half agree the share of these errs by 0.02 or less.
const ROWS: usize = 500;

/// Rows that are looked at first. Most images have no steps: where these have less than half of the share the others are not asked.
const FIRST_ROWS: usize = 100;

/// Share of the confidence of all edges that the others need to be believed instead: of what is drawn without blur or noise by an upright
/// camera they are what is left.
const AS_SURE: f64 = 0.5;

/// Share of the confidence that is left where they are not: a view that is drawn without blur may be right.
const ALONE: f64 = 0.5;

/// By how much in radians other edges tell another vertical.
const APART_RAD: f64 = 1f64.to_radians();

/// What tells which edge pixels are steps of the pixel grid.
#[derive(Debug, Clone, Copy)]
pub(super) enum Steps<'a> {
    /// The image.
    Of(&'a ImageView<'a>),
    /// Their numbers within the region, ascending.
    Known(&'a [u32]),
}

impl Steps<'_> {
    /// Whether an edge pixel is one, by its number within the region.
    pub(super) fn has(&self, region: &Region, slot: u32, gradient: [f32; 2]) -> bool {
        match self {
            Self::Of(image) => is_grid_step(image, place(region, slot), gradient),
            Self::Known(steps) => steps.binary_search(&slot).is_ok(),
        }
    }

    /// The numbers within the region of all that are.
    pub(super) fn all(&self, edges: &EdgePixels, region: &Region) -> Vec<u32> {
        let pixels = edges.slot().iter().zip(edges.gx()).zip(edges.gy());
        pixels.filter(|((slot, gx), gy)| self.has(region, **slot, [**gx, **gy])).map(|((slot, _), _)| *slot).collect()
    }

    /// Share of the edge pixels that agreed with the last fit, if it is much.
    pub(super) fn share(&self, edges: &EdgePixels, region: &Region, work: &Work) -> Option<f64> {
        if self.share_of(FIRST_ROWS, edges, region, work) < 0.5 * SHARE_MIN {
            return None;
        }
        let share = self.share_of(ROWS, edges, region, work);
        (share >= SHARE_MIN).then_some(share)
    }

    /// The share by so many rows, or up to twice as many.
    fn share_of(&self, rows: usize, edges: &EdgePixels, region: &Region, work: &Work) -> f64 {
        let (mut all, mut steps) = (0, 0);
        for row in (0..work.rows.len()).step_by((work.rows.len() / rows).max(1)).filter(|row| work.is_inlier(*row)) {
            all += 1;
            steps += u32::from(self.has(region, work.slots[row], gradient(edges, work.places[row])));
        }
        f64::from(steps) / f64::from(all.max(1))
    }

    /// Leaves out the rows that are steps, and what these may go on to.
    pub(super) fn leave_out(&self, edges: &EdgePixels, region: &Region, work: &mut Work) {
        work.steps.clear();
        for row in 0..work.rows.len() {
            let (slot, gradient) = (work.slots[row], gradient(edges, work.places[row]));
            if self.has(region, slot, gradient) {
                work.steps.insert(place(region, slot), gradient);
            }
        }
        let steps = std::mem::replace(&mut work.steps, StepMap::new([0, 0]));
        work.keep(|_, slot, edge| !steps.has(place(region, slot), gradient(edges, edge)));
        work.steps = steps;
    }
}

fn place(region: &Region, slot: u32) -> [usize; 2] {
    let (u, v) = region.place(slot as usize);
    [u.into(), v.into()]
}

fn gradient(edges: &EdgePixels, edge: u32) -> [f32; 2] {
    [edges.gx()[edge as usize], edges.gy()[edge as usize]]
}

/// Whether the other edges are about as sure.
pub(super) fn is_as_sure(others: &TiltEstimate, told: &TiltEstimate) -> bool {
    others.confidence >= AS_SURE * told.confidence
}

/// Whether they tell another vertical, whatever they may err by.
pub(super) fn is_apart(others: &TiltEstimate, told: &TiltEstimate) -> bool {
    let normals = others.tilt.zip(told.tilt).map(|(others, told)| (others.normal(), told.normal()));
    normals.is_some_and(|(others, told)| others.angle(&told) > APART_RAD)
}

/// Doubts an estimate so much of which is steps.
pub(super) fn doubt(told: &mut TiltEstimate, share: f64) {
    told.confidence *= ALONE;
    told.doubt = told.doubt.or(Some(Doubt::OnGrid { share }));
}
