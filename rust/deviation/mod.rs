//! Allan variance and related statistics, one per file.

pub mod allan;
pub mod family;
mod hadamard;
pub mod identify;
pub mod loops;
mod modified;
mod modified_total;
pub mod naive;
mod parabolic;
pub mod statistic;
mod theo;
mod tie;
mod total;

use statistic::Statistic;

/// Every statistic except the Allan variance, which has loops of its own.
pub static STATISTICS: &[&dyn Statistic] = &[
    &hadamard::Overlapping,
    &hadamard::Adjacent,
    &modified::Modified,
    &parabolic::Parabolic,
    &total::Total,
    &modified_total::ModifiedTotal,
    &modified_total::HadamardTotal,
    &theo::Theo1,
    &tie::TieRms,
    &tie::Mtie,
];

/// The statistic with this name.
pub fn statistic(name: &str) -> Option<&'static dyn Statistic> {
    STATISTICS.iter().copied().find(|statistic| statistic.name() == name)
}
