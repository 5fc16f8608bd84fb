//! The localiser as a user has it: streams in, poses out.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic)]

mod accuracy;
mod allocation;
mod bad_input;
mod recovery;
mod streams;

use std::sync::Arc;

use instep_localisation::evaluate::{Measures, Track, follow};
use instep_localisation::scenario::Scenario;
use instep_localisation::stream::Stream;
use instep_localisation::{Map, Method, Settings, methods};

/// Method number `k` along `runs` seeds of a scenario. Seeds differ from those that the settings were tuned on.
fn tracks(name: &str, k: usize, runs: u64) -> Vec<Track> {
    let scenario = Scenario::named(name).unwrap();
    (500..500 + runs)
        .map(|seed| {
            let stream = Stream::simulate(scenario, seed).unwrap();
            follow(method(&stream, k), &stream, &|| 0.0).unwrap()
        })
        .collect()
}

fn measured(name: &str, k: usize, runs: u64) -> Measures {
    Measures::of(&tracks(name, k, runs))
}

fn method(stream: &Stream, k: usize) -> Box<dyn Method> {
    let map = Arc::new(Map::new(&stream.field, true).unwrap());
    methods(&map, &Settings::default(), 1).swap_remove(k)
}
