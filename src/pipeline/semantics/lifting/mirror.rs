//! Guesses of parts on sides that no labeled photo shows: a thing that looks like its own mirror image has the parts of
//! the labeled side on the other one, too.

use glam::DVec3;
use rayon::prelude::*;
use rstar::RTree;
use rstar::primitives::GeomWithData;

use super::votes::{Assignment, LEAST_VOTES, UNKNOWN, Votes};
use crate::math::format::things;
use crate::math::sh::SH_C0;
use crate::math::stats::{median, quantile};
use crate::pipeline::observer::{Interrupted, Observer, Severity, begin};
use crate::scene::{GaussianCloud, Identities, IdentityId, Level, NO_IDENTITY};

/// Margin of a guess.
pub(crate) const GUESSED: f32 = 0.05;

/// Fewest Gaussians of a thing that labels speak for, and that they do not.
const LEAST_GAUSSIANS: usize = 30;
/// Directions of the normal that are tried, and those that are refined.
const DIRECTIONS: usize = 120;
const BEST: usize = 3;
/// Offsets from the middle that are tried for the best, as shares of the size.
const OFFSETS: [f64; 9] = [-0.12, -0.08, -0.05, -0.025, 0.0, 0.025, 0.05, 0.08, 0.12];
/// First and last step of the refinement, in radians and shares of the size.
const STEPS: (f64, f64) = (0.08, 0.01);
/// Likeness of colors this far apart is 1/e; 0 to 1 in each channel.
const ALIKE: f64 = 0.2;
/// Least likeness to the mirror image, as a share of that of neighbors.
const LEAST_LIKENESS: f64 = 0.6;
/// Labeled Gaussians around a mirrored place that decide, their least likeness in all, and the least share of it for a
/// guess.
const AROUND: usize = 5;
const LEAST_AROUND: f64 = 1.0;
const LEAST_SHARE: f64 = 0.7;
/// Distance beyond which nothing is alike, in lengths of [`Comparison::near`].
const REACH: f64 = 3.0;

/// Scale and effort of a comparison with the mirror image.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Comparison {
    /// Gaussians that are compared.
    sample: usize,
    /// Likeness of places this far apart is 1/e, as a share of the size.
    near: f64,
}

const COARSE: Comparison = Comparison { sample: 80, near: 0.12 };
const FINE: Comparison = Comparison { sample: 150, near: 0.04 };

type Place = GeomWithData<[f64; 3], usize>;

/// Plane between a thing's two sides: the points with `normal * x = offset`.
#[derive(Clone, Copy, Debug, PartialEq)]
struct MirrorPlane {
    normal: DVec3,
    offset: f64,
}

impl MirrorPlane {
    fn image(&self, p: DVec3) -> DVec3 {
        p - 2.0 * (self.normal.dot(p) - self.offset) * self.normal
    }
}

/// Looks of the Gaussians of one thing.
struct Thing<'a> {
    cloud: &'a GaussianCloud,
    own: &'a [usize],
    tree: RTree<Place>,
    /// Median distance from the mean place, times two.
    size: f64,
}

/// Gives parts to the Gaussians that no mask voted on ([`Votes`] `said`), where the mirror image of their thing has
/// some. The margin of a guess is [`GUESSED`].
pub(crate) fn guess(
    cloud: &GaussianCloud,
    identities: &Identities,
    said: &Votes,
    assignments: &mut [Assignment],
    observer: &mut dyn Observer,
) -> Result<(), Interrupted> {
    begin("Comparing things with their mirror images", observer)?;
    let mut counts = vec![0; identities.len() + 1];
    let (mut told, mut untold) = (vec![Vec::new(); counts.len()], vec![Vec::new(); counts.len()]);
    let mut open = Vec::new();
    for (g, now) in assignments.iter().enumerate() {
        let is_told = said.weight(g) >= LEAST_VOTES;
        match identities.object_of(now.identity) as usize {
            _ if now.identity == UNKNOWN && !is_told => open.push(g),
            object if object != NO_IDENTITY as usize && object < counts.len() => {
                if is_told {
                    told[object].push(g)
                } else {
                    untold[object].push(g)
                }
            }
            _ => {}
        }
    }
    for (object, _) in
        identities.iter().filter(|(id, i)| i.level == Level::Object && identities.children(*id).next().is_some())
    {
        observer.proceed()?;
        let (told, untold) = (&told[object as usize], &untold[object as usize]);
        if told.len().min(untold.len()) < LEAST_GAUSSIANS {
            continue;
        }
        let own: Vec<usize> = told.iter().chain(untold).copied().collect();
        let thing = Thing::new(cloud, &own);
        let Some(plane) = thing.plane() else { continue };
        let labeled = RTree::bulk_load(told.iter().map(|&g| place(cloud, g)).collect());
        let guessed = |&g: &usize| {
            let id = thing.mirrored(&plane, g, &labeled, |q| assignments[q].identity)?;
            Some((g, other_side(identities, id)?)).filter(|(g, id)| assignments[*g].identity != *id)
        };
        let guesses: Vec<(usize, IdentityId)> = untold.par_iter().chain(&open).filter_map(guessed).collect();
        for (g, id) in guesses {
            assignments[g] = Assignment { identity: id, margin: GUESSED };
            counts[id as usize] += 1;
        }
    }
    let guessed: Vec<(IdentityId, usize)> = (0..).zip(counts).filter(|c| c.1 > 0).collect();
    if let Some((id, n)) = guessed.iter().max_by_key(|g| g.1) {
        let more = match guessed.len() - 1 {
            0 => String::new(),
            more => format!(", and of {more} more"),
        };
        let text =
            format!("{} of {}{more} are guessed from mirror images", things(*n, "Gaussian"), identities.full_name(*id));
        observer.note(Severity::Info, text);
    }
    Ok(())
}

/// Identity of the mirror image of an object or part: "left wheel" is "right wheel" there. `None` if the object has no
/// such part.
fn other_side(identities: &Identities, id: IdentityId) -> Option<IdentityId> {
    let swap = |word: &String| match word.as_str() {
        "left" => "right".to_owned(),
        "right" => "left".to_owned(),
        other => other.to_owned(),
    };
    let whole = identities.get(id)?.parent;
    let names = |id: IdentityId| identities.words().names(id);
    let swapped: Vec<Vec<String>> = names(id).iter().map(|name| name.iter().map(swap).collect()).collect();
    if whole == NO_IDENTITY || names(id) == swapped {
        return Some(id);
    }
    identities.children(whole).find(|other| names(*other).iter().any(|name| swapped.contains(name)))
}

fn place(cloud: &GaussianCloud, g: usize) -> Place {
    GeomWithData::new(cloud.world_position(g).to_array(), g)
}

impl<'a> Thing<'a> {
    fn new(cloud: &'a GaussianCloud, own: &'a [usize]) -> Self {
        let tree = RTree::bulk_load(own.iter().map(|&g| place(cloud, g)).collect());
        let sum: DVec3 = own.iter().map(|&g| cloud.world_position(g)).sum();
        let middle = sum / own.len().max(1) as f64;
        let size = 2.0 * median(&own.iter().map(|&g| cloud.world_position(g).distance(middle)).collect::<Vec<_>>());
        Self { cloud, own, tree, size }
    }

    /// Color of a Gaussian from everywhere.
    fn color(&self, g: usize) -> DVec3 {
        DVec3::from(self.cloud.sh[g * self.cloud.sh_stride()].map(|c| 0.5 + SH_C0 * f64::from(c)))
    }

    /// Middle of the extent along a direction, without the outermost twentieth on each side: of both sides of a thing,
    /// one may have more Gaussians.
    fn middle_along(&self, normal: DVec3) -> f64 {
        let sample = self.own.iter().step_by(self.own.len().div_ceil(FINE.sample).max(1));
        let along: Vec<f64> = sample.map(|&g| normal.dot(self.cloud.world_position(g))).collect();
        0.5 * (quantile(&along, 0.05) + quantile(&along, 0.95))
    }

    /// Likeness of Gaussian `g`, moved to `image`, to Gaussian `q`, 0 to 1.
    fn likeness(&self, g: usize, image: DVec3, q: usize, how: Comparison) -> f64 {
        let far = image.distance(self.cloud.world_position(q)) / (how.near * self.size);
        let unlike = self.color(g).distance(self.color(q)) / ALIKE;
        (-far * far - unlike * unlike).exp()
    }

    /// Mean likeness of Gaussians, each moved to its image, to the nearest other one there.
    fn mean_likeness(&self, image: impl Fn(DVec3) -> DVec3, how: Comparison) -> f64 {
        let sample = self.own.iter().step_by(self.own.len().div_ceil(how.sample).max(1));
        let (count, of) = (sample.len(), |&g: &usize| {
            let image = image(self.cloud.world_position(g));
            let mut near = self.tree.nearest_neighbor_iter(image.to_array()).map(|q| q.data).filter(|q| *q != g);
            near.next().map_or(0.0, |q| self.likeness(g, image, q, how))
        });
        sample.map(of).sum::<f64>() / count.max(1) as f64
    }

    /// Plane with the greatest likeness of both sides, if that is hardly less than the likeness of neighbors.
    fn plane(&self) -> Option<MirrorPlane> {
        if !(self.size > 0.0 && self.size.is_finite()) {
            return None;
        }
        let through = |normal: DVec3, share: f64, how: Comparison| {
            let normal = normal.normalize_or(DVec3::X);
            let plane = MirrorPlane { normal, offset: self.middle_along(normal) + share * self.size };
            (plane, self.mean_likeness(|p| plane.image(p), how))
        };
        let more = |a: &(MirrorPlane, f64), b: &(MirrorPlane, f64)| a.1.total_cmp(&b.1);
        // Evenly over half a sphere, along a spiral.
        let direction = |k: usize| {
            let z = (k as f64 + 0.5) / DIRECTIONS as f64;
            let angle = k as f64 * std::f64::consts::PI * (3.0 - 5.0_f64.sqrt());
            DVec3::new((1.0 - z * z).sqrt() * angle.cos(), (1.0 - z * z).sqrt() * angle.sin(), z)
        };
        let mut tried: Vec<_> = (0..DIRECTIONS).into_par_iter().map(|k| through(direction(k), 0.0, COARSE)).collect();
        tried.sort_by(|a, b| more(b, a));
        let refined = tried.into_par_iter().take(BEST).filter_map(|(plane, _)| {
            let mut now = OFFSETS.map(|share| through(plane.normal, share, FINE)).into_iter().max_by(more)?;
            let mut step = STEPS.0;
            while step >= STEPS.1 {
                let (u, v) = now.0.normal.any_orthonormal_pair();
                let share = (now.0.offset - self.middle_along(now.0.normal)) / self.size;
                let turned = [u, -u, v, -v].map(|side| through(now.0.normal + step * side, share, FINE));
                let moved = [step, -step].map(|far| through(now.0.normal, share + far, FINE));
                let next = turned.into_iter().chain(moved).max_by(more)?;
                if next.1 > now.1 { now = next } else { step *= 0.5 }
            }
            Some(now)
        });
        let (plane, likeness) = refined.max_by(more)?;
        (likeness >= LEAST_LIKENESS * self.mean_likeness(|p| p, FINE)).then_some(plane)
    }

    /// Part that the labeled Gaussians around the mirror image of Gaussian `g` have, if they look like it.
    fn mirrored(
        &self,
        plane: &MirrorPlane,
        g: usize,
        labeled: &RTree<Place>,
        of: impl Fn(usize) -> IdentityId,
    ) -> Option<IdentityId> {
        let image = plane.image(self.cloud.world_position(g));
        // Most Gaussians of a scene are nowhere near.
        if labeled.root().envelope().distance_2(&image.to_array()) > (REACH * FINE.near * self.size).powi(2) {
            return None;
        }
        let near = labeled.nearest_neighbor_iter(image.to_array()).take(AROUND);
        let mut sums: Vec<(IdentityId, f64)> = Vec::with_capacity(AROUND);
        for q in near {
            let likeness = self.likeness(g, image, q.data, FINE);
            match sums.iter_mut().find(|s| s.0 == of(q.data)) {
                Some(s) => s.1 += likeness,
                None => sums.push((of(q.data), likeness)),
            }
        }
        let total: f64 = sums.iter().map(|s| s.1).sum();
        let (id, most) = sums.into_iter().max_by(|a, b| a.1.total_cmp(&b.1))?;
        (total >= LEAST_AROUND && most >= LEAST_SHARE * total && id != UNKNOWN && id != NO_IDENTITY).then_some(id)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::pipeline::observer::Silent;
    use crate::pipeline::semantics::lifting::votes::LEAST_SEEN;
    use crate::scene::SemanticMap;

    const BODY: usize = 500;
    const WHEEL: usize = 60;

    /// Numbers between 0 and 1 that fill a square evenly.
    fn even(k: usize) -> [f64; 2] {
        [(k as f64 * 0.754_877_666).fract(), (k as f64 * 0.569_840_291).fract()]
    }

    /// A wedge with a dark wheel on each side, first all of the side at +x, then the other one in the same order; its
    /// body is brighter toward one end.
    fn car() -> GaussianCloud {
        let body = (0..BODY).map(|k| {
            let [u, v] = even(k);
            ([0.15 + 0.2 * u, 1.2 * u, 0.5 * v * (1.0 - 0.6 * u)], 0.4 + 0.5 * u)
        });
        let wheel = (0..WHEEL).map(|k| {
            let [u, v] = even(k).map(|v| v - 0.5);
            ([0.3, 0.3 + 0.16 * u, -0.08 + 0.16 * v], 0.05)
        });
        let side: Vec<([f64; 3], f64)> = body.chain(wheel).collect();
        let other = side.iter().map(|([x, y, z], light)| ([-x, *y, *z], *light));
        let all: Vec<([f64; 3], f64)> = side.iter().copied().chain(other).collect();
        let sh = all.iter().map(|(_, light)| [((light - 0.5) / SH_C0) as f32; 3]).collect();
        let positions = all.iter().map(|(p, _)| p.map(|v| v as f32)).collect();
        GaussianCloud { sh, ..GaussianCloud::isotropic(positions, -4.0, 4.0) }
    }

    /// Names of all Gaussians after a guess, where masks name the side at +x alone, and growth calls the rest the body.
    fn guessed(cloud: &GaussianCloud, wheels: &[&str]) -> Vec<String> {
        let mut all = Identities::default();
        let car = all.add(Level::Object, NO_IDENTITY, vec!["car".into()]);
        let body = all.add(Level::Part, car, vec!["body".into()]);
        let wheels: Vec<IdentityId> =
            wheels.iter().map(|name| all.add(Level::Part, car, vec![(*name).into()])).collect();
        let side = BODY + WHEEL;
        let of = |g: usize| if g < BODY { body } else { wheels[0] };
        let told: Vec<IdentityId> = (0..cloud.len()).map(|g| if g < side { of(g) } else { NO_IDENTITY }).collect();
        let margin = (0..cloud.len()).map(|g| f32::from(u8::from(g < side))).collect();
        let said = Votes::known(&SemanticMap::from_identities(all.clone(), told, margin, vec![]), LEAST_SEEN);
        // Growth knows the body of the other side, and nothing of half of its wheel.
        let grown = |g: usize| match g {
            _ if g < side => Assignment { identity: of(g), margin: 1.0 },
            _ if g + WHEEL / 2 < cloud.len() => Assignment { identity: body, margin: 0.1 },
            _ => Assignment { identity: UNKNOWN, margin: 0.0 },
        };
        let mut assignments: Vec<Assignment> = (0..cloud.len()).map(grown).collect();
        let before = assignments.clone();
        guess(cloud, &all, &said, &mut assignments, &mut Silent).expect("not stopped");
        let changed: Vec<usize> = (0..cloud.len()).filter(|&g| assignments[g] != before[g]).collect();
        assert_eq!(assignments.iter().filter(|a| a.margin == GUESSED).count(), changed.len());
        assert!(changed.iter().all(|&g| g >= side && assignments[g].margin == GUESSED), "masks are never overruled");
        assignments.iter().map(|a| if a.identity == UNKNOWN { String::new() } else { all.name(a.identity) }).collect()
    }

    #[test]
    fn the_other_side_has_what_the_labeled_side_has() {
        let names = guessed(&car(), &["wheel"]);
        let far = &names[2 * BODY + WHEEL..];
        let wheels = far.iter().filter(|n| *n == "wheel").count();
        assert!(wheels > 9 * WHEEL / 10, "{wheels} of {WHEEL}");
        let body = names[BODY + WHEEL..2 * BODY + WHEEL].iter().filter(|n| *n == "body").count();
        assert!(body > 9 * BODY / 10, "{body} of {BODY}");
    }

    #[test]
    fn left_is_right_in_the_mirror() {
        let count = |names: &[String], name: &str| names[2 * BODY + WHEEL..].iter().filter(|n| *n == name).count();
        let both = guessed(&car(), &["left wheel", "right wheel"]);
        assert!(count(&both, "right wheel") > 9 * WHEEL / 10 && count(&both, "left wheel") == 0, "{both:?}");
        let written = guessed(&car(), &["Left_Wheel", "right wheels"]);
        assert!(count(&written, "right wheels") > 9 * WHEEL / 10, "however it is written: {written:?}");
        // No part has that name: nothing is guessed.
        let one = guessed(&car(), &["left wheel"]);
        assert_eq!(count(&one, "left wheel"), 0, "{one:?}");
    }

    #[test]
    fn what_is_unlike_its_mirror_image_stays_as_it_is() {
        let is_wheel = |names: &[String]| names[BODY + WHEEL..].iter().filter(|n| *n == "wheel").count();
        // Something bright in place of the other wheel.
        let mut cloud = car();
        cloud.sh[2 * BODY + WHEEL..].fill([1.5; 3]);
        assert_eq!(is_wheel(&guessed(&cloud, &["wheel"])), 0);
        // The other side is turned around, so that no plane fits.
        let mut cloud = car();
        for p in &mut cloud.positions[BODY + WHEEL..] {
            (p[1], p[2]) = (0.9 - p[1], 0.3 - p[2] * 1.5);
        }
        assert_eq!(is_wheel(&guessed(&cloud, &["wheel"])), 0);
    }

    #[test]
    fn things_in_one_place_have_no_sides() {
        let cloud = GaussianCloud { positions: vec![[0.5; 3]; 2 * (BODY + WHEEL)], ..car() };
        assert!(guessed(&cloud, &["wheel"]).iter().filter(|n| *n == "wheel").count() <= WHEEL);
    }
}
