//! Allan variance and related statistics, one per file.

pub mod allan;
pub mod family;
pub mod identify;
pub mod loops;
pub mod naive;
pub mod statistic;

use statistic::Statistic;

/// Declares the file of each statistic, and lists every statistic except the Allan variance, which has loops of its own.
macro_rules! statistics {
    ($($file:ident: $($statistic:ident),+;)+) => {
        $(mod $file;)+
        pub static STATISTICS: &[&dyn Statistic] = &[$($(&$file::$statistic),+),+];
    };
}

statistics! {
    hadamard: Overlapping, Adjacent;
    modified: Modified;
    parabolic: Parabolic;
    total: Total;
    modified_total: ModifiedTotal, HadamardTotal;
    theo: Theo1;
    tie: TieRms, Mtie;
}

/// The statistic with this name.
pub fn statistic(name: &str) -> Option<&'static dyn Statistic> {
    STATISTICS.iter().copied().find(|statistic| statistic.name() == name)
}
