//! Detection of the vector units of the processor. No other module asks the processor.
//!
//! Code for a wider unit is `unsafe` to call. A [`Width`] is the proof that the processor has the unit. [`limit_unit_to`]
//! restricts the process to narrower units, so that each code path can be tested on any machine.
//!
//! The crate `pulp` could replace only one of the three traits of registers (`deviation/loops/lanes.rs`, about 150
//! lines). Its trait lacks the shuffles of four lanes (`noise/quad.rs`) and the table look-ups and exponents
//! (`rng/registers.rs`) of the others, so that two ways of choosing a unit would remain.

use std::sync::atomic::{AtomicUsize, Ordering};

use crate::{Error, Result};

/// A vector unit. Each unit includes the instructions of the units before it.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) enum Unit {
    /// Plain Rust.
    Portable,
    /// AVX2 and FMA.
    #[cfg(target_arch = "x86_64")]
    Avx2,
    /// AVX-512F and VL.
    #[cfg(target_arch = "x86_64")]
    Avx512,
}

impl Unit {
    #[cfg(target_arch = "x86_64")]
    const ALL: [Self; 3] = [Self::Portable, Self::Avx2, Self::Avx512];
    #[cfg(not(target_arch = "x86_64"))]
    const ALL: [Self; 1] = [Self::Portable];

    /// True if this processor has the unit.
    fn is_available(self) -> bool {
        match self {
            Self::Portable => true,
            #[cfg(target_arch = "x86_64")]
            Self::Avx2 => is_x86_feature_detected!("avx2") && is_x86_feature_detected!("fma"),
            #[cfg(target_arch = "x86_64")]
            Self::Avx512 => {
                Self::Avx2.is_available()
                    && is_x86_feature_detected!("avx512f")
                    && is_x86_feature_detected!("avx512vl")
            }
        }
    }

    /// Name of the unit: `portable`, `avx2` or `avx512`.
    fn name(self) -> &'static str {
        match self {
            Self::Portable => "portable",
            #[cfg(target_arch = "x86_64")]
            Self::Avx2 => "avx2",
            #[cfg(target_arch = "x86_64")]
            Self::Avx512 => "avx512",
        }
    }
}

/// 1 + index in `Unit::ALL` of the widest unit to use; 0 until the processor has been examined.
static BEST: AtomicUsize = AtomicUsize::new(0);

/// Restricts this process, from this call on, to the named unit and narrower ones.
pub(crate) fn limit_unit_to(name: &str) -> Result<()> {
    let Some(width) = Width::available().find(|width| width.name() == name) else {
        let names: Vec<_> = Width::available().map(Width::name).collect();
        return Err(Error::Input(format!(
            "no vector unit {name:?}: this processor has {}",
            names.join(", ")
        )));
    };
    BEST.store(width.0 as usize + 1, Ordering::Relaxed);
    Ok(())
}

/// A vector unit that this processor has.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Width(Unit);

impl Width {
    /// The widest unit of this processor, or the one set by [`limit_unit_to`].
    pub fn best() -> Self {
        match BEST.load(Ordering::Relaxed) {
            0 => {
                let width = Self::available().next_back().unwrap_or(Self::portable());
                BEST.store(width.0 as usize + 1, Ordering::Relaxed);
                width
            }
            // Only available units are stored.
            place => Self(Unit::ALL[place - 1]),
        }
    }

    /// All units of this processor, the widest last.
    pub fn available() -> impl DoubleEndedIterator<Item = Self> {
        Unit::ALL.into_iter().filter(|unit| unit.is_available()).map(Self)
    }

    /// The unit that every processor has: plain Rust.
    pub(crate) fn portable() -> Self {
        Self(Unit::Portable)
    }

    /// True if the unit includes AVX2 and FMA.
    #[cfg_attr(not(target_arch = "x86_64"), allow(dead_code, reason = "only x86 has wider units"))]
    pub(crate) fn is_wide(self) -> bool {
        self != Self::portable()
    }

    /// The unit, which the processor is known to have.
    pub(crate) fn unit(self) -> Unit {
        self.0
    }

    /// Name of the unit: `portable`, `avx2` or `avx512`.
    pub fn name(self) -> &'static str {
        self.0.name()
    }
}

/// Defines a function that takes a [`Width`] and runs the code of a plain function, compiled for that unit. Fused
/// multiply-adds are not enabled, so that all units give the same bits. The plain function must be
/// `#[inline(always)]`.
macro_rules! compiled_for_each_width {
    ($(#[$about:meta])* $public:vis fn $name:ident($($arg:ident: $type:ty),*) $(-> $out:ty)? = $plain:path) => {
        $(#[$about])*
        $public fn $name(width: $crate::machine::processor::Width, $($arg: $type),*) $(-> $out)? {
            use $crate::machine::processor::Unit;
            #[cfg(target_arch = "x86_64")]
            #[target_feature(enable = "avx2")]
            fn avx2($($arg: $type),*) $(-> $out)? {
                $plain($($arg),*)
            }
            #[cfg(target_arch = "x86_64")]
            #[target_feature(enable = "avx2,avx512f,avx512vl")]
            fn avx512($($arg: $type),*) $(-> $out)? {
                $plain($($arg),*)
            }
            match width.unit() {
                Unit::Portable => $plain($($arg),*),
                // SAFETY: a `Width` is only made of units that the processor has.
                #[cfg(target_arch = "x86_64")]
                Unit::Avx2 => unsafe { avx2($($arg),*) },
                // SAFETY: as above.
                #[cfg(target_arch = "x86_64")]
                Unit::Avx512 => unsafe { avx512($($arg),*) },
            }
        }
    };
}
pub(crate) use compiled_for_each_width;
