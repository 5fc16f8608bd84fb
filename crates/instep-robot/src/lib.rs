//! A robot: a MuJoCo model and the file that says which part plays which role.
