//! Known things that strokes correct, and what all others lose meanwhile.

use std::collections::BTreeMap;

use super::{Category, LabeledPhoto};
use crate::math::stats::mean;
use crate::pipeline::semantics::lifting::edit::reshaped;
use crate::pipeline::semantics::view_map::ViewMap;
use crate::render::{DrawError, RenderSettings, Renderer};
use crate::scene::{GaussianCloud, IdentityId, LevelFilter, SemanticMap};

/// Largest loss of another thing by a stroke.
#[derive(Clone, Debug, Default, PartialEq, serde::Serialize)]
pub(crate) struct WorstOther {
    /// Its name; empty if nothing loses.
    pub(crate) name: String,
    /// Change of its mean IoU over the views that label it: 0 or less.
    pub(crate) change: f64,
}

/// Labels of named things: the number of each view, and the label there.
pub(crate) type NamedThings<'a> = BTreeMap<&'a str, Vec<(usize, &'a Category)>>;

/// Known things of a scene, while one of them is corrected.
pub(crate) struct KnownThings<'a> {
    map: &'a SemanticMap,
    drawn: (&'a GaussianCloud, &'a RenderSettings),
    views: &'a [LabeledPhoto],
    things: &'a NamedThings<'a>,
    renderer: Renderer,
    /// Mean IoU of each thing, before any correction and now.
    before: BTreeMap<&'a str, f64>,
    now: BTreeMap<&'a str, f64>,
}

impl<'a> KnownThings<'a> {
    /// Scores all things as they are.
    pub(crate) fn new(
        map: &'a SemanticMap,
        drawn: (&'a GaussianCloud, &'a RenderSettings),
        (views, things): (&'a [LabeledPhoto], &'a NamedThings<'a>),
    ) -> Result<Self, DrawError> {
        let (before, now) = (BTreeMap::new(), BTreeMap::new());
        let mut known = Self { map, drawn, views, things, renderer: Renderer::new(), before, now };
        known.before = known.scores(&map.identity_of)?;
        known.restart();
        Ok(known)
    }

    /// Takes back all corrections.
    pub(crate) fn restart(&mut self) {
        self.now = self.before.clone();
    }

    /// Returns the map, and the identity in it with this name.
    pub(crate) fn find(&self, name: &str) -> Option<(&'a SemanticMap, IdentityId)> {
        let id = self.map.identities.called(name, LevelFilter::Auto).first().copied();
        id.map(|id| (self.map, id))
    }

    /// Mean IoU of each thing if the Gaussians have these labels.
    fn scores(&mut self, labels: &[IdentityId]) -> Result<BTreeMap<&'a str, f64>, DrawError> {
        let ((cloud, settings), all) = (self.drawn, &self.map.identities);
        let mut drawn = Vec::with_capacity(self.views.len());
        for view in self.views {
            drawn.push(ViewMap::render(&mut self.renderer, cloud, labels, all, &view.camera, settings)?);
        }
        let known = self.things.iter().filter_map(|(name, seen)| Some((*name, self.find(name)?.1, seen)));
        let score = |(name, id, seen): (&'a str, IdentityId, &Vec<(usize, &Category)>)| {
            let iou = seen.iter().map(|(view, label)| drawn[*view].mask(all, id).iou(&label.mask));
            (name, mean(&iou.collect::<Vec<_>>()))
        };
        Ok(known.map(score).collect())
    }

    /// Gives a thing these Gaussians; returns the largest loss of another one by that.
    pub(crate) fn worst_other(&mut self, corrected: &str, is_in: &[bool]) -> Result<WorstOther, DrawError> {
        let Some((map, id)) = self.find(corrected) else { return Ok(WorstOther::default()) };
        let after = self.scores(&reshaped(map, id, is_in))?;
        let before = std::mem::replace(&mut self.now, after);
        let changes = self.now.iter().filter_map(|(name, now)| Some((*name, now - before.get(name)?)));
        let losses = changes.filter(|(name, change)| *name != corrected && *change < 0.0);
        let worst = losses.min_by(|a, b| a.1.total_cmp(&b.1));
        Ok(worst.map_or_else(WorstOther::default, |(name, change)| WorstOther { name: name.to_owned(), change }))
    }
}

#[cfg(test)]
mod tests {
    use glam::DVec3;

    use super::*;
    use crate::scene::{Camera, Identities, Level, Mask, NO_IDENTITY};

    #[test]
    fn what_another_thing_loses_is_told_and_what_the_corrected_one_loses_is_not() {
        let mut all = Identities::default();
        for name in ["left", "right", "far"] {
            all.add(Level::Object, NO_IDENTITY, vec![name.into()]);
        }
        // Three balls, side by side.
        let cloud = GaussianCloud::isotropic(vec![[-0.6, 0.0, 0.0], [0.0; 3], [0.6, 0.0, 0.0]], -2.0, 4.0);
        let camera =
            Camera::look_at(DVec3::new(0.0, 0.0, -3.0), DVec3::ZERO, DVec3::NEG_Y, 0.8, 60, 40).expect("valid");
        let map = SemanticMap::from_identities(all, vec![1, 2, 3], vec![1.0; 3], Vec::new());
        let (mut renderer, settings) = (Renderer::new(), RenderSettings::default());
        let drawn = ViewMap::render(&mut renderer, &cloud, &map.identity_of, &map.identities, &camera, &settings);
        let drawn = drawn.expect("drawn");
        let label = |name: &str, id| {
            let mask: Mask = drawn.mask(&map.identities, id);
            Category { name: name.into(), level: Level::Object, boxes: Vec::new(), mask }
        };
        let categories = vec![label("left", 1), label("right", 2), label("far", 3)];
        let views = [LabeledPhoto { name: "view".into(), camera, categories }];
        let things: NamedThings<'_> = views[0].categories.iter().map(|c| (c.name.as_str(), vec![(0, c)])).collect();
        let known = KnownThings::new(&map, (&cloud, &settings), (&views, &things));
        let mut known = known.expect("drawn");
        let mut worst = |is_in: [bool; 3]| known.worst_other("left", &is_in).expect("drawn");
        assert_eq!(worst([true, false, false]), WorstOther::default(), "nothing has changed");
        assert_eq!(worst([false; 3]), WorstOther::default(), "it alone loses");
        assert_eq!(worst([true, false, true]), WorstOther { name: "far".into(), change: -1.0 });
        assert_eq!(worst([true, false, true]), WorstOther::default(), "since the last stroke");
        assert_eq!(
            worst([true, true, false]),
            WorstOther { name: "right".into(), change: -1.0 },
            "the other one gains"
        );
        known.restart();
        assert_eq!(known.worst_other("left", &[true, false, false]).expect("drawn"), WorstOther::default());
        assert_eq!(known.worst_other("nobody", &[true; 3]).expect("drawn"), WorstOther::default());
    }
}
