//! Graph of connected keypoints, and the shortest route from one to another.
//!
//! Every keypoint is tried with its nearest neighbors; an edge exists if the straight line keeps enough distance to all
//! occupied space. Edges are tested when a route first asks for them, and remembered.

use std::sync::atomic::{AtomicU8, Ordering};

use glam::DVec3;
use pathfinding::prelude::dijkstra;
use rayon::prelude::*;

use super::keypoints::{Keypoint, Places, places};
use super::occupancy::OccupancyGrid;

/// Neighbors that are tried per keypoint: more than the six of its own star, so that stars are connected to each other.
const NEIGHBORS: usize = 14;
/// Unit in which lengths are counted, as a share of a voxel: the search adds whole numbers, so that
/// equal routes are equal.
const UNIT: f64 = 1e-6;

const UNSEEN: u8 = 0;
const FREE: u8 = 1;
const BLOCKED: u8 = 2;

/// Keypoints and their connections.
pub struct Graph {
    /// Places that a camera may take.
    pub keypoints: Vec<Keypoint>,
    /// Distance to occupied space that every point of an edge has.
    pub(crate) clearance: f64,
    places: Places,
    /// Both ends of each edge that is tried; the lower one first.
    pairs: Vec<[u32; 2]>,
    /// State of each: `UNSEEN`, `FREE` or `BLOCKED`.
    state: Vec<AtomicU8>,
    /// Edges of each keypoint.
    of: Vec<Vec<u32>>,
}

/// A way through keypoints.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Route {
    /// Keypoints by number, first to last.
    pub(crate) through: Vec<usize>,
    /// Its length between keypoints, scene units.
    pub(crate) length: f64,
}

impl Graph {
    /// Keypoints with their neighbors, no edge tested yet.
    pub(crate) fn new(keypoints: Vec<Keypoint>, clearance: f64) -> Self {
        let places = places(&keypoints);
        let near = |i: usize| {
            let found = places.nearest_neighbor_iter(keypoints[i].center.to_array());
            found.map(|p| p.data).filter(move |j| *j != i).take(NEIGHBORS)
        };
        let mut pairs: Vec<[u32; 2]> = (0..keypoints.len())
            .into_par_iter()
            .flat_map_iter(|i| near(i).map(move |j| [i.min(j) as u32, i.max(j) as u32]))
            .collect();
        pairs.par_sort_unstable();
        pairs.dedup();
        let mut of = vec![Vec::new(); keypoints.len()];
        for (e, [a, b]) in pairs.iter().enumerate() {
            of[*a as usize].push(e as u32);
            of[*b as usize].push(e as u32);
        }
        let state = pairs.iter().map(|_| AtomicU8::new(UNSEEN)).collect();
        Self { keypoints, clearance, places, pairs, state, of }
    }

    /// Returns whether edge `e` is free.
    fn is_free(&self, e: usize, occupancy: &OccupancyGrid) -> bool {
        let known = self.state[e].load(Ordering::Relaxed);
        if known != UNSEEN {
            return known == FREE;
        }
        let [a, b] = self.pairs[e].map(|i| self.keypoints[i as usize].center);
        let free = occupancy.is_free(a, b, self.clearance);
        self.state[e].store(if free { FREE } else { BLOCKED }, Ordering::Relaxed);
        free
    }

    /// The other end of edge `e`.
    fn other(&self, e: usize, from: usize) -> usize {
        let [a, b] = self.pairs[e].map(|i| i as usize);
        if a == from { b } else { a }
    }

    /// Tests all edges not tested yet; returns the numbers of free and of blocked ones.
    pub(crate) fn look_at_all(&self, occupancy: &OccupancyGrid) -> (usize, usize) {
        let free = (0..self.pairs.len()).into_par_iter().filter(|e| self.is_free(*e, occupancy)).count();
        (free, self.pairs.len() - free)
    }

    /// Numbers of edges tested so far, and of all.
    pub(crate) fn looked_at(&self) -> (usize, usize) {
        let seen = self.state.iter().filter(|s| s.load(Ordering::Relaxed) != UNSEEN).count();
        (seen, self.state.len())
    }

    /// The number of the connected part that each keypoint belongs to, the largest part first.
    pub(crate) fn parts(&self, occupancy: &OccupancyGrid) -> Vec<usize> {
        self.look_at_all(occupancy);
        let mut part = vec![usize::MAX; self.keypoints.len()];
        let mut sizes = Vec::new();
        for start in 0..part.len() {
            if part[start] != usize::MAX {
                continue;
            }
            let number = sizes.len();
            let mut stack = vec![start];
            part[start] = number;
            let mut size = 0;
            while let Some(at) = stack.pop() {
                size += 1;
                for &e in &self.of[at] {
                    let next = self.other(e as usize, at);
                    if part[next] == usize::MAX && self.is_free(e as usize, occupancy) {
                        part[next] = number;
                        stack.push(next);
                    }
                }
            }
            sizes.push(size);
        }
        let mut order: Vec<usize> = (0..sizes.len()).collect();
        order.sort_by_key(|p| (std::cmp::Reverse(sizes[*p]), *p));
        let mut rank = vec![0; sizes.len()];
        order.iter().enumerate().for_each(|(r, p)| rank[*p] = r);
        part.into_iter().map(|p| rank[p]).collect()
    }

    /// The keypoints nearest to a place, nearest first.
    pub(crate) fn nearest(&self, place: DVec3) -> impl Iterator<Item = usize> + '_ {
        let finite = if place.is_finite() { place } else { DVec3::ZERO };
        self.places.nearest_neighbor_iter(finite.to_array()).map(|p| p.data)
    }

    /// The shortest way from one keypoint to another (Dijkstra); `None` if they are not connected.
    #[cfg(test)]
    fn route(&self, from: usize, to: usize, occupancy: &OccupancyGrid) -> Option<Route> {
        self.route_between(&[(from, 0.0)], &[(to, 0.0)], occupancy)
    }

    /// Shortest way from any of `starts` to any of `goals`, each with the cost (scene units) of reaching it from
    /// outside, or of going on from it. One search, however many there are.
    pub(crate) fn route_between(
        &self,
        starts: &[(usize, f64)],
        goals: &[(usize, f64)],
        occupancy: &OccupancyGrid,
    ) -> Option<Route> {
        const START: usize = usize::MAX;
        const GOAL: usize = usize::MAX - 1;
        let unit = UNIT * occupancy.voxel();
        let cost = |length: f64| (length / unit).round() as u64;
        let known = |i: &usize| *i < self.keypoints.len();
        let next = |&at: &usize| -> Vec<(usize, u64)> {
            if at == START {
                return starts.iter().filter(|(i, _)| known(i)).map(|(i, length)| (*i, cost(*length))).collect();
            }
            if at == GOAL {
                return Vec::new();
            }
            let here = self.keypoints[at].center;
            let free = self.of[at].iter().filter(|e| self.is_free(**e as usize, occupancy));
            let step = |e: &u32| {
                let other = self.other(*e as usize, at);
                (other, cost(here.distance(self.keypoints[other].center)))
            };
            let ends = goals.iter().filter(|(i, _)| *i == at).map(|(_, length)| (GOAL, cost(*length)));
            free.map(step).chain(ends).collect()
        };
        let (through, _) = dijkstra(&START, next, |i| *i == GOAL)?;
        let through: Vec<usize> = through.into_iter().filter(known).collect();
        let length =
            through.windows(2).map(|w| self.keypoints[w[0]].center.distance(self.keypoints[w[1]].center)).sum();
        Some(Route { through, length })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::navigate::keypoints::keypoints;
    use crate::navigate::testing::{camera_at, cloud_of_wall, joined, wall_with_hole};
    use crate::scene::{Camera, GaussianCloud};

    fn graph(cloud: &GaussianCloud, cameras: &[Camera]) -> (Graph, OccupancyGrid) {
        let eyes: Vec<DVec3> = cameras.iter().map(|c| c.center).collect();
        let occupancy = OccupancyGrid::of(cloud, &eyes, 0.05);
        let (all, _) = keypoints(cameras, &occupancy, 0.05);
        (Graph::new(all, 0.05), occupancy)
    }

    fn lattice(step: f64) -> Vec<Camera> {
        let line = |n: i32| (0..n).map(move |i| (f64::from(i) - 0.5 * f64::from(n - 1)) * step);
        line(3).flat_map(|x| line(3).flat_map(move |y| line(4).map(move |z| camera_at(DVec3::new(x, y, z))))).collect()
    }

    /// Floyd and Warshall's, on the same edges.
    fn all_distances(g: &Graph, occupancy: &OccupancyGrid) -> Vec<Vec<f64>> {
        let n = g.keypoints.len();
        let mut d = vec![vec![f64::INFINITY; n]; n];
        (0..n).for_each(|i| d[i][i] = 0.0);
        for (e, [a, b]) in g.pairs.iter().enumerate() {
            if g.is_free(e, occupancy) {
                let (a, b) = (*a as usize, *b as usize);
                let length = g.keypoints[a].center.distance(g.keypoints[b].center);
                (d[a][b], d[b][a]) = (length, length);
            }
        }
        for k in 0..n {
            for i in 0..n {
                for j in 0..n {
                    d[i][j] = d[i][j].min(d[i][k] + d[k][j]);
                }
            }
        }
        d
    }

    #[test]
    fn routes_are_as_short_as_brute_force_says() {
        let (g, occupancy) = graph(&wall_with_hole(0.0, 0.5), &lattice(0.5));
        let truth = all_distances(&g, &occupancy);
        let n = g.keypoints.len();
        let (mut found, mut none) = (0, 0);
        for from in (0..n).step_by(7) {
            for to in (0..n).step_by(5) {
                match g.route(from, to, &occupancy) {
                    Some(route) => {
                        assert!((route.length - truth[from][to]).abs() < 1e-6, "{from} to {to}");
                        assert_eq!((route.through[0], *route.through.last().expect("one")), (from, to));
                        found += 1;
                    }
                    None => {
                        assert!(truth[from][to].is_infinite(), "{from} to {to} was given up");
                        none += 1;
                    }
                }
            }
        }
        assert!(found > 100, "{found} {none}");
    }

    #[test]
    fn a_wall_parts_the_graph_and_a_hole_joins_it() {
        let cameras = lattice(0.5);
        // A wall so wide that no route leads around it within the grid.
        let (closed, occupancy) = graph(&cloud_of_wall(0.0), &cameras);
        let parts = closed.parts(&occupancy);
        let side = |i: usize| closed.keypoints[i].center.z > 0.0;
        let largest = parts.iter().position(|p| *p == 0).expect("one");
        assert!((0..parts.len()).filter(|i| parts[*i] == 0).all(|i| side(i) == side(largest)), "both sides in one");
        let other = (0..parts.len()).find(|i| side(*i) != side(largest)).expect("other side");
        assert_eq!(closed.route(largest, other, &occupancy), None);
        let (open, occupancy) = graph(&wall_with_hole(0.0, 0.6), &cameras);
        let parts = open.parts(&occupancy);
        let side = |i: usize| open.keypoints[i].center.z > 0.0;
        let (near, far) = (0..parts.len()).fold((None, None), |(n, f), i| match (parts[i], side(i)) {
            (0, true) => (Some(i), f),
            (0, false) => (n, Some(i)),
            _ => (n, f),
        });
        let route = open.route(near.expect("near"), far.expect("far"), &occupancy).expect("through the hole");
        for pair in route.through.windows(2) {
            let [a, b] = [pair[0], pair[1]].map(|i| open.keypoints[i].center);
            for k in 0..=200 {
                let c = occupancy.clearance(a.lerp(b, f64::from(k) / 200.0));
                assert!(c >= 0.05 - 0.05 * occupancy.voxel(), "clearance {c} on an edge");
            }
        }
    }

    #[test]
    fn edges_are_looked_at_when_they_are_needed_and_remembered() {
        let cameras = lattice(0.5);
        let cloud = joined(&cloud_of_wall(3.0), &cloud_of_wall(-3.0));
        let (g, occupancy) = graph(&cloud, &cameras);
        let near = g.nearest(g.keypoints[0].center).nth(1).expect("a neighbor");
        g.route(0, near, &occupancy).expect("beside it");
        let (seen, all) = g.looked_at();
        assert!(seen > 0 && seen < all / 2, "{seen} of {all}");
        g.look_at_all(&occupancy);
        assert_eq!(g.looked_at(), (all, all));
    }

    #[test]
    fn no_keypoints_no_routes() {
        let (g, occupancy) = graph(&GaussianCloud::default(), &[]);
        assert_eq!(g.route(0, 0, &occupancy), None);
        assert!(g.parts(&occupancy).is_empty());
    }
}
