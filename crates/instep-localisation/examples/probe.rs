use instep_localisation::{evaluate::*, scenario::Scenario, stream::Stream, *};
use std::sync::Arc;
fn main() {
    let args: Vec<String> = std::env::args().collect();
    let seeds: u64 = args[2].parse().unwrap();
    let base: u64 = args[3].parse().unwrap();
    let only: usize = args.get(4).map_or(5, |s| s.parse().unwrap());
    let settings: Settings = toml::from_str(&std::env::var("SET").unwrap_or_default()).unwrap();
    for name in args[1].split(',') {
        let scenario = Scenario::named(name).unwrap();
        let clock = || {
            let mut t = libc::timespec { tv_sec: 0, tv_nsec: 0 };
            unsafe {
                libc::clock_gettime(libc::CLOCK_THREAD_CPUTIME_ID, &mut t);
            }
            t.tv_sec as f64 + 1e-9 * t.tv_nsec as f64
        };
        let streams: Vec<_> = (0..seeds).map(|s| Stream::simulate(scenario, base + s).unwrap()).collect();
        let map = Arc::new(Map::new(&streams[0].field, true).unwrap());
        for k in (0..5).filter(|k| only == 5 || *k == only) {
            let mut label = "";
            let tracks: Vec<_> = streams
                .iter()
                .enumerate()
                .map(|(i, s)| {
                    let m = methods(&map, &settings, i as u64).remove(k);
                    label = m.name();
                    follow(m, s, &clock).unwrap()
                })
                .collect();
            let m = Measures::of(&tracks);
            println!(
                "{name:12} {label:20} mae {:.4} mse {:.4} std {:.4} worst {:.2} head {:.2} wrong {:.3} astray {:.3} resets {}/{} nees {:.2?} rec {:.2} {:.2?} {:.2?} twin {:.2} upd {:.0} chk {:.0} us",
                m.mae,
                m.mse,
                m.std,
                m.worst,
                m.heading_mae.to_degrees(),
                m.wrong_half_rate,
                m.astray_rate,
                m.false_resets,
                m.resets,
                m.nees,
                m.recovered_rate,
                m.recovery_median,
                m.recovery_worst,
                m.twin_rate,
                m.update_p99 * 1e6,
                m.check_p99 * 1e6
            );
        }
    }
}
