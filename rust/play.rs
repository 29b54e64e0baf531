//! Play (backlash): the value that a moving quantity drags along.

/// Values that `values` drag along with a play of ±`width`, started in the middle of the play. NaN moves nothing.
///
/// This is Prandtl's play operator p_k = min(max(p_{k−1}, u_k − w), u_k + w) (Visintin 1994, Differential Models of
/// Hysteresis, III.2).
pub(crate) fn play(values: &[f64], width: f64) -> Vec<f64> {
    let mut dragged = values.first().copied().unwrap_or_default();
    values
        .iter()
        .map(|value| {
            dragged = dragged.max(value - width).min(value + width);
            dragged
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    #[test]
    fn a_value_is_dragged_up_and_down() {
        assert_eq!(play(&[20.0, 24.0, 28.0, 24.0, 20.0], 1.0), [20.0, 23.0, 27.0, 25.0, 21.0]);
        assert!(play(&[], 1.0).is_empty());
    }

    proptest! {
        #[test]
        fn the_value_stays_within_the_play_and_moves_only_at_its_ends(
            values in prop::collection::vec(-1e3..1e3, 1..50), width in 0.0..100.0
        ) {
            let found = play(&values, width);
            for (k, (value, dragged)) in values.iter().zip(&found).enumerate() {
                let distance = (value - dragged).abs();
                prop_assert!(distance <= width + 1e-9);
                let moved = k > 0 && found[k] != found[k - 1];
                prop_assert!(!moved || (distance - width).abs() < 1e-9);
            }
        }
    }
}
