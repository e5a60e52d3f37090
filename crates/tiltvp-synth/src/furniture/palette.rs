//! The materials that the pieces of one room share.

use crate::builder::{Builder, Material, MaterialId};
use crate::rng::Rng;
use crate::texture::{Color, Texture, rgb};

/// Materials of one room.
pub(crate) struct Palette {
    pub(crate) wood: MaterialId,
    pub(crate) wood_v: MaterialId,
    pub(crate) other_wood: MaterialId,
    pub(crate) front: MaterialId,
    pub(crate) metal: MaterialId,
    pub(crate) dark: MaterialId,
    pub(crate) white: MaterialId,
    pub(crate) fabric: MaterialId,
    pub(crate) cushion: MaterialId,
    pub(crate) pot: MaterialId,
    pub(crate) leaves: [MaterialId; 3],
    pub(crate) cardboard: MaterialId,
    pub(crate) lampshade: MaterialId,
    pub(crate) books: Vec<Book>,
    /// Style of the room's chairs.
    pub(crate) chair: ChairStyle,
}

/// A kind of book: colours of back and print.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Book {
    pub(crate) color: Color,
    pub(crate) ink: Color,
}

/// How the chairs of a room are built.
#[derive(Debug, Clone, Copy)]
pub(crate) struct ChairStyle {
    /// How far the legs stand out at the floor, metres.
    pub(crate) splay: f64,
    /// How far the back leans, metres over its height.
    pub(crate) lean: f64,
    /// Upright slats in the back; 0 for a board.
    pub(crate) slats: usize,
}

impl Palette {
    /// Draws a palette.
    pub(crate) fn draw(builder: &mut Builder, rng: &mut Rng) -> Self {
        let woods = [
            (rgb(214, 178, 130), rgb(168, 124, 80)),
            (rgb(170, 116, 70), rgb(112, 70, 40)),
            (rgb(112, 74, 48), rgb(66, 40, 24)),
            (rgb(232, 222, 204), rgb(206, 190, 164)),
        ];
        let (light, dark) = rng.pick(woods);
        let (other_light, other_dark) = rng.pick(woods);
        let seed = rng.seed();
        let wood = builder.matt(Texture::Wood { light, dark, along_v: false, seed });
        let wood_v = builder.matt(Texture::Wood { light, dark, along_v: true, seed });
        let other_wood =
            builder.matt(Texture::Wood { light: other_light, dark: other_dark, along_v: true, seed: seed ^ 1 });
        let front = match rng.below(4) {
            0 => builder.paint(236, 234, 228),
            1 => builder.paint(120, 140, 150),
            2 => builder.paint(176, 70, 56),
            _ => wood_v,
        };
        let cloth = |color| Texture::Cloth { color, fold: 0.08, seed };
        let fabric = builder.matt(cloth(rng.pick([
            rgb(96, 110, 130),
            rgb(150, 140, 124),
            rgb(140, 60, 54),
            rgb(84, 100, 80),
            rgb(190, 170, 140),
        ])));
        let cushion =
            builder.matt(cloth(rng.pick([rgb(220, 170, 60), rgb(200, 90, 70), rgb(230, 224, 210), rgb(60, 100, 120)])));
        let (pot_r, pot_g, pot_b) = rng.pick([(176, 96, 66), (226, 222, 214), (70, 74, 80)]);
        let inks = [rgb(230, 210, 150), rgb(240, 240, 236), rgb(30, 30, 34)];
        let books = (0..24)
            .map(|_| {
                let color = rng.pick([
                    rgb(120, 34, 36),
                    rgb(34, 48, 88),
                    rgb(40, 78, 56),
                    rgb(222, 212, 188),
                    rgb(40, 40, 44),
                    rgb(190, 140, 56),
                    rgb(44, 110, 116),
                    rgb(140, 142, 146),
                    rgb(206, 100, 48),
                    rgb(236, 234, 230),
                    rgb(96, 66, 46),
                    rgb(150, 172, 196),
                ]);
                let color = color.map(|c| c * rng.within(0.7, 1.15));
                Book { color, ink: rng.pick(inks) }
            })
            .collect();
        Self {
            wood,
            wood_v,
            other_wood,
            front,
            metal: builder.paint(150, 152, 158),
            dark: builder.paint(48, 48, 54),
            white: builder.paint(232, 230, 226),
            fabric,
            cushion,
            pot: builder.paint(pot_r, pot_g, pot_b),
            leaves: [builder.paint(62, 112, 54), builder.paint(92, 142, 66), builder.paint(44, 86, 50)],
            cardboard: builder.paint(186, 148, 104),
            lampshade: builder.material(Material::Lamp([2.6, 2.2, 1.6])),
            books,
            chair: ChairStyle {
                splay: rng.within(0.015, 0.09),
                lean: rng.within(0.04, 0.12),
                slats: rng.pick([0, 3, 4, 5]),
            },
        }
    }
}
