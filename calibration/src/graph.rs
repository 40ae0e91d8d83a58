//! The graph of sensors that could be related in pairs: its best spanning tree, or its separate groups.

use std::collections::{BTreeMap, BTreeSet};

use nalgebra::Isometry3;

use crate::pair::PairStart;

/// Pairs by the indices of their sensors, the lower first.
pub(crate) type Edges = BTreeMap<(usize, usize), PairStart>;

/// One sensor's pose and time offset in the first sensor's frame and clock.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Placed {
    /// Takes the sensor's points to the first sensor's frame.
    pub(crate) world_from_sensor: Isometry3<f64>,
    /// Added to its stamps, half-way through the walk, seconds.
    pub(crate) offset_s: f64,
    /// How much that grows per second.
    pub(crate) drift: f64,
}

impl Placed {
    /// What is added to its stamps `since_middle_s` after the middle of the walk, seconds.
    pub(crate) fn offset_at(&self, since_middle_s: f64) -> f64 {
        self.offset_s + self.drift * since_middle_s
    }
}

/// The tree of highest quality (Kruskal), as pairs of indices; the groups that no edge joins if there are several. Sensors
/// that stand in one frame `already` need no edge between them.
pub(crate) fn spanning_tree(
    sensors: usize,
    edges: &Edges,
    already: &[usize],
) -> Result<BTreeSet<(usize, usize)>, Vec<Vec<usize>>> {
    let mut order: Vec<_> = edges.iter().collect();
    order.sort_by(|x, y| y.1.quality.total_cmp(&x.1.quality).then(x.0.cmp(y.0)));
    let mut group: Vec<usize> = (0..sensors).collect();
    already
        .iter()
        .for_each(|sensor| group[*sensor] = already[0]);
    let mut tree = BTreeSet::new();
    for (&(a, b), _) in order {
        let (ga, gb) = (group[a], group[b]);
        if ga != gb {
            group.iter_mut().filter(|g| **g == gb).for_each(|g| *g = ga);
            tree.insert((a, b));
        }
    }
    let mut groups: BTreeMap<usize, Vec<usize>> = BTreeMap::new();
    for (sensor, group) in group.into_iter().enumerate() {
        groups.entry(group).or_default().push(sensor);
    }
    if groups.len() <= 1 {
        return Ok(tree);
    }
    let mut groups: Vec<_> = groups.into_values().collect();
    groups.sort();
    Err(groups)
}

/// The pair of the tree that agrees least.
pub(crate) fn weakest(tree: &BTreeSet<(usize, usize)>, edges: &Edges) -> Option<(usize, usize)> {
    let quality = |pair: &(usize, usize)| edges[pair].quality;
    let worse = |x: &&(usize, usize), y: &&(usize, usize)| quality(x).total_cmp(&quality(y));
    tree.iter().min_by(worse).copied()
}

/// Walks the tree from the sensors that are `held`, or else from sensor 0, which then stands at the origin.
pub(crate) fn place(
    sensors: usize,
    tree: &BTreeSet<(usize, usize)>,
    edges: &Edges,
    held: &[(usize, Placed)],
) -> Vec<Placed> {
    let origin = Placed {
        world_from_sensor: Isometry3::identity(),
        offset_s: 0.0,
        drift: 0.0,
    };
    let mut placed: Vec<Option<Placed>> = vec![None; sensors];
    let mut queue = held.to_vec();
    held.iter()
        .for_each(|(sensor, pose)| placed[*sensor] = Some(*pose));
    if queue.is_empty() {
        placed[0] = Some(origin);
        queue.push((0, origin));
    }
    while let Some((sensor, pose)) = queue.pop() {
        for &(a, b) in tree.iter().filter(|(a, b)| *a == sensor || *b == sensor) {
            let other = if a == sensor { b } else { a };
            if placed[other].is_none() {
                let edge = &edges[&(a, b)];
                let (step, offset_s) = if a == sensor {
                    (edge.a_from_b, edge.offset_s)
                } else {
                    (edge.a_from_b.inverse(), -edge.offset_s)
                };
                let next = Placed {
                    world_from_sensor: pose.world_from_sensor * step,
                    offset_s: pose.offset_s + offset_s,
                    drift: 0.0,
                };
                placed[other] = Some(next);
                queue.push((other, next));
            }
        }
    }
    placed.into_iter().map(|p| p.unwrap_or(origin)).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn edge(x: f64, quality: f64) -> PairStart {
        PairStart {
            a_from_b: Isometry3::translation(x, 0.0, 0.0),
            offset_s: x,
            quality,
        }
    }

    #[test]
    fn the_weakest_edge_of_a_ring_is_left_out() {
        let edges = Edges::from([
            ((0, 1), edge(1.0, 5.0)),
            ((1, 2), edge(1.0, 4.0)),
            ((0, 2), edge(9.0, 1.0)),
        ]);
        let tree = spanning_tree(3, &edges, &[]).unwrap();
        assert_eq!(tree, BTreeSet::from([(0, 1), (1, 2)]));
        let placed = place(3, &tree, &edges, &[]);
        assert_eq!(placed[2].world_from_sensor.translation.vector.x, 2.0);
        assert_eq!(placed[2].offset_s, 2.0);
    }

    #[test]
    fn a_tree_is_walked_against_its_edges_too() {
        let edges = Edges::from([((0, 2), edge(3.0, 1.0)), ((1, 2), edge(1.0, 1.0))]);
        let tree = spanning_tree(3, &edges, &[]).unwrap();
        let placed = place(3, &tree, &edges, &[]);
        assert_eq!(placed[1].world_from_sensor.translation.vector.x, 2.0);
        assert_eq!(placed[1].offset_s, 2.0);
    }

    #[test]
    fn sensors_that_are_held_need_no_edge_and_do_not_move() {
        let edges = Edges::from([((1, 2), edge(1.0, 1.0))]);
        let held = |x: f64| Placed {
            world_from_sensor: Isometry3::translation(x, 0.0, 0.0),
            offset_s: -x,
            drift: 0.0,
        };
        let tree = spanning_tree(3, &edges, &[0, 1]).unwrap();
        assert_eq!(weakest(&tree, &edges), Some((1, 2)));
        let placed = place(3, &tree, &edges, &[(0, held(7.0)), (1, held(5.0))]);
        let xs = [0, 1, 2].map(|s: usize| placed[s].world_from_sensor.translation.vector.x);
        assert_eq!(xs, [7.0, 5.0, 6.0]);
        assert_eq!(placed[2].offset_s, -4.0);
    }

    #[test]
    fn separate_groups_are_told() {
        let edges = Edges::from([((0, 2), edge(1.0, 1.0)), ((1, 3), edge(1.0, 1.0))]);
        let groups = spanning_tree(4, &edges, &[]).unwrap_err();
        assert_eq!(groups, [[0, 2], [1, 3]]);
    }
}
