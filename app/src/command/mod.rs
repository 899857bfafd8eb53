//! One module a subcommand. Each returns its exit code: 0 = fine, 1 = it ran and found something wrong; an
//! error (2) means it could not run.

pub mod compare;
pub mod doctor;
pub mod info;
pub mod print;
pub mod record;
pub mod reference;
pub mod replay;
