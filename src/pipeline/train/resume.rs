//! Start of a run from a checkpoint: of one that was stopped, or of a refinement.

use rand::SeedableRng;
use rand_pcg::Pcg64Mcg;

use super::checkpoint::{self, Checkpoint, Header};
use super::inputs::{Compare, TrainInputs};
use super::refine::Refinement;
use super::schedule::Schedule;
use super::trainer::Trainer;
use super::window::StepWindow;
use super::{TrainConfig, TrainView};
use crate::io::trained::History;
use crate::io::{IoError, SceneFolder};
use crate::scene::{Dataset, GaussianCloud};

/// Writes the checkpoint from which the refinement of `cloud` on the photos of `dataset` starts.
pub(crate) fn begin_refinement(
    scene: &SceneFolder,
    dataset: &Dataset,
    cloud: GaussianCloud,
    (config, budget): (&TrainConfig, usize),
    (refinement, history): (Refinement, History),
) -> Result<(), IoError> {
    let inputs = TrainInputs::of(dataset, Compare::Contents)?;
    let rng = Pcg64Mcg::seed_from_u64(config.seed);
    let header = Header {
        config: config.clone(),
        photos: refinement.photos.iter().map(|p| p.name.clone()).collect(),
        inputs: Some(inputs),
        step: refinement.from_step,
        secs: history.steps.last().map_or(0.0, |s| s.secs),
        count: cloud.len(),
        sh_degree: cloud.sh_degree,
        origin: cloud.origin,
        rng: rng.clone(),
        round: Vec::new(),
        budget,
        damping: 1.0,
        refinement: Some(refinement),
        history,
        unreported: StepWindow::default(),
        fits: Vec::new(),
    };
    checkpoint::save(scene, &Trainer::new(cloud, config, [0.0; 3], 1.0, rng), &header)
}

impl Checkpoint {
    /// Returns the trainer that goes on from this checkpoint with these views.
    pub(super) fn trainer(
        self,
        config: &TrainConfig,
        background: [f32; 3],
        extent: f64,
        views: &[TrainView],
    ) -> Trainer {
        let header = self.header;
        let mut t = Trainer::new(self.cloud, config, background, extent, header.rng);
        (t.moments, t.stats) = (self.moments, self.stats);
        (t.step, t.budget) = (header.step, header.budget);
        // Photos may have gone since.
        t.round = header.round.into_iter().filter(|k| (*k as usize) < views.len()).collect();
        if let Some(refinement) = header.refinement {
            t.schedule = Schedule::refining(config, extent, refinement.from_step);
            let turns = |v: &TrainView| refinement.photos.iter().find(|p| p.name == v.name).map_or(1, |p| p.turns);
            t.turns = views.iter().map(turns).collect();
            t.refinement = Some(refinement);
        }
        t.schedule.damping = header.damping;
        t
    }
}

#[cfg(test)]
mod tests {
    use glam::DVec3;

    use super::*;
    use crate::scene::{Camera, PhotoPixels};

    /// Two Gaussians before a black photo, the first of which is frozen: every step moves the second alone.
    #[test]
    fn frozen_gaussians_get_no_step() {
        let cloud = GaussianCloud {
            sh: vec![[0.5; 3]; 2],
            ..GaussianCloud::isotropic(vec![[-0.3, 0.0, 0.0], [0.3, 0.0, 0.0]], -1.5, 2.0)
        };
        let camera = Camera::look_at(DVec3::new(0.0, 0.0, -3.0), DVec3::ZERO, DVec3::NEG_Y, 0.6, 32, 32);
        let pixels =
            PhotoPixels { width_px: 32, height_px: 32, rgb: vec![[0; 3]; 32 * 32], coverage: None, alpha: None };
        let views = [TrainView { name: "a".into(), camera: camera.expect("valid"), pixels }];
        let config = TrainConfig { sh_degree: 0, densify: false, ..TrainConfig::default() };
        let steps = |frozen: usize| {
            let mut t = Trainer::new(cloud.clone(), &config, [0.0; 3], 1.0, Pcg64Mcg::seed_from_u64(1));
            t.refinement = Some(Refinement { frozen, ..Refinement::default() });
            for _ in 0..5 {
                t.advance(&views).expect("a step");
            }
            t.cloud
        };
        let (one, none) = (steps(1), steps(0));
        let bits = |c: &GaussianCloud, i: usize| {
            let g = c.gaussian(i);
            let all = g.position.iter().chain(&g.log_scale).chain(&g.quaternion).chain(g.sh.as_flattened());
            all.chain([&g.opacity_logit]).map(|v| v.to_bits()).collect::<Vec<_>>()
        };
        assert_eq!(bits(&one, 0), bits(&cloud, 0), "bit for bit");
        assert_ne!(bits(&one, 1), bits(&cloud, 1));
        assert_ne!(bits(&none, 0), bits(&cloud, 0), "the control: it would have moved");
    }
}
