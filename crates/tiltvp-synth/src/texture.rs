//! What surfaces look like: procedural reflectances over surface coordinates in metres.

use crate::noise::{fade_by_size, fractal_noise, hash_unit, value_noise};

/// A linear colour: red, green, blue reflectance or radiance.
pub(crate) type Color = [f64; 3];

/// A linear colour from display levels 0 to 255.
pub(crate) fn rgb(red: u8, green: u8, blue: u8) -> Color {
    [red, green, blue].map(|level| (f64::from(level) / 255.0).powf(2.2))
}

/// A colour scaled by a factor.
pub(crate) fn scale(color: Color, factor: f64) -> Color {
    color.map(|c| c * factor)
}

/// The sum of two colours.
pub(crate) fn add(a: Color, b: Color) -> Color {
    [a[0] + b[0], a[1] + b[1], a[2] + b[2]]
}

/// The luminance of a linear colour (Rec. 709).
pub(crate) fn luminance(color: Color) -> f64 {
    0.2126 * color[0] + 0.7152 * color[1] + 0.0722 * color[2]
}

/// The mix of two colours, `a` at 0 and `b` at 1.
pub(crate) fn mix(a: Color, b: Color, t: f64) -> Color {
    let t = t.clamp(0.0, 1.0);
    [0, 1, 2].map(|i| a[i] + (b[i] - a[i]) * t)
}

/// The pattern of a wallpaper.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum Motif {
    Stripes,
    Diamonds,
    Flowers,
}

/// The edges of the upright stripes of a wallpaper, in periods: one broad stripe and two narrow ones.
const STRIPE_EDGES: [f64; 6] = [0.07, 0.13, 0.28, 0.72, 0.87, 0.93];

/// A reflectance over surface coordinates `(u, v)` in metres: `u` to the right, `v` up, seen from the front.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum Texture {
    /// One colour with faint mottling of the given relative strength.
    Paint { color: Color, mottle: f64, seed: u32 },
    /// Two colours in a repeating motif.
    Wallpaper { base: Color, ink: Color, motif: Motif, period: f64, seed: u32 },
    /// Grain along `u` or `v`.
    Wood { light: Color, dark: Color, along_v: bool, seed: u32 },
    /// Boards of wood, laid along `u` with staggered joints.
    Planks { light: Color, dark: Color, width: f64, length: f64, seed: u32 },
    /// Rectangular tiles with joints.
    Tiles { color: Color, joint: Color, size: [f64; 2], gap: f64, variation: f64, seed: u32 },
    /// Mineral-fibre ceiling tiles: grid lines and specks.
    CeilingTiles { color: Color, size: f64, seed: u32 },
    /// Running bond.
    Brick { color: Color, joint: Color, seed: u32 },
    /// Speckled pile.
    Carpet { color: Color, speckle: Color, seed: u32 },
    /// Woven cloth with broad folds.
    Cloth { color: Color, fold: f64, seed: u32 },
    /// A framed picture of the given size.
    Picture { size: [f64; 2], sky: Color, land: Color, accent: Color, seed: u32 },
    /// A board with writing, of the given size.
    Whiteboard { size: [f64; 2], seed: u32 },
    /// Cork with sheets of paper.
    Pinboard { size: [f64; 2], seed: u32 },
    /// The back of a book: a title block and bands.
    Spine { color: Color, ink: Color, height: f64, seed: u32 },
    /// A screen that shows windows of text.
    Screen { size: [f64; 2], seed: u32 },
    /// A rug with a border, of the given size.
    Rug { size: [f64; 2], base: Color, ink: Color, seed: u32 },
}

impl Texture {
    /// The reflectance at `(u, v)` metres, with features finer than `footprint` metres averaged out.
    pub(crate) fn reflectance(&self, u: f64, v: f64, footprint: f64) -> Color {
        match *self {
            Self::Paint { color, mottle, seed } => {
                scale(color, 1.0 + mottle * fractal_noise(u, v, 0.5, 4, footprint, seed))
            }
            Self::Wallpaper { base, ink, motif, period, seed } => {
                let t = motif_at(motif, u / period, v / period, footprint / period) * 0.85;
                scale(mix(base, ink, t), 1.0 + 0.05 * fractal_noise(u, v, 0.7, 3, footprint, seed))
            }
            Self::Wood { light, dark, along_v, seed } => {
                let (along, across) = if along_v { (v, u) } else { (u, v) };
                mix(light, dark, grain(along, across, footprint, seed))
            }
            Self::Planks { light, dark, width, length, seed } => {
                planks(light, dark, [width, length], [u, v], footprint, seed)
            }
            Self::Tiles { color, joint, size, gap, variation, seed } => {
                let (i, j) = ((u / size[0]).floor(), (v / size[1]).floor());
                let inside = gap_mask(u, size[0], gap, footprint) * gap_mask(v, size[1], gap, footprint);
                let tone = 1.0 + variation * (2.0 * hash_unit(i as i64, j as i64, seed) - 1.0);
                let vein = 1.0 + 0.12 * fractal_noise(u, v, 0.18, 3, footprint, seed ^ 7);
                mix(joint, scale(color, tone * vein), inside)
            }
            Self::CeilingTiles { color, size, seed } => {
                let line = gap_mask(u, size, 0.024, footprint) * gap_mask(v, size, 0.024, footprint);
                let speck = fade_by_size(0.02, footprint) * f64::from(value_noise(u / 0.012, v / 0.012, seed) > 0.6);
                let tone = 1.0 + 0.05 * fractal_noise(u, v, 1.0, 4, footprint, seed);
                scale(color, tone * (0.55 + 0.45 * line) * (1.0 - 0.3 * speck))
            }
            Self::Brick { color, joint, seed } => {
                let row = (v / 0.08).floor();
                let shifted = u + if (row as i64).rem_euclid(2) == 0 { 0.0 } else { 0.12 };
                let column = (shifted / 0.24).floor();
                let inside = gap_mask(shifted, 0.24, 0.012, footprint) * gap_mask(v, 0.08, 0.012, footprint);
                let tone = 0.75 + 0.5 * hash_unit(column as i64, row as i64, seed);
                mix(joint, scale(color, tone * (1.0 + 0.2 * fractal_noise(u, v, 0.05, 2, footprint, seed))), inside)
            }
            Self::Carpet { color, speckle, seed } => {
                let coarse = fractal_noise(u, v, 0.9, 2, footprint, seed);
                let fine = fractal_noise(u, v, 0.03, 2, footprint, seed ^ 3);
                mix(color, speckle, 0.3 + 0.25 * coarse + 0.7 * fine)
            }
            Self::Cloth { color, fold, seed } => {
                let folds = value_noise(u / 0.12, v / 1.5, seed) * fade_by_size(0.12, footprint);
                let weave = fractal_noise(u, v, 0.02, 2, footprint, seed ^ 5);
                scale(color, 1.0 + fold * folds + 0.2 * weave)
            }
            Self::Picture { size, sky, land, accent, seed } => {
                picture([u / size[0], v / size[1]], [sky, land, accent], seed)
            }
            Self::Whiteboard { size, seed } => whiteboard(u, v, size, footprint, seed),
            Self::Pinboard { size, seed } => pinboard(u, v, size, footprint, seed),
            Self::Spine { color, ink, height, seed } => spine(color, ink, v / height, seed),
            Self::Screen { size, seed } => screen(u, v, size, footprint, seed),
            Self::Rug { size, base, ink, seed } => rug(u, v, size, [base, ink], footprint, seed),
        }
    }

    /// Where, from `low` to `high` along `u`, the texture has upright edges that run through all `v`, ascending.
    pub(crate) fn upright_edges(&self, low: f64, high: f64) -> Vec<f64> {
        let (period, steps): (f64, &[f64]) = match self {
            Self::Wallpaper { motif: Motif::Stripes, period, .. } => (*period, &STRIPE_EDGES),
            Self::Tiles { size, gap, .. } => (size[0], &[-0.5 * gap / size[0], 0.5 * gap / size[0]]),
            _ => return Vec::new(),
        };
        let cells = (low / period).floor() as i64..=(high / period).ceil() as i64;
        let at = cells.flat_map(|cell| steps.iter().map(move |step| (cell as f64 + step) * period));
        at.filter(|u| (low..high).contains(u)).collect()
    }

    /// A typical reflectance, for light that bounces off the surface.
    pub(crate) fn mean(&self) -> Color {
        let at = |u, v| self.reflectance(u, v, 0.3);
        let samples = [at(0.11, 0.13), at(0.37, 0.29), at(0.23, 0.61), at(0.53, 0.47)];
        [0, 1, 2].map(|i| samples.iter().map(|s| s[i]).sum::<f64>() / 4.0)
    }
}

/// 1 inside a cell of the given size, 0 in the gap between cells, averaged over the footprint.
fn gap_mask(x: f64, size: f64, gap: f64, footprint: f64) -> f64 {
    let to_line = (x - size * (x / size).round()).abs();
    let soft = footprint.max(1e-4);
    let covered = ((0.5 * gap - to_line) / soft + 0.5).clamp(0.0, 1.0) * (gap / soft).min(1.0);
    1.0 - covered
}

/// 1 inside the interval, 0 outside, averaged over the footprint.
fn inside(x: f64, low: f64, high: f64, footprint: f64) -> f64 {
    let soft = footprint.max(1e-4);
    (((x - low) / soft + 0.5).clamp(0.0, 1.0)) * (((high - x) / soft + 0.5).clamp(0.0, 1.0))
}

fn motif_at(motif: Motif, u: f64, v: f64, footprint: f64) -> f64 {
    let cell = |x: f64| x - x.floor() - 0.5;
    let sharp = |distance: f64| (0.5 - distance / footprint.max(0.02)).clamp(0.0, 1.0);
    let visible = fade_by_size(0.5, footprint);
    let t = match motif {
        Motif::Stripes => sharp(cell(u).abs() - 0.22).max(0.6 * sharp((cell(u).abs() - 0.4).abs() - 0.03)),
        Motif::Diamonds => sharp(((cell(u).abs() + 0.5 * cell(0.5 * v).abs() * 2.0) - 0.38).abs() - 0.06),
        Motif::Flowers => {
            let odd = (v.floor() as i64).rem_euclid(2) as f64 * 0.5;
            let (x, y) = (cell(u + odd), cell(v));
            let angle = y.atan2(x);
            let petals = (x * x + y * y).sqrt() - 0.22 - 0.11 * (5.0 * angle).cos();
            sharp(petals) * (1.0 - 0.7 * sharp((x * x + y * y).sqrt() - 0.09))
        }
    };
    t * visible + 0.3 * (1.0 - visible)
}

fn grain(along: f64, across: f64, footprint: f64, seed: u32) -> f64 {
    let bend = 0.03 * value_noise(along / 0.6, across / 0.15, seed);
    let rings = fractal_noise(along * 0.06, across + bend, 0.05, 3, footprint, seed ^ 0xB);
    let tone = value_noise(along / 1.3, across / 0.4, seed ^ 0xD);
    0.45 + 0.55 * rings + 0.15 * tone
}

fn planks(light: Color, dark: Color, size: [f64; 2], at: [f64; 2], footprint: f64, seed: u32) -> Color {
    let row = (at[1] / size[0]).floor();
    let shifted = at[0] + size[1] * hash_unit(row as i64, 1, seed);
    let board = (shifted / size[1]).floor();
    let own = crate::noise::hash(board as i64, row as i64, seed);
    let tone = 0.8 + 0.4 * f64::from(own >> 8) / 16_777_216.0;
    let color = scale(mix(light, dark, grain(shifted, at[1], footprint, own)), tone);
    let mask = gap_mask(at[1], size[0], 0.006, footprint) * gap_mask(shifted, size[1], 0.006, footprint);
    scale(color, 0.3 + 0.7 * mask)
}

fn picture(at: [f64; 2], colors: [Color; 3], seed: u32) -> Color {
    let [sky, land, accent] = colors;
    let (x, y) = (at[0], at[1]);
    if seed.is_multiple_of(3) {
        // Overlapping rectangles of paint.
        let mut color = sky;
        for k in 0..7 {
            let r = |n: i64| hash_unit(k, n, seed);
            let (cx, cy, w, h) = (r(0), r(1), 0.08 + 0.3 * r(2), 0.08 + 0.3 * r(3));
            if (x - cx).abs() < w && (y - cy).abs() < h {
                color =
                    mix([land, accent, rgb(240, 236, 220), rgb(30, 32, 40)][(r(4) * 4.0) as usize % 4], color, 0.15);
            }
        }
        return color;
    }
    let hills = 0.38 + 0.16 * fractal_noise(x, 0.5, 0.6, 4, 0.0, seed);
    let near = 0.2 + 0.12 * fractal_noise(x, 9.5, 0.4, 4, 0.0, seed ^ 0x11);
    let sun = ((x - 0.3 - 0.4 * hash_unit(5, 5, seed)).powi(2) + (y - 0.75).powi(2)).sqrt();
    if y < near {
        scale(land, 0.5 + 0.4 * fractal_noise(x, y, 0.1, 3, 0.0, seed))
    } else if y < hills {
        scale(land, 1.1)
    } else if sun < 0.09 {
        accent
    } else {
        mix(scale(sky, 1.25), sky, (y - hills) * 1.5 + 0.2 * fractal_noise(x, y, 0.3, 3, 0.0, seed ^ 0x13))
    }
}

fn whiteboard(u: f64, v: f64, size: [f64; 2], footprint: f64, seed: u32) -> Color {
    let board = rgb(238, 240, 240);
    let line = (v / 0.11).floor();
    let present = hash_unit(line as i64, 0, seed) < 0.85 && v > 0.15 * size[1] && v < 0.9 * size[1];
    let (start, end) = (0.05 + 0.3 * hash_unit(line as i64, 1, seed), 0.4 + 0.55 * hash_unit(line as i64, 2, seed));
    let along = u / size[0];
    if !present || along < start || along > end {
        return scale(board, 1.0 + 0.03 * value_noise(u / 0.3, v / 0.3, seed));
    }
    let wobble = 0.035 * value_noise(u / 0.022, line * 7.3, seed) + 0.01 * value_noise(u / 0.2, line, seed);
    let offset = (v - (line + 0.5) * 0.11 - wobble).abs();
    let word = value_noise(u / 0.09, line * 3.1, seed ^ 0x17) > -0.45;
    let ink =
        [rgb(25, 30, 60), rgb(170, 30, 35), rgb(20, 90, 50)][(hash_unit(line as i64, 3, seed) * 3.0) as usize % 3];
    let covered =
        ((0.009 - offset) / footprint.max(0.002) + 0.5).clamp(0.0, 1.0) * (0.018 / footprint.max(0.002)).min(1.0);
    if word { mix(board, ink, covered) } else { board }
}

fn pinboard(u: f64, v: f64, size: [f64; 2], footprint: f64, seed: u32) -> Color {
    let (i, j) = ((u / 0.26).floor(), (v / 0.34).floor());
    let r = |n: u32| hash_unit(i as i64, j as i64, seed.wrapping_add(n));
    let cork = scale(rgb(176, 130, 84), 1.0 + 0.25 * fractal_noise(u, v, 0.03, 2, footprint, seed));
    let lean = 0.12 * (r(1) - 0.5);
    let (cu, cv) = (u - (i + 0.5) * 0.26, v - (j + 0.5) * 0.34);
    let (x, y) = (cu + lean * cv + 0.02 * r(2), cv - lean * cu);
    let fits = (i + 1.0) * 0.26 <= size[0] && (j + 1.0) * 0.34 <= size[1];
    let sheet = inside(x, -0.1, 0.1, footprint) * inside(y, -0.14, 0.14, footprint);
    if !fits || r(3) > 0.8 {
        return cork;
    }
    let paper =
        [rgb(240, 240, 235), rgb(235, 220, 120), rgb(150, 190, 220), rgb(230, 150, 140)][(r(4) * 4.0) as usize % 4];
    let text =
        f64::from(value_noise(x / 0.02, (y / 0.018).floor() * 5.0, seed) > 0.0 && x.abs() < 0.08 && y.abs() < 0.11);
    mix(cork, mix(paper, rgb(60, 60, 70), 0.5 * text * fade_by_size(0.02, footprint)), sheet)
}

fn spine(color: Color, ink: Color, at: f64, seed: u32) -> Color {
    let r = |n: i64| hash_unit(n, 0, seed);
    let band = |center: f64, half: f64| (at - center).abs() < half;
    let (low, title) = (0.08 + 0.1 * r(0), 0.55 + 0.2 * r(1));
    let banded = band(low, 0.012) || (r(2) < 0.5 && band(1.0 - low, 0.012));
    let titled = r(3) < 0.8 && band(title, 0.06 + 0.12 * r(4));
    if banded || titled { mix(color, ink, 0.8) } else { color }
}

fn screen(u: f64, v: f64, size: [f64; 2], footprint: f64, seed: u32) -> Color {
    let (x, y) = (u / size[0], v / size[1]);
    let desktop = mix(rgb(30, 60, 110), rgb(90, 140, 180), y);
    let left = 0.08 + 0.2 * hash_unit(1, 1, seed);
    if y < 0.06 {
        return rgb(40, 42, 48);
    }
    if x < left || x > left + 0.6 || !(0.15..0.92).contains(&y) {
        return desktop;
    }
    if y > 0.86 {
        return rgb(200, 205, 210);
    }
    let row = (y / 0.045).floor();
    let text = (y / 0.045 - row) < 0.5 && x - left - 0.03 < 0.5 * hash_unit(row as i64, 2, seed) && x > left + 0.03;
    mix(rgb(245, 245, 245), rgb(60, 70, 90), f64::from(text) * 0.8 * fade_by_size(0.02, footprint))
}

fn rug(u: f64, v: f64, size: [f64; 2], colors: [Color; 2], footprint: f64, seed: u32) -> Color {
    let [base, ink] = colors;
    let edge = u.min(size[0] - u).min(v).min(size[1] - v);
    let border = inside(edge, 0.08, 0.13, footprint).max(inside(edge, 0.17, 0.19, footprint));
    let field = if edge > 0.22 { 0.7 * motif_at(Motif::Diamonds, u / 0.3, v / 0.3, footprint / 0.3) } else { 0.0 };
    scale(mix(base, ink, border.max(field)), 1.0 + 0.3 * fractal_noise(u, v, 0.02, 2, footprint, seed))
}
