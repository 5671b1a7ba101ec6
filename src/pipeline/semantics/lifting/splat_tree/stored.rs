//! The tree's file, from which a scene that was prepared once is ready at once. It is a cache: a file of other
//! Gaussians or a damaged one is ignored.
//!
//! | entry | what |
//! |---|---|
//! | metadata `of` | digest of the Gaussians, views and settings that the tree was made of |
//! | tensor `leaf` | `[n]` u32: the leaf of each Gaussian |
//! | tensor `area` | `[n]` f64: its area, square units |
//! | tensor `merges` | `[m, 2]` u32: the two nodes that each inner node merges; leaves count first |
//! | tensor `births` | `[m]` f64: the unlikeness at which it merges them, ascending |

use std::collections::HashMap;

use bytemuck::cast_slice;
use safetensors::tensor::{Dtype, SafeTensors, TensorView};
use sha2::{Digest, Sha256};

use super::hierarchy::Hierarchy;
use crate::io::files::hex;
use crate::pipeline::semantics::lifting::regions::tree::{Node, Tree};
use crate::render::RenderSettings;
use crate::scene::{Camera, GaussianCloud};

/// Key of the digest in the metadata.
const OF: &str = "of";
/// Changes with the rules by which a tree is made.
const VERSION: &str = "1";

/// Digest of all that a tree is made of.
pub(crate) fn digest(cloud: &GaussianCloud, cameras: &[Camera], settings: &RenderSettings) -> String {
    let mut sum = Sha256::new();
    sum.update(VERSION);
    sum.update(cast_slice(&cloud.origin.to_array()));
    sum.update(cast_slice(&cloud.positions));
    sum.update(cast_slice(&cloud.log_scales));
    sum.update(cast_slice(&cloud.quaternions));
    sum.update(cast_slice(&cloud.opacity_logits));
    sum.update(cast_slice(&cloud.sh));
    sum.update(format!("{settings:?}"));
    cameras.iter().for_each(|camera| sum.update(format!("{camera:?}")));
    hex(&sum.finalize())
}

impl Hierarchy {
    /// Bytes of the tree's file; `None` if they cannot be packed.
    pub(crate) fn encode(&self, of: &str) -> Option<Vec<u8>> {
        let inner = self.tree.nodes.iter().filter_map(|node| Some((node.children?, node.birth)));
        let (merges, births): (Vec<[u32; 2]>, Vec<f64>) = inner.unzip();
        let (n, m) = (self.leaf.len(), merges.len());
        let tensors = [
            ("leaf", TensorView::new(Dtype::U32, vec![n], cast_slice(&self.leaf)).ok()?),
            ("area", TensorView::new(Dtype::F64, vec![n], cast_slice(&self.area)).ok()?),
            ("merges", TensorView::new(Dtype::U32, vec![m, 2], cast_slice(&merges)).ok()?),
            ("births", TensorView::new(Dtype::F64, vec![m], cast_slice(&births)).ok()?),
        ];
        safetensors::serialize(tensors, Some(HashMap::from([(OF.to_owned(), of.to_owned())]))).ok()
    }

    /// Reads the tree of `n` Gaussians; `None` if the file is of something else, or damaged.
    pub(crate) fn decode(bytes: &[u8], of: &str, n: usize) -> Option<Self> {
        let (_, head) = SafeTensors::read_metadata(bytes).ok()?;
        if head.metadata().as_ref()?.get(OF)? != of {
            return None;
        }
        let file = SafeTensors::deserialize(bytes).ok()?;
        let data = |name: &str, dtype: Dtype| file.tensor(name).ok().filter(|t| t.dtype() == dtype);
        let whole = |t: TensorView<'_>| -> Vec<u32> {
            t.data().as_chunks().0.iter().copied().map(u32::from_le_bytes).collect()
        };
        let real = |t: TensorView<'_>| -> Vec<f64> {
            t.data().as_chunks().0.iter().copied().map(f64::from_le_bytes).collect()
        };
        let (leaf, area) = (whole(data("leaf", Dtype::U32)?), real(data("area", Dtype::F64)?));
        let (merges, births) = (whole(data("merges", Dtype::U32)?), real(data("births", Dtype::F64)?));
        let leaves = leaf.iter().max().map_or(0, |last| *last as usize + 1);
        let is_whole = [leaf.len(), area.len()] == [n, n] && merges.len() == 2 * births.len() && leaves <= n;
        if !is_whole || !area.iter().chain(&births).all(|v| v.is_finite() && *v >= 0.0) {
            return None;
        }
        let blank = Node { children: None, parent: None, birth: 0.0, death: 0.0, area: 0.0 };
        let mut nodes = vec![blank.clone(); leaves];
        leaf.iter().zip(&area).for_each(|(leaf, area)| nodes[*leaf as usize].area += area);
        for (pair, birth) in merges.chunks_exact(2).zip(&births) {
            let (children, new) = ([pair[0], pair[1]], nodes.len() as u32);
            let mut sum = 0.0;
            for child in children {
                // Each is there already, and merged once.
                let node = nodes.get_mut(child as usize).filter(|node| node.parent.is_none())?;
                (node.parent, node.death) = (Some(new), *birth);
                sum += node.area;
            }
            nodes.push(Node { children: Some(children), birth: *birth, area: sum, ..blank.clone() });
        }
        let last = births.last().copied().unwrap_or(0.0);
        nodes.iter_mut().filter(|node| node.parent.is_none()).for_each(|node| node.death = last);
        Some(Self { leaf, leaves, tree: Tree { nodes }, area })
    }
}

#[cfg(test)]
mod tests {
    use super::super::hierarchy::tests::{cameras, hierarchy, sheet};
    use super::*;

    #[test]
    fn a_stored_tree_is_the_same_and_one_of_other_gaussians_or_a_damaged_one_is_none() {
        let (cloud, _) = sheet();
        let settings = RenderSettings::default();
        let (tree, of) = (hierarchy(&cloud), digest(&cloud, &cameras(), &settings));
        let bytes = tree.encode(&of).expect("packed");
        let again = Hierarchy::decode(&bytes, &of, cloud.len()).expect("read");
        assert_eq!(format!("{tree:?}"), format!("{again:?}"));
        let mut other = cloud.clone();
        other.positions[5][0] += 0.25;
        let other = digest(&other, &cameras(), &settings);
        assert_ne!(of, other);
        assert!(Hierarchy::decode(&bytes, &other, cloud.len()).is_none(), "of other Gaussians");
        assert!(Hierarchy::decode(&bytes, &of, cloud.len() - 1).is_none(), "of another number");
        for cut in [0, 7, bytes.len() / 2, bytes.len() - 1] {
            assert!(Hierarchy::decode(&bytes[..cut], &of, cloud.len()).is_none(), "cut off at {cut}");
        }
        let torn = Hierarchy {
            leaf: vec![0; 3],
            leaves: 1,
            tree: Tree { nodes: tree.tree.nodes.clone() },
            area: vec![1.0; 3],
        };
        let torn = torn.encode(&of).expect("packed");
        assert!(Hierarchy::decode(&torn, &of, 3).is_none(), "nodes that are not there");
    }
}
