use instep_perception::net::file;
use std::path::Path;
fn main() {
    let a: Vec<String> = std::env::args().collect();
    let (w, _) = file::read(Path::new(&a[1]), &[]).unwrap();
    std::fs::write(&a[2], file::bytes(&w, &[], Default::default()).unwrap()).unwrap();
}
