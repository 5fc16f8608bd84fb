use instep_field::Field;
use instep_perception::{
    Camera, label,
    render::Renderer,
    scene::random::{Split, scene},
};
fn main() {
    let field = Field::named("adult-2024").unwrap();
    let camera = Camera::default();
    let mut renderer = Renderer::new(camera, &field);
    let (mut t_scene, mut t_render) = (0.0, 0.0);
    let mut counts = [[0usize; 2]; 6];
    let n = 200;
    for k in 0..n {
        let split = if k % 2 == 0 { Split::Train } else { Split::Test };
        let t = std::time::Instant::now();
        let s = scene(&field, &camera, split, k);
        t_scene += t.elapsed().as_secs_f64();
        let t = std::time::Instant::now();
        let view = renderer.render(&s);
        t_render += t.elapsed().as_secs_f64();
        let labels = label::labels(&camera, &field, &s, &view);
        for l in &labels {
            counts[l.class.index()][l.ignored as usize] += 1;
        }
        if k < 16 {
            let mut frame = view.frame.clone();
            for l in &labels {
                let c: [u8; 3] = if l.ignored {
                    [128, 128, 128]
                } else {
                    [[255, 128, 0], [255, 255, 0], [255, 0, 255], [255, 0, 0], [0, 255, 255], [0, 0, 255]]
                        [l.class.index()]
                };
                let r = l.rect;
                for x in r.left as usize..(r.right as usize).min(383) {
                    for y in [r.top as usize, (r.low as usize).min(223)] {
                        let i = 3 * (y * 384 + x);
                        frame.rgb[i..i + 3].copy_from_slice(&c);
                    }
                }
                for y in r.top as usize..(r.low as usize).min(223) {
                    for x in [r.left as usize, (r.right as usize).min(383)] {
                        let i = 3 * (y * 384 + x);
                        frame.rgb[i..i + 3].copy_from_slice(&c);
                    }
                }
            }
            std::fs::write(format!("/tmp/w/see/f{k:02}.png"), frame.png()).unwrap();
            if k < 4 {
                std::fs::write(format!("/tmp/w/see/d{k:02}.png"), view.depth.picture(12.0).png()).unwrap();
            }
        }
    }
    println!("scene {:.2} ms render {:.2} ms {counts:?}", t_scene / n as f64 * 1e3, t_render / n as f64 * 1e3);
}
