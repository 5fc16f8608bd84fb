//! Kick engines: what turns a request and sensor readings into joint commands.
