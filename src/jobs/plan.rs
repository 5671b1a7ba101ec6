//! Facts that a scene's plan is computed from, for all callers.

use super::Scene;
use crate::io::memory;
use crate::pipeline::train::{TrainConfig, budget};
use crate::render::{BackendChoice, real_gpu};
use crate::scene::{Dataset, GaussianCloud, Machine, Overrides, SceneFacts, ScenePlan};

/// Looks at memory, cores and the graphics adapter. Takes some milliseconds: not for the window's
/// thread.
pub(crate) fn machine() -> Machine {
    Machine {
        free_memory_bytes: memory::free(),
        max_gaussians: budget::gaussians(),
        cores: memory::cores(),
        gpu: real_gpu(),
    }
}

/// Returns facts about photos and trained Gaussians; those come with the degree of spherical harmonics in their file.
pub(crate) fn facts(
    machine: &Machine,
    dataset: Option<&Dataset>,
    cloud: Option<(&GaussianCloud, u8)>,
    config: &TrainConfig,
) -> SceneFacts {
    let cameras = dataset.map(Dataset::cameras).unwrap_or_default();
    let facts = SceneFacts::of(machine.clone(), config.limits()).with_photos(&cameras);
    let facts = facts.with_test_photos(dataset.map_or(0, Dataset::test_photos));
    match cloud {
        Some((cloud, sh_stored)) => facts.with_cloud(cloud, sh_stored, &cameras),
        None => facts,
    }
}

/// Returns facts about a scene and its cameras, without its photos.
pub(crate) fn scene_facts(machine: &Machine, scene: &Scene, config: &TrainConfig) -> SceneFacts {
    let cameras = scene.views();
    let facts = SceneFacts::of(machine.clone(), config.limits()).with_photos(&cameras);
    facts.with_cloud(&scene.cloud, scene.sh_stored, &cameras)
}

/// Returns the automatic plan for drawing a scene; nothing in it depends on the machine.
pub(crate) fn of_scene(scene: &Scene) -> ScenePlan {
    ScenePlan::new(scene_facts(&Machine::default(), scene, &scene.config), &Overrides::default())
}

/// Returns the settings of training on photos, with its plan applied.
pub(crate) fn planned(dataset: &Dataset, config: TrainConfig, overrides: &Overrides) -> TrainConfig {
    let plan = ScenePlan::new(facts(&Machine::default(), Some(dataset), None, &config), overrides);
    let backend = if plan.on_cpu { BackendChoice::Cpu } else { config.backend };
    TrainConfig { max_side_px: plan.train_side_px, backend, ..config }
}
