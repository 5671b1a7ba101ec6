//! The option that overrides a scene's plan.

use crate::scene::Overrides;
use crate::scene::plan::{Item, PlanOverride};

/// The user's overrides of a scene's plan.
#[derive(Debug, Default, clap::Args)]
pub(crate) struct PlanArgs {
    /// Choices of the user; a later one of the same item wins.
    #[arg(long = "plan", value_name = "ITEM=VALUE", help = help())]
    pub(crate) overrides: Vec<PlanOverride>,
}

fn help() -> String {
    format!("Decide otherwise than the scene plan; may be given several times: {}", Item::choices())
}

impl PlanArgs {
    /// All of them together.
    pub(crate) fn overrides(&self) -> Overrides {
        self.overrides.iter().copied().collect()
    }
}
