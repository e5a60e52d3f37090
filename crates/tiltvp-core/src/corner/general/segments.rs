//! Line segments: ridge pixels grown together where their gradients agree, and split until each lies on one great circle.

use nalgebra::{Matrix3, Vector2, Vector3};
use tiltvp_kernels::prefetch::prefetch;
use tiltvp_kernels::vectorised;

use crate::camera::Camera;
use crate::corner::options::GeneralOptions;
use crate::edges::{EdgeOptions, Mask, Region, RidgeDetector, RidgePixels};
use crate::error::Result;
use crate::geometry::fit_great_circle;
use crate::image::ImageView;

/// Cosine of the largest angle between a pixel's gradient and that of the pixels it joins: 22.5 degrees, as in the line
/// segment detector of Grompone von Gioi et al. 2010.
const AGREEING_COS: f32 = 0.9239;

/// How far from a pixel its followers are looked for, in pixels: a ridge may miss one pixel.
const REACH: usize = 2;

/// How many pixels ahead bearings are asked for: the latency of memory. Answers do not depend on it.
const AHEAD: usize = 8;

/// Pixels from one end of the reach to the other.
const SPAN: usize = 2 * REACH + 1;

/// Most segments of an image, the longest ones, which bounds the search for junctions to 320 ends.
const SEGMENTS_MAX: usize = 160;

/// A straight piece of an edge.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Segment {
    /// Unit normal of its great circle, camera frame.
    pub normal: Vector3<f64>,
    /// Unit bearings of its ends, on the circle: from the first to the second is a positive turn about the normal.
    pub ends: [Vector3<f64>; 2],
    /// Pixels of its ends.
    pub ends_px: [Vector2<f64>; 2],
    /// Distance of its ends in pixels.
    pub length_px: f64,
    /// Pixels per radian along it.
    pub px_per_rad: f64,
}

/// The pixels that are looked at, which are the same for every image of a camera.
#[derive(Debug, Clone)]
pub(crate) struct SegmentFinder {
    region: Region,
    /// Unit bearings of the region's pixels.
    bearings: Vec<Vector3<f64>>,
    edges: EdgeOptions,
    /// For each row its one span of pixels: the first column, one past the last, and the slot of the first; none for rows
    /// with several spans.
    rows: Vec<Option<(usize, usize, usize)>>,
}

/// Memory for one thread.
#[derive(Debug, Clone)]
pub(crate) struct SegmentScratch {
    detector: RidgeDetector,
    ridge: RidgePixels,
    free: FreePixels,
    /// Places among the ridge pixels in the lower half, in the upper what is less for stronger ones.
    order: Vec<u64>,
    spare: Vec<u64>,
    /// Directions of the ridge pixels' gradients.
    units: Vec<[f32; 2]>,
    members: Vec<u32>,
    points: Vec<(Vector2<f64>, Vector3<f64>)>,
    pub(crate) segments: Vec<Segment>,
}

/// A bit for each pixel: whether it is a ridge pixel that has not been taken. All are zero after an image.
#[derive(Debug, Clone, Default)]
struct FreePixels {
    bits: Vec<u8>,
    /// Bytes from row to row, some more than the pixels need.
    stride: usize,
    /// The same bits before any was taken, and how many ridge pixels come before each byte.
    all: Vec<u8>,
    before: Vec<u32>,
}

impl FreePixels {
    fn make(&mut self, width: usize, height: usize) {
        let stride = width / 8 + 4;
        if (self.stride, self.bits.len()) != (stride, stride * height) {
            self.stride = stride;
            self.bits.clear();
            self.bits.resize(stride * height, 0);
        }
    }

    /// Counts the pixels, once all are there.
    fn count(&mut self) {
        self.all.clone_from(&self.bits);
        let mut before = 0;
        self.before.clear();
        self.before.extend(self.all.iter().map(|byte| {
            let so_far = before;
            before += byte.count_ones();
            so_far
        }));
    }

    /// The place among the ridge pixels, which are in the order of rows and columns, of a pixel that is one.
    #[inline(always)]
    fn number(&self, u: usize, v: usize) -> u32 {
        let at = v * self.stride + u / 8;
        self.before[at] + (u32::from(self.all[at]) & ((1 << (u % 8)) - 1)).count_ones()
    }

    #[inline(always)]
    fn add(&mut self, u: usize, v: usize) {
        self.bits[v * self.stride + u / 8] |= 1 << (u % 8);
    }

    /// Whether it was there to be taken.
    #[inline(always)]
    fn take(&mut self, u: usize, v: usize) -> bool {
        let (byte, bit) = (&mut self.bits[v * self.stride + u / 8], 1 << (u % 8));
        let was = *byte & bit != 0;
        *byte &= !bit;
        was
    }

    /// The bits of the pixels within reach, row by row, the first the lowest.
    #[inline(always)]
    fn around(&self, u: usize, v: usize) -> u32 {
        let (byte, shift) = ((u - REACH) / 8, (u - REACH) % 8);
        (0..SPAN).fold(0, |around, row| {
            let at = (v - REACH + row) * self.stride + byte;
            let bits = self.bits[at..at + 2].iter().rev().fold(0, |bits, byte| bits << 8 | u32::from(*byte));
            around | (bits >> shift & ((1 << SPAN) - 1)) << (SPAN * row)
        })
    }
}

impl SegmentFinder {
    /// Tables for a camera.
    pub(crate) fn new(camera: &Camera, options: &GeneralOptions, mask: Option<&Mask>) -> Result<Self> {
        let edges = EdgeOptions {
            gradient_min: options.gradient_min,
            smoothing_px: options.smoothing_px,
            elevation_min_rad: -std::f64::consts::FRAC_PI_2,
            elevation_max_rad: std::f64::consts::FRAC_PI_2,
            margin_px: options.margin_px.max(2.0),
        };
        let region = Region::new(camera, &Matrix3::identity(), &edges, mask)?;
        let mut spans_in = vec![0_u32; camera.height() as usize];
        let mut rows = vec![None; camera.height() as usize];
        for span in region.spans() {
            spans_in[span.v] += 1;
            rows[span.v] = (spans_in[span.v] == 1).then_some((span.first, span.end, span.slot));
        }
        let bearings = region.pixels().map(|(_, _, bearing)| bearing).collect();
        Ok(Self { region, bearings, edges, rows })
    }

    /// The slot of the pixel beside `(u, v)` on whose side a place is, where it is known.
    fn beside(&self, (u, v): (usize, usize), shift: (f64, f64)) -> Option<usize> {
        let step = |at: usize, by: f64| if by < 0.0 { at.checked_sub(1) } else { Some(at + usize::from(by > 0.0)) };
        let (u, v) = (step(u, shift.0)?, step(v, shift.1)?);
        let (first, end, start) = (*self.rows.get(v)?)?;
        (first..end).contains(&u).then(|| start + u - first)
    }

    /// The unit bearing of a place a share of a pixel from the pixel `(u, v)` that is number `slot`, along the row or the
    /// column; between the bearings of pixel centres where both are known.
    fn bearing(&self, camera: &Camera, slot: usize, (u, v): (usize, usize), shift: (f64, f64)) -> Option<Vector3<f64>> {
        let between = || {
            let (here, there) = (self.bearings.get(slot)?, self.bearings.get(self.beside((u, v), shift)?)?);
            (here + (there - here) * shift.0.abs().max(shift.1.abs())).try_normalize(0.5)
        };
        between().or_else(|| camera.unproject(&Vector2::new(u as f64 + shift.0, v as f64 + shift.1)))
    }

    /// Memory for one thread.
    pub(crate) fn scratch(&self) -> SegmentScratch {
        SegmentScratch {
            detector: RidgeDetector::new(&self.region, &self.edges),
            ridge: RidgePixels::default(),
            free: FreePixels::default(),
            order: Vec::new(),
            spare: Vec::new(),
            units: Vec::new(),
            members: Vec::new(),
            points: Vec::new(),
            segments: Vec::new(),
        }
    }

    /// Fills `scratch.segments`, the longest first.
    pub(crate) fn find(
        &self,
        camera: &Camera,
        image: &ImageView<'_>,
        options: &GeneralOptions,
        scratch: &mut SegmentScratch,
    ) {
        let SegmentScratch { detector, ridge, free, order, spare, units, members, points, segments } = scratch;
        detector.detect(image, &self.region, self.edges.gradient_min, None, ridge);
        let (slots, gx, gy) = (ridge.edges.slot(), ridge.edges.gx(), ridge.edges.gy());
        free.make(image.width(), image.height());
        let places = ridge.edges.place();
        let place = |i: usize| column_and_row(places[i]);
        for i in 0..slots.len() {
            let (u, v) = place(i);
            free.add(u, v);
        }
        free.count();
        units.resize(slots.len(), [0.0; 2]);
        directions(gx, gy, units);
        order.clear();
        order.extend(gx.iter().zip(gy).enumerate().map(|(i, (x, y))| {
            // Bits of numbers that are not negative are ordered as the numbers are.
            u64::from(!(x * x + y * y).to_bits()) << 32 | i as u64
        }));
        sort_by_upper_half(order, spare);
        // Which pixel beside it a ridge pixel's edge is next to, by its shift along the row or the column.
        let shift = |i: usize| {
            let shift = f64::from(ridge.shift_px()[i]);
            if gx[i].abs() >= gy[i].abs() { (shift, 0.0) } else { (0.0, shift) }
        };
        segments.clear();
        for seed in order.iter().map(|key| *key as u32) {
            let (u, v) = place(seed as usize);
            if !free.take(u, v) {
                continue;
            }
            let sum = grow(seed, (places, units), free, members);
            if (members.len() as f64) < 0.7 * options.segment_min_px {
                continue;
            }
            points.clear();
            points.extend(members.iter().enumerate().filter_map(|(k, i)| {
                if let Some(later) = members.get(k + AHEAD) {
                    let later = *later as usize;
                    prefetch(&self.bearings, slots[later] as usize);
                    prefetch(&self.bearings, self.beside(place(later), shift(later)).unwrap_or(0));
                }
                let (i, (u, v)) = (*i as usize, place(*i as usize));
                let (du, dv) = shift(i);
                let bearing = self.bearing(camera, slots[i] as usize, (u, v), (du, dv))?;
                Some((Vector2::new(u as f64 + du, v as f64 + dv), bearing))
            }));
            // Along the edge, which is across the mean gradient.
            let along = Vector2::new(f64::from(-sum[1]), f64::from(sum[0]));
            points.sort_unstable_by(|(a, _), (b, _)| a.dot(&along).total_cmp(&b.dot(&along)));
            split(camera, points, options, segments);
        }
        segments.sort_unstable_by(|a, b| b.length_px.total_cmp(&a.length_px));
        segments.truncate(SEGMENTS_MAX);
    }
}

/// Bits of a digit: three of them are the upper half of a key.
const DIGIT: usize = 11;

/// Sorts keys by their upper halves, those with the same in the order they are in.
fn sort_by_upper_half(keys: &mut Vec<u64>, spare: &mut Vec<u64>) {
    let digit = |key: u64, shift: usize| (key >> shift) as usize & ((1 << DIGIT) - 1);
    for shift in [32, 32 + DIGIT, 32 + 2 * DIGIT] {
        let mut next = [0_u32; 1 << DIGIT];
        for key in keys.iter() {
            next[digit(*key, shift)] += 1;
        }
        let mut before = 0;
        for place in &mut next {
            (*place, before) = (before, before + *place);
        }
        spare.resize(keys.len(), 0);
        for key in keys.iter() {
            let place = &mut next[digit(*key, shift)];
            spare[*place as usize] = *key;
            *place += 1;
        }
        std::mem::swap(keys, spare);
    }
}

/// Column and row of a packed place.
#[inline(always)]
fn column_and_row(place: u32) -> (usize, usize) {
    ((place & 0xffff) as usize, (place >> 16) as usize)
}

/// Collects the free pixels that connect to a seed and whose gradients agree with those collected before; returns the sum of
/// the gradients' directions.
#[inline(always)]
fn grow(seed: u32, (places, units): (&[u32], &[[f32; 2]]), free: &mut FreePixels, members: &mut Vec<u32>) -> [f32; 2] {
    members.clear();
    members.push(seed);
    let mut sum = units[seed as usize];
    let mut least = AGREEING_COS * length(sum);
    let mut next = 0;
    while let Some(at) = members.get(next) {
        next += 1;
        let (u, v) = column_and_row(places[*at as usize]);
        // The region keeps more than the reach clear of the image's border.
        let mut around = free.around(u, v);
        while around != 0 {
            let place = around.trailing_zeros() as usize;
            around &= around - 1;
            let (u, v) = (u - REACH + place % SPAN, v - REACH + place / SPAN);
            let candidate = free.number(u, v);
            let [x, y] = units[candidate as usize];
            if x * sum[0] + y * sum[1] > least {
                free.take(u, v);
                sum = [sum[0] + x, sum[1] + y];
                least = AGREEING_COS * length(sum);
                members.push(candidate);
            }
        }
    }
    sum
}

/// Length of a vector, rounded once.
#[inline(always)]
fn length([x, y]: [f32; 2]) -> f32 {
    (f64::from(x) * f64::from(x) + f64::from(y) * f64::from(y)).sqrt() as f32
}

vectorised! {
    /// Unit vectors along gradients.
    fn directions(gx: &[f32], gy: &[f32], out: &mut [[f32; 2]]) {
        for ((x, y), out) in gx.iter().zip(gy).zip(out) {
            let length = length([*x, *y]);
            *out = [x / length, y / length];
        }
    }
}

/// Appends the points as one segment, or the halves on both sides of the point that is farthest from the circle through
/// the ends.
fn split(
    camera: &Camera,
    points: &[(Vector2<f64>, Vector3<f64>)],
    options: &GeneralOptions,
    segments: &mut Vec<Segment>,
) {
    let (Some((first_px, first)), Some((last_px, last))) = (points.first(), points.last()) else { return };
    let length_px = (last_px - first_px).norm();
    if length_px < options.segment_min_px || (points.len() < 8 && (points.len() as f64) < 0.6 * length_px) {
        return;
    }
    let Some(chord) = first.cross(last).try_normalize(1e-9) else { return };
    let px_per_rad = length_px / first.angle(last);
    let farthest = points
        .iter()
        .enumerate()
        .map(|(i, (_, bearing))| (i, chord.dot(bearing).abs() * px_per_rad))
        .max_by(|a, b| a.1.total_cmp(&b.1));
    let Some((at, distance)) = farthest else { return };
    let fit = fit_great_circle(points.iter().map(|(_, bearing)| (*bearing, 1.0)));
    let straight = fit.filter(|fit| {
        let worst = points.iter().map(|(_, bearing)| fit.normal.dot(bearing).abs()).fold(0.0, f64::max);
        worst * px_per_rad <= options.segment_threshold_px
    });
    if let Some(fit) = straight {
        let normal = if fit.normal.dot(&chord) < 0.0 { -fit.normal } else { fit.normal };
        let onto = |bearing: &Vector3<f64>| (bearing - normal * normal.dot(bearing)).normalize();
        let ends = [onto(first), onto(last)];
        let [Some(a), Some(b)] = ends.map(|end| camera.project(&end)) else { return };
        segments.push(Segment { normal, ends, ends_px: [a, b], length_px, px_per_rad });
    } else if distance > 0.5 * options.segment_threshold_px && at > 0 && at + 1 < points.len() {
        split(camera, &points[..=at], options, segments);
        split(camera, &points[at..], options, segments);
    }
}
