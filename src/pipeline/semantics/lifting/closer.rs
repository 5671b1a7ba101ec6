//! Masks of close-ups, added to a known map: known identities get finer borders, and parts that only a close-up shows
//! come below the identities that they lie in.

use super::associate::{Link, link};
use super::edit::add;
use super::error::FindError;
use super::segmenter::{FoundMask, Segmenter};
use super::tracker::labels_of;
use super::votes::{LEAST_VOTES, UNKNOWN, Votes};
use crate::pipeline::observer::{Observer, Ticker};
use crate::pipeline::semantics::view_map::ViewMap;
use crate::render::{RenderSettings, Renderer};
use crate::scene::{GaussianCloud, IdentityId, Level, NO_IDENTITY, Photo, SemanticMap};

/// Least number of pixels of a mask of a new identity.
const LEAST_PX: usize = 24;
/// Least share of a mask that lies in its whole, and largest share of the whole's pixels that it takes.
const INSIDE: f64 = 0.8;
const MOST: f64 = 0.7;
/// Least share of unlabeled pixels of a mask that shows a new object.
const NEWS: f64 = 0.5;

/// Returns the map with the masks of `photos`, from the photo after those it has masks of already. A Gaussian from
/// `frozen` on takes any identity that the masks give it; one before that only a piece of its own.
pub(crate) fn closer(
    known: &SemanticMap,
    (cloud, frozen): (&GaussianCloud, usize),
    photos: &[Photo],
    (settings, side_px): (&RenderSettings, u32),
    segmenter: &mut dyn Segmenter,
    observer: &mut dyn Observer,
) -> Result<SemanticMap, FindError> {
    let covered: Vec<&Photo> = photos.iter().filter(|p| segmenter.covers(p)).collect();
    let mut ticker = Ticker::new("Finding parts in close-ups", 2 * covered.len());
    let (mut renderer, mut map, mut votes) = (Renderer::new(), known.clone(), Votes::new(cloud.len()));
    for (done, photo) in covered.iter().enumerate() {
        let seen = votes.see(&mut renderer, cloud, &photo.camera.limited_to(side_px), settings);
        seen.map_err(|e| FindError::Render(photo.name.clone(), e.into()))?;
        ticker.tick(done + 1, observer)?;
    }
    for (done, photo) in covered.iter().enumerate() {
        let failed = |e| FindError::Render(photo.name.clone(), e);
        let camera = photo.camera.limited_to(side_px);
        let found = segmenter.segment(photo, side_px, observer)?;
        let of = &map.identity_of;
        let view = ViewMap::render(&mut renderer, cloud, of, &map.identities, &camera, settings).map_err(failed)?;
        let ids = identities(&mut map, &found, &view);
        let labels = labels_of(&found, &ids, camera.width_px as usize * camera.height_px as usize);
        let voted = votes.add_view(&mut renderer, cloud, &camera, settings, &labels);
        voted.map_err(|e| failed(e.into()))?;
        decide(&mut map, known, &votes, frozen);
        if !map.seeds.contains(&photo.name) {
            map.seeds.push(photo.name.clone());
        }
        ticker.tick(covered.len() + done + 1, observer)?;
    }
    map.look_at(cloud);
    Ok(map)
}

/// Returns the identity of each mask of a view, and adds new ones; `UNKNOWN` for masks that say nothing.
fn identities(map: &mut SemanticMap, found: &[FoundMask], view: &ViewMap) -> Vec<IdentityId> {
    let links = link(found, Some(view), &map.identities);
    let mut ids: Vec<IdentityId> = Vec::with_capacity(found.len());
    for (mask, link) in found.iter().zip(&links) {
        let whole = mask.parent.map(|p| ids[p]);
        let id = match link {
            Link::Known(id) => *id,
            _ if mask.mask.area() < LEAST_PX || whole == Some(UNKNOWN) => UNKNOWN,
            _ => {
                // A file that calls it an object means it.
                let is_said = mask.level == Level::Object && mask.name.is_some();
                let around = if is_said { None } else { around(map, mask, view, whole) };
                let free = mask.mask.pixels().filter(|i| matches!(view.identity[*i], NO_IDENTITY | UNKNOWN)).count();
                let is_new = around.is_none() && whole.is_none() && free as f64 >= NEWS * mask.mask.area() as f64;
                let name = mask.name.clone().unwrap_or_default();
                match around.or(whole) {
                    Some(whole) => add(map, Level::Part, whole, name, &[]),
                    None if is_new => add(map, mask.level, NO_IDENTITY, name, &[]),
                    None => UNKNOWN,
                }
            }
        };
        ids.push(id);
    }
    ids
}

/// Returns the innermost identity, `whole` or a piece of it if that is given, in which a mask lies and of which it is a
/// piece.
fn around(map: &SemanticMap, mask: &FoundMask, view: &ViewMap, whole: Option<IdentityId>) -> Option<IdentityId> {
    let all = &map.identities;
    let candidates = all.iter().map(|(id, _)| id).filter(|id| whole.is_none_or(|w| *id == w || all.is_piece(*id, w)));
    let area = mask.mask.area() as f64;
    let is_around = |id: &IdentityId| {
        let is = all.descendants(*id);
        let has = |i: usize| is.get(view.identity[i] as usize).copied().unwrap_or(false);
        let inside = mask.mask.pixels().filter(|i| has(*i)).count() as f64;
        let visible = (0..view.identity.len()).filter(|i| has(*i)).count() as f64;
        inside >= INSIDE * area && inside <= MOST * visible
    };
    let depth = |id: &IdentityId| all.ancestors(*id).count();
    candidates.filter(is_around).max_by_key(depth)
}

/// Gives Gaussians the identities that the votes so far decide.
fn decide(map: &mut SemanticMap, known: &SemanticMap, votes: &Votes, frozen: usize) {
    for (i, now) in votes.decide(&map.identities, LEAST_VOTES).into_iter().enumerate() {
        let own = known.identity_of[i];
        let is_unsaid = now.identity == UNKNOWN || now.identity == NO_IDENTITY && own != NO_IDENTITY;
        // A whole says nothing against its piece.
        let is_coarser = own != NO_IDENTITY && own != UNKNOWN && map.identities.is_piece(own, now.identity);
        let is_finer = own == NO_IDENTITY || map.identities.is_piece(now.identity, own);
        if is_unsaid || is_coarser || i < frozen && !is_finer {
            continue;
        }
        (map.identity_of[i], map.margin[i]) = (now.identity, now.margin);
        map.codes[i] = map.identities.codes(now.identity);
    }
}

#[cfg(test)]
mod tests {
    use glam::DVec3;

    use super::*;
    use crate::pipeline::observer::Silent;
    use crate::scene::{Camera, Identities, Mask};

    const SIDE_PX: u32 = 48;

    /// Masks of the right half of what every photo shows, as a part of nobody knows what.
    struct RightHalf;

    impl Segmenter for RightHalf {
        fn name(&self) -> &str {
            "right half"
        }

        fn covers(&self, _: &Photo) -> bool {
            true
        }

        fn segment(&mut self, _: &Photo, side: u32, _: &mut dyn Observer) -> Result<Vec<FoundMask>, FindError> {
            let side = side as usize;
            let mask = Mask::from_fn(side, side, |i| (24..43).contains(&(i % side)) && (21..27).contains(&(i / side)));
            Ok(vec![FoundMask { level: Level::Part, parent: None, name: Some("lid".into()), mask }])
        }
    }

    #[test]
    fn a_part_that_a_close_up_shows_comes_below_the_object_it_lies_in() {
        let xs = [-0.3_f32, -0.1, 0.1, 0.3];
        let cloud = GaussianCloud::isotropic(xs.map(|x| [x, 0.0, 0.0]).to_vec(), -2.6, 4.0);
        let camera = Camera::look_at(DVec3::new(0.0, 0.0, -2.0), DVec3::ZERO, DVec3::NEG_Y, 0.5, SIDE_PX, SIDE_PX);
        let camera = camera.expect("valid");
        let on_the_right = |i: usize| camera.project(cloud.world_position(i)).is_some_and(|p| p.x > 24.0);
        let mut all = Identities::default();
        let pot = all.add(Level::Object, NO_IDENTITY, vec!["pot".into()]);
        let known = SemanticMap::from_identities(all, vec![pot; 4], vec![1.0; 4], vec!["far".into()]);
        let photos = [Photo::new("near", "near.png", camera.clone())];
        let settings = RenderSettings::default();
        let map =
            closer(&known, (&cloud, 0), &photos, (&settings, SIDE_PX), &mut RightHalf, &mut Silent).expect("found");
        assert_eq!((map.identities.len(), map.identities.get(2).map(|i| i.parent)), (2, Some(pot)));
        let is = |i: usize| if on_the_right(i) { 2 } else { pot };
        assert_eq!(map.identity_of, (0..4).map(is).collect::<Vec<_>>());
        assert_eq!(map.seeds, ["far", "near"]);
        assert_ne!(map.codes[0], map.codes[3], "the part has its own code");
        // Once more: the part is known by its name.
        let again =
            closer(&map, (&cloud, 4), &photos, (&settings, SIDE_PX), &mut RightHalf, &mut Silent).expect("found");
        assert_eq!((again.identities.len(), &again.identity_of), (2, &map.identity_of));
    }
}
