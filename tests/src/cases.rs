//! Properties over many cases: the same ones in every run, and more on demand.

use proptest::prelude::*;
use proptest::test_runner::{RngSeed, TestRunner};

/// How many times as many cases as usual are tried: `SPLAT_CASES=N`, the usual ones among them.
pub fn factor() -> u32 {
    let given = std::env::var("SPLAT_CASES").ok();
    given.map_or(1, |text| text.parse().expect("SPLAT_CASES is a whole number"))
}

/// Runs a property over a strategy; panics with the simplest case that fails.
pub fn check<S: Strategy>(cases: u32, seed: u64, strategy: S, test: impl Fn(S::Value))
where
    S::Value: std::fmt::Debug,
{
    let config = ProptestConfig {
        cases: cases * factor(),
        rng_seed: RngSeed::Fixed(seed),
        failure_persistence: None,
        ..ProptestConfig::default()
    };
    let run = TestRunner::new(config).run(&strategy, |case| {
        test(case);
        Ok(())
    });
    if let Err(error) = run {
        panic!("{error}");
    }
}
