//! The kernels of single precision for each kind of vectors, and the choice of the widest.

/// A kernel from a generic body: one implementation for each kind of vectors, in a module of its name, and the function that calls
/// the widest of this machine.
macro_rules! kernel {
    ($(#[$doc:meta])* $name:ident = $body:ident($($argument:ident: $type:ty),* $(,)?) $(-> $out:ty)?) => {
        mod $name {
            use super::*;

            /// # Safety
            /// None: every machine has single numbers.
            #[cfg(any(test, not(target_arch = "x86_64")))]
            pub(super) unsafe fn scalar($($argument: $type),*) $(-> $out)? {
                // SAFETY: every machine has single numbers.
                unsafe { $body::<crate::rows::simd::Scalar>($($argument),*) }
            }

            /// # Safety
            /// None: every x86-64 has SSE2.
            #[cfg(target_arch = "x86_64")]
            pub(super) unsafe fn sse2($($argument: $type),*) $(-> $out)? {
                // SAFETY: every x86-64 has SSE2.
                unsafe { $body::<crate::rows::sse2::Sse2>($($argument),*) }
            }

            /// # Safety
            /// The machine must have the features.
            #[cfg(target_arch = "x86_64")]
            #[target_feature(enable = "avx2,popcnt")]
            pub(super) unsafe fn avx2($($argument: $type),*) $(-> $out)? {
                // SAFETY: the caller vouches for the machine.
                unsafe { $body::<crate::rows::simd::x86::Avx2>($($argument),*) }
            }

            /// # Safety
            /// The machine must have the features.
            #[cfg(target_arch = "x86_64")]
            #[target_feature(enable = "avx512f,popcnt")]
            pub(super) unsafe fn avx512($($argument: $type),*) $(-> $out)? {
                // SAFETY: the caller vouches for the machine.
                unsafe { $body::<crate::rows::simd::x86::Avx512>($($argument),*) }
            }
        }

        $(#[$doc])*
        pub(super) fn $name($($argument: $type),*) $(-> $out)? {
            #[cfg(target_arch = "x86_64")]
            match crate::level::level() {
                // SAFETY: the machine has the level.
                crate::level::Level::Avx512 => unsafe { $name::avx512($($argument),*) },
                // SAFETY: as above.
                crate::level::Level::Avx2 => unsafe { $name::avx2($($argument),*) },
                // SAFETY: every x86-64 has it.
                _ => unsafe { $name::sse2($($argument),*) },
            }
            // SAFETY: every machine has single numbers.
            #[cfg(not(target_arch = "x86_64"))]
            unsafe {
                $name::scalar($($argument),*)
            }
        }
    };
}
pub(super) use kernel;
