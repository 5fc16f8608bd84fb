use instep_perception::{
    Camera,
    scene::random::Split,
    train::{Plan, Rendered, Training},
};
use std::path::Path;
fn main() {
    let a: Vec<String> = std::env::args().collect();
    let frames: u64 = a[1].parse().unwrap();
    let threads: usize = a[2].parse().unwrap();
    let rate: f32 = a[3].parse().unwrap();
    let path = Path::new("/tmp/w/see/ck.safetensors");
    let plan = Plan { frames, threads, rate, ..Plan::default() };
    let source = || Rendered::new(Camera::default(), Rendered::fields(Split::Train).unwrap(), Split::Train);
    let mut t = Training::new(plan, [source(), source()]);
    if path.exists() {
        t.resume(path).unwrap();
    }
    let (mut sum, mut n) = (0.0, 0);
    let start = std::time::Instant::now();
    while !t.done() {
        sum += t.step().unwrap();
        n += 1;
        if n == 50 {
            println!("{} frames loss {:.4} {:.0} s", t.frames(), sum / f64::from(n), start.elapsed().as_secs_f64());
            (sum, n) = (0.0, 0);
            t.save(path).unwrap();
        }
    }
    t.save(path).unwrap();
}
