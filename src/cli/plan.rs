//! The option that overrides a scene's plan.

use crate::scene::Overrides;
use crate::scene::plan::Wish;

/// What a person wants of a scene's plan.
#[derive(Debug, Default, clap::Args)]
pub struct PlanArgs {
    /// Decide otherwise than the scene plan; may be given several times. Items: colour=full,
    /// maps=always, parts=on, portraits=open, encoder=open, navigation=open, depth=always,
    /// photos=full, objects=full, backend=cpu, redraw=always, buffers=keep; =auto takes each back
    #[arg(long = "plan", value_name = "ITEM=VALUE")]
    pub wishes: Vec<Wish>,
}

impl PlanArgs {
    /// All wishes together.
    pub fn overrides(&self) -> Overrides {
        self.wishes.iter().copied().collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::plan::Item;

    #[test]
    fn the_help_names_every_choice() {
        let command = <PlanArgs as clap::Args>::augment_args(clap::Command::new("x"));
        let help = command.get_arguments().next().and_then(|a| a.get_help()).expect("help").to_string();
        let help = help.replace('\n', " ");
        for item in Item::ALL {
            if let Some(alternative) = item.alternative() {
                assert!(help.contains(&format!("{}={alternative}", item.id())), "{item} is not in: {help}");
            }
        }
    }
}
