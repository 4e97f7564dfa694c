//! `lapwing sweep`.
use anyhow::Result;
use crate::{args::Sweep, session::Session};
pub(crate) fn run(_: &Session, _: &Sweep) -> Result<()> { Ok(()) }
