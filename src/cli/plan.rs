//! The option that overrides a scene's plan, and plans of what a subcommand has opened.

use super::opened::DrawableScene;
use crate::scene::plan::PlanOverride;
use crate::scene::{Camera, Facts, Machine, Overrides, ScenePlan};

/// What the user wants of a scene's plan.
#[derive(Debug, Default, clap::Args)]
pub struct PlanArgs {
    /// Decide otherwise than the scene plan; may be given several times. Items: color=full,
    /// feature-maps=always, parts=on, thumbnails=eager, encoder=eager, navigation=eager, depth=always,
    /// photos=full, objects=full, backend=cpu, redraw=always, buffers=keep; =auto resets one
    #[arg(long = "plan", value_name = "ITEM=VALUE")]
    pub wishes: Vec<PlanOverride>,
}

impl PlanArgs {
    /// All of them together.
    pub fn overrides(&self) -> Overrides {
        self.wishes.iter().copied().collect()
    }

    /// The plan for a scene that is to be drawn; nothing in it depends on the machine.
    pub fn of_scene(&self, scene: &DrawableScene) -> ScenePlan {
        let cameras: Vec<Camera> = scene.cameras.iter().map(|c| c.camera.clone()).collect();
        let facts = Facts::of(Machine::default(), scene.config.limits()).with_photos(&cameras);
        let facts = facts.with_cloud(&scene.cloud, scene.cloud.sh_degree, &cameras);
        ScenePlan::new(facts, &self.overrides())
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
