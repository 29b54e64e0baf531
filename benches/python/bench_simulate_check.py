"""Time of `Fit.simulate_check`: 200 replicates of a million samples, simulated and refitted."""

import time

import allanite as al

REPLICATES, SAMPLES = 200, 1_000_000


def main() -> None:
    """Print the check and its time."""
    truth = al.parse_model("N(N=0.0126)+B(B=0.002)+K(K=9.07e-5)")
    fit = al.fit_model(truth.simulate(n=SAMPLES, rate=100, seed=1, unit="rad/s"), "N+B+K")
    start = time.perf_counter()
    check = fit.simulate_check(REPLICATES, seed=1)
    print(check)
    print(f"{REPLICATES} replicates of {SAMPLES} samples: {time.perf_counter() - start:.1f} s")


if __name__ == "__main__":
    main()
