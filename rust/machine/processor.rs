//! What the processor can do: asked here and nowhere else.
//!
//! Code for a wider unit is `unsafe` to call; a [`Width`] is the proof that the processor has it. The environment
//! variable `ALLANITE_WIDTH` (`portable`, `avx2`) keeps to narrower units than there are, so that each path can be tested on
//! any machine. It is read once.

use std::sync::OnceLock;

/// A vector unit. Every one has what those before it have.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Unit {
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

    fn is_there(self) -> bool {
        match self {
            Self::Portable => true,
            #[cfg(target_arch = "x86_64")]
            Self::Avx2 => is_x86_feature_detected!("avx2") && is_x86_feature_detected!("fma"),
            #[cfg(target_arch = "x86_64")]
            Self::Avx512 => {
                Self::Avx2.is_there()
                    && is_x86_feature_detected!("avx512f")
                    && is_x86_feature_detected!("avx512vl")
            }
        }
    }

    /// The widest that is wanted.
    fn most() -> Self {
        match std::env::var("ALLANITE_WIDTH").as_deref() {
            Ok("portable") => Self::Portable,
            #[cfg(target_arch = "x86_64")]
            Ok("avx2") => Self::Avx2,
            _ => Self::ALL[Self::ALL.len() - 1],
        }
    }
}

/// A vector unit that this processor has.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Width(Unit);

impl Width {
    /// The widest unit that this processor has.
    pub fn best() -> Self {
        static BEST: OnceLock<Width> = OnceLock::new();
        *BEST.get_or_init(|| {
            let most = Unit::most();
            Self::available().rfind(|width| width.0 <= most).unwrap_or(Self::portable())
        })
    }

    /// All units that this processor has, the widest last.
    pub fn available() -> impl DoubleEndedIterator<Item = Self> {
        Unit::ALL.into_iter().filter(|unit| unit.is_there()).map(Self)
    }

    /// Plain Rust, on any processor.
    pub fn portable() -> Self {
        Self(Unit::Portable)
    }

    /// Whether the processor has been found to have AVX2 and FMA.
    pub fn is_wide(self) -> bool {
        self != Self::portable()
    }

    /// Which unit it is: the processor has it.
    pub fn unit(self) -> Unit {
        self.0
    }
}
