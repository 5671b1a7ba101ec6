//! The option that overrides a scene's plan.

use crate::scene::Overrides;
use crate::scene::plan::PlanOverride;

/// The user's overrides of a scene's plan.
#[derive(Debug, Default, clap::Args)]
pub(crate) struct PlanArgs {
    /// Decide otherwise than the scene plan; may be given several times. Items: color=full,
    /// feature-maps=always, parts=on, thumbnails=eager, encoder=eager, navigation=eager, depth=always,
    /// photos=full, objects=full, backend=cpu, redraw=always, buffers=keep, levels=always; =auto resets one
    #[arg(long = "plan", value_name = "ITEM=VALUE")]
    pub(crate) overrides: Vec<PlanOverride>,
}

impl PlanArgs {
    /// All of them together.
    pub(crate) fn overrides(&self) -> Overrides {
        self.overrides.iter().copied().collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::plan::Item;
    use strum::VariantArray;

    #[test]
    fn the_help_names_every_choice() {
        let command = <PlanArgs as clap::Args>::augment_args(clap::Command::new("x"));
        let help = command.get_arguments().next().and_then(|a| a.get_help()).expect("help").to_string();
        let help = help.replace('\n', " ");
        for item in Item::VARIANTS {
            if let Some(alternative) = item.alternative() {
                assert!(help.contains(&format!("{}={alternative}", item.id())), "{item} is not in: {help}");
            }
        }
    }
}
