//! Python bindings of the core, one thin file per module. Nothing is computed here.
//!
//! Add a new function to the file of its module and export it here by name.

mod arrays;
mod covariance;
mod deviation;
mod envelope;
mod errors;
mod gil;
mod kalman;
mod likelihood;
mod lstsq;
mod machine;
mod noise;
mod play;
mod ranks;
mod spectrum;
mod text;

use pyo3::prelude::*;

#[pymodule]
mod _core {
    use pyo3::prelude::*;

    /// Called when the module is imported: lets panics store their message instead of printing it.
    #[pymodule_init]
    #[expect(clippy::unnecessary_wraps, reason = "the signature that pymodule_init asks for")]
    fn begin(_module: &Bound<'_, PyModule>) -> PyResult<()> {
        crate::machine::panics::keep();
        Ok(())
    }

    #[pymodule_export]
    use super::gil::version;

    // deviation
    #[pymodule_export]
    use super::deviation::{
        PyAccumulator, adjacent_allan, averaging_factors, family_variance, overlapping_allan,
    };

    // spectrum
    #[pymodule_export]
    use super::spectrum::{
        PyLapped, add_rows, best_courses, best_pair, chirp_heights, cosine_transform,
        inverse_cosine_transform, padded_periodogram, squares, steps,
    };

    // ranks
    #[pymodule_export]
    use super::ranks::{in_order, order};

    // machine
    #[pymodule_export]
    use super::machine::{end_with_line, own_process, release, trim, vector_unit};

    // play
    #[pymodule_export]
    use super::play::play;

    // noise
    #[pymodule_export]
    use super::noise::{Simulator, power_law_bank, simulate};

    // text
    #[pymodule_export]
    use super::text::{TextReader, read_text};
    // covariance
    #[pymodule_export]
    use super::covariance::{Ordinates, allan_covariance, allan_law, allan_variances};

    // envelope
    #[pymodule_export]
    use super::envelope::sample_envelope;

    // likelihood
    #[pymodule_export]
    use super::likelihood::Likelihood;
    // kalman
    #[pymodule_export]
    use super::kalman::{kalman_filter, kalman_smooth, stamped_filter};

    // lstsq
    #[pymodule_export]
    use super::lstsq::gls_nonnegative;
}
