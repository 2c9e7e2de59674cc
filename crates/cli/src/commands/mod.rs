//! One module a command: it reads what it needs, calls the libraries, writes what it made and says so.

pub(crate) mod align;
pub(crate) mod compare;
pub(crate) mod completions;
pub(crate) mod dispute;
pub(crate) mod embed;
pub(crate) mod inspect;
pub(crate) mod keygen;
pub(crate) mod library;
pub(crate) mod man;
pub(crate) mod partition;
pub(crate) mod spectrum;
pub(crate) mod stamp;
pub(crate) mod trace;
pub(crate) mod verify;
