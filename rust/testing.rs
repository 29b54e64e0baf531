//! Items of the core for the tests in `tests/`, the timings in `benches/` and the fuzz targets: the only public module.

pub use crate::error::{Error, Result};

pub mod accumulator {
    pub use crate::accumulator::{Accumulator, Grid};
}

pub mod averaging {
    pub use crate::averaging::{Grid, factors};
}

pub mod deviation {
    pub use crate::deviation::{STATISTICS, allan, family, identify, loops, naive, statistic};
}

pub mod machine {
    pub use crate::machine::processor;
}

pub mod noise {
    pub use crate::noise::{Generator, Primitive, WINDOW, process};
}

pub mod parallel {
    pub use crate::parallel::{default_threads, pooled};
}

pub mod phase {
    pub use crate::phase::{Quantity, Record, Sample, Series, add_to};
}

pub mod rng {
    pub use crate::rng::{Stream, StreamKey};
}

pub mod text {
    pub use crate::text::{Options, Reader, Table, read};
}
