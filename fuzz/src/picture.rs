//! Pictures of any content for small cameras, as slices of borrowed bytes that end where they must not be passed.

use std::sync::LazyLock;

use tiltvp_core::camera::Camera;
use tiltvp_core::image::ImageView;

use crate::bytes::Bytes;
use crate::lens::ZOO;

/// The zoo over images of a few thousand pixels.
pub(crate) static SMALL: LazyLock<Vec<Camera>> = LazyLock::new(|| {
    let small = |camera: &Camera| camera.scaled(40.0 / f64::from(camera.width().max(camera.height()))).ok();
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
        for _ in 0..=bytes.byte() % 8 {
            Self::draw(&mut data, stride, channels, bytes);
        }
        Self { data, width, height, stride }
    }

    /// A half plane, stripes, a box, noise, or single bytes.
    fn draw(data: &mut [u8], stride: usize, channels: usize, bytes: &mut Bytes<'_>) {
        let (kind, level) = (bytes.byte() % 6, bytes.byte());
        let (a, b, c) = (bytes.byte() as i8, bytes.byte() as i8, bytes.word() as i16);
        let (u, v, w, h) = (bytes.byte(), bytes.byte(), bytes.byte(), bytes.byte());
        let color = bytes.below(channels);
        let period = i32::from(w) + 1;
        let mut state = u64::from(bytes.word()) | 1;
        for (k, pixel) in data.iter_mut().enumerate() {
            let (x, y) = ((k % stride / channels) as i32, (k / stride) as i32);
            let across = i32::from(a) * x + i32::from(b) * y + i32::from(c);
            if kind < 4 && channels > 1 && k % stride % channels != color {
                continue;
            }
            match kind {
                0 if across >= 0 => *pixel = level,
                1 if across.rem_euclid(2 * period) >= period => *pixel = level,
                2 if (i32::from(u)..i32::from(u) + i32::from(w)).contains(&x)
                    && (i32::from(v)..i32::from(v) + i32::from(h)).contains(&y) =>
                {
                    *pixel = level;
                }
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
                5 => *pixel = if bytes.is_empty() { *pixel } else { bytes.byte() },
                _ => {}
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
