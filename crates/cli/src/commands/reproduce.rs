//! `lapwing reproduce`.
use anyhow::Result;
use crate::{args::Reproduce, session::Session};
pub(crate) fn run(_: &Session, _: &Reproduce) -> Result<()> { Ok(()) }
