use instep_perception::{
    Camera,
    net::shape,
    scene::random::Split,
    train::{Rendered, Source},
};
fn main() {
    use rand::SeedableRng;
    let mut src = Rendered::new(Camera::default(), Rendered::fields(Split::Train).unwrap(), Split::Train);
    let w = shape::initial(&mut rand_chacha::ChaCha8Rng::seed_from_u64(1));
    let mut tape = shape::Tape::new();
    let mut planes = Vec::new();
    let (mut a, mut b, mut c) = (vec![], vec![], vec![]);
    let mut g = vec![0.0; w.len()];
    for k in 0..30 {
        let t = std::time::Instant::now();
        let (f, _) = src.frame(k).unwrap();
        a.push(t.elapsed().as_secs_f64());
        let t = std::time::Instant::now();
        shape::image(&f.rgb, &mut planes);
        shape::forward(&w, &planes, &mut tape);
        b.push(t.elapsed().as_secs_f64());
        let s: Vec<f32> = tape.output().to_vec();
        let t = std::time::Instant::now();
        shape::backward(&w, &planes, &mut tape, &s, &mut g);
        c.push(t.elapsed().as_secs_f64());
    }
    for (n, v) in [("frame", &mut a), ("forward", &mut b), ("backward", &mut c)] {
        v.sort_by(f64::total_cmp);
        println!("{n} min {:.1} median {:.1} ms", v[0] * 1e3, v[15] * 1e3);
    }
    println!("{} MFLOP {} parameters", shape::operations() / 1_000_000, shape::parameters());
}
