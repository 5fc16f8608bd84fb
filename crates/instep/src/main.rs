//! Instep command line.
fn main() {}
