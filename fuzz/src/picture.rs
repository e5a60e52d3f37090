//! Pictures of any content for small cameras, as slices of borrowed bytes that end where they must not be passed.

use std::sync::LazyLock;

use tiltvp_core::camera::Camera;
use tiltvp_core::image::ImageView;

use crate::bytes::Bytes;
use crate::lens::ZOO;

/// Longest side of a small camera's image, pixels: of those of 24 some have no region left within their margins, and above the time of an
/// execution grows with the pixels.
const SIDE_PX: f64 = 32.0;

/// The zoo over images of some hundred pixels.
pub(crate) static SMALL: LazyLock<Vec<Camera>> = LazyLock::new(|| {
    let small = |camera: &Camera| camera.scaled(SIDE_PX / f64::from(camera.width().max(camera.height()))).ok();
    ZOO.iter().filter_map(small).collect()
});

/// Rows of bytes with what lies between them, which nothing may depend on.
pub(crate) struct Picture {
    data: Vec<u8>,
    width: usize,
    height: usize,
    stride: usize,
}

impl Picture {
    /// Of the size of a camera's images, with so many bytes to a pixel.
    pub(crate) fn of(camera: &Camera, channels: usize, bytes: &mut Bytes<'_>) -> Self {
        let (width, height) = (camera.width() as usize * channels, camera.height() as usize);
        let stride = width + bytes.below(70);
        let mut data = vec![bytes.byte(); stride * (height - 1) + width];
        for _ in 0..=bytes.byte() % 4 {
            Self::draw(&mut data, stride, channels, bytes);
        }
        Self { data, width, height, stride }
    }

    /// A half plane, stripes, a box, a ramp, noise, or single bytes; of coloured pictures the first four in one colour.
    fn draw(data: &mut [u8], stride: usize, channels: usize, bytes: &mut Bytes<'_>) {
        let (kind, level) = (bytes.byte() % 6, bytes.byte());
        let (a, b, c) = (i32::from(bytes.byte() as i8), i32::from(bytes.byte() as i8), i32::from(bytes.word() as i16));
        let (u, v, w, h) = (bytes.byte(), bytes.byte(), bytes.byte(), bytes.byte());
        let (first, step) = if kind < 4 { (bytes.below(channels), channels) } else { (0, 1) };
        let period = i32::from(w) + 1;
        let mut state = u64::from(bytes.word()) | 1;
        for (y, row) in data.chunks_mut(stride).enumerate() {
            let mut across = b * y as i32 + c;
            let in_rows = (usize::from(v)..usize::from(v) + usize::from(h)).contains(&y);
            for (x, pixel) in row.iter_mut().skip(first).step_by(step).enumerate() {
                match kind {
                    0 if across >= 0 => *pixel = level,
                    1 if across.rem_euclid(2 * period) >= period => *pixel = level,
                    2 if in_rows && (usize::from(u)..usize::from(u) + usize::from(w)).contains(&x) => *pixel = level,
                    3 => *pixel = pixel.wrapping_add((across / 8) as u8),
                    4 => {
                        // Marsaglia 2003.
                        state ^= state << 13;
                        state ^= state >> 7;
                        state ^= state << 17;
                        if (state >> 32) as u8 <= level {
                            *pixel = pixel.wrapping_add(state as u8 & w);
                        }
                    }
                    5 if bytes.is_empty() => return,
                    5 => *pixel = bytes.byte(),
                    _ => {}
                }
                across += a;
            }
        }
    }

    /// As it is.
    pub(crate) fn bytes(&self) -> (&[u8], usize, usize, usize) {
        (&self.data, self.width, self.height, self.stride)
    }

    /// The same without what lies between the rows.
    pub(crate) fn packed(&self) -> Vec<u8> {
        self.data.chunks(self.stride).flat_map(|row| &row[..self.width]).copied().collect()
    }

    /// As the core sees it.
    pub(crate) fn view(&self) -> ImageView<'_> {
        ImageView::new(&self.data, self.width, self.height, self.stride).expect("rows that are all there")
    }
}
