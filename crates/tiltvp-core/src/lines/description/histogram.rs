//! Histograms of the gradients on both sides of an area (Scaramuzza, Siegwart and Martinelli 2009, section 3), in passes over all its samples at once.

use std::f32::consts::{PI, TAU};

use tiltvp_kernels::vectorised;

use crate::lines::angles::atan2;

/// The Gaussian window of an area of the descriptor, laid out as the rows of a patch are.
#[derive(Debug, Clone, Default)]
pub(crate) struct GaussianWindow {
    /// Weights of the samples, zero outside the circle; half of them on the line itself, which counts on both sides.
    weights: Vec<f32>,
    /// For each row where the circle begins.
    starts: Vec<usize>,
    /// Samples from the middle to the rim.
    half: usize,
    /// From row to row.
    stride: usize,
    /// The Gaussian's standard deviation as a fraction of the radius.
    width: f64,
}

impl GaussianWindow {
    /// Makes the window for areas of `half` samples from middle to rim, in patches of `stride` columns.
    pub(crate) fn make(&mut self, half: usize, width: f64, stride: usize) {
        if (self.half, self.stride, self.width) == (half, stride, width) {
            return;
        }
        let n = 2 * half + 1;
        let weight = |row: usize, column: usize| {
            let (x, y) = (column as f64 - half as f64, row as f64 - half as f64);
            let squared = (x * x + y * y) / (half * half) as f64;
            let share = if column == half { 0.5 } else { 1.0 };
            if squared <= 1.0 { share * (-0.5 * squared / (width * width)).exp() as f32 } else { 0.0 }
        };
        let weight = |i: usize| if i % stride < n { weight(i / stride, i % stride) } else { 0.0 };
        self.weights.clear();
        self.weights.extend((0..n * stride).map(weight));
        self.starts.clear();
        self.starts.extend(
            self.weights.chunks_exact(stride).map(|row| row.iter().position(|weight| *weight > 0.0).unwrap_or(n)),
        );
        (self.half, self.stride, self.width) = (half, stride, width);
    }
}

/// Memory of one area.
#[derive(Debug, Clone, Default)]
pub(crate) struct AreaScratch {
    along: Vec<f32>,
    smooth: Vec<f32>,
    votes: Votes,
}

/// What each sample adds to which bins.
#[derive(Debug, Clone, Default)]
struct Votes {
    /// The bin below its orientation, and the one above.
    bins: [Vec<u32>; 2],
    /// What it adds to each.
    shares: [Vec<f32>; 2],
}

/// Adds the gradients of a smoothed patch to the histograms of its two sides, which are the halves of `out`: left of the line,
/// where azimuth is greater, first.
///
/// `kernel` is half of the Gaussian that smooths, the middle first; with a kernel of `k` values patches reach `k` samples
/// beyond the circle.
pub(crate) fn histograms(
    levels: &[f32],
    window: &GaussianWindow,
    kernel: &[f32],
    scratch: &mut AreaScratch,
    out: &mut [f32],
) {
    let AreaScratch { along, smooth, votes } = scratch;
    let (stride, reach) = (window.stride, kernel.len() - 1);
    // What wraps from the end of a row to the begin of the next lies beyond the window.
    along.resize(levels.len() - 2 * reach * stride, 0.0);
    blend(levels, kernel, stride, along);
    smooth.resize(along.len() - 2 * reach, 0.0);
    blend(along, kernel, 1, smooth);
    // The last row of weights ends with the last sample of its gradients.
    let n = window.weights.len().min(smooth.len() - 2 * stride - 2);
    let bins = out.len() / 2;
    votes.bins.iter_mut().for_each(|bins| bins.resize(n, 0));
    votes.shares.iter_mut().for_each(|shares| shares.resize(n, 0.0));
    cast(smooth, stride, &window.weights[..n], bins as u32, votes);
    let [below, above] = votes.bins.each_ref().map(Vec::as_slice);
    let [low, high] = votes.shares.each_ref().map(Vec::as_slice);
    let (left, right) = out.split_at_mut(bins);
    for (row, start) in window.starts.iter().enumerate() {
        // From the rim to the line on the right, from the line to the rim on the left: two sums that do not wait for each other.
        let count = (window.half + 1).saturating_sub(*start);
        let (first, middle) = (row * stride + start, row * stride + window.half);
        let side = |at: usize| {
            let part = at..at + count;
            below[part.clone()].iter().zip(&above[part.clone()]).zip(low[part.clone()].iter().zip(&high[part]))
        };
        for (((ra, rb), (rl, rh)), ((la, lb), (ll, lh))) in side(first).zip(side(middle)) {
            right[*ra as usize] += rl;
            left[*la as usize] += ll;
            right[*rb as usize] += rh;
            left[*lb as usize] += lh;
        }
    }
}

/// Values that are worked on together, in registers. Answers do not depend on it; a test compares with one by one.
const BLOCK: usize = 32;

vectorised! {
    /// Weights values by a Gaussian over neighbours that are `step` apart; it loses its reach on both ends.
    fn blend(values: &[f32], kernel: &[f32], step: usize, out: &mut [f32]) {
        let reach = kernel.len() - 1;
        let (blocks, rest) = out.as_chunks_mut::<BLOCK>();
        let done = BLOCK * blocks.len();
        for (block, start) in blocks.iter_mut().zip((reach * step..).step_by(BLOCK)) {
            let mut sums = [0.0; BLOCK];
            for (sum, value) in sums.iter_mut().zip(&values[start..start + BLOCK]) {
                *sum = kernel[0] * value;
            }
            for (tap, off) in kernel[1..].iter().zip((step..).step_by(step)) {
                let (before, after) = (&values[start - off..][..BLOCK], &values[start + off..][..BLOCK]);
                for ((sum, before), after) in sums.iter_mut().zip(before).zip(after) {
                    *sum += tap * (before + after);
                }
            }
            *block = sums;
        }
        for (sum, at) in rest.iter_mut().zip(reach * step + done..) {
            *sum = kernel[0] * values[at];
            for (tap, off) in kernel[1..].iter().zip((step..).step_by(step)) {
                *sum += tap * (values[at - off] + values[at + off]);
            }
        }
    }
}

vectorised! {
    /// The votes of the Sobel gradients about each sample: weighted magnitudes, shared by the two bins next to the orientation
    /// (eq. 2), zero where a sample is not of the world. Rows are two samples wider than those of the weights.
    fn cast(levels: &[f32], stride: usize, weights: &[f32], bins: u32, votes: &mut Votes) {
        let [first, second] = &mut votes.bins;
        let [low, high] = &mut votes.shares;
        let outs =
            first.chunks_mut(BLOCK).zip(second.chunks_mut(BLOCK)).zip(low.chunks_mut(BLOCK).zip(high.chunks_mut(BLOCK)));
        for ((weights, outs), start) in weights.chunks(BLOCK).zip(outs).zip((0..).step_by(BLOCK)) {
            let n = weights.len();
            let mut block = VoteBlock::default();
            block.weights[..n].copy_from_slice(weights);
            for (row, at) in block.rows.iter_mut().zip((start..).step_by(stride)) {
                row[..n + 2].copy_from_slice(&levels[at..at + n + 2]);
            }
            block.cast(bins);
            let ((first, second), (low, high)) = outs;
            first.copy_from_slice(&block.bins[0][..n]);
            second.copy_from_slice(&block.bins[1][..n]);
            low.copy_from_slice(&block.shares[0][..n]);
            high.copy_from_slice(&block.shares[1][..n]);
        }
    }
}

/// Samples whose votes are cast together, in arrays of their own, so that nothing written is read.
struct VoteBlock {
    weights: [f32; BLOCK],
    rows: [[f32; BLOCK + 2]; 3],
    bins: [[u32; BLOCK]; 2],
    shares: [[f32; BLOCK]; 2],
}

impl Default for VoteBlock {
    fn default() -> Self {
        Self { weights: [0.0; BLOCK], rows: [[0.0; BLOCK + 2]; 3], bins: [[0; BLOCK]; 2], shares: [[0.0; BLOCK]; 2] }
    }
}

impl VoteBlock {
    #[inline(always)]
    fn cast(&mut self, bins: u32) {
        let Self { weights, rows: [below, here, above], bins: [first, second], shares: [low, high] } = self;
        let bins_per_rad = bins as f32 / TAU;
        for j in 0..BLOCK {
            let across = above[j + 2] - above[j] + below[j + 2] - below[j] + 2.0 * (here[j + 2] - here[j]);
            let along = above[j] - below[j] + above[j + 2] - below[j + 2] + 2.0 * (above[j + 1] - below[j + 1]);
            let magnitude = weights[j] * (across * across + along * along).sqrt();
            let place = (atan2(across, along) + PI) * bins_per_rad;
            let whole = place as i32;
            let share = place - whole as f32;
            let bin = if whole as u32 >= bins { whole as u32 - bins } else { whole as u32 };
            first[j] = bin;
            second[j] = if bin + 1 == bins { 0 } else { bin + 1 };
            // NaN is a sample that is not of the world.
            low[j] = if magnitude > 0.0 { magnitude * (1.0 - share) } else { 0.0 };
            high[j] = if magnitude > 0.0 { magnitude * share } else { 0.0 };
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The sums one by one, sample after sample, as in section 3.
    fn one_by_one(levels: &[f32], side: usize, half: usize, width: f64, kernel: &[f32], bins: usize) -> Vec<f32> {
        let reach = kernel.len() - 1;
        let weighted = |value: &dyn Fn(usize) -> f32, at: usize| {
            (1..=reach).fold(kernel[0] * value(at), |sum, k| sum + kernel[k] * (value(at - k) + value(at + k)))
        };
        let along = |i: usize, j: usize| weighted(&|i| levels[i * side + j], i);
        let smooth = |i: usize, j: usize| weighted(&|j| along(i + reach, j), j + reach);
        let mut out = vec![0.0; 2 * bins];
        for i in 0..=2 * half {
            for j in 0..=2 * half {
                let at = |di: usize, dj: usize| smooth(i + di, j + dj);
                let across = at(2, 2) - at(2, 0) + at(0, 2) - at(0, 0) + 2.0 * (at(1, 2) - at(1, 0));
                let rising = at(2, 0) - at(0, 0) + at(2, 2) - at(0, 2) + 2.0 * (at(2, 1) - at(0, 1));
                let (x, y) = (j as f64 - half as f64, i as f64 - half as f64);
                let squared = (x * x + y * y) / (half * half) as f64;
                let weight = if squared <= 1.0 { (-0.5 * squared / (width * width)).exp() as f32 } else { 0.0 };
                let magnitude = weight * (across * across + rising * rising).sqrt();
                if magnitude.is_nan() || magnitude <= 0.0 {
                    continue;
                }
                let place = (atan2(across, rising) + PI) * (bins as f32 / TAU);
                let (bin, share) = (place as usize, place - place.floor());
                let sides: &[(usize, f32)] = match j.cmp(&half) {
                    std::cmp::Ordering::Greater => &[(0, 1.0)],
                    std::cmp::Ordering::Less => &[(bins, 1.0)],
                    std::cmp::Ordering::Equal => &[(0, 0.5), (bins, 0.5)],
                };
                for (first, part) in sides {
                    out[first + bin % bins] += part * magnitude * (1.0 - share);
                    out[first + (bin + 1) % bins] += part * magnitude * share;
                }
            }
        }
        out
    }

    #[test]
    fn passes_over_all_samples_give_the_same_bits_as_one_by_one() {
        for (half, kernel, bins) in [(5, vec![1.0], 8), (9, vec![0.6, 0.2], 32), (18, vec![0.4, 0.2, 0.08, 0.02], 32)] {
            let side = 2 * (half + kernel.len()) + 1;
            let mut levels: Vec<f32> =
                (0..(side * side) as u32).map(|i| (i.wrapping_mul(2_654_435_761) >> 24) as f32).collect();
            for seen in [true, false] {
                if !seen {
                    levels.iter_mut().skip(7).step_by(101).for_each(|level| *level = f32::NAN);
                }
                let (mut window, mut scratch, mut out) =
                    (GaussianWindow::default(), AreaScratch::default(), vec![0.0; 2 * bins]);
                window.make(half, 0.4, side);
                histograms(&levels, &window, &kernel, &mut scratch, &mut out);
                let plainly = one_by_one(&levels, side, half, 0.4, &kernel, bins);
                assert!(out.iter().sum::<f32>() > 0.0);
                for (ours, plain) in out.iter().zip(&plainly) {
                    assert_eq!(ours.to_bits(), plain.to_bits(), "{half}, {bins}: {ours}, not {plain}");
                }
            }
        }
    }
}
