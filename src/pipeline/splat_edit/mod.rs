//! Edits of Gaussians: move, duplicate and recolor objects and parts, and delete selected Gaussians.
//!
//! An edit returns new Gaussians and leaves the old ones unchanged, so that it can be undone.

mod grade;

use glam::{DMat3, DQuat, DVec3};

pub(crate) use self::grade::Grade;

use crate::math::sh::{self, SH_C0};
use crate::math::{Real, rotation};
use crate::pipeline::semantics::lifting::edit;
use crate::scene::{Bounds, GaussianCloud, IdentityId, NO_IDENTITY, SemanticMap};

/// Luma weights of red, green and blue (ITU-R BT.709).
const BRIGHTNESS: [f64; 3] = [0.2126, 0.7152, 0.0722];
/// Least mean brightness of an object when it is recolored: shades of black are noise.
const DARKEST: f64 = 0.1;

/// Sine of half the angle up to which a rotation counts as whole turns, for rounding.
const WHOLE_TURN: f64 = 1e-9;

/// Edit of Gaussians.
#[derive(Clone, Debug, PartialEq)]
pub enum SplatEdit {
    /// Deletes the Gaussians that are `true`.
    Delete(Vec<bool>),
    /// Changes an object or a part.
    Arrange(Arrangement),
}

/// Edit of an object or a part.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Arrangement {
    pub(crate) id: IdentityId,
    /// True if a copy is edited and the original stays.
    pub(crate) duplicate: bool,
    pub(crate) to: Placement,
    /// New color (red, green, blue, 0 to 1, as displayed), which keeps its shades.
    pub(crate) color: Option<[f32; 3]>,
    /// Change of its colors, after the new color.
    pub(crate) grade: Grade,
}

impl Arrangement {
    /// Edit that changes nothing.
    pub(crate) fn of(id: IdentityId) -> Self {
        Self { id, duplicate: false, to: Placement::default(), color: None, grade: Grade::default() }
    }

    /// Returns whether its colors change.
    pub(crate) fn is_recolored(&self) -> bool {
        self.color.is_some() || self.grade != Grade::default()
    }
}

/// Placement of an object: rotated and scaled about its own middle, then shifted.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Placement {
    /// Scene units.
    pub(crate) shift: DVec3,
    pub(crate) turn: DQuat,
    pub(crate) scale: f64,
}

impl Placement {
    /// True if it moves nothing; whole turns count as no rotation.
    fn is_nothing(&self) -> bool {
        let axis = DVec3::new(self.turn.x, self.turn.y, self.turn.z);
        let is_whole = axis.length() < WHOLE_TURN * self.turn.length();
        self.shift == DVec3::ZERO && self.scale == 1.0 && is_whole
    }
}

impl Default for Placement {
    fn default() -> Self {
        Self { shift: DVec3::ZERO, turn: DQuat::IDENTITY, scale: 1.0 }
    }
}

/// Reasons for which an edit cannot be made.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[allow(missing_docs, reason = "each text says what its variant is")]
pub enum SplatEditError {
    #[error("the scene has no objects and parts that could be edited")]
    NoObjects,
    #[error("there is no object or part number {0}")]
    Unknown(IdentityId),
    #[error("'{0}' has no Gaussians")]
    Empty(String),
    #[error("no Gaussian is chosen, so nothing would change")]
    NothingChosen,
    #[error("nothing would be left of the scene")]
    NothingLeft,
    #[error("nothing would change: it stays where it is, as large and in the color that it has")]
    NoChange,
    #[error("nothing would be seen of it: a second one would lie exactly in the first; move, turn or scale it as well")]
    SamePlace,
    #[error("a scale must be more than 0, and all numbers finite")]
    Placement,
    #[error("brightness and saturation must be 0 or more and finite, and a tint must not be black")]
    Grade,
    #[error("'{0}' would be too far away or too large for the numbers that a scene is stored in")]
    OutOfRange(String),
}

type Result<T> = std::result::Result<T, SplatEditError>;

/// Returns the Gaussians and the semantic map after an edit.
///
/// # Errors
/// If the edit is invalid; nothing has changed then.
pub(crate) fn apply(
    cloud: &GaussianCloud,
    map: Option<&SemanticMap>,
    edit: &SplatEdit,
) -> Result<(GaussianCloud, Option<SemanticMap>)> {
    match edit {
        SplatEdit::Delete(gone) => delete(cloud, map, gone),
        SplatEdit::Arrange(change @ Arrangement { id, duplicate, to, color, grade }) => {
            let matrix = grade.matrix().ok_or(SplatEditError::Grade)?;
            let is_recolored = change.is_recolored();
            let (map, mut thing) = thing(map, *id)?;
            match (to.is_nothing(), duplicate, is_recolored) {
                (true, false, false) => return Err(SplatEditError::NoChange),
                (true, true, false) => return Err(SplatEditError::SamePlace),
                _ => {}
            }
            let (mut cloud, mut map) = (cloud.clone(), map.clone());
            if *duplicate {
                let all: Vec<usize> = (0..cloud.len()).chain(thing).collect();
                thing = (cloud.len()..all.len()).collect();
                (cloud, map) = (cloud.select(&all), doubled(&map, &all, *id));
            }
            if *to != Placement::default() {
                place(&mut cloud, &thing, to, &map, *id)?;
            }
            if let Some(color) = color {
                recolor(&mut cloud, &thing, color.map(f64::from));
            }
            if *grade != Grade::default() {
                grade::apply(&mut cloud, &thing, &matrix);
            }
            if *duplicate || is_recolored {
                map.look_at(&cloud);
            }
            Ok((cloud, Some(map)))
        }
    }
}

/// Returns the Gaussians of an identity; an error if it has none.
fn thing(map: Option<&SemanticMap>, id: IdentityId) -> Result<(&SemanticMap, Vec<usize>)> {
    let map = map.ok_or(SplatEditError::NoObjects)?;
    if map.identities.get(id).is_none() {
        return Err(SplatEditError::Unknown(id));
    }
    let thing = map.members(id);
    if thing.is_empty() { Err(SplatEditError::Empty(map.identities.full_name(id))) } else { Ok((map, thing)) }
}

fn delete(
    cloud: &GaussianCloud,
    map: Option<&SemanticMap>,
    gone: &[bool],
) -> Result<(GaussianCloud, Option<SemanticMap>)> {
    let kept: Vec<usize> = (0..cloud.len()).filter(|&i| gone.get(i) != Some(&true)).collect();
    if kept.len() == cloud.len() {
        return Err(SplatEditError::NothingChosen);
    }
    if kept.is_empty() {
        return Err(SplatEditError::NothingLeft);
    }
    Ok((cloud.select(&kept), map.map(|map| map.select_fully(&kept))))
}

/// Center of rotation of an object: the middle of its bounds, without stray Gaussians.
pub(crate) fn middle(cloud: &GaussianCloud, thing: &[usize]) -> DVec3 {
    Bounds::robust(thing.iter().map(|&i| cloud.world_position(i))).map_or(DVec3::ZERO, |b| b.center())
}

fn place(cloud: &mut GaussianCloud, thing: &[usize], to: &Placement, map: &SemanticMap, id: IdentityId) -> Result<()> {
    let turn = rotation::unit_quaternion([to.turn.w, to.turn.x, to.turn.y, to.turn.z]);
    let Some([w, x, y, z]) = turn.filter(|_| to.scale > 0.0 && to.scale.is_finite() && to.shift.is_finite()) else {
        return Err(SplatEditError::Placement);
    };
    let turn = DQuat::from_xyzw(x, y, z, w);
    let (about, origin, stride) = (middle(cloud, thing), cloud.origin, cloud.sh_stride());
    let harmonics = sh::rotation(&DMat3::from_quat(turn));
    for &i in thing {
        let p = about + to.scale * (turn * (cloud.world_position(i) - about)) + to.shift;
        cloud.positions[i] = (p - origin).as_vec3().to_array();
        cloud.log_scales[i] = cloud.log_scales[i].map(|s| (f64::from(s) + to.scale.ln()) as f32);
        if turn != DQuat::IDENTITY {
            // Gaussians with an invalid rotation are not drawn, so they stay as they are.
            if let Some([w, x, y, z]) = rotation::unit_quaternion(cloud.quaternions[i].map(f64::from)) {
                let q = turn * DQuat::from_xyzw(x, y, z, w);
                cloud.quaternions[i] = [q.w, q.x, q.y, q.z].map(|v| v as f32);
            }
            let own = &mut cloud.sh[i * stride..(i + 1) * stride];
            let before: Vec<[f64; 3]> = own.iter().map(|c| c.map(f64::from)).collect();
            for (row, coefficient) in harmonics.iter().zip(own.iter_mut()).skip(1) {
                *coefficient = [0, 1, 2].map(|c| row.iter().zip(&before).map(|(m, b)| m * b[c]).sum::<f64>() as f32);
            }
        }
    }
    let is_good = |i: &usize| cloud.positions[*i].iter().chain(&cloud.log_scales[*i]).all(|v| v.is_finite());
    if thing.iter().all(is_good) { Ok(()) } else { Err(SplatEditError::OutOfRange(map.identities.full_name(id))) }
}

/// Semantic map of the Gaussians `all`, whose repeated ones belong to a copy of `id`.
fn doubled(map: &SemanticMap, all: &[usize], id: IdentityId) -> SemanticMap {
    let mut new = map.select_fully(all);
    let inside = map.identities.descendants(id);
    let first_copy = map.identity_of.len();
    let mut number: Vec<IdentityId> = (0..=map.identities.len() as IdentityId).collect();
    // Parents have smaller numbers than their parts.
    for old in (1..=map.identities.len() as IdentityId).filter(|i| inside[*i as usize]) {
        let Some(identity) = map.identities.get(old) else { continue };
        let parent = if old == id { identity.parent } else { number[identity.parent as usize] };
        let name = identity.names.first().cloned().unwrap_or_default();
        let own: Vec<usize> = (first_copy..all.len()).filter(|&k| map.identity_of[all[k]] == old).collect();
        let added = edit::add(&mut new, identity.level, parent, name, &own);
        number[old as usize] = added;
        if let Some(copy) = new.identities.get_mut(added) {
            (copy.names, copy.by_hand) = (identity.names.clone(), true);
        }
        if let Some(language) = &mut new.language
            && let Some(seen) = language.by_identity.get(old as usize - 1).cloned()
            && let Some(copy) = language.by_identity.get_mut(added as usize - 1)
        {
            *copy = seen;
        }
    }
    debug_assert!(number[id as usize] != NO_IDENTITY);
    new
}

/// Colors an object's shades of gray, so that its mean brightness becomes `color`.
fn recolor(cloud: &mut GaussianCloud, thing: &[usize], color: [f64; 3]) {
    let stride = cloud.sh_stride();
    let brightness = |rgb: [f64; 3]| BRIGHTNESS.iter().zip(rgb).map(|(b, v)| b * v).sum::<f64>();
    let shown = |c: [f32; 3]| c.map(|v| 0.5 + SH_C0 * f64::from(v));
    let (sum, weight) = thing.iter().fold((0.0, 0.0), |(sum, weight), &i| {
        let [a, b, c] = cloud.log_scales[i].map(|s| f64::from(s).exp());
        // The area of the two larger extents is the visible one.
        let w = f64::from(cloud.opacity_logits[i].sigmoid()) * (a * b).max(b * c).max(a * c);
        (sum + w * brightness(shown(cloud.sh[i * stride])).clamp(0.0, 1.0), weight + w)
    });
    let mean = if weight > 0.0 { (sum / weight).max(DARKEST) } else { DARKEST };
    let tinted = |gray: f64| color.map(|c| c * gray / mean);
    for &i in thing {
        let own = &mut cloud.sh[i * stride..(i + 1) * stride];
        own[0] = tinted(brightness(shown(own[0]))).map(|v| ((v - 0.5) / SH_C0) as f32);
        own[1..].iter_mut().for_each(|c| *c = tinted(brightness(c.map(f64::from))).map(|v| v as f32));
    }
}

#[cfg(test)]
mod tests;
