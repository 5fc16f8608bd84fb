//! Where am I: CLAP and the methods that it is compared with.
