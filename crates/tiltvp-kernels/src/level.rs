//! The widest vectors that kernels use: those of the machine, or narrower ones where a program says so first.

use std::sync::OnceLock;

#[doc(hidden)]
pub use fearless_simd;

/// Vectors that a machine may have. Answers do not depend on them.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Level {
    /// What every machine of the kind has: on x86-64 the 128 bits of SSE2.
    Fallback,
    /// 128 bits (x86-64-v2).
    Sse42,
    /// 256 bits (x86-64-v3: Haswell, Zen and later).
    Avx2,
    /// 512 bits (x86-64-v4). Gradients are compacted by VBMI2 where there is that too (Ice Lake, Zen 4), and loops without a kernel
    /// of their own use 256 bits elsewhere.
    Avx512,
    /// 128 bits, which every 64-bit ARM has.
    Neon,
}

impl Level {
    /// All there are, on any machine.
    const ALL: [Self; 5] = [Self::Fallback, Self::Sse42, Self::Avx2, Self::Avx512, Self::Neon];

    /// Its word.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Fallback => "fallback",
            Self::Sse42 => "sse4.2",
            Self::Avx2 => "avx2",
            Self::Avx512 => "avx512",
            Self::Neon => "neon",
        }
    }

    /// Those of this machine, the widest last.
    pub fn available() -> impl Iterator<Item = Self> {
        Self::ALL.into_iter().filter(|level| level.loops().is_some())
    }

    /// What runs loops without a kernel of their own at this level; none where the machine has not got it.
    fn loops(self) -> Option<fearless_simd::Level> {
        use fearless_simd::Level as Loops;
        let machine = Loops::new();
        match self {
            Self::Fallback => Some(Loops::baseline()),
            #[cfg(target_arch = "x86_64")]
            Self::Sse42 => machine.as_sse4_2().map(fearless_simd::Simd::level),
            #[cfg(target_arch = "x86_64")]
            Self::Avx2 => machine.as_avx2().map(fearless_simd::Simd::level),
            #[cfg(target_arch = "x86_64")]
            Self::Avx512 => {
                let there = is_x86_feature_detected!("avx512f")
                    && is_x86_feature_detected!("avx512bw")
                    && is_x86_feature_detected!("avx512cd")
                    && is_x86_feature_detected!("avx512dq")
                    && is_x86_feature_detected!("avx512vl");
                machine.as_avx2().filter(|_| there).map(|_| machine)
            }
            #[cfg(target_arch = "aarch64")]
            Self::Neon => machine.as_neon().map(|token| token.level()),
            _ => None,
        }
    }
}

/// What [`cap`] takes on this machine.
pub fn expected() -> String {
    let names: Vec<_> = Level::available().map(Level::name).collect();
    format!("one of {} (what this machine has)", names.join(", "))
}

/// The level of this process and what runs its loops.
struct Chosen {
    level: Level,
    loops: fearless_simd::Level,
}

static CHOSEN: OnceLock<Chosen> = OnceLock::new();

impl Chosen {
    fn of(level: Level) -> Self {
        Self { level, loops: level.loops().unwrap_or(fearless_simd::Level::baseline()) }
    }
}

fn chosen() -> &'static Chosen {
    CHOSEN.get_or_init(|| Chosen::of(asked().or(Level::available().last()).unwrap_or(Level::Fallback)))
}

/// What a build for the tests of whole crates at one level asks for (`just sanitize`); else programs do, by [`cap`].
fn asked() -> Option<Level> {
    let word = option_env!("TILTVP_BUILT_FOR")?;
    let level = Level::available().find(|level| level.name() == word);
    assert!(level.is_some(), "TILTVP_BUILT_FOR = {word:?}, expected {}", expected());
    level
}

/// Caps the level of this process before anything was asked of it. False for a word that is none of the machine's, and where
/// another level is in use already.
pub fn cap(word: &str) -> bool {
    let Some(level) = Level::available().find(|level| level.name() == word) else { return false };
    CHOSEN.get_or_init(|| Chosen::of(level)).level == level
}

/// The level of this process: the machine's widest where nobody has capped it. The machine has it.
#[inline]
pub fn level() -> Level {
    chosen().level
}

#[doc(hidden)]
#[inline]
pub fn loops() -> fearless_simd::Level {
    chosen().loops
}

/// A function whose loops the compiler makes vectors of, once for each level; the one of this process is called. Arguments are
/// names, or names in brackets where an array is taken apart.
#[macro_export]
macro_rules! vectorised {
    ($(#[$meta:meta])* $vis:vis fn $name:ident($($argument:tt: $type:ty),* $(,)?) $(-> $out:ty)? $body:block) => {
        $(#[$meta])*
        $vis fn $name($($argument: $type),*) $(-> $out)? {
            // A function and no closure: the compiler is to know that its arguments do not overlap.
            #[inline(always)]
            fn body($($argument: $type),*) $(-> $out)? $body
            $crate::level::fearless_simd::dispatch!($crate::level::loops(), _ => body($($argument),*))
        }
    };
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_widest_level_of_a_machine_is_chosen_and_every_word_is_of_one_level() {
        let names: Vec<_> = Level::ALL.map(Level::name).to_vec();
        assert_eq!(names, ["fallback", "sse4.2", "avx2", "avx512", "neon"]);
        assert!(Level::available().any(|one| one == level()));
        assert!(cap(level().name()));
        assert!(!cap("mmx"));
        assert!(expected().starts_with("one of fallback, "));
    }
}
