//! The centre of a mirror's image, by the circle of its rim (Scaramuzza, Siegwart and Martinelli 2009, section 2, first step).

use nalgebra::Vector2;

use crate::image::ImageView;

/// Memory of the circle detector.
#[derive(Debug, Clone, Default)]
pub(crate) struct CenterScratch {
    votes: Vec<f32>,
}

/// The centre of the circle of radius `radius_px` about which most edge pixels lie, within `search_px` of `near`, to a
/// fraction of a pixel; none where no edge pixel votes.
///
/// The edge image, `magnitude >= gradient_min`, is convolved with a circle one pixel wide: each edge pixel votes for the
/// centres at the radius from it.
pub(crate) fn find_center(
    magnitude: &[f32],
    image: &ImageView<'_>,
    gradient_min: f32,
    near: &Vector2<f64>,
    radius_px: f64,
    search_px: f64,
    scratch: &mut CenterScratch,
) -> Option<Vector2<f64>> {
    let (width, height) = (image.width(), image.height());
    let reach = search_px.ceil() as i64 + 1;
    let side = (2 * reach + 1) as usize;
    let votes = &mut scratch.votes;
    votes.clear();
    votes.resize(side * side, 0.0);
    let origin = (near.x.round() as i64 - reach, near.y.round() as i64 - reach);
    let (inner, outer) = ((radius_px - search_px - 3.0).max(0.0), radius_px + search_px + 3.0);
    for v in 0..height {
        let dy = v as f64 - near.y;
        for u in 0..width {
            if magnitude[v * width + u] < gradient_min {
                continue;
            }
            let distance = (u as f64 - near.x).hypot(dy);
            if !(inner..=outer).contains(&distance) {
                continue;
            }
            // Where the circle about the pixel is steep one centre for each row, where it is flat one for each column.
            let steep = (u as f64 - near.x).abs() >= dy.abs();
            let (across, along) = if steep { ((v, origin.1), (u, origin.0)) } else { ((u, origin.0), (v, origin.1)) };
            for line in 0..side {
                let apart = across.0 as f64 - (across.1 + line as i64) as f64;
                let half = radius_px * radius_px - apart * apart;
                if half < 0.0 {
                    continue;
                }
                for x in [along.0 as f64 - half.sqrt(), along.0 as f64 + half.sqrt()] {
                    let place = x - along.1 as f64;
                    let low = place.floor();
                    if low >= 0.0 && low + 1.0 < side as f64 {
                        let (stride, start) = if steep { (1, line * side) } else { (side, line) };
                        let (cell, share) = (start + stride * low as usize, (place - low) as f32);
                        votes[cell] += 1.0 - share;
                        votes[cell + stride] += share;
                    }
                }
            }
        }
    }
    let near_enough = |i: usize| {
        let (x, y) = (i % side, i / side);
        let inside = x > 0 && y > 0 && x + 1 < side && y + 1 < side;
        let place = Vector2::new((origin.0 + x as i64) as f64, (origin.1 + y as i64) as f64);
        inside && (place - near).amax() <= search_px + 1.0
    };
    let best =
        (0..votes.len()).filter(|i| near_enough(*i)).max_by(|a, b| votes[*a].total_cmp(&votes[*b]).then(b.cmp(a)))?;
    if votes[best] <= 0.0 {
        return None;
    }
    let top = |before: f32, here: f32, after: f32| {
        let bend = 2.0 * here - before - after;
        if bend > 0.0 { f64::from((0.5 * (after - before) / bend).clamp(-0.5, 0.5)) } else { 0.0 }
    };
    let (x, y) = ((best % side) as i64, (best / side) as i64);
    Some(Vector2::new(
        (origin.0 + x) as f64 + top(votes[best - 1], votes[best], votes[best + 1]),
        (origin.1 + y) as f64 + top(votes[best - side], votes[best], votes[best + side]),
    ))
}
