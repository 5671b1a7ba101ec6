//! Identities together with the Gaussians that belong to them.

use super::{ExtraProperty, GaussianCloud, Identities, IdentityId, NOBODY};

/// Per-Gaussian properties that carry the map in a `.ply`: identity, margin of its votes, code.
pub const IDENTITY: &str = "fmlgs_identity";
const MARGIN: &str = "fmlgs_margin";
const CODE: [&str; 3] = ["fmlgs_code_0", "fmlgs_code_1", "fmlgs_code_2"];

/// What a scene consists of.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct SemanticMap {
    /// Objects and parts.
    pub identities: Identities,
    /// The innermost identity of each Gaussian; `NOBODY` for none.
    pub of: Vec<IdentityId>,
    /// How clearly each Gaussian belongs there, 0 (a guess) to 1.
    pub margin: Vec<f32>,
    /// Names of the photos whose masks it comes from.
    pub seeds: Vec<String>,
}

impl SemanticMap {
    /// Writes identity, margin and code into the cloud's extra properties; `background` is the
    /// code of what is nobody's.
    pub fn store(&self, cloud: &mut GaussianCloud, background: [f32; 3]) {
        let ours = |name: &str| name == IDENTITY || name == MARGIN || CODE.contains(&name);
        cloud.extras.retain(|e| !ours(&e.name));
        let code = |id: &IdentityId| self.identities.get(*id).map_or(background, |i| i.code);
        let mut add = |name: &str, values: Vec<f32>| cloud.extras.push(ExtraProperty { name: name.into(), values });
        // Whole numbers up to 2^24 are exact.
        add(IDENTITY, self.of.iter().map(|id| *id as f32).collect());
        add(MARGIN, self.margin.clone());
        for (c, name) in CODE.iter().enumerate() {
            add(name, self.of.iter().map(|id| code(id)[c]).collect());
        }
    }

    /// The map of a cloud that [`Self::store`] has written to, with these identities. `None` if
    /// the cloud carries none, or refers to identities that are not there.
    pub fn restore(identities: Identities, seeds: Vec<String>, cloud: &GaussianCloud) -> Option<Self> {
        let values = |name: &str| cloud.extras.iter().find(|e| e.name == name).map(|e| e.values.as_slice());
        let id = |v: &f32| {
            let whole = *v >= 0.0 && v.fract() == 0.0 && *v <= identities.len() as f32;
            whole.then_some(*v as IdentityId)
        };
        let of: Vec<IdentityId> = values(IDENTITY)?.iter().map(id).collect::<Option<_>>()?;
        let margin = values(MARGIN).map_or_else(|| vec![0.0; of.len()], <[f32]>::to_vec);
        Some(Self { identities, of, margin, seeds })
    }

    /// Number of Gaussians of each identity, pieces included, by number; those of nobody first.
    pub fn sizes(&self) -> Vec<usize> {
        let mut sizes = vec![0; self.identities.len() + 1];
        for &id in &self.of {
            if id == NOBODY {
                sizes[0] += 1;
            }
            for i in self.identities.line(id) {
                sizes[i as usize] += 1;
            }
        }
        sizes
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::Level;

    #[test]
    fn a_cloud_carries_its_map() {
        let mut identities = Identities::default();
        let doll = identities.add(Level::Object, NOBODY, vec!["doll".into()]);
        let eye = identities.add(Level::Part, doll, vec!["eye".into()]);
        let map = SemanticMap {
            identities: identities.clone(),
            of: vec![eye, NOBODY, doll],
            margin: vec![0.5, 0.0, 1.0],
            seeds: vec!["a.jpg".into()],
        };
        let mut cloud = GaussianCloud { positions: vec![[0.0; 3]; 3], ..GaussianCloud::default() };
        cloud.extras.push(ExtraProperty { name: "kept".into(), values: vec![7.0; 3] });
        map.store(&mut cloud, [0.5; 3]);
        map.store(&mut cloud, [0.5; 3]);
        assert_eq!(cloud.extras.len(), 6);
        assert_eq!(SemanticMap::restore(identities.clone(), map.seeds.clone(), &cloud), Some(map.clone()));
        assert_eq!(map.sizes(), [1, 2, 1]);
        assert_eq!(SemanticMap::restore(Identities::default(), vec![], &cloud), None, "identities are missing");
        for bad in [-1.0, 0.5, 3.0, f32::NAN] {
            cloud.extras[1].values[0] = bad;
            assert_eq!(SemanticMap::restore(identities.clone(), vec![], &cloud), None, "{bad}");
        }
        assert_eq!(SemanticMap::restore(identities, vec![], &GaussianCloud::default()), None);
    }
}
