//! Which lines of two images are the same when the camera has moved by metres: by their profiles, and by one motion that explains all.

mod likeness;
mod motion;

use self::likeness::{COURSE, Weighted, likenesses};
use self::motion::{Motion, Search};
use super::angles::wrap;
use super::description::profile_rows;
use super::line::Lines;
use super::order::{Match, keep_cyclic_order};
use crate::error::{Error, Result};
use crate::options;
use crate::options::POSITIVE;

options! {
    /// Options of matching over metres.
    #[derive(Copy)]
    pub struct WideOptions {
        /// Least confidence of a match.
        confidence_min: f64 = 0.8 => 0.0..=1.0, "a confidence from 0 to 1";
        /// Least likeness of two profiles, of at most 2.1.
        likeness_min: f64 = 1.2 => 0.0..=2.1, "a likeness from 0 to 2.1";
        /// Standard deviation of a direction of motion that is told, in radians: it is looked for up to three of them away.
        motion_sigma_rad: f64 = 2.0 * std::f64::consts::PI / 180.0 => POSITIVE, "a positive angle";
    }
}

/// The lines of an image and their profiles, as `LineExtractor::describe` writes them with `descriptor_kind` "profile".
#[derive(Debug, Clone, Copy)]
pub struct Profiles<'a> {
    /// The lines, by rising bearing.
    pub lines: &'a Lines,
    /// Their profiles, one after the other.
    pub values: &'a [f32],
}

/// A match over metres.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct WideMatch {
    /// Place in the first image.
    pub a: usize,
    /// Place in the second image.
    pub b: usize,
    /// How probable it is that both are the same edge, from 0 to 1.
    pub confidence: f64,
}

/// Memory of the matcher.
#[derive(Debug, Clone, Default)]
pub struct WideScratch {
    weighted: [Weighted; 2],
    likenesses: Vec<f32>,
    search: Search,
    kept: Vec<Match>,
    bearings: [Vec<f64>; 2],
}

/// What tells right matches from false ones.
#[derive(Debug, Clone, Copy)]
struct Signs {
    /// How much more alike than the next pair of either line under the same motion.
    margin: f64,
    /// What the best motion beside this one explains, as a share of this one.
    rival: f64,
    /// The share of the lines of the image with fewer that have matches.
    share: f64,
    /// How far the bearing changes beside the turn, radians.
    parallax_rad: f64,
    /// How much more alike the two are at another shift.
    drop: f64,
}

impl Signs {
    /// A logistic regression over 2,965 matches of 120 pairs of images 1 to 2 m apart, of ten rendered rooms, half of them with the
    /// motion told to 2 degrees.
    fn confidence(&self) -> f64 {
        let Self { margin, rival, share, parallax_rad, drop } = self;
        let evidence =
            0.4 + 5.0 * margin.min(MARGIN_MOST) - 1.5 * rival + 4.4 * share * share - 1.3 * parallax_rad - 2.3 * drop;
        1.0 / (1.0 + (-evidence).exp())
    }
}

/// More of a margin says nothing more: the two lines have no other pair that could be.
const MARGIN_MOST: f64 = 0.3;

/// The rival of a motion that is told, by the same regression.
const RIVAL_TOLD: f64 = 0.4;

/// The matches of two images, by rising place in the first. `ahead` is the direction of the camera's way from the first image to the
/// second as the one and the other see it, a bearing in each, where it is known, as by odometry.
///
/// # Errors
/// [`Error::InvalidOption`], or [`Error::InvalidArgument`] unless both have a whole profile for each line, rise, and are of one camera
/// and mounting.
pub fn match_wide(
    a: &Profiles<'_>,
    b: &Profiles<'_>,
    ahead: Option<[f64; 2]>,
    options: &WideOptions,
    scratch: &mut WideScratch,
    out: &mut Vec<WideMatch>,
) -> Result<()> {
    options.validate()?;
    out.clear();
    for (name, image) in [("a", a), ("b", b)] {
        let (lines, width) = (image.lines.lines.len(), profile_rows::VALUES);
        if image.values.len() != lines * width {
            let got = format!("{} values for {lines} lines", image.values.len());
            let expected = format!("{width} for each line, as descriptor_kind \"profile\" has them");
            return Err(Error::argument(name, got, expected));
        }
        image.lines.check_after(a.lines.frame.seen_by, true)?;
    }
    if ahead.is_some_and(|ahead| ahead.iter().any(|angle| !angle.is_finite())) {
        return Err(Error::argument("ahead", "an angle that is not finite", "two bearings"));
    }
    if a.lines.lines.is_empty() || b.lines.lines.is_empty() {
        return Ok(());
    }
    let WideScratch { weighted, likenesses: scores, search, kept, bearings } = scratch;
    for ((weighted, bearings), image) in weighted.iter_mut().zip(bearings.iter_mut()).zip([a, b]) {
        weighted.fill(image.lines, image.values);
        bearings.clear();
        bearings.extend(image.lines.lines.iter().map(|line| line.bearing_rad));
    }
    // Lines that are bright on the same side, where both tell.
    let same = |i: usize, j: usize| a.lines.lines[i].polarity * b.lines.lines[j].polarity >= 0.0;
    likenesses(&weighted[0], &weighted[1], same, scores);
    search.fill(scores);
    let least = options.likeness_min as f32;
    let [first, second] = &*bearings;
    let (motion, rival) = if let Some(ahead) = ahead {
        (search.near(first, second, ahead, 3.0 * options.motion_sigma_rad, least), None)
    } else {
        let (motion, rival) = search.best(first, second, least);
        (motion, Some(rival))
    };
    let found = search.under(first, second, &motion, false);
    mutual(found, second.len(), least, kept);
    keep_cyclic_order(kept, second.len());
    let share = kept.len() as f64 / first.len().min(second.len()) as f64;
    let rival = rival.map_or(RIVAL_TOLD, |rival| f64::from(rival / motion.total.max(1e-6)).min(1.0));
    for one in &*kept {
        let pair = one.a * second.len() + one.b;
        let score = found[pair];
        let signs = Signs {
            margin: f64::from(margin(found, second.len(), one)),
            rival,
            share,
            parallax_rad: parallax(first[one.a], second[one.b], &motion),
            drop: f64::from(scores[pair * COURSE..(pair + 1) * COURSE].iter().copied().fold(score, f32::max) - score),
        };
        let confidence = signs.confidence();
        if confidence >= options.confidence_min {
            out.push(WideMatch { a: one.a, b: one.b, confidence });
        }
    }
    Ok(())
}

/// The pairs that are best for both of their lines, by rising line of the first image.
fn mutual(scores: &[f32], m: usize, least: f32, out: &mut Vec<Match>) {
    let n = scores.len() / m;
    out.clear();
    for (a, row) in scores.chunks_exact(m).enumerate() {
        let Some((b, score)) = row.iter().enumerate().max_by(|x, y| x.1.total_cmp(y.1)) else { continue };
        if *score >= least && (0..n).all(|i| i == a || scores[i * m + b] < *score) {
            out.push(Match { a, b, distance: -f64::from(*score) });
        }
    }
}

/// How much more alike a pair is than any other of its two lines.
fn margin(scores: &[f32], m: usize, pair: &Match) -> f32 {
    let row = (0..m).filter(|j| *j != pair.b).map(|j| scores[pair.a * m + j]);
    let column = (0..scores.len() / m).filter(|i| *i != pair.a).map(|i| scores[i * m + pair.b]);
    scores[pair.a * m + pair.b] - row.chain(column).fold(likeness::NEVER, f32::max)
}

/// How far the bearing of a line changes from one image to the next beside the turn.
fn parallax(a: f64, b: f64, motion: &Motion) -> f64 {
    wrap(wrap(b - motion.ahead_b) - wrap(a - motion.ahead_a)).abs()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::lines::line::Line;

    /// Where edges stand, and the level at the height `h` of either side of one: waves of its own.
    const EDGES: [(f64, f64); 12] = [
        (3.0, 1.2),
        (2.0, -1.5),
        (-1.0, 2.5),
        (-2.5, -0.8),
        (4.5, 0.4),
        (0.8, -2.2),
        (-3.5, 1.9),
        (1.4, 2.0),
        (5.0, -2.6),
        (-0.6, -3.1),
        (-4.2, -2.4),
        (2.9, 3.3),
    ];

    fn level(edge: usize, side: usize, h: f64) -> f32 {
        let wave = |k: f64| (k * (3.0 + 0.7 * edge as f64) * h + 2.3 * (edge * edge + 5 * side) as f64 + k).sin();
        (120.0 + 35.0 * (wave(1.0) + 0.6 * wave(2.3)) + if side == 0 { -25.0 } else { 25.0 }) as f32
    }

    /// The edges as a camera at `(x, y)` sees them that is turned by `yaw`, by rising bearing, and the edge of each line.
    fn seen(x: f64, y: f64, yaw: f64) -> (Lines, Vec<f32>, Vec<usize>) {
        let mut all: Vec<(f64, f64, usize)> = EDGES
            .iter()
            .enumerate()
            .map(|(edge, (u, v))| (wrap((v - y).atan2(u - x) - yaw), (u - x).hypot(v - y), edge))
            .collect();
        all.sort_by(|a, b| a.0.total_cmp(&b.0));
        let mut values = Vec::new();
        for (_, distance, edge) in &all {
            for side in 0..2 {
                values.extend(
                    (0..profile_rows::ROWS)
                        .map(|row| level(*edge, side, distance * profile_rows::elevation_rad(row).tan())),
                );
            }
        }
        let line = |bearing_rad: f64| Line {
            bearing_rad,
            sigma_rad: 0.001,
            support_px: 50,
            elevation_min_rad: -0.4,
            elevation_max_rad: 0.6,
            polarity: 1.0,
        };
        let lines = Lines { lines: all.iter().map(|one| line(one.0)).collect(), ..Lines::default() };
        (lines, values, all.iter().map(|one| one.2).collect())
    }

    fn matched(ahead: Option<[f64; 2]>) -> (usize, usize) {
        let ((first, a, here), (second, b, there)) = (seen(0.0, 0.0, 0.3), seen(1.1, 0.6, -1.2));
        let (a, b) = (Profiles { lines: &first, values: &a }, Profiles { lines: &second, values: &b });
        let mut out = Vec::new();
        match_wide(&a, &b, ahead, &WideOptions::default(), &mut WideScratch::default(), &mut out).unwrap();
        assert!(out.iter().all(|found| found.confidence >= 0.8 && found.confidence <= 1.0));
        (out.len(), out.iter().filter(|found| here[found.a] == there[found.b]).count())
    }

    #[test]
    fn lines_are_found_again_after_more_than_a_metre_whether_the_motion_is_told_or_not() {
        let way = 0.6_f64.atan2(1.1);
        for ahead in [None, Some([way - 0.3 + 0.03, way + 1.2 - 0.03])] {
            let (found, right) = matched(ahead);
            assert!(right >= 6 && right == found, "{ahead:?}: {right} right of {found}");
        }
    }

    #[test]
    fn the_likeness_is_greatest_at_the_ratio_of_the_distances() {
        let ((first, a, here), (second, b, there)) = (seen(0.0, 0.0, 0.0), seen(1.1, 0.6, 0.0));
        let mut weighted = [Weighted::default(), Weighted::default()];
        weighted[0].fill(&first, &a);
        weighted[1].fill(&second, &b);
        let mut scores = Vec::new();
        likenesses(&weighted[0], &weighted[1], |_, _| true, &mut scores);
        let mut right = 0;
        for (i, edge) in here.iter().enumerate() {
            let j = there.iter().position(|other| other == edge).unwrap();
            let course = &scores[(i * there.len() + j) * COURSE..][..COURSE];
            let best = (0..COURSE).max_by(|x, y| course[*x].total_cmp(&course[*y])).unwrap();
            let (u, v) = EDGES[*edge];
            let ratio = (u.hypot(v) / (u - 1.1).hypot(v - 0.6)).ln() / profile_rows::PITCH;
            right += usize::from((best as f64 - likeness::SHIFTS as f64 - ratio).abs() <= 1.0);
        }
        assert!(right >= 10, "{right}");
    }

    #[test]
    fn what_is_no_profile_is_refused_and_no_lines_are_no_matches() {
        let (lines, values, _) = seen(0.0, 0.0, 0.0);
        let (whole, none) = (Profiles { lines: &lines, values: &values }, Lines::default());
        let short = Profiles { lines: &lines, values: &values[1..] };
        let (options, mut scratch, mut out) = (WideOptions::default(), WideScratch::default(), Vec::new());
        let refusal = match_wide(&whole, &short, None, &options, &mut scratch, &mut out).unwrap_err().to_string();
        assert!(refusal.contains("190 for each line"), "{refusal}");
        let refusal = match_wide(&whole, &whole, Some([f64::NAN, 0.0]), &options, &mut scratch, &mut out).unwrap_err();
        assert!(refusal.to_string().contains("ahead"), "{refusal}");
        let empty = Profiles { lines: &none, values: &[] };
        match_wide(&whole, &empty, None, &options, &mut scratch, &mut out).unwrap();
        assert!(out.is_empty());
    }
}
